"""A failing run read by a formula: which subformula is false at which letter, on a lasso or a bad prefix."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction
from itertools import islice

from llfsm_verify.logic.bounds import Clock, time_bound
from llfsm_verify.logic.formula import Formula, atoms
from llfsm_verify.logic.lasso import evaluate, truth_of
from llfsm_verify.logic.rewriting.literals import NEGATIVE, every_literal, literal_letter, over_literals
from llfsm_verify.logic.word import Times

Letter = frozenset[str]


class Reading:
    """The truth of every subformula of a formula, in each place where it stands, at each letter of a run.

    `places` has the formula over literals (`logic.rewriting.literals`) of a subformula in a place. After a bad prefix
    stands a letter in which every literal holds, forever, a period each: what is false then is false however the run
    goes on (the weak view of Eisner et al., Reasoning with temporal logic on truncated paths, CAV 2003).
    """

    def __init__(
        self, formula: Formula, letters: Sequence[Letter], loop: int | None, clock: Clock | None = None
    ) -> None:
        """`loop` is the number of the letter to which the last one leads back; None: `letters` are a prefix.

        ValueError: the formula has regular expressions. ExpressionTooLarge does not occur, therefore.
        """
        places = over_literals(formula)
        if places is None:
            raise ValueError("a formula with regular expressions is not monotone in its literals")
        self.formula = formula
        self.places = places
        self.count = len(letters)
        """Letters of the run; a position from there on is one more turn of the loop, or after the prefix."""
        self.loop = loop
        keys = atoms(formula)
        shown = [literal_letter(keys, letter) for letter in letters]
        delays: list[Fraction] | None = None if clock is None else clock.delays(letters)
        if loop is None and clock is not None and delays is not None:
            delays = [*delays, clock.period]
        self._shown, self._delays = shown, delays
        stem, again = self._split(shown)
        self._word, self._truth = truth_of(tuple(dict.fromkeys(places.values())), stem, again, delays)

    def _split(self, shown: Sequence[Letter]) -> tuple[Sequence[Letter], Sequence[Letter]]:
        """Stem and loop of a run."""
        if self.loop is None:
            return shown, [every_literal(self.formula)]
        return shown[: self.loop], shown[self.loop :]

    @property
    def fails(self) -> bool:
        """The formula is false of the run; for a bad prefix: of all its continuations, and its operands show it."""
        return self.is_false(self.places[self.formula, False], 0)

    @property
    def back(self) -> int:
        """The position to which the last one leads back."""
        return self._word.back

    @property
    def size(self) -> int:
        """About how many truth values one evaluation of the formula takes."""
        return len(self._truth) * len(self._word.letters)

    def fails_with(self, changed: Iterable[tuple[int, str]]) -> bool:
        """Whether the formula is false with both literals of each of these (letter, atom) pairs made true."""
        shown = list(self._shown)
        for letter, key in changed:
            shown[letter] |= {key, NEGATIVE + key}
        stem, again = self._split(shown)
        return not evaluate(self.places[self.formula, False], stem, again, self._delays)

    def is_false(self, literal: Formula, at: int) -> bool:
        """Whether a formula over literals, one of `places`, is false at a position."""
        return not self._truth[literal][at]

    def fails_at(self, node: Formula, negative: bool, at: int) -> bool:
        """Whether a subformula (negated, when it stands under an odd number of negations) is false at a position."""
        return self.is_false(self.places[node, negative], at)

    def letter(self, at: int) -> int | None:
        """The number of the letter that a position shows; None: it is after the prefix."""
        if at < self.count:
            return at
        return None if self.loop is None else self.loop + (at - self.loop) % (self.count - self.loop)

    def after(self, at: int) -> int:
        """The position after a position."""
        return self._word.after(at)

    def onward(self, at: int) -> Iterator[int]:
        """The positions that can be reached from one, itself first, each once."""
        seen: set[int] = set()
        while at not in seen:
            seen.add(at)
            yield at
            at = self.after(at)

    def window(self, node: Formula, at: int) -> tuple[list[int], list[int]]:
        """The positions before the time of an operator with a bound in time at a position, and within it, each once."""
        assert self._word.delays is not None, "a bound in time comes with a clock"
        least, most = time_bound(node.key)
        later = Times(self._word).later(at, least) if least else (0, Fraction(0), at)
        if later is None:
            return list(self.onward(at)), []
        letters, passed, start = later
        within: list[int] = []
        for here in self.onward(start):
            if most is not None and passed > most:
                break
            within.append(here)
            passed += Fraction(self._word.delays[here])
        return list(islice(self.onward(at), letters)), within

"""Which atoms, at which letters, cause a formula to fail on a run: docs/decisions/0017-causes.md.

`Reading` has the truth of each subformula at each letter. Of properties that only a monitor knows: what of the letter
that closes a bad prefix would have to be otherwise.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction
from itertools import combinations, islice

from llfsm_verify.automata.safety import PrefixMonitor
from llfsm_verify.checking.goals.goal import mask
from llfsm_verify.limits import tick
from llfsm_verify.logic.bounds import HIDDEN, Clock, time_bound
from llfsm_verify.logic.formula import BOUNDED_PAST, Formula, atoms
from llfsm_verify.logic.lasso import evaluate, looked_back, truth_of
from llfsm_verify.logic.regular import exclusions
from llfsm_verify.logic.rewriting.literals import NEGATIVE, atom_of, every_literal, literal_letter, over_literals
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
        self._back: dict[Formula, list[tuple[int, int]]] = {}
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
        """The positions before what the bound of an operator at a position allows, and within it, each once, in the
        direction in which the operator looks."""
        if node.op in BOUNDED_PAST:
            if node not in self._back:
                self._back[node] = looked_back(node, self._word)
            first, last = self._back[node][at]
            return list(range(at, max(first, last + 1) - 1, -1)), list(range(last, first - 1, -1))
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


Pair = tuple[int, str]
"""The number of a letter and the key of an atom."""
_Place = tuple[Formula, int]


def causes(reading: Reading, node: Formula | None = None, *, negative: bool = False, at: int = 0) -> frozenset[Pair]:
    """The (letter, atom) pairs that cause `node` (the whole formula, unless it is given), false at a position, to fail.

    Every cause is among them; where no literal stands in two places they are exactly the causes. Time and memory: size
    of the formula times letters. Source: Beer et al., Explaining counterexamples using causality, FMSD 40 (2012).
    """
    start = reading.places[reading.formula if node is None else node, negative]
    found: set[Pair] = set()
    seen: set[_Place] = set()
    todo: list[_Place] = [(start, at)] if reading.is_false(start, at) else []
    while todo:
        tick()
        place = todo.pop()
        if place in seen:
            continue
        seen.add(place)
        formula, here = place
        if formula.op == "atom":
            letter = reading.letter(here)
            if letter is not None:
                found.add((letter, atom_of(formula.key)))
        else:
            todo += [p for p in _parts(reading, formula, here) if p not in seen and reading.is_false(*p)]
    return frozenset(found)


def _parts(reading: Reading, formula: Formula, at: int) -> Iterator[_Place]:
    """What a formula that is false at a position is made of, by its expansion law. Those parts that are false matter:
    of a disjunction that are all, of a conjunction some."""
    args = formula.args
    match formula.op:
        case "and" | "or":
            yield from ((a, at) for a in args)
        case "X":
            yield args[0], reading.after(at)
        case "F" | "G" if reading.loop is not None and {formula.op, args[0].op} == {"F", "G"} and at < reading.back:
            # `G F p` and `F G p` say nothing of what comes before the loop.
            yield formula, reading.back
        case "F" | "G" | "U" | "W":
            yield from ((a, at) for a in args)
            yield formula, reading.after(at)
        case "R" | "M":
            yield args[1], at
            if reading.is_false(args[0], at) and reading.is_false(formula, reading.after(at)):
                yield args[0], at
                yield formula, reading.after(at)
        case "Y" | "Z":
            if at:
                yield args[0], at - 1
        case "O" | "H":
            yield args[0], at
            if at:
                yield formula, at - 1
        case "S":
            yield args[1], at
            if at:
                yield args[0], at
                yield formula, at - 1
        case "T":
            yield args[1], at
            if at and reading.is_false(args[0], at) and reading.is_false(formula, at - 1):
                yield args[0], at
                yield formula, at - 1
        case "F<=" | "G<=" | "O<=" | "H<=" | "O[]" | "H[]":
            yield from ((args[0], here) for here in reading.window(formula, at)[1])
        case "U<=" | "S<=" | "S[]":
            yield from _until_in_time(reading, formula, at)
        case "R<=" | "T<=" | "T[]":
            yield from _release_in_time(reading, formula, at)
        case _:
            assert formula.op in ("true", "false"), f"{formula.op} is not an operator over literals"


def _until_in_time(reading: Reading, formula: Formula, at: int) -> Iterator[_Place]:
    """`a U[…] b`: b, if it is time, or a and the same at the next position, as long as there is time for that. `S` is
    the same backwards."""
    a, b = formula.args
    early, window = reading.window(formula, at)
    places = early + window
    later = [False] * (len(places) + 1)
    for i in reversed(range(len(places))):
        now = i >= len(early) and not reading.is_false(b, places[i])
        later[i] = now or (later[i + 1] and not reading.is_false(a, places[i]))
    for i, here in enumerate(places):
        if i >= len(early):
            yield b, here
        if i + 1 < len(places):
            yield a, here
        if later[i + 1]:
            return


def _release_in_time(reading: Reading, formula: Formula, at: int) -> Iterator[_Place]:
    """`a R[…] b`: b, if it is time, and a or the same at the next position, as long as there is time for that."""
    a, b = formula.args
    early, window = reading.window(formula, at)
    places = early + window
    later = [True] * (len(places) + 1)
    for i in reversed(range(len(places))):
        now = i < len(early) or not reading.is_false(b, places[i])
        later[i] = now and (later[i + 1] or not reading.is_false(a, places[i]))
    for i, here in enumerate(places):
        if i >= len(early):
            yield b, here
        if later[i + 1] or not reading.is_false(a, here):
            return
        yield a, here


ALL_SETS = 12
"""Atoms up to which every set of changes is tried."""
SMALL_SETS = 3
"""The size of the sets that are tried among more atoms."""


def changes(monitor: PrefixMonitor, keys: Sequence[str], letters: Sequence[Letter]) -> frozenset[str]:
    """The atoms in the least sets of atoms whose change in the last of `letters`, a bad prefix, makes it none.

    With them changed a machine is still in one state at a time. Empty: what the letter shows does not matter, or the
    prefix is closed before its first letter.
    """
    state = _before_last(monitor, keys, letters)
    if state is None or not letters:
        return frozenset()
    last, found = letters[-1], list[frozenset[str]]()
    own = [key for key in keys if not key.startswith(HIDDEN)]
    world = exclusions(own)
    for changed in _sets(own):
        if any(known <= changed for known in found):
            continue
        other = last ^ changed
        if evaluate(world, (), (other,)) and monitor.step(state, mask(other, keys)) is not None:
            found.append(changed)
    return frozenset().union(*found)


def possible(monitor: PrefixMonitor, keys: Sequence[str], letters: Sequence[Letter]) -> list[Letter] | None:
    """All letters in place of the last of `letters` with which they are no bad prefix; None: there are too many."""
    own = [key for key in keys if not key.startswith(HIDDEN)]
    if len(own) > ALL_SETS:
        return None
    state, world = _before_last(monitor, keys, letters), exclusions(own)
    if state is None:
        return []
    every = (frozenset[str](), *_sets(own))
    return [x for x in every if monitor.step(state, mask(x, keys)) is not None and evaluate(world, (), (x,))]


def _before_last(monitor: PrefixMonitor, keys: Sequence[str], letters: Sequence[Letter]) -> int | None:
    """The state before the last letter; None: a bad prefix ends before it."""
    state = monitor.initial()
    for letter in letters[:-1]:
        if state is None:
            return None
        state = monitor.step(state, mask(letter, keys))
    return state


def _sets(keys: Sequence[str]) -> Iterator[frozenset[str]]:
    """Sets of atoms, small ones first."""
    most = len(keys) if len(keys) <= ALL_SETS else SMALL_SETS
    return (frozenset(chosen) for size in range(1, most + 1) for chosen in combinations(keys, size))

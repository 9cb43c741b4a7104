"""Whether a word violates a regular property, straight from the definition, without automata."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise, product

from llfsm_verify.logic.expressions import MAX_ATOMS, MAX_DERIVATIVES, derivative, letters, nullable
from llfsm_verify.logic.formula import FALSE, Formula, atoms
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.regular import ExpressionTooLarge, RegularKind, exclusions
from llfsm_verify.logic.word import Letter, holds_in

Valuation = frozenset[Formula]
"""The letters of the expression that hold in a configuration."""


def valuations(expression: Formula, word: Sequence[Letter]) -> list[Valuation]:
    """The valuations of `word` with equal neighbours merged."""
    alphabet = letters(expression)
    keys = atoms(*alphabet)
    known: dict[frozenset[str], Valuation] = {}  # long words repeat few letters
    seen: list[Valuation] = []
    for letter in word:
        true = frozenset(key for key in keys if holds_in(key, letter))
        if true not in known:
            known[true] = frozenset(f for f in alphabet if evaluate(f, (), (true,)))
        seen.append(known[true])
    return seen[:1] + [after for before, after in pairwise(seen) if before != after]


def is_bad(kind: RegularKind, expression: Formula, word: Sequence[Letter]) -> bool:
    """Whether no run that starts with `word` has the property `kind expression`.

    `enforce`: what `word` shows begins no word of the expression; `forbid`: a non-empty part of it is one; `forbid
    initially`: a non-empty beginning is. ExpressionTooLarge: an expression that could still go on over too many atoms.
    """
    shown = valuations(expression, word)
    reading = _Reading(kind, expression)
    if any(reading.read(valuation) for valuation in shown):
        return True
    return reading.cannot_go_on(shown[-1] if shown else None)


class _Reading:
    """What may still follow in the words of a property: one rest of the expression for each place where one began."""

    def __init__(self, kind: RegularKind, expression: Formula) -> None:
        self._kind = kind
        self._expression = expression
        self._known: dict[tuple[Formula, Valuation], Formula] = {}
        self.rests: frozenset[Formula] = frozenset((expression,))

    def read(self, valuation: Valuation) -> bool:
        """Whether the property is lost for want of a rest (`enforce`), or because a word has come to its end."""
        before = self.rests | {self._expression} if self._kind == "forbid" else self.rests
        self.rests = frozenset(self._rest(rest, valuation) for rest in before) - {FALSE}
        return not self.rests if self._kind == "enforce" else any(map(nullable, self.rests))

    def cannot_go_on(self, last: Valuation | None) -> bool:
        """Whether no word of `enforce` can be completed after `last`. ExpressionTooLarge: too many atoms to tell."""
        if self._kind != "enforce":
            return False
        (rest,) = self.rests
        return not _goes_on(rest, last, letters(self._expression))

    def _rest(self, rest: Formula, valuation: Valuation) -> Formula:
        key = (rest, valuation)
        if key not in self._known:
            self._known[key] = derivative(rest, valuation.__contains__)
        return self._known[key]


def is_violated(kind: RegularKind, expression: Formula, stem: Sequence[Letter], loop: Sequence[Letter]) -> bool:
    """Whether the run `stem` `loop` `loop` … lacks the property: some beginning of it `is_bad`.

    The loop is read until what may still follow is the same as at an earlier turn. ValueError: the loop is empty.
    ExpressionTooLarge as for `is_bad`.
    """
    if not loop:
        raise ValueError("a lasso needs a loop")
    reading = _Reading(kind, expression)
    last: Valuation | None = None
    seen: set[tuple[frozenset[Formula], Valuation | None]] = set()
    part = stem
    while (reading.rests, last) not in seen:
        if part is loop:
            seen.add((reading.rests, last))
        shown = valuations(expression, part)
        if any(reading.read(valuation) for valuation in (shown[1:] if shown and shown[0] == last else shown)):
            return True
        last = shown[-1] if shown else last
        part = loop
        if len(seen) > MAX_DERIVATIVES:
            raise ExpressionTooLarge(f"an expression with more than {MAX_DERIVATIVES:,} continuations")
    return reading.cannot_go_on(last)


def _goes_on(expression: Formula, last: Valuation | None, alphabet: Sequence[Formula]) -> bool:
    """Some word of satisfiable valuations, no two neighbours and not its first and `last` equal, matches."""
    possible: list[Valuation] | None = None
    seen = {(expression, last)}
    queue = [(expression, last)]
    for rest, before in queue:
        if nullable(rest):
            return True
        possible = possible if possible is not None else list(dict.fromkeys(_possible(alphabet)))
        for valuation in possible:
            if valuation != before:
                state = (derivative(rest, valuation.__contains__), valuation)
                if state[0] is not FALSE and state not in seen:
                    seen.add(state)
                    queue.append(state)
        if len(queue) > MAX_DERIVATIVES:
            raise ExpressionTooLarge(f"an expression with more than {MAX_DERIVATIVES:,} continuations")
    return False


def _possible(alphabet: Sequence[Formula]) -> Iterator[Valuation]:
    keys = atoms(*alphabet)
    if len(keys) > MAX_ATOMS:
        raise ExpressionTooLarge(f"an expression over more than {MAX_ATOMS} atoms")
    excluded = exclusions(keys)
    for values in product((False, True), repeat=len(keys)):
        world: Mapping[str, bool] = dict(zip(keys, values, strict=True))
        if evaluate(excluded, (), (world,)):
            yield frozenset(f for f in alphabet if evaluate(f, (), (world,)))

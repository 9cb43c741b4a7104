"""The causes of a failure by their definition: every set of changes is tried."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import combinations

from llfsm_verify.logic.bounds import Clock
from llfsm_verify.logic.formula import Formula, atoms
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.rewriting.literals import atom_of, every_literal, literal_letter, over_literals

Word = Sequence[frozenset[str]]


def causes_by_definition(
    formula: Formula, letters: Word, loop: int | None, clock: Clock | None = None
) -> frozenset[tuple[int, str]]:
    """The (letter, atom) pairs p of false literals for which some set of other false literals can be made true such
    that `formula`, which is false, stays so, and is no longer false with p made true as well."""
    places = over_literals(formula)
    assert places is not None
    literal = places[formula, False]
    keys = atoms(formula)
    word = [literal_letter(keys, letter) for letter in letters]
    delays = None if clock is None else [*clock.delays(letters), *([clock.period] if loop is None else [])]
    every = frozenset().union(*(literal_letter(keys, x) for x in (frozenset(), frozenset(keys))))
    used = frozenset(atoms(literal))
    false = [(i, name) for i, letter in enumerate(word) for name in sorted((every & used) - letter)]
    found: set[tuple[int, str]] = set()
    for size in range(len(false)):
        for changed in combinations(false, size):
            base = _with(word, changed)
            if _fails(literal, formula, base, loop, delays):
                for pair in false:
                    if pair not in changed and not _fails(literal, formula, _with(base, (pair,)), loop, delays):
                        found.add((pair[0], atom_of(pair[1])))
    return frozenset(found)


def _fails(literal: Formula, formula: Formula, word: Word, loop: int | None, delays: Sequence[Fraction] | None) -> bool:
    stem, again = (word, [every_literal(formula)]) if loop is None else (word[:loop], word[loop:])
    return not evaluate(literal, stem, again, delays)


def _with(word: Word, changed: Sequence[tuple[int, str]]) -> list[frozenset[str]]:
    return [letter | {name for j, name in changed if j == i} for i, letter in enumerate(word)]

"""Safety properties: which formulas are, and the finite words that already violate one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.products import disjoint
from llfsm_verify.automata.translate import translate
from llfsm_verify.logic.formula import Formula, atoms, postorder
from llfsm_verify.logic.rewriting import nnf

MAX_PAIRS = 50_000
"""Pairs of states that `safety` looks at before it falls back to the form of the formula."""


@dataclass(frozen=True, slots=True)
class Safety:
    """Whether a formula is a safety property: every word that violates it has a finite prefix that does.

    `exact` False: the automata were too large, and only the form of the formula was looked at; then `holds` True is
    still right, `holds` False means that it is not known.
    """

    holds: bool
    exact: bool


def is_safety(formula: Formula) -> bool:
    """`safety(formula).holds`."""
    return safety(formula).holds


def safety(formula: Formula, max_pairs: int = MAX_PAIRS, tick: Callable[[], None] | None = None) -> Safety:
    """Whether `formula` is a safety property, exactly unless a limit is passed (see `Safety`).

    It is when no word violates it all of whose prefixes can be continued to satisfy it: the words of the closure
    (Alpern and Schneider, Recognizing safety and liveness, 1987: the automaton with every state of non-empty language
    accepting) and those of the negation have none in common.
    """
    if looks_safe(formula):
        return Safety(True, True)
    keys = atoms(formula)
    left = max_pairs

    def count() -> None:
        nonlocal left
        left -= 1
        if left < 0:
            raise AutomatonTooLarge("pairs of states", max_pairs)
        if tick is not None:
            tick()

    try:
        closure = translate(formula, keys, tick=tick)
        violation = translate(formula, keys, negate=True, tick=tick)
        return Safety(disjoint(closure, violation, count, closure=True), True)
    except AutomatonTooLarge:
        return Safety(False, False)


def looks_safe(formula: Formula) -> bool:
    """There is no `F`, `U` or `M` in the negation normal form, hence it is a safety property (Sistla 1994)."""
    return all(node.op not in ("F", "U", "M") for node in postorder(nnf(formula)))


class BadPrefix:
    """Reads a word letter by letter and tells when no continuation of it satisfies the formula any more.

    The subset construction of the closure automaton, done as far as it is asked for. States are small numbers; a state
    stands for what the word read so far leaves possible.
    """

    def __init__(self, formula: Formula, atom_order: Sequence[str], tick: Callable[[], None] | None = None) -> None:
        """`atom_order` gives the bits of letters. AutomatonTooLarge as for `translate`."""
        self._automaton = translate(formula, atom_order, tick=tick)
        self._relevant = 0
        for row in self._automaton.edges:
            for edge in row:
                self._relevant |= edge.positive | edge.negative
        self._sets: list[frozenset[int]] = []
        self._numbers: dict[frozenset[int], int] = {}
        self._steps: dict[tuple[int, int], int | None] = {}

    def initial(self) -> int | None:
        """The state before the first letter; None: the formula is unsatisfiable, the empty word is a bad prefix."""
        return None if self._automaton.is_empty else self._number(frozenset((0,)))

    def step(self, state: int, letter: int) -> int | None:
        """The state after `letter` (the mask of the atoms that hold); None: the word read so far is a bad prefix."""
        key = (state, letter & self._relevant)
        if key not in self._steps:
            edges = self._automaton.edges
            targets = frozenset(e.target for q in self._sets[state] for e in edges[q] if e.allows(letter))
            self._steps[key] = self._number(targets) if targets else None
        return self._steps[key]

    def _number(self, states: frozenset[int]) -> int:
        number = self._numbers.setdefault(states, len(self._sets))
        if number == len(self._sets):
            self._sets.append(states)
        return number

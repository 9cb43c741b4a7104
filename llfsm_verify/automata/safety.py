"""Safety properties: which formulas are, and the finite words that already violate one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, Self

from llfsm_verify.automata.automaton import Automaton
from llfsm_verify.automata.ltl.classes import closed_by_prefixes
from llfsm_verify.automata.ltl.translate import translate
from llfsm_verify.automata.omega.moves import Lazy, moves_of
from llfsm_verify.logic.formula import Formula, is_boolean, is_plain, postorder
from llfsm_verify.logic.rewriting.normal_form import nnf

MAX_PAIRS = 50_000
"""Pairs of states that `safety` looks at before it falls back to the form of the formula."""
MAX_STATES = 1_000
MAX_TRANSITIONS = 20_000
"""Sizes of the two automata at which it does so too."""
MAX_BITS, MAX_SEEN = 6, 64
"""Atoms and states up to which `never_bad` looks."""


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


def safety(formula: Formula, max_pairs: int = MAX_PAIRS) -> Safety:
    """Whether `formula` is a safety property, exactly unless a limit is passed (see `Safety`).

    Source: Alpern and Schneider, Recognizing safety and liveness, Distributed Computing 2 (1987); see `classes`.
    """
    if looks_safe(formula):
        return Safety(True, True)
    found = closed_by_prefixes(formula, max_states=MAX_STATES, max_transitions=MAX_TRANSITIONS, max_pairs=max_pairs)
    return Safety(bool(found), found is not None)


def looks_safe(formula: Formula) -> bool:
    """There is no `F`, `U` or `M` in the negation normal form, hence it is a safety property (Sistla 1994)."""
    return all(node.op not in ("F", "U", "M") for node in postorder(nnf(formula)))


def is_invariant(formula: Formula) -> bool:
    """Whether `formula` says the same of each letter and nothing of their order: `G` of a state formula, or several of
    them. False also where only its form hides that.

    Source: Baier and Katoen, Principles of Model Checking (2008), definition 3.20.
    """
    plain = nnf(formula) if is_plain(formula) else formula
    parts = plain.args if plain.op == "and" else (plain,)
    return all(part.op == "G" and is_boolean(part.args[0]) for part in parts)


class PrefixMonitor(Protocol):
    """Reads a word letter by letter and tells when no continuation of it has some property any more."""

    def initial(self) -> int | None:
        """The state before the first letter; None: the empty word is a bad prefix."""
        ...

    def step(self, state: int, letter: int) -> int | None:
        """The state after `letter` (the mask of the atoms that hold); None: the word read so far is a bad prefix."""
        ...


def never_bad(monitor: PrefixMonitor, atoms: int) -> bool:
    """No word is a bad prefix: the property is one of liveness. False also where finding that out takes long.

    `atoms` is the number of bits of letters.
    """
    first = monitor.initial()
    if first is None or atoms > MAX_BITS:
        return False
    seen, queue = {first}, [first]
    while queue:
        state = queue.pop()
        for letter in range(1 << atoms):
            following = monitor.step(state, letter)
            if following is None or len(seen) > MAX_SEEN:
                return False
            if following not in seen:
                seen.add(following)
                queue.append(following)
    return True


class SubsetReader:
    """Reads a word letter by letter and tells when no run of an automaton is left.

    The subset construction, done as far as it is asked for. States are small numbers; a state stands for what the word
    read so far leaves possible.
    """

    def __init__(self, automaton: Automaton | Lazy) -> None:
        self._moves = moves_of(automaton)
        self._sets: list[frozenset[int]] = []
        self._numbers: dict[frozenset[int], int] = {}
        self._steps: dict[tuple[int, int], int | None] = {}

    def initial(self) -> int | None:
        """The state before the first letter; None: there is no run at all, the empty word is a bad prefix."""
        first = frozenset[int]() if self._moves.is_empty else self._left({0})
        return self._number(first) if first else None

    def step(self, state: int, letter: int) -> int | None:
        """The state after `letter` (the mask of the atoms that hold); None: the word read so far is a bad prefix."""
        key = (state, letter & self._moves.relevant)
        if key not in self._steps:
            targets = self._left({target for q in self._sets[state] for _, target in self._moves(q, letter)})
            self._steps[key] = self._number(targets) if targets else None
        return self._steps[key]

    def _left(self, states: set[int]) -> frozenset[int]:
        """Those of some states that matter."""
        return frozenset(states)

    def _number(self, states: frozenset[int]) -> int:
        number = self._numbers.setdefault(states, len(self._sets))
        if number == len(self._sets):
            self._sets.append(states)
        return number


class BadPrefix(SubsetReader):
    """Reads a word letter by letter and tells when no continuation of it satisfies the formula any more."""

    def __init__(self, formula: Formula, atom_order: Sequence[str]) -> None:
        """`atom_order` gives the bits of letters. AutomatonTooLarge as for `translate`."""
        self._begin(translate(formula, atom_order, closed=True))

    @classmethod
    def of_closure(cls, automaton: Automaton) -> Self:
        """The same for an automaton, all runs of which count, with an accepted word from each state."""
        self = cls.__new__(cls)
        self._begin(automaton)
        return self

    def _begin(self, automaton: Automaton) -> None:
        super().__init__(automaton)
        self.closure = automaton
        """The automaton: a word is a bad prefix when no run of it is left."""

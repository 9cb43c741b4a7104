"""What is empty about an automaton of a file as a property: it allows every word, or none, or an atom never occurs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from llfsm_verify.automata.automaton import Automaton, Edge
from llfsm_verify.automata.omega.products import accepted_word, common_word
from llfsm_verify.checking.goals.automata import AutomatonGoal
from llfsm_verify.checking.verdict import VacuityFinding
from llfsm_verify.limits import LimitReached


def automaton_findings(goal: AutomatonGoal, never: Sequence[str]) -> Iterator[VacuityFinding]:
    """Of a line that holds; `never` are its atoms that no configuration reached shows.

    AutomatonTooLarge. LimitReached: which words are allowed cannot be told, and so not whether the atom should occur.
    """
    if accepted_word(goal.violations()) is None:
        yield VacuityFinding("valid", "every run of any arrangement satisfies it", goal.line.text)
        return
    for key in never:
        allowed = goal.allowed()
        if allowed is None:
            raise LimitReached(f"whether it means that `{key}` never holds is not known")
        if common_word(allowed, _some_time(allowed.atoms, key)) is not None:
            yield VacuityFinding("letter", f"`{key}` never holds in any configuration reached", key)


def allows_nothing(goal: AutomatonGoal) -> bool:
    """No word is allowed; False also where that cannot be told. AutomatonTooLarge."""
    allowed = goal.allowed()
    return allowed is not None and accepted_word(allowed) is None


def _some_time(keys: Sequence[str], key: str) -> Automaton:
    """`F key` over `keys`."""
    bit = 1 << list(keys).index(key)
    return Automaton(tuple(keys), ((Edge(0, bit, 0, 0), Edge(bit, 0, 1, 0)), (Edge(0, 0, 1, 1),)), 1)

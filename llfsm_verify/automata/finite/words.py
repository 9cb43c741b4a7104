"""The words that a regular property allows, as the smallest deterministic automaton over valuations."""

from __future__ import annotations

from llfsm_verify.automata.boolean import Guard, Guards
from llfsm_verify.automata.finite.expressions import (
    MAX_STATES,
    DeterministicAutomaton,
    FiniteAutomaton,
    explore_subsets,
    minimise,
    nondeterministic,
)
from llfsm_verify.automata.finite.monitor import EmptyWordForbidden, NoWord, open_states
from llfsm_verify.logic.expressions import letters, nullable
from llfsm_verify.logic.formula import Formula
from llfsm_verify.logic.regular import RegularKind, exclusions


def allowed_words(
    kind: RegularKind, expression: Formula, guards: Guards, max_states: int = MAX_STATES
) -> DeterministicAutomaton:
    """The automaton of the words that violate nothing: in each state a letter without an edge does.

    It reads configurations whose valuation of the expression's letters differs from the one before; who runs it leaves
    out the others. Letters are told apart only where those of one state do, never all of the expression's. All states
    accept. NoWord, EmptyWordForbidden, AutomatonTooLarge as for `RegularMonitor`.
    """
    alphabet = [guards.of(f) for f in letters(expression)]
    world = guards.of(exclusions(guards.atoms))
    automaton = nondeterministic(expression, guards)
    classes = open_states(automaton, alphabet, world)
    if 0 not in classes:
        raise NoWord
    if kind != "enforce" and nullable(expression):
        raise EmptyWordForbidden
    same = {v: _showing(v, alphabet, world) for v in classes.values() if v is not None}
    _, edges = explore_subsets(
        frozenset((0,)),
        lambda states: _successors(kind, automaton, states, classes, same, world).items(),
        max_states,
    )
    return minimise(DeterministicAutomaton(guards, edges, (True,) * len(edges)))


def _showing(valuation: int, alphabet: list[Guard], world: Guard) -> Guard:
    """The configurations that show `valuation`."""
    result = world
    for i, guard in enumerate(alphabet):
        result = result & (guard if valuation >> i & 1 else ~guard)
    return result


def _successors(
    kind: RegularKind,
    automaton: FiniteAutomaton,
    states: frozenset[int],
    classes: dict[int, int | None],
    same: dict[int, Guard],
    world: Guard,
) -> dict[Guard, frozenset[int]]:
    """The states after each class of letters that violates nothing."""
    leaving = [edge for q in sorted(states | {0} if kind == "forbid" else states) for edge in automaton.edges[q]]
    found: dict[Guard, frozenset[int]] = {}
    barred = {v for _, t in leaving if (v := classes.get(t)) is not None} if kind == "enforce" else set()
    marks = [*(guard for guard, _ in leaving), *(same[v] for v in sorted(barred))]
    for part, inside in automaton.guards.partition(marks, world).items():
        targets = {t for guard, t in leaving if guard in inside}
        if kind != "enforce":
            if not any(automaton.accepting[t] for t in targets):
                found[part] = frozenset(targets)
            continue
        left = frozenset(t for t in targets if t in classes and not _bars(classes[t], same, inside))
        if left:
            found[part] = left
    return found


def _bars(valuation: int | None, same: dict[int, Guard], inside: frozenset[Guard]) -> bool:
    """The class of letters shows the valuation after which a state is of no use."""
    return valuation is not None and same[valuation] in inside

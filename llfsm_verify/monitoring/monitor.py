"""Monitors: what a finite word already says about a property, as a minimal deterministic automaton."""

from __future__ import annotations

from collections.abc import Sequence

from llfsm_verify.automata.automaton import Automaton, AutomatonTooLarge, Edge
from llfsm_verify.automata.labels import Cube, L, alphabet_of
from llfsm_verify.automata.ltl.counting import Counting
from llfsm_verify.automata.ltl.translate import translate
from llfsm_verify.automata.ltl.translation import automaton_of, counting_of
from llfsm_verify.automata.omega.products import explore
from llfsm_verify.automata.omega.reduction import closure
from llfsm_verify.automata.omega.simulation import simulating
from llfsm_verify.automata.omega.subsets import Step, maximal, regions_of
from llfsm_verify.automata.omega.symbolic import Symbolic, cubes_at, from_automaton, mentioned, narrowed
from llfsm_verify.limits import tick
from llfsm_verify.logic.bounds import TICK, Clock
from llfsm_verify.logic.formula import TIMED, Formula, apply, atoms, is_plain, negation, operators
from llfsm_verify.monitoring.states import MAX_EDGES, Monitor, Monitorability, MonitorEdge, MonitorVerdict, minimal

__all__ = ["Monitor", "MonitorEdge", "MonitorVerdict", "Monitorability", "monitor", "monitor_of"]

MAX_STATES = 10_000
"""Of a monitor, or as many as the automata of both sides have."""


def monitor(
    formula: Formula,
    atom_order: Sequence[str] | None = None,
    *,
    given: Formula | None = None,
    clock: Clock | None = None,
    every_letter_ticks: bool = False,
    max_states: int | None = None,
    max_edges: int = MAX_EDGES,
) -> Monitor:
    """The monitor of `formula` over `atom_order` (its own atoms by default), whatever its operators.

    `given`: only continuations that satisfy this assumption count; once none does, no violation can follow, and the
    verdict is true. `clock`: what bounds in time mean; with such, TICK (time passes after this letter) is an atom,
    unless time passes after every letter. Source: Bauer, Leucker and Schallhart, Runtime verification for LTL and
    TLTL, ACM TOSEM 20 (2011). ValueError as for `translate`; Untranslatable: bounds in time and no clock.
    AutomatonTooLarge: it has more states or edges than allowed (before it is minimised).
    """
    whole = (formula,) if given is None else (formula, given)
    keys = tuple(atoms(*whole) if atom_order is None else atom_order)
    if given is None and is_plain(formula):
        sides = [translate(formula, keys, negate=negate, closed=True) for negate in (False, True)]
        return monitor_of(*sides, max_states=max_states, max_edges=max_edges)
    if any(operators(f) & TIMED for f in whole) and TICK not in keys:
        keys = (*keys, TICK)
    claims = (formula, negation(formula))
    if given is not None:
        claims = (apply("and", given, claims[0]), apply("and", given, claims[1]))
    sides = [timed_automaton(claim, keys, clock) for claim in claims]
    if every_letter_ticks:
        sides = [always_ticking(side) for side in sides]
    return monitor_of(*sides, max_states=max_states, max_edges=max_edges)


def monitor_of(
    satisfying: Automaton, violating: Automaton, *, max_states: int | None = None, max_edges: int = MAX_EDGES
) -> Monitor:
    """The monitor of a property given by an automaton of it and one of its complement, over the same atoms.

    The two may be those of an assumption with the property and with its complement: see `monitor`.
    """
    if satisfying.atoms != violating.atoms:
        raise ValueError("the automata have different atoms")
    keys = satisfying.atoms
    used = mentioned(satisfying, violating)
    alphabet = alphabet_of(len(used))

    def widened(labels: dict[int, L]) -> dict[int, list[Cube]]:
        return {target: cubes_at(alphabet, label, used) for target, label in labels.items()}

    good, bad = (closure(from_automaton(narrowed(a, used), alphabet)) for a in (satisfying, violating))
    most = max(MAX_STATES, len(good.rows) + len(bad.rows)) if max_states is None else max_states
    verdicts, rows = _explored(good, bad, most, max_edges)
    return minimal(keys, verdicts, rows, widened, max_edges)


_Explored = tuple[list[MonitorVerdict], list[list[Step[L]]]]

_FALSE, _TRUE = 0, -1
"""The names of the verdicts among sets of states."""


def _explored(satisfying: Symbolic[L], violating: Symbolic[L], max_states: int, max_edges: int) -> _Explored[L]:
    """Pairs of subsets: the states that the two automata can be in. An empty one is a verdict, and ends the search."""
    shift = len(satisfying.rows)
    moved = tuple(tuple((label, a, target + shift) for label, a, target in row) for row in violating.rows)
    union = Symbolic(satisfying.alphabet, satisfying.rows + moved, 0)
    above = simulating(satisfying)
    above += (mask << shift for mask in simulating(violating))
    low = (1 << shift) - 1
    start = (1 if satisfying.rows else 0) | (1 << shift if violating.rows else 0)

    def canonical(members: int) -> int:
        if members & ~low == 0:
            return _TRUE
        return maximal(members, above) if members & low else _FALSE

    numbers = {canonical(start): 0}
    queue = [canonical(start)]
    verdicts: list[MonitorVerdict] = []
    rows: list[list[Step[L]]] = []
    made = 0
    for members in queue:
        tick()
        if members in (_TRUE, _FALSE):
            verdicts.append(MonitorVerdict.TRUE if members == _TRUE else MonitorVerdict.FALSE)
            rows.append([(union.alphabet.true, numbers[members])])
            continue
        verdicts.append(MonitorVerdict.NOT_YET)
        row: list[Step[L]] = []
        left = union.alphabet.true
        regions = regions_of(union, members, made, max_edges)
        for label, _ in regions:
            left = left & ~label
        # Letters without any step: the assumption is broken.
        for label, targets in [*regions, *([(left, 0)] if left else [])]:
            name = canonical(targets)
            number = numbers.setdefault(name, len(queue))
            if number == len(queue):
                queue.append(name)
                if len(queue) > max_states:
                    raise AutomatonTooLarge("states", max_states)
            row.append((label, number))
        made += len(row)
        rows.append(row)
    return verdicts, rows


MAX_TIMED_STATES = 3_000
MAX_TIMED_EDGES = 60_000
"""Sizes of an automaton with its counters of time written out: a monitor needs all states at once."""


def timed_automaton(formula: Formula, keys: Sequence[str], clock: Clock | None = None) -> Automaton:
    """The automaton of `formula` over `keys`, among which is TICK (time passes after the letter) with bounds in time.

    Those words are left out in which time does not pass forever. Untranslatable: bounds in time, and no clock.
    AutomatonTooLarge: as for `automaton_of`, or more than `MAX_TIMED_STATES` states with their counters,
    `MAX_TIMED_EDGES` edges.
    """
    if clock is None or not operators(formula) & TIMED:
        return automaton_of(formula, keys)
    reader = counting_of(formula, keys, clock)
    if reader.is_empty:
        return Automaton(tuple(keys), (), reader.acceptance_sets + 1)
    sets = reader.acceptance_sets + 1
    states, edges = MAX_TIMED_STATES, MAX_TIMED_EDGES
    if not reader.counters:  # only of the past: there is nothing to write out
        states, edges = max(states, len(reader.steps)), max(edges, 4 * sum(map(len, reader.steps)))
    return explore(0, lambda state: _moves(reader, state), keys, sets, states, edges)


def _moves(reader: Counting, state: int) -> list[tuple[int, int, int, int]]:
    """Positive and negative atoms, target and acceptance; the last set holds the moves after which time passes."""
    guards, bit = reader.guards, reader.tick_bit
    forever = 1 << reader.acceptance_sets
    here, levels = reader.states[state]
    found: list[tuple[int, int, int, int]] = []
    for step in reader.steps[here]:
        active = step.starts | sum(1 << i for i, level in enumerate(levels) if level)
        watched = [guard for i in range(len(reader.counters)) if active >> i & 1 for guard in reader.watched(i)]
        label = guards.cube(step.positive, step.negative)
        for part in guards.partition([*watched, guards.cube(bit, 0)], label):
            letter = guards.example(part)
            after = reader.after(levels, step, letter)
            if after is not None:
                acceptance = step.acceptance | (forever if letter & bit else 0)
                target = reader.number(step.target, after)
                found += [(p, n, target, acceptance) for p, n in guards.cubes(part)]
    return found


def always_ticking(automaton: Automaton) -> Automaton:
    """The words of `automaton` in which time passes after every letter, without the atom that says so."""
    if TICK not in automaton.atoms:
        return automaton
    bit = 1 << automaton.atoms.index(TICK)
    rows = tuple(
        tuple(Edge(e.positive & ~bit, e.negative, e.target, e.acceptance) for e in row if not e.negative & bit)
        for row in automaton.edges
    )
    return Automaton(automaton.atoms, rows, automaton.acceptance_sets)

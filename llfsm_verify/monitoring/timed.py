"""Automata of formulas with bounds in time, written out: monitors need all states at once."""

from __future__ import annotations

from collections.abc import Sequence

from llfsm_verify.automata.automaton import Automaton, AutomatonTooLarge, Edge
from llfsm_verify.automata.ltl.counting import Counting
from llfsm_verify.automata.ltl.translation import automaton_of, reader_of
from llfsm_verify.limits import tick
from llfsm_verify.logic.bounds import TICK, Clock
from llfsm_verify.logic.formula import TIMED, Formula, operators

MAX_STATES = 3_000
MAX_EDGES = 60_000


def timed_automaton(formula: Formula, keys: Sequence[str], clock: Clock | None = None) -> Automaton:
    """The automaton of `formula` over `keys`, among which is TICK (time passes after the letter) with bounds in time.

    Those words are left out in which time does not pass forever. Untranslatable: bounds in time, and no clock.
    AutomatonTooLarge: as for `automaton_of`, or more than `MAX_STATES` states with their counters, `MAX_EDGES` edges.
    """
    if clock is None or not operators(formula) & TIMED:
        return automaton_of(formula, keys)
    reader = reader_of(formula, keys, clock)
    assert isinstance(reader, Counting)
    if reader.is_empty:
        return Automaton(tuple(keys), (), reader.acceptance_sets + 1)
    numbers = {0: 0}
    queue = [0]
    rows: list[tuple[Edge, ...]] = []
    made = 0
    for state in queue:
        tick()
        row: list[Edge] = []
        for positive, negative, target, acceptance in _moves(reader, state):
            number = numbers.setdefault(target, len(queue))
            if number == len(queue):
                queue.append(target)
            row.append(Edge(positive, negative, number, acceptance))
        made += len(row)
        if len(queue) > MAX_STATES:
            raise AutomatonTooLarge("states", MAX_STATES)
        if made > MAX_EDGES:
            raise AutomatonTooLarge("transitions", MAX_EDGES)
        rows.append(tuple(row))
    return Automaton(tuple(keys), tuple(rows), reader.acceptance_sets + 1)


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

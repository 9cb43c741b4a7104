"""Monitors of regular properties: the same minimal deterministic automata as those of formulas."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.boolean import Guard, Guards
from llfsm_verify.automata.finite.expressions import DeterministicAutomaton
from llfsm_verify.automata.finite.monitor import allowed_words
from llfsm_verify.automata.omega.components import reaching
from llfsm_verify.limits import tick
from llfsm_verify.logic.expressions import letters
from llfsm_verify.logic.formula import Formula
from llfsm_verify.logic.regular import RegularKind, exclusions
from llfsm_verify.monitoring.states import MAX_EDGES, Monitor, MonitorVerdict, minimal

MAX_STATES = 10_000

Cube = tuple[int, int]

_State = tuple[int, Guard | None] | None
"""A state of the automaton of allowed words with the letters that leave it alone; None: a bad prefix was read."""


def regular_to_monitor(
    kind: RegularKind,
    expression: Formula,
    atom_order: Sequence[str],
    *,
    max_states: int = MAX_STATES,
    max_edges: int = MAX_EDGES,
) -> Monitor:
    """The minimal monitor of `enforce` or `forbid` over `atom_order`.

    The automaton of the allowed words reads changes of the valuation (which letters of the expression hold) only. A
    monitor reads every configuration, so it remembers the last valuation, but just where reading it once more would
    make a difference: valuations are never enumerated otherwise. A configuration that is impossible (a machine in two
    states) counts as some possible one. The verdict is true where no bad prefix can follow. NoWord, EmptyWordForbidden:
    the property is void. AutomatonTooLarge: a limit, before it is minimised.
    """
    guards = Guards(atom_order)
    world = guards.of(exclusions(atom_order))
    reader = _Reader(allowed_words(kind, expression, guards), [guards.of(f) for f in letters(expression)], world)
    first: _State = (0, None)
    numbers: dict[_State, int] = {first: 0}
    queue: list[_State] = [first]
    rows: list[list[tuple[Guard, int]]] = []
    made = 0
    for state in queue:
        tick()
        merged: dict[int, Guard] = {}
        for label, following in reader.steps(state):
            number = numbers.setdefault(following, len(queue))
            if number == len(queue):
                queue.append(following)
                if len(queue) > max_states:
                    raise AutomatonTooLarge("states", max_states)
            merged[number] = merged[number] | label if number in merged else label
        rows.append([(label, number) for number, label in merged.items()])
        made += len(merged)
        if made > max_edges:
            raise AutomatonTooLarge("transitions", max_edges)
    targets = [[target for _, target in row] for row in rows]
    threatened = reaching(targets, [state is None for state in queue])
    verdicts = [
        MonitorVerdict.FALSE if state is None else MonitorVerdict.NOT_YET if threatened[i] else MonitorVerdict.TRUE
        for i, state in enumerate(queue)
    ]
    return minimal(atom_order, verdicts, rows, lambda labels: _completed(guards, labels, ~world), max_edges)


class _Reader:
    """Steps through configurations with an automaton that reads changes."""

    def __init__(self, automaton: DeterministicAutomaton, alphabet: Sequence[Guard], world: Guard) -> None:
        self._automaton = automaton
        self._guards = automaton.guards
        self._alphabet = alphabet
        self._world = world
        self._loops = [
            next((guard for guard, target in row if target == q), self._guards.never)
            for q, row in enumerate(automaton.edges)
        ]

    def steps(self, state: _State) -> Iterator[tuple[Guard, _State]]:
        """The letters that can come, none twice, with the states after them."""
        left = self._world
        if state is None:
            yield left, None
            return
        q, last = state
        if last is not None:
            yield last, state
            left = left & ~last
        for guard, target in self._automaton.edges[q]:
            part = guard & left
            left = left & ~part
            # Where the same valuation once more leads nowhere else, it need not be remembered.
            easy = part & self._loops[target]
            if easy:
                yield easy, (target, None)
            hard = part & ~easy
            while hard:
                alike = self._showing(self._guards.example(hard))
                yield alike, (target, alike)
                hard = hard & ~alike
        if left:
            yield left, None

    def _showing(self, letter: int) -> Guard:
        """The configurations with the valuation of `letter`."""
        alike = self._world
        for guard in self._alphabet:
            alike = alike & (guard if self._guards.holds(guard, letter) else ~guard)
        return alike


def _completed(guards: Guards, labels: dict[int, Guard], free: Guard) -> dict[int, list[Cube]]:
    """Disjoint sets of letters as cubes; the letters of `free` are given to whichever makes the cubes large."""
    found: dict[int, list[Cube]] = {}
    for i, (target, label) in enumerate(labels.items()):
        if i == len(labels) - 1:
            label, free = label | free, guards.never
        cubes: list[Cube] = []
        covered = guards.never
        for positive, negative in guards.cubes(label):
            if not guards.cube(positive, negative) & ~covered:
                continue
            larger = _enlarged(guards, positive, negative, label | free)
            cubes.append(larger)
            covered = covered | guards.cube(*larger)
        found[target] = cubes
        free = free & ~covered
    return found


def _enlarged(guards: Guards, positive: int, negative: int, inside: Guard) -> Cube:
    """The cube without the literals that it does not need to stay `inside`."""
    for i in range(len(guards.atoms)):
        bit = 1 << i
        if (positive | negative) & bit:
            larger = (positive & ~bit, negative & ~bit)
            if not guards.cube(*larger) & ~inside:
                positive, negative = larger
    return positive, negative

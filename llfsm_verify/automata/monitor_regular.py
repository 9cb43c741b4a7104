"""Monitors of regular properties: the same minimal deterministic automata as those of formulas."""

from __future__ import annotations

from collections.abc import Sequence

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.boolean import Guard, Guards
from llfsm_verify.automata.monitor_states import MAX_EDGES, Monitor, Verdict, minimal, reaching
from llfsm_verify.automata.regular_monitor import RegularMonitor
from llfsm_verify.automata.symbolic import Tick
from llfsm_verify.logic.expressions import letters
from llfsm_verify.logic.formula import Formula
from llfsm_verify.logic.regular import exclusions

Cube = tuple[int, int]


def regular_to_monitor(
    reader: RegularMonitor,
    expression: Formula,
    atom_order: Sequence[str],
    possible: Formula | None = None,
    *,
    max_edges: int = MAX_EDGES,
    tick: Tick | None = None,
) -> Monitor:
    """The minimal monitor of what `reader` reads, whose arguments are repeated here.

    What a state does depends on the letters of the expression that hold (its valuation), so letters are told apart by
    these, and only as far as a configuration can show them; a configuration that is impossible counts as some possible
    one. The verdict is true where no bad prefix can follow. AutomatonTooLarge: too many valuations, states or steps.
    """
    guards = Guards(atom_order)
    world = guards.of(exclusions(atom_order) if possible is None else possible)
    classes = list(guards.partition((guards.of(f) for f in letters(expression)), world))
    examples = [guards.example(label) for label in classes]
    first = reader.initial()
    assert first is not None
    numbers: dict[int | None, int] = {first: 0}
    queue: list[int | None] = [first]
    rows: list[list[tuple[Guard, int]]] = []
    for state in queue:
        if tick is not None:
            tick()
        if state is None:
            rows.append([(world, numbers[None])])
            continue
        merged: dict[int, Guard] = {}
        for label, letter in zip(classes, examples, strict=True):
            following = reader.step(state, letter)
            number = numbers.setdefault(following, len(queue))
            if number == len(queue):
                queue.append(following)
            merged[number] = merged[number] | label if number in merged else label
        rows.append([(label, number) for number, label in merged.items()])
        if len(rows) * len(classes) > max_edges:
            raise AutomatonTooLarge("steps", max_edges)
    targets = [[target for _, target in row] for row in rows]
    threatened = reaching(targets, [state is None for state in queue])
    verdicts = [
        Verdict.FALSE if state is None else Verdict.NOT_YET if threatened[i] else Verdict.TRUE
        for i, state in enumerate(queue)
    ]
    return minimal(atom_order, verdicts, rows, lambda labels: _completed(guards, labels, ~world), max_edges)


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

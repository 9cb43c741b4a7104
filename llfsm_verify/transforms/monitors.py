"""Programs that keep the states of monitors, and where their processes stand in their cycles, in their configurations.

Kept: every run, with its letters, faults and overflows: what is added reads the program and writes variables of its
own. What is reachable is then reachable together with what the monitors have come to. A run in which a `fatal` monitor
comes to *violated* is kept up to there, and ends in a fault. Source: the product with a
deterministic safety automaton (O. Kupferman and M. Y. Vardi, Model checking of safety properties, FMSD 2001).
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace

from llfsm_verify.monitoring.lookup import WalkTable
from llfsm_verify.monitoring.states import Monitor, MonitorEdge, MonitorVerdict
from llfsm_verify.program.program import (
    BOOL,
    Block,
    Expr,
    Fault,
    FaultSite,
    Get,
    If,
    Int,
    Origin,
    Program,
    Set,
    Stmt,
    Switch,
    Var,
)  # fmt: skip
from llfsm_verify.program.terms import TRUE, conjunction, const, disjunction, get, op

MONITOR, WITHIN = "$monitor.", "$within."
MOST_EDGES = 5_000
"""Of a monitor that becomes a part of a program."""


class TooManyEdges(Exception):
    """A monitor is too large to become a part of a program."""


def monitor_name(number: int) -> str:
    """The variable with the state of a monitor, in the numbers of its table."""
    return f"{MONITOR}{number}"


def within_names(program: Program) -> list[str]:
    """The variables that are 1 while a process is in the middle of a cycle, in the order of the processes."""
    return [f"{WITHIN}{number}" for number in range(len(program.processes))]


def with_monitors(
    program: Program, monitors: Sequence[Monitor], tables: Sequence[WalkTable], fatal: Collection[int] = ()
) -> Program:
    """The program with these monitors, which step where a letter is. They begin in the states in which they have read
    nothing; whoever begins elsewhere says so in the record. TooManyEdges.

    Where monitor k of those that are `fatal` comes to *violated*, the step ends in the k-th fault after those of the
    program.
    """
    if any(sum(map(len, monitor.edges)) > MOST_EDGES for monitor in monitors):
        raise TooManyEdges(f"a monitor has more than {MOST_EDGES:,} edges")
    outputs = {atom.name: atom.output for atom in program.atoms}
    pairs = list(zip(monitors, tables, strict=True))
    variables = [
        Var(monitor_name(k), Int(0, len(m.edges) - 1), t.numbers[0], Origin("control"))
        for k, (m, t) in enumerate(pairs)
    ]
    variables += [Var(name, BOOL, 0, Origin("control")) for name in within_names(program)]
    first = len(program.faults)
    steps: Block = tuple(
        _step(monitor_name(k), *pair, outputs, first + k if k in fatal else None) for k, pair in enumerate(pairs)
    )
    cycle = get(program.cycle, BOOL)
    shown: Block = steps if program.observe == "ringlet" or not steps else (If(cycle, steps),)
    processes = tuple(
        replace(process, epilogue=(*process.epilogue, Set(name, None, op("not", cycle))))
        for process, name in zip(program.processes, within_names(program), strict=True)
    )
    return replace(
        program,
        vars=(*program.vars, *variables),
        processes=processes,
        faults=(*program.faults, *(FaultSite("monitor", "", None) for _ in monitors)),
        letter=(*program.letter, *shown),
        letter_stutter=(*program.letter_stutter, *steps),
    )


def _step(name: str, monitor: Monitor, table: WalkTable, outputs: Mapping[str, str], fault: int | None) -> Stmt:
    atoms = [get(outputs[atom], BOOL) for atom in monitor.atoms]
    cases = []
    for state, row in enumerate(monitor.edges):
        by_target: dict[int, list[MonitorEdge]] = {}
        for edge in row:
            by_target.setdefault(edge.target, []).append(edge)
        block: Block = ()
        for at, (target, edges) in enumerate(by_target.items()):  # for each letter one of the targets is allowed
            move: Block = (Set(name, None, const(table.numbers[target])),) if target != state else ()
            if move and fault is not None and monitor.verdicts[target] is MonitorVerdict.FALSE:
                move = (Fault(fault, TRUE),)
            block = move if not at else (If(_allowed(edges, atoms), move, block),)
        if block:
            cases.append((table.numbers[state], block))
    return Switch(get(name, Int(0, len(monitor.edges) - 1)), tuple(cases))


def _allowed(edges: Iterable[MonitorEdge], atoms: Sequence[Get]) -> Expr:
    return disjunction(
        [
            conjunction(
                [atom for i, atom in enumerate(atoms) if edge.positive >> i & 1]
                + [op("not", atom) for i, atom in enumerate(atoms) if edge.negative >> i & 1]
            )
            for edge in edges
        ]
    )

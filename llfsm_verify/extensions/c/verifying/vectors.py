"""Vectors for images: runs of the executor that pass through all steps, where these are few, or drawn ones."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from math import prod
from random import Random

from llfsm_verify.plug import PROGRAM_ENDED as ENDED
from llfsm_verify.plug import (
    Execution,
    Program,
    Unit,
    Vectors,
    fault_of,
    field_names,
    program_hash,
    record_of,
    starting_values,
)
from llfsm_verify.plug import VectorSteps as Steps
from llfsm_verify.plug import vector_ended as ended

Row = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class _Edge:
    """A step from a node: its inputs, the number of the node that it leads to (-1: none), and its fault."""

    inputs: Row
    to: int
    fault: int = 0


def drawn(program: Program, unit: Unit, seed: int = 1, sequences: int = 10, steps: int = 200) -> Vectors:
    """Runs with inputs that are drawn: often the last ones, in some runs for long, or values near the ends of their
    ranges."""
    run, random = _Run(program, unit), Random(seed)  # noqa: S311 - no secrets
    made = []
    for _ in range(sequences):
        record, row, pace = run.first, run.start, random.choice((0.5, 0.1, 0.02))
        taken: list[tuple[Row, bytes]] = []
        fault = 0
        for _ in range(steps):
            row = tuple(n if random.random() > pace else _drawn(random, c.type.low, c.type.high)
                        for n, c in zip(row, program.choices, strict=True))  # fmt: skip
            status, after = run.step(record, row)
            if status == ENDED:
                break
            taken.append((row, after))
            if status:
                fault = fault_of(status)
                break
            record = after
        made.append(run.sequence(taken, fault))
    return run.vectors(made)


def all_steps(program: Program, unit: Unit, limit: int = 60_000) -> Vectors | None:
    """Sequences with every step, with every combination of the inputs that it reads, from every configuration
    that can be reached; None: there are more than `limit`, or too many values."""
    run = _Run(program, unit)
    if any(v.free for v in program.vars):
        return None
    graph = run.explore(limit)
    if graph is None:
        return None
    records, edges = graph
    waiting = [deque(found) for found in edges]
    sequences = []
    for first, record in enumerate(records):
        while waiting[first]:
            node, fault, taken = first, 0, list[tuple[Row, bytes]]()
            while node >= 0 and waiting[node]:
                edge = waiting[node].popleft()
                node, fault = edge.to, edge.fault
                taken.append((edge.inputs, records[max(node, 0)]))
            sequences.append(run.sequence(taken, fault, record if first else None))
    return run.vectors(sequences)


def _drawn(random: Random, low: int, high: int) -> int:
    near = min(high, max(low, random.randint(-9, 9)))
    return random.choice((low, high, min(high, low + 1), near, random.randint(low, high)))


class _Run:
    """Steps of a program, and what vectors tell of them."""

    def __init__(self, program: Program, unit: Unit) -> None:
        self._program, self._unit = program, unit
        self._execution = Execution(program)
        self._native = self._execution.native
        self._names = [c.name for c in program.choices]
        held = starting_values(program)
        self.start: Row = tuple(held.get(c.name, c.type.low) for c in program.choices)
        self.first = self._native.layout.first()

    def step(self, record: bytes, row: Row) -> tuple[int, bytes]:
        """The status, and the record after it (before it, where it is a fault)."""
        choices = dict(zip(self._names, row, strict=True))
        if ended(self._execution, record):
            return ENDED, record
        if self._unit == "ringlet":
            done = self._native.step(record, 0, choices)
            return done.status, done.record
        ran = self._native.run(record, 1 << 20, stop_on_cycle=True, choices=choices)
        return ran.status, ran.record

    def explore(self, limit: int) -> tuple[list[bytes], list[list[_Edge]]] | None:
        """All records that can be reached, and the steps from each."""
        numbers, records, edges, count = {self.first: 0}, [self.first], list[list[_Edge]](), 0
        after = self._ringlets if self._unit == "ringlet" else self._cycles(limit)
        if after is None:
            return None
        while len(edges) < len(records):
            found = []
            for status, record, row in after(records[len(edges)]):
                count += 1
                if count > limit:
                    return None
                if status == 0 and record not in numbers:
                    numbers[record] = len(records)
                    records.append(record)
                found.append(_Edge(row, numbers[record] if status == 0 else -1, fault_of(status) if status else 0))
            edges.append(found)
        return records, edges

    def _ringlets(self, record: bytes) -> Iterator[tuple[int, bytes, Row]]:
        if ended(self._execution, record):
            return
        for edge in self._native.successors(record):
            read = dict(edge.samples)
            row = tuple(read.get(i, n) for i, n in enumerate(self.start))
            yield edge.status, edge.record, row

    def _cycles(self, limit: int) -> Callable[[bytes], Iterator[tuple[int, bytes, Row]]] | None:
        kinds = [c.type for c in self._program.choices]
        if prod(kind.high - kind.low + 1 for kind in kinds) > limit:
            return None
        rows = list(product(*(range(kind.low, kind.high + 1) for kind in kinds)))

        def after(record: bytes) -> Iterator[tuple[int, bytes, Row]]:
            for row in rows:
                status, record_after = self.step(record, row)
                if status != ENDED:
                    yield status, record_after, row

        return after

    def sequence(self, taken: Sequence[tuple[Row, bytes]], fault: int, start: bytes | None = None) -> Steps:
        kept = taken[:-1] if fault else taken
        records = tuple(record_of(self._execution, record) for _, record in kept)
        begin = () if start is None else record_of(self._execution, start)
        return Steps(tuple(row for row, _ in taken), records, fault, begin)

    def vectors(self, sequences: Sequence[Steps]) -> Vectors:
        fields = field_names(self._program)
        return Vectors(program_hash(self._program), self._unit, tuple(self._names), fields, tuple(sequences))

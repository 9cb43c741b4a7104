"""Test vectors performed by the executor: the ringlets of a step, the records after steps, and what they cover."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from llfsm_verify.analysis.coverage.vectors import Sequence as Run
from llfsm_verify.analysis.coverage.vectors import Vectors
from llfsm_verify.backends.native.code import OVERFLOW
from llfsm_verify.backends.native.executor import StepResult
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Program
from llfsm_verify.values import element_names

LEFT_64 = -2
"""`Sequence.fault` of an `int` that left 64 bits."""


def field_names(program: Program) -> tuple[str, ...]:
    """The elements of all variables, outputs too."""
    return tuple(name for var in program.vars for name in element_names(var))


def record_of(execution: Execution, record: bytes) -> tuple[int, ...]:
    """The values of `field_names`."""
    values = execution.layout.decode_record(record)
    flat: list[int] = []
    for var in execution.program.vars:
        value = values[var.name]
        flat += value if isinstance(value, tuple) else (value,)
    return tuple(flat)


def step(execution: Execution, record: bytes, values: dict[str, int], *, cycle: bool) -> Iterator[StepResult]:
    """The ringlets of one step from a record: one, or those of a cycle with its inputs held, up to one that fails."""
    ends = execution.layout.reader(execution.program.cycle)
    while True:
        result = execution.step(record, Move(0, values))
        yield result
        if result.status or not cycle or ends(result.record):
            return
        record = result.record


def ended(execution: Execution, record: bytes) -> bool:
    """Whether no machine takes a turn any more."""
    return not execution.enabled(record)


def fault_of(status: int) -> int:
    """`Sequence.fault` of the status of a step."""
    return LEFT_64 if status == OVERFLOW else status


def performed(execution: Execution, vectors: Vectors, inputs: Sequence[Sequence[int]]) -> tuple[Run, list[Move]]:
    """A sequence of these inputs with the records that the executor makes, and its ringlets; after a fault, and after
    the end of all machines, no inputs are used."""
    record, moves, records, fault = execution.start(), list[Move](), list[tuple[int, ...]](), 0
    used = 0
    for row in inputs:
        if fault or ended(execution, record):
            break
        used += 1
        values = dict(zip(vectors.inputs, row, strict=True))
        for result in step(execution, record, values, cycle=vectors.unit == "cycle"):
            moves.append(Move(0, values))
            if result.status:
                fault = fault_of(result.status)
                break
            record = result.record
        if not fault:
            records.append(record_of(execution, record))
    return Run(tuple(tuple(row) for row in inputs[:used]), tuple(records), fault), moves

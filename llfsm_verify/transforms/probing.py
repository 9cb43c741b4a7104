"""The step program of an arrangement with its probes: faults become outcomes, so that every step has an end.

Probes are put where expressions are lowered, so this begins with an arrangement. Kept: every run up to its first fault,
where it then stays; letters show outcomes in the place of atoms, and nothing is said about fairness. Source: assertion
checking by instrumentation (the error location of T. Ball and S. K. Rajamani, The SLAM project, POPL 2002).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.language.typed import Expression
from llfsm_verify.program.program import (
    BOOL,
    Atom,
    Block,
    Fault,
    Get,
    If,
    Origin,
    Program,
    Set,
    Slot,
    Stmt,
    Var,
)
from llfsm_verify.program.terms import FALSE, TRUE, op
from llfsm_verify.program.trees import statements, stop_at_faults, while_fine
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.semantics.probes import DEAD, Condition, Outcome, Probe, Probes

ALIVE = op("not", Get(DEAD, None, BOOL))


@dataclass(frozen=True, slots=True)
class Probed:
    """A program without faults whose letters are outcomes: atom ``outputs[outcome]`` holds after a step in which that
    came out, up to what would have ended the step."""

    program: Program
    outputs: dict[Outcome, str]
    expressions: dict[Probe, Expression]
    conditions: dict[Probe, tuple[Condition, ...]]
    has_faults: bool
    """There is a variable DEAD."""

    @property
    def wide(self) -> bool:
        """Guards alone are probed."""
        return any(o.probe.kind == "alone" for o in self.outputs)


def probed(
    arrangement: Arrangement,
    *,
    wide: bool = False,
    decisions: bool = False,
    passed_over: frozenset[str] = frozenset(),
    keep_all_bits: bool = False,
) -> Probed:
    """The step program of `arrangement` with its probes; every ringlet is a step (whatever `observe` says). `wide`,
    `decisions`, `passed_over`: which (`Probes`).

    Raises DiagnosticError as `lower` does.
    """
    probes = Probes(wide=wide, decisions=decisions, passed_over=passed_over)
    program = lower(replace(arrangement, observe="ringlet"), keep_all_bits=keep_all_bits, probes=probes)
    faulting = any(isinstance(s, Fault) for slot in program.slots for b in _blocks(slot) for s in statements(b))
    slots = tuple(_without_faults(program, slot, probes) for slot in program.slots) if faulting else program.slots
    processes = program.processes
    extra: tuple[Var, ...] = ()
    if faulting:
        processes = tuple(replace(p, epilogue=_unless_dead(p.epilogue)) for p in processes)
        extra = (Var(DEAD, BOOL, 0, Origin("control")),)
    shown = tuple(Var(name, BOOL, 0, Origin("output"), output=True) for name in probes.outputs.values())
    made = replace(
        program,
        vars=(*program.vars, *extra, *shown),
        slots=slots,
        processes=processes,
        letter=(),
        letter_stutter=(),
        atoms=tuple(Atom(name, name, FALSE) for name in probes.outputs.values()),
        fairness=(),
    )
    return Probed(made, probes.outputs, probes.expressions, probes.conditions, faulting)


# ---------------------------------------------------------------- faults become outcomes


def _blocks(slot: Slot) -> tuple[Block, ...]:
    return slot.prologue, *slot.blocks, slot.epilogue, slot.canonical


def _without_faults(program: Program, slot: Slot, probes: Probes) -> Slot:
    """The same slot, in which nothing happens once a check has failed."""
    machine = program.machines[slot.machine].name

    def told(block: Block) -> Block:
        return _unless_dead(_told(block, program, machine, probes))

    return replace(
        slot,
        prologue=told(slot.prologue),
        blocks=tuple(map(told, slot.blocks)),
        epilogue=told(slot.epilogue),
        canonical=told(slot.canonical),
    )


def _unless_dead(block: Block) -> Block:
    return while_fine(ALIVE, block)


def _told(block: Block, program: Program, machine: str, probes: Probes) -> Block:
    """A block in which checks tell how they come out, and what follows one that fails is left out."""

    def tell(fault: Fault) -> Stmt:
        if probes.decisions:
            return If(fault.when, (Set(DEAD, None, TRUE),))
        probe = Probe("fault", machine, program.faults[fault.fault].span, number=fault.fault)
        failed: Block = (probes.tell(probe, 1), Set(DEAD, None, TRUE))
        return If(fault.when, failed, (probes.tell(probe, 0),))

    return stop_at_faults(block, ALIVE, tell)

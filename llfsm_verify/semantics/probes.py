"""Probes: what comes out at each place of the source in a step, told by outputs of the step program."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.diagnostics import Span
from llfsm_verify.language.typed import Expression
from llfsm_verify.program.program import (
    BOOL,
    Atom,
    Block,
    Const,
    Expr,
    Fault,
    Get,
    If,
    Origin,
    Program,
    Set,
    Slot,
    Stmt,
    Switch,
    Var,
)
from llfsm_verify.program.terms import FALSE, TRUE, op
from llfsm_verify.program.trees import statements

DEAD = "$dead"
"""The variable that is true from the step on that would have ended in a fault."""
Kind = Literal["spent", "fired", "guard", "alone", "both", "condition", "fault"]


@dataclass(frozen=True, slots=True)
class Probe:
    """A place of one machine instance at which something comes out true (1) or false (0).

    `spent`: a turn is spent in `state` (1 only). `fired`: its transition `number` fires (1 only). `guard`: what that
    transition's guard is when it is evaluated. `alone`: what it is at that point of the ringlet, whatever the guards
    before it are; `both`: it and that of transition `other`, which comes later, are true (1 only). `condition`: an
    `if`, a `?:` or an operand of `&&` and `||`, at `span`. `fault`: check `number` of the program's faults fails.
    """

    kind: Kind
    machine: str
    span: Span | None = None
    state: int = -1
    number: int = -1
    other: int = -1


@dataclass(frozen=True, slots=True)
class Outcome:
    """What comes out at a probe."""

    probe: Probe
    value: int


class Probes:
    """Collects the probes of one lowering. `wide`: those of guards alone, too."""

    def __init__(self, *, wide: bool) -> None:
        self.wide = wide
        self.muted = False
        """What is lowered now is no evaluation of the arrangement's own."""
        self.outputs: dict[Outcome, str] = {}
        """The output variable that tells an outcome."""
        self.expressions: dict[Probe, Expression] = {}
        """What is evaluated at guards and conditions."""

    def watch(self, probe: Probe, value: Expr, written: Expression | None = None) -> Block:
        """Statements that tell what `value` is at `probe`, which `written` stands at."""
        if self.muted:
            return ()
        if written is not None:
            self.expressions[probe] = written
        if isinstance(value, Const):
            return (self.tell(probe, int(bool(value.value))),)
        return (If(value, (self.tell(probe, 1),), (self.tell(probe, 0),)),)

    def tell(self, probe: Probe, value: int) -> Stmt:
        """The statement that tells an outcome."""
        name = self.outputs.setdefault(Outcome(probe, value), f"$probe.{len(self.outputs)}")
        return Set(name, None, TRUE)


@dataclass(frozen=True, slots=True)
class Probed:
    """A program without faults whose letters are outcomes: atom ``outputs[outcome]`` holds after a step in which that
    came out, up to what would have ended the step."""

    program: Program
    outputs: dict[Outcome, str]
    expressions: dict[Probe, Expression]
    has_faults: bool
    """There is a variable DEAD."""

    @property
    def wide(self) -> bool:
        """Guards alone are probed."""
        return any(o.probe.kind == "alone" for o in self.outputs)


def probed(arrangement: Arrangement, *, wide: bool, keep_all_bits: bool = False) -> Probed:
    """The step program of `arrangement` with its probes; every ringlet is a step (whatever `observe` says).

    Raises DiagnosticError as `lower` does.
    """
    from llfsm_verify.semantics.lowering import lower

    probes = Probes(wide=wide)
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
    return Probed(made, probes.outputs, probes.expressions, faulting)


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
    return (If(op("not", Get(DEAD, None, BOOL)), block),) if block else ()


def _told(block: Block, program: Program, machine: str, probes: Probes) -> Block:
    """A block in which checks tell how they come out, and what follows one that fails is left out.

    Blocks nest as deep as the source does, which the parser limits.
    """
    out: list[Stmt] = []
    part: list[Stmt] = []

    def close() -> None:
        out.extend(_unless_dead(tuple(part)) if out else part)
        part.clear()

    for s in block:
        faults = any(isinstance(each, Fault) for each in statements((s,)))
        match s:
            case Fault(number, when):
                probe = Probe("fault", machine, program.faults[number].span, number=number)
                failed: Block = (probes.tell(probe, 1), Set(DEAD, None, TRUE))
                part.append(If(when, failed, (probes.tell(probe, 0),)))
            case If(condition, then, otherwise) if faults:
                part.append(
                    If(
                        condition,
                        _told(then, program, machine, probes),
                        _told(otherwise, program, machine, probes),
                    )
                )
            case Switch(value, cases, default) if faults:
                told = tuple((k, _told(b, program, machine, probes)) for k, b in cases)
                part.append(Switch(value, told, _told(default, program, machine, probes)))
            case _:
                part.append(s)
        if faults:
            close()
    close()
    return tuple(out)

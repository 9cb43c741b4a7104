"""Probes: what comes out at each place of the source in a step, told by outputs of the step program."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from llfsm_verify.diagnostics import Span
from llfsm_verify.language.typed import Expression
from llfsm_verify.program.program import (
    Block,
    Const,
    Expr,
    If,
    Set,
    Stmt,
)
from llfsm_verify.program.terms import TRUE

DEAD = "$dead"
"""The variable that is true from the step on that would have ended in a fault."""
Kind = Literal["spent", "fired", "guard", "alone", "both", "condition", "fault", "action"]
ACTIONS = ("exit", "internal", "on_suspend", "on_resume")
"""The events of the actions that may never run; `on_entry` runs wherever turns are spent."""


@dataclass(frozen=True, slots=True)
class Probe:
    """A place of one machine instance at which something comes out true (1) or false (0).

    `spent`: a turn is spent in `state` (1 only). `fired`: its transition `number` fires (1 only). `guard`: what that
    transition's guard is when it is evaluated. `alone`: what it is at that point of the ringlet, whatever the guards
    before it are; `both`: it and that of transition `other`, which comes later, are true (1 only). `condition`: an
    `if`, a `?:` or an operand of `&&` and `||`, at `span`. `fault`: check `number` of the program's faults fails.
    `action`: action `number` of ACTIONS of `state` runs (1 only).
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
    """Collects the probes of one lowering. `wide`: also those of guards alone."""

    def __init__(self, *, wide: bool) -> None:
        self.wide = wide
        self.muted = False
        """What is lowered now is not an evaluation of the arrangement's own."""
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

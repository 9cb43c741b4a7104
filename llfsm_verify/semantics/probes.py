"""Probes: what comes out at each place of the source in a step, told by outputs of the step program."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from llfsm_verify.diagnostics import Span
from llfsm_verify.language.typed import Expression
from llfsm_verify.program.program import (
    Block,
    Const,
    Expr,
    If,
    Local,
    Set,
    Stmt,
)
from llfsm_verify.program.terms import TRUE

DEAD = "$dead"
"""The variable that is true from the step on that would have ended in a fault."""
Kind = Literal["spent", "fired", "guard", "alone", "both", "condition", "fault", "action", "deciding"]
ACTIONS = ("exit", "internal", "on_suspend", "on_resume")
"""The events of the actions that may never run; `on_entry` runs wherever turns are spent."""


@dataclass(frozen=True, slots=True)
class Probe:
    """A place of one machine instance at which something comes out true (1) or false (0).

    `spent`: a turn is spent in `state` (1 only). `fired`: its transition `number` fires (1 only). `guard`: what that
    transition's guard is when it is evaluated. `alone`: what it is at that point of the ringlet, whatever the guards
    before it are; `both`: it and that of transition `other`, which comes later, are true (1 only). `condition`: an
    `if`, a `?:` or an operand of `&&` and `||`, at `span`. `fault`: check `number` of the program's faults fails.
    `action`: action `number` of ACTIONS of `state` runs (1 only). `deciding`: what a condition of the decision is that
    has this `span`, `state` and `number`, where it decides (`semantics.decisions`); `other` says which condition and in
    which situation.
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


@dataclass(frozen=True, slots=True)
class Condition:
    """A leaf of a decision. `situations`: in how many ways what is compared with it can come out; 0: too many."""

    span: Span
    text: str
    situations: int


SITUATIONS = 1 << 8


def deciding(decision: Probe, condition: int, situation: int) -> Probe:
    """The probe of condition number `condition` of a decision."""
    return replace(decision, kind="deciding", other=condition * SITUATIONS + situation)


class Probes:
    """Collects the probes of one lowering. `wide`: also those of guards alone. `decisions`: those of decisions and
    their conditions, in the place of operands, actions and checks; of the machines in `passed_over` none."""

    def __init__(
        self, *, wide: bool = False, decisions: bool = False, passed_over: frozenset[str] = frozenset()
    ) -> None:
        self.wide = wide
        self.decisions = decisions
        self.passed_over = passed_over
        self.conditions: dict[Probe, tuple[Condition, ...]] = {}
        """Those of each decision, in the order of its text."""
        self.marks: dict[int, Local] = {}
        """Of a decision that is lowered now: where the value of an expression (its `id`) is kept."""
        self.muted = False
        """What is lowered now is not an evaluation of the arrangement's own."""
        self.outputs: dict[Outcome, str] = {}
        """The output variable that tells an outcome."""
        self.expressions: dict[Probe, Expression] = {}
        """What is evaluated at guards and conditions."""

    def watch(self, probe: Probe, value: Expr, written: Expression | None = None) -> Block:
        """Statements that tell what `value` is at `probe`, which `written` stands at."""
        if self.muted or probe.machine in self.passed_over or (self.decisions and probe.kind == "action"):
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

"""The parts of guards: events that tell the value of each part of a guard where a step evaluates it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate

from llfsm_verify.language import types as lt
from llfsm_verify.language.typed import After, Expression, Literal
from llfsm_verify.language.types import digits_of
from llfsm_verify.program.program import BOOL, UNBOUNDED, EventKind, Expr, Int, Stmt, Type
from llfsm_verify.program.terms import const
from llfsm_verify.semantics.storage import labels
from llfsm_verify.semantics.vocabulary import Control, emit

PART: EventKind = "part"
CLOCK = "clock"


@dataclass(frozen=True, slots=True)
class Part:
    """A part of a guard as its machine writes it; `labels` name its values, where they have names."""

    text: str
    type: Type
    labels: tuple[str, ...] = ()
    clock: bool = False
    """It is the clock of the machine, which `after` asks: cycles since the state was entered, or, of an untimed
    arrangement, how many of the bounds of the state are over."""


class Parts:
    """Collects the parts of one lowering: event `part` has an index in `found`, and the value."""

    def __init__(self) -> None:
        self.found: list[Part] = []
        self.open = False
        """What is lowered now is a guard, where the arrangement evaluates it."""

    def tell(self, control: Control, e: Expression, value: Expr) -> Stmt:
        """The statement that tells what `e` is."""
        return self._told(control, Part(written(e), _kind(e.type), _labels(e.type)), value)

    def tell_clock(self, control: Control, value: Expr) -> Stmt:
        """The statement that tells what a clock shows."""
        return self._told(control, Part(f"{CLOCK} of {control.machine.name}", UNBOUNDED, clock=True), value)

    def _told(self, control: Control, part: Part, value: Expr) -> Stmt:
        self.found.append(part)
        return emit(control, PART, const(len(self.found) - 1), value)


def written(e: Expression) -> str:
    """As it is written, with the brackets of its first and last operands, which the span of an operation leaves out."""
    source, start, end = e.span.source.text, e.span.start, e.span.end
    depths = [0, *accumulate({"(": 1, ")": -1}.get(sign, 0) for sign in source[start:end])]
    for _ in range(-min(depths)):
        start = source.rindex("(", 0, start)
    for _ in range(depths[-1] - min(depths)):
        end = source.index(")", end) + 1
    return " ".join(source[start:end].split())


def is_told(e: Expression) -> bool:
    """Whether the value of such a part says anything: a constant says what it is."""
    return not isinstance(e, Literal)


def asks_clock(e: Expression) -> bool:
    """Whether it compares the clock of its machine."""
    return isinstance(e, After)


def _kind(kind: lt.Type) -> Type:
    if isinstance(kind, lt.BoolType):
        return BOOL
    if isinstance(kind, lt.EnumType):
        return Int(0, len(labels(kind)) - 1)
    digits = digits_of(kind)
    return Int(0, 0, digits=digits) if digits else UNBOUNDED


def _labels(kind: lt.Type) -> tuple[str, ...]:
    return labels(kind) if isinstance(kind, lt.EnumType) else ()

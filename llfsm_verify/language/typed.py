"""The typed tree: guards and actions after name resolution and type checking, as the lowering reads them.

Every name is resolved for one machine *instance*: parameters are already replaced by the constant, whiteboard variable
or machine they stand for. Machines are named by instance, states by (instance, index).
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Literal as OneOf

from llfsm_verify.diagnostics import Span
from llfsm_verify.language.types import ScalarType, Type, Value


@dataclass(frozen=True, slots=True)
class Variable:
    """A declared variable. `name` is unique in the arrangement: ``car`` (whiteboard), ``ns.n`` (machine variable of
    instance ns), ``ns.RED.n`` (state variable)."""

    name: str
    type: Type
    init: Value
    scope: OneOf["whiteboard", "machine", "state"]
    span: Span


@dataclass(frozen=True, slots=True)
class Local:
    """A local variable of an action; `key` is unique within the action (shadowing in sibling blocks is resolved)."""

    key: str
    type: ScalarType


# ---------------------------------------------------------------- expressions; each has `type` and `span`


@dataclass(frozen=True, slots=True)
class Literal:
    """A constant: bool for BoolType, int for integers, steps for decimals, index for enumerations."""

    value: int | bool
    type: ScalarType
    span: Span


@dataclass(frozen=True, slots=True)
class Field:
    """One step of a path: the field number `index` of a record."""

    name: str
    index: int


@dataclass(frozen=True, slots=True)
class Index:
    """One step of a path: an element of an array of `size`; `value` has an integer type."""

    value: Expression
    size: int
    span: Span


@dataclass(frozen=True, slots=True)
class Read:
    """The value of a variable, or of the part of it that `path` leads to (may be a whole record or array)."""

    variable: Variable
    path: tuple[Field | Index, ...]
    type: Type
    span: Span


@dataclass(frozen=True, slots=True)
class ReadLocal:
    """The value of a local variable."""

    local: Local
    type: ScalarType
    span: Span


@dataclass(frozen=True, slots=True)
class Unary:
    """`not` on bool; `neg`, `abs` and `sqrt` on numbers; `floor`, `ceil` and `round` on decimals; `bnot` on a
    fixed width.

    `sqrt` is the largest number with the digits of its operand whose square does not exceed it. `round` takes halves
    away from zero.
    """

    op: OneOf["not", "neg", "abs", "floor", "ceil", "round", "sqrt", "bnot"]
    operand: Expression
    type: ScalarType
    span: Span


@dataclass(frozen=True, slots=True)
class Binary:
    """Arithmetic (numbers; div and mod of integers are C's, truncating), comparison (result bool), or logic.

    Sums, `min` and `max` have as many digits as the side with more of them, products those of both, quotients those of
    the dividend, truncated towards zero. `eq` and `ne` compare two bools, two numbers, two values of one enumeration,
    or two records or arrays of one type.
    `and` and `or` evaluate their right side only when it is needed. `band`, `bor`, `bxor`, `shl` and `shr` (arithmetic
    where the type has a sign) are in a fixed width at once, that of the result's type.
    """

    op: OneOf[
        "add", "sub", "mul", "div", "mod", "min", "max", "eq", "ne", "lt", "le", "gt", "ge", "and", "or", "xor",
        "band", "bor", "bxor", "shl", "shr",
    ]  # fmt: skip
    left: Expression
    right: Expression
    type: ScalarType
    span: Span


@dataclass(frozen=True, slots=True)
class Conditional:
    """`c ? a : b`; only the chosen side is evaluated."""

    condition: Expression
    then: Expression
    otherwise: Expression
    type: ScalarType
    span: Span


@dataclass(frozen=True, slots=True)
class LetIn:
    """`value`, after each of `definitions` in their order: all are evaluated, and each once. `value` and later
    definitions read them as locals."""

    definitions: tuple[tuple[Local, Expression], ...]
    value: Expression
    type: ScalarType
    span: Span


@dataclass(frozen=True, slots=True)
class Lookup:
    """`t[i]`: the number at place `index` of a table, in the steps of its type."""

    table: str
    values: tuple[int, ...]
    index: Expression
    type: ScalarType
    span: Span


@dataclass(frozen=True, slots=True)
class After:
    """`after(s)`, `after_ms(ms)`: the bound in milliseconds, a constant, or (after_ms and after alike) an integer
    expression with `scale` milliseconds per unit."""

    bound: Fraction | Expression
    scale: int
    type: ScalarType
    span: Span


@dataclass(frozen=True, slots=True)
class Choose:
    """`choose(…)`, only in models and as a whole right-hand side: any of `values`, which are different constants."""

    values: range | tuple[int, ...]
    target: str
    """What it is stored in, as the user wrote it."""
    type: ScalarType
    span: Span

    @property
    def low(self) -> int:
        return self.values[0] if isinstance(self.values, range) else min(self.values)

    @property
    def high(self) -> int:
        return self.values[-1] if isinstance(self.values, range) else max(self.values)


@dataclass(frozen=True, slots=True)
class AtState:
    """`m@STATE`: machine instance `machine` is in the state number `state` (-1: the implicit `__suspend`)."""

    machine: str
    state: int
    type: ScalarType
    span: Span


@dataclass(frozen=True, slots=True)
class Query:
    """`is_running(m)`, `is_suspended(m)`, `done(m)`."""

    kind: OneOf["running", "suspended", "done"]
    machine: str
    type: ScalarType
    span: Span


@dataclass(frozen=True, slots=True)
class Observe:
    """What only a property may ask: about the last step, or about a machine as a whole.

    `ran`, `suspended`, `loaded`, `finished`, `refused`, `entered` of `machine`; `cycle` (machine empty); `fired`:
    transition number `transition` (counted from 0) of state number `state`.
    """

    kind: OneOf["ran", "suspended", "loaded", "finished", "refused", "faulted", "entered", "cycle", "fired"]
    machine: str
    state: int
    transition: int
    type: ScalarType
    span: Span


@dataclass(frozen=True, slots=True)
class Sampled:
    """Only in properties: the value that the input `variable`, or the part of it at `path`, had when `machine` sampled
    it last ("": when any machine did)."""

    machine: str
    variable: Variable
    path: tuple[Field | Index, ...]
    type: Type
    span: Span


@dataclass(frozen=True, slots=True)
class Sampling:
    """Only in properties: the last step was a ringlet of `machine`, and the input `variable` was in its sample."""

    machine: str
    variable: Variable
    type: ScalarType
    span: Span


@dataclass(frozen=True, slots=True)
class Edge:
    """Only in properties: how `operand` differs from its value in the letter before; false in the first letter.

    `rose`: it is true and was false; `fell`: the other way round; `changed`: its value is another one.
    """

    kind: OneOf["rose", "fell", "changed"]
    operand: Expression
    type: ScalarType
    span: Span


Expression = (
    Literal
    | Read
    | ReadLocal
    | Unary
    | Binary
    | Conditional
    | LetIn
    | Lookup
    | After
    | Choose
    | AtState
    | Query
    | Observe
    | Sampled
    | Sampling
    | Edge
)


# ---------------------------------------------------------------- statements


@dataclass(frozen=True, slots=True)
class Assign:
    """`target = value` (`op` None) or `target op= value`. Target and value have the same type, or both are integers.

    A whole record or array can be assigned from one of the same type (`op` None, `value` a Read).
    """

    target: Read | ReadLocal
    op: OneOf["add", "sub", "mul", "div", "mod", "band", "bor", "bxor", "shl", "shr"] | None
    value: Expression
    span: Span


@dataclass(frozen=True, slots=True)
class Declare:
    """A local variable comes into being with a value (stores as an assignment does: wraps or faults)."""

    local: Local
    value: Expression
    span: Span


@dataclass(frozen=True, slots=True)
class IfElse:
    """The statements of one of two branches."""

    condition: Expression
    then: tuple[Statement, ...]
    otherwise: tuple[Statement, ...]
    span: Span


@dataclass(frozen=True, slots=True)
class For:
    """The body once for each of the values first, first + 1, …, last of the local (none when last < first).

    The number of iterations of nested loops of one action together is limited by the type checker.
    """

    local: Local
    first: int
    last: int
    body: tuple[Statement, ...]
    span: Span


CommandKind = OneOf["suspend", "resume", "restart", "load", "unload", "load_suspended"]


@dataclass(frozen=True, slots=True)
class Command:
    """`suspend(m)`, `load(m)` and so on; `suspend_all()` comes as one suspend per other machine."""

    kind: CommandKind
    machine: str
    span: Span


Statement = Assign | Declare | IfElse | For | Command

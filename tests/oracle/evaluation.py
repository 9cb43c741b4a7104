"""What guards and actions mean, read off the typed tree: the oracle's own evaluator."""

from __future__ import annotations

from fractions import Fraction
from typing import Any, Protocol

from llfsm_verify.diagnostics import Span
from llfsm_verify.language import typed
from llfsm_verify.language.constants import evaluate as constant
from llfsm_verify.language.types import (
    ArrayType,
    BoolType,
    DecimalType,
    EnumType,
    FixedType,
    IntType,
    RangeType,
    RecordType,
    ScalarType,
    Type,
    Value,
    digits_of,
)

Path = tuple[int, ...]
"""Numbers of fields and elements on the way into a value."""


class FaultError(Exception):
    """The step has no successor."""

    def __init__(self, code: str, span: Span) -> None:
        self.code, self.span = code, span
        super().__init__(f"{code} at {span}")


class World(Protocol):
    """What an evaluation looks at and changes. `wide` notes that some integer left 64 bits."""

    variables: dict[str, Value]
    inputs: frozenset[str]
    wide: bool

    def sample(self, scalar: str, kind: ScalarType) -> int | bool: ...
    def passed(self, milliseconds: Fraction) -> bool: ...
    def at(self, machine: str, state: int) -> bool: ...
    def running(self, machine: str) -> bool: ...
    def suspended(self, machine: str) -> bool: ...
    def observe(self, what: typed.Observe) -> bool: ...
    def sampled(self, machine: str, scalar: str) -> int | bool: ...
    def has_sampled(self, machine: str, variable: str) -> bool: ...
    def edge(self, e: typed.Edge) -> bool: ...
    def chosen(self, e: typed.Choose) -> int | bool: ...
    def is_done(self, machine: str) -> bool: ...
    def issue(self, kind: str, machine: str, line: int) -> None: ...

    def refuses_write(self, variable: str, line: int) -> bool: ...


Locals = dict[str, int | bool]


def values_of(kind: ScalarType) -> list[int | bool]:
    """The values of a finite scalar type, the lowest first."""
    if isinstance(kind, BoolType):
        return [False, True]
    if isinstance(kind, EnumType):
        return list(range(len(kind.values)))
    assert not isinstance(kind, IntType) and kind.low is not None and kind.high is not None
    return list(range(kind.low, kind.high + 1))


def scalars_of(name: str, kind: Type) -> list[tuple[str, ScalarType]]:
    """The scalars that a variable consists of, in order."""
    if isinstance(kind, RecordType):
        return [s for field, t in kind.fields for s in scalars_of(f"{name}.{field}", t)]
    if isinstance(kind, ArrayType):
        return [s for i in range(kind.size) for s in scalars_of(f"{name}[{i}]", kind.element)]
    return [(name, kind)]


def _sampled(world: World, name: str, kind: Type, by: str | None = None) -> Value:
    """An input now, or (`by` given) as it was sampled last by that machine ("": by any)."""
    if isinstance(kind, RecordType):
        return tuple(_sampled(world, f"{name}.{field}", t, by) for field, t in kind.fields)
    if isinstance(kind, ArrayType):
        return tuple(_sampled(world, f"{name}[{i}]", kind.element, by) for i in range(kind.size))
    return world.sample(name, kind) if by is None else world.sampled(by, name)


def place_of(e: typed.Sampled) -> tuple[str, Type]:
    """The part of an input that `sampled(…)` names; its indices are constants."""
    name, kind = e.variable.name, e.variable.type
    for step in e.path:
        if isinstance(step, typed.Field):
            assert isinstance(kind, RecordType)
            name, kind = f"{name}.{step.name}", kind.fields[step.index][1]
        else:
            assert isinstance(kind, ArrayType)
            index = constant(step.value)
            assert index is not None
            name, kind = f"{name}[{int(index)}]", kind.element
    return name, kind


def part(value: Value, path: Path) -> Value:
    for step in path:
        assert isinstance(value, tuple)
        value = value[step]
    return value


def replaced(value: Value, path: Path, new: Value) -> Value:
    if not path:
        return new
    assert isinstance(value, tuple)
    i = path[0]
    return (*value[:i], replaced(value[i], path[1:], new), *value[i + 1 :])


def _place(read: typed.Read, world: World, locals_: Locals) -> Path:
    """Where `read` leads: its indices evaluated and checked from left to right."""
    path: list[int] = []
    for step in read.path:
        if isinstance(step, typed.Field):
            path.append(step.index)
        else:
            index = integer(step.value, world, locals_)
            if not 0 <= index < step.size:
                raise FaultError("F003", step.span)
            path.append(index)
    return tuple(path)


def _read(read: typed.Read, world: World, locals_: Locals) -> Value:
    path = _place(read, world, locals_)
    if read.variable.name not in world.inputs:
        return part(world.variables[read.variable.name], path)
    name, kind = read.variable.name, read.variable.type
    for step in path:
        if isinstance(kind, RecordType):
            name, kind = f"{name}.{kind.fields[step][0]}", kind.fields[step][1]
        else:
            assert isinstance(kind, ArrayType)
            name, kind = f"{name}[{step}]", kind.element
    return _sampled(world, name, kind)


def natural(value: Value, kind: Type) -> Any:
    """A stored value as a number: a decimal is stored in steps."""
    return Fraction(value, 10**kind.digits) if isinstance(kind, DecimalType) else value  # type: ignore[arg-type]


def number(e: typed.Expression, world: World, locals_: Locals) -> int | Fraction:
    value = evaluate(e, world, locals_)
    assert isinstance(value, (int, Fraction))
    return value


def integer(e: typed.Expression, world: World, locals_: Locals) -> int:
    value = evaluate(e, world, locals_)
    assert isinstance(value, int) and not isinstance(value, bool)
    return value


def truth(e: typed.Expression, world: World, locals_: Locals) -> bool:
    value = evaluate(e, world, locals_)
    assert isinstance(value, bool)
    return value


def evaluate(e: typed.Expression, world: World, locals_: Locals) -> Any:
    value = _value(e, world, locals_)
    if isinstance(value, (int, Fraction)) and not -(2**63) <= value * 10 ** digits_of(e.type) < 2**63:
        world.wide = True
    return value


def _value(e: typed.Expression, world: World, locals_: Locals) -> Any:
    match e:
        case typed.Literal():
            return natural(e.value, e.type)
        case typed.Read():
            return natural(_read(e, world, locals_), e.type)
        case typed.ReadLocal():
            return natural(locals_[e.local.key], e.type)
        case typed.Unary("not"):
            return not truth(e.operand, world, locals_)
        case typed.Unary("neg"):
            return -number(e.operand, world, locals_)
        case typed.Unary("bnot"):
            assert isinstance(e.type, FixedType)
            return in_width(~integer(e.operand, world, locals_), e.type)
        case typed.Unary("abs"):
            return abs(number(e.operand, world, locals_))
        case typed.Unary():
            return rounded(e, number(e.operand, world, locals_))
        case typed.Binary("and"):
            return truth(e.left, world, locals_) and truth(e.right, world, locals_)
        case typed.Binary("or"):
            return truth(e.left, world, locals_) or truth(e.right, world, locals_)
        case typed.Binary("eq" | "ne" | "xor"):
            left, right = evaluate(e.left, world, locals_), evaluate(e.right, world, locals_)
            _align(e.op, left, e.left.type, right, e.right.type, world)
            return (left == right) is (e.op == "eq")
        case typed.Binary():
            if e.op in BITS:
                assert isinstance(e.type, FixedType)
                pair = integer(e.left, world, locals_), integer(e.right, world, locals_)
                return bits(e.op, *pair, e.type, e.span)
            first, second = number(e.left, world, locals_), number(e.right, world, locals_)
            _align(e.op, first, e.left.type, second, e.right.type, world)
            return arithmetic(e.op, first, second, digits_of(e.left.type), e.span)
        case typed.Conditional():
            side = e.then if truth(e.condition, world, locals_) else e.otherwise
            return evaluate(side, world, locals_)
        case typed.LetIn():
            known = dict(locals_)
            for local, definition in e.definitions:
                known[local.key] = truth(definition, world, known)
            return truth(e.value, world, known)
        case typed.Lookup():
            place = integer(e.index, world, locals_)
            if not 0 <= place < len(e.values):
                raise FaultError("F003", e.span)
            return natural(e.values[place], e.type)
        case typed.After():
            constant = isinstance(e.bound, Fraction)
            return world.passed(e.bound if constant else Fraction(integer(e.bound, world, locals_) * e.scale))
        case typed.AtState():
            return world.at(e.machine, e.state)
        case typed.Query("running"):
            return world.running(e.machine)
        case typed.Query("done"):
            return world.is_done(e.machine)
        case typed.Query():
            return world.suspended(e.machine)
        case typed.Observe():
            return world.observe(e)
        case typed.Sampled():
            name, kind = place_of(e)
            return natural(_sampled(world, name, kind, e.machine), e.type)
        case typed.Sampling():
            return world.has_sampled(e.machine, e.variable.name)
        case typed.Edge():
            return world.edge(e)
        case typed.Choose():
            return natural(world.chosen(e), e.type)
    raise AssertionError(e)


def _align(op: str, a: Any, of_a: Type, b: Any, of_b: Type, world: World) -> None:
    """Note that a side leaves 64 bits where both are brought to the same steps, or the dividend to finer ones."""
    if op == "mul" or not isinstance(a, (int, Fraction)):
        return
    digits = max(digits_of(of_a), digits_of(of_b)) if op != "div" else digits_of(of_a) + digits_of(of_b)
    for side in (a, b) if op != "div" else (a,):
        if not -(2**63) <= side * 10**digits < 2**63:
            world.wide = True


BITS = ("band", "bor", "bxor", "shl", "shr")


def in_width(value: int, kind: FixedType) -> int:
    value &= 2**kind.bits - 1
    return value - 2**kind.bits if value > kind.high else value


def bits(op: str, a: int, b: int, kind: FixedType, span: Span) -> int:
    """C's operations on two's complement, as Python has them for numbers of any width."""
    if op in ("shl", "shr"):
        if not 0 <= b < kind.bits:
            raise FaultError("F005", span)
        return in_width(a << b if op == "shl" else a >> b, kind)
    return in_width({"band": a & b, "bor": a | b, "bxor": a ^ b}[op], kind)


def rounded(e: typed.Unary, value: int | Fraction) -> int | Fraction:
    """`floor`, `ceil`, `round` and `sqrt`, the last one by trying."""
    match e.op:
        case "floor":
            return value.__floor__()
        case "ceil":
            return value.__ceil__()
        case "round":
            near = abs(value).__floor__()
            near += abs(value) - near >= Fraction(1, 2)
            return near if value >= 0 else -near
    assert e.op == "sqrt"
    if value < 0:
        raise FaultError("F004", e.span)
    step = Fraction(1, 10 ** digits_of(e.operand.type))
    root, width = Fraction(0), step
    while width * width <= value:
        width *= 2
    while width >= step:
        if (root + width) ** 2 <= value:
            root += width
        width /= 2
    return root if digits_of(e.operand.type) else int(root)


def arithmetic(op: str, a: int | Fraction, b: int | Fraction, digits: int, span: Span) -> Any:
    """C's arithmetic, exactly; a quotient is truncated to so many digits."""
    if op in ("div", "mod"):
        if b == 0:
            raise FaultError("F002", span)
        quotient = Fraction((Fraction(a) / Fraction(b) * 10**digits).__trunc__(), 10**digits)
        result = quotient if op == "div" else a - b * quotient
        return result if digits else int(result)
    table = {"add": a + b, "sub": a - b, "mul": a * b, "min": min(a, b), "max": max(a, b)}
    order = {"lt": a < b, "le": a <= b, "gt": a > b, "ge": a >= b}
    return table[op] if op in table else order[op]


def stored(value: Any, kind: Type, span: Span, world: World) -> Value:
    """What a variable of type `kind` holds after a store of `value`."""
    if isinstance(kind, RangeType):
        assert isinstance(value, int)
        if not kind.low <= value <= kind.high:
            raise FaultError("F001", span)
    if isinstance(kind, DecimalType):
        steps = (value * 10**kind.digits).__trunc__()
        world.wide |= not -(2**63) <= steps < 2**63
        if kind.low is None or kind.high is None or not kind.low <= steps <= kind.high:
            raise FaultError("F001", span)
        return steps
    if isinstance(kind, FixedType):
        assert isinstance(value, int)
        value = value % 2**kind.bits
        return value - 2**kind.bits if value > kind.high else value
    if isinstance(kind, IntType) and isinstance(value, int) and not -(2**63) <= value < 2**63:
        world.wide = True
    return value


def run(statements: tuple[typed.Statement, ...], world: World, locals_: Locals) -> None:
    """Run statements in order. Raises FaultError."""
    for s in statements:
        match s:
            case typed.Assign():
                _assign(s, world, locals_)
            case typed.Declare():
                value = stored(evaluate(s.value, world, locals_), s.local.type, s.span, world)
                assert isinstance(value, int)
                locals_[s.local.key] = value
            case typed.IfElse():
                run(s.then if truth(s.condition, world, locals_) else s.otherwise, world, locals_)
            case typed.For():
                for i in range(s.first, s.last + 1):
                    locals_[s.local.key] = i
                    run(s.body, world, locals_)
            case typed.Command():
                world.issue(s.kind, s.machine, s.span.line)


def _assign(s: typed.Assign, world: World, locals_: Locals) -> None:
    """The value is computed before the place of a plain assignment; `a[e] += v` evaluates the place once."""
    target = s.target
    if isinstance(target, typed.ReadLocal):
        old: Value = locals_.get(target.local.key, 0)
        value = stored(_new_value(s, old, world, locals_), target.type, s.span, world)
        assert isinstance(value, int)
        locals_[target.local.key] = value
        return
    name = target.variable.name
    if s.op is None:
        new = evaluate(s.value, world, locals_)
        path = _place(target, world, locals_)
    else:
        path = _place(target, world, locals_)
        new = _new_value(s, part(world.variables[name], path), world, locals_)
    if target.variable.scope == "whiteboard" and world.refuses_write(name, target.span.line):
        return
    world.variables[name] = replaced(world.variables[name], path, stored(new, target.type, s.span, world))


def _new_value(s: typed.Assign, old: Value, world: World, locals_: Locals) -> Any:
    if s.op is None:
        return evaluate(s.value, world, locals_)
    kind = s.target.type
    if s.op in BITS:
        assert isinstance(kind, FixedType) and isinstance(old, int)
        return bits(s.op, old, integer(s.value, world, locals_), kind, s.span)
    added = number(s.value, world, locals_)
    _align(s.op, natural(old, kind), kind, added, s.value.type, world)
    value = arithmetic(s.op, natural(old, kind), added, digits_of(kind), s.span)
    if not -(2**63) <= value < 2**63:
        world.wide = True
    return value

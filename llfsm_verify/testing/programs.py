"""Hypothesis strategies of random step programs that keep the contract of `program.program`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import get_args

from hypothesis import strategies as st

from llfsm_verify.program.program import (
    BOOL,
    INT64_MAX,
    INT64_MIN,
    UNBOUNDED,
    Block,
    Choice,
    Const,
    Emit,
    EventKind,
    Expr,
    Fault,
    FaultSite,
    Get,
    If,
    Int,
    Ite,
    Let,
    Local,
    MachineInfo,
    Op,
    OpName,
    Origin,
    Process,
    Program,
    Sample,
    Set,
    Slot,
    Stmt,
    Switch,
    Type,
    Var,
)
from llfsm_verify.program.terms import applied, const, interval, join
from llfsm_verify.testing.texts import Draw, Pen

FAULTS = 5
ARITHMETIC: tuple[OpName, ...] = ("add", "sub", "mul", "neg", "abs", "min", "max")
COMPARISONS: tuple[OpName, ...] = ("eq", "ne", "lt", "le", "gt", "ge")
TYPES: tuple[Int, ...] = (
    BOOL, BOOL, Int(0, 15), Int(0, 5), Int(-3, 4), Int(-7, -2), Int(7, 7), Int(-128, 127), Int(0, 65535),
    Int(-(1 << 31), (1 << 31) - 1), Int(0, (1 << 32) - 1), Int(INT64_MIN, INT64_MAX), Int(0, (1 << 64) - 1),
)  # fmt: skip
CHOICE_TYPES: tuple[Int, ...] = (BOOL, BOOL, Int(0, 2), Int(-1, 1), Int(4, 4))
LOGIC: tuple[OpName, ...] = ("and", "or", "xor")
LOCAL_TYPES: tuple[Type, ...] = (BOOL, Int(-8, 7), UNBOUNDED)
VARIABLE_TYPES: tuple[Type, ...] = (*TYPES, UNBOUNDED, UNBOUNDED)
DIVISIONS: tuple[OpName, ...] = ("div", "mod")
SMALL = sorted(range(-9, 10), key=abs)
"""The simplest first."""
CONSTANTS = (0, 1, -1, 2, 3, -3, 7, 8, 255, -128, 1 << 31, 1 << 40, INT64_MAX, INT64_MIN, (1 << 64) - 1)


@dataclass(slots=True)
class _Scope:
    """What a block may use where it stands: locals that surely have a value, and the next local's number."""

    locals: dict[str, Type] = field(default_factory=dict)
    counter: list[int] = field(default_factory=lambda: [0])

    def inner(self) -> _Scope:
        return _Scope(dict(self.locals), self.counter)

    def fresh(self) -> str:
        self.counter[0] += 1
        return f"t{self.counter[0]}"


class _Writer(Pen):
    def __init__(self, draw: Draw, variables: Sequence[Var], choices: Sequence[Choice], machines: int,
                 kept: frozenset[str], size: int) -> None:  # fmt: skip
        super().__init__(draw)
        self._choices = choices
        self._machines = machines
        self._size = size
        self._targets = [v for v in variables if v.name not in kept]
        self._scalars = [v for v in variables if v.length is None]
        self._arrays = [v for v in variables if v.length is not None]

    def chance(self, percent: int) -> bool:
        return self.number(0, 99) >= 100 - percent

    # ------------------------------------------------------------ expressions

    def truth(self, scope: _Scope, depth: int) -> Expr:
        kind = self.number(0, 5) if depth > 0 else self.number(0, 1)
        booleans = [Get(v.name, None, v.type) for v in self._scalars if v.type == BOOL]
        values: list[Expr] = [*booleans, *(Local(n, t) for n, t in scope.locals.items() if t == BOOL)]
        match kind:
            case 0:
                return Const(self.number(0, 1), BOOL)
            case 1 if values:
                return self.pick(values)
            case 2:
                return applied("not", self.truth(scope, depth - 1))
            case 3:
                op = self.pick(LOGIC)
                return applied(op, self.truth(scope, depth - 1), self.truth(scope, depth - 1))
            case 4:
                sides = (self.truth(scope, depth - 1), self.truth(scope, depth - 1))
                return Ite(self.truth(scope, depth - 1), *sides, BOOL)
            case _:
                depth = max(0, depth - 1)
                return applied(self.pick(COMPARISONS), self.integer(scope, depth), self.integer(scope, depth))

    def integer(self, scope: _Scope, depth: int) -> Expr:
        kind = self.number(0, 9) if depth > 0 else self.number(0, 3)
        match kind:
            case 0:
                return const(self.pick(CONSTANTS) if self.chance(30) else self.pick(SMALL))
            case 1 if scope.locals:
                name = self.pick(list(scope.locals))
                return Local(name, scope.locals[name])
            case 3 if self._arrays:
                array = self.pick(self._arrays)
                return Get(array.name, self.index(scope, array, depth - 1), array.type)
            case 4:
                then, otherwise = self.integer(scope, depth - 1), self.integer(scope, depth - 1)
                return Ite(self.truth(scope, depth - 1), then, otherwise, join(then.type, otherwise.type))
            case 5:
                value = self.integer(scope, depth - 1)
                return Op("wrap", (value,), self.pick((Int(0, 7), Int(-128, 127), Int(-2, 1), Int(5, 5), *TYPES[-2:])))
            case 6:
                dividend, divisor = self.integer(scope, depth - 1), self.integer(scope, depth - 1)
                quotient = applied(self.pick(DIVISIONS), dividend, divisor)
                safe = applied("ne", divisor, const(0))  # the side that divides must only run when this holds
                return Ite(safe, quotient, const(1), join(quotient.type, Int(1, 1)))
            case 7:
                return self.truth(scope, depth - 1)
            case 8 | 9:
                op = self.pick(ARITHMETIC)
                arity = 1 if op in ("neg", "abs") else 2
                return applied(op, *(self.integer(scope, depth - 1) for _ in range(arity)))
            case _:
                variable = self.pick(self._scalars)
                return Get(variable.name, None, variable.type)

    def index(self, scope: _Scope, array: Var, depth: int) -> Expr:
        """An expression that is always an index of the array."""
        length = array.length or 1
        if depth <= 0 or self.chance(40):
            return const(self.number(0, length - 1))
        value = self.integer(scope, depth)
        if length & (length - 1) == 0:
            return Op("wrap", (value,), Int(0, length - 1))
        return applied("max", const(0), applied("min", const(length - 1), value))

    # ------------------------------------------------------------ statements

    def fitting(self, scope: _Scope, kind: Type, out: list[Stmt]) -> Expr:
        """A value inside a type, after the statements that see to it."""
        value = self.truth(scope, 2) if kind == BOOL and self.chance(70) else self.integer(scope, 3)
        if not isinstance(kind, Int):
            return value
        low, high = kind.low, kind.high
        inside = interval(value)
        if inside is not None and low <= inside[0] and inside[1] <= high:
            return value
        size = high - low + 1
        if size & (size - 1) == 0 and self.chance(60):
            return Op("wrap", (value,), kind)
        if self.chance(70):
            return applied("max", const(low), applied("min", const(high), value))
        checked = Local(scope.fresh(), value.type)
        scope.locals[checked.name] = checked.type
        outside = applied("or", applied("lt", checked, const(low)), applied("gt", checked, const(high)))
        out += [Let(checked, value), Fault(self.number(0, FAULTS - 1), outside)]
        return checked

    def block(self, scope: _Scope | None = None, depth: int = 2) -> Block:
        scope = _Scope() if scope is None else scope
        out: list[Stmt] = []
        for _ in range(self.number(0, self._size if depth == 2 else 2)):
            self.statement(scope, depth, out)
        return tuple(out)

    def statement(self, scope: _Scope, depth: int, out: list[Stmt]) -> None:
        match self.number(0, 11) if depth > 0 else self.number(0, 7):
            case 0 | 1 | 2 if self._targets:
                target = self.pick(self._targets)
                value = self.fitting(scope, target.type, out)
                index = None if target.length is None else self.index(scope, target, 2)
                out.append(Set(target.name, index, value))
            case 3:
                value = self.integer(scope, 3)
                self.let(scope, value, out)
            case 4 | 5 if self._choices:
                choice = self.pick(self._choices)
                local = Local(scope.fresh(), choice.type)
                scope.locals[local.name] = local.type
                out.append(Sample(local, choice.name))
            case 6:
                kinds: tuple[EventKind, ...] = get_args(EventKind)
                args = tuple(self.truth(scope, 1) for _ in range(self.number(0, 3)))
                out.append(Emit(self.pick(kinds), self.number(0, self._machines - 1), args))
            case 7:
                dividend, divisor = self.integer(scope, 2), self.let(scope, self.integer(scope, 2), out)
                out.append(Fault(self.number(0, FAULTS - 1), applied("eq", divisor, const(0))))
                self.let(scope, applied(self.pick(DIVISIONS), dividend, divisor), out)
            case 8:
                out.append(Fault(self.number(0, FAULTS - 1), applied("and", *(self.truth(scope, 2) for _ in "ab"))))
            case 9:
                self.switch(scope, depth, out)
            case 10:
                self.both(scope, depth, out)
            case _:
                then, otherwise = self.block(scope.inner(), depth - 1), self.block(scope.inner(), depth - 1)
                out.append(If(self.truth(scope, 2), then, otherwise))

    def let(self, scope: _Scope, value: Expr, out: list[Stmt]) -> Local:
        local = Local(scope.fresh(), value.type)
        out.append(Let(local, value))
        scope.locals[local.name] = local.type
        return local

    def switch(self, scope: _Scope, depth: int, out: list[Stmt]) -> None:
        value = self.integer(scope, 2)
        keys = sorted({self.pick(SMALL[:9]) for _ in range(self.number(0, 3))})
        cases = tuple((k, self.block(scope.inner(), depth - 1)) for k in keys)
        out.append(Switch(value, cases, self.block(scope.inner(), depth - 1)))

    def both(self, scope: _Scope, depth: int, out: list[Stmt]) -> None:
        """A local that both branches of an If assign, and that may be used after it."""
        condition, kind = self.truth(scope, 2), self.pick(LOCAL_TYPES)
        local = Local(scope.fresh(), kind)
        branches = []
        for _ in range(2):
            inner = scope.inner()
            statements = list(self.block(inner, depth - 1))
            value = self.fitting(inner, kind, statements)
            branches.append((*statements, Let(local, value)))
        out.append(If(condition, branches[0], branches[1]))
        scope.locals[local.name] = kind


@st.composite
def programs(draw: st.DrawFn, *, size: int = 4) -> Program:
    """A step program of one or two processes with one to three slots each; `size` bounds the statements of a block.

    Every kind of statement and expression occurs. Turns go round, and a process may end after some rounds.
    """
    number = Pen(draw).number
    origin, output = Origin("control"), Origin("output")
    processes, slots = number(1, 2), [number(1, 3) for _ in range(2)]
    total = sum(slots[:processes])
    variables = [Var("cycle", BOOL, 0, output, output=True), Var("ran", Int(0, total), 0, output, output=True)]
    kept = {"cycle"}
    for p in range(processes):
        variables.append(Var(f"turn{p}", Int(0, slots[p] - 1), 0, origin))
        kept |= {f"turn{p}", f"ended{p}"}
        if number(0, 1):
            variables.append(Var(f"ended{p}", BOOL, 0, origin))
    states = [number(1, 3) for _ in range(total)]
    variables += [Var(f"state{s}", Int(0, states[s] - 1), number(0, states[s] - 1), origin) for s in range(total)]
    for i in range(number(1, 5)):
        variables.append(_variable(draw, f"v{i}"))
    choices = [
        Choice(f"c{i}", CHOICE_TYPES[number(0, len(CHOICE_TYPES) - 1)], "input", f"i{i}") for i in range(number(0, 4))
    ]
    writer = _Writer(draw, variables, choices, total, frozenset(kept), size)
    all_slots: list[Slot] = []
    all_processes: list[Process] = []
    names = {v.name for v in variables}
    for p in range(processes):
        first = len(all_slots)
        for s in range(first, first + slots[p]):
            blocks = tuple(writer.block() for _ in range(states[s]))
            marked: Block = (*writer.block(), Set("ran", None, const(s + 1)))
            all_slots.append(Slot(s, p, f"state{s}", writer.block(), blocks, marked, writer.block(depth=1)))
        ended = f"ended{p}" if f"ended{p}" in names else None
        epilogue = _epilogue(writer, f"turn{p}", slots[p], ended)
        all_processes.append(Process(f"p{p}", tuple(range(first, first + slots[p])), f"turn{p}", ended, epilogue))
    return Program(
        "random",
        "cycle" if number(0, 2) == 2 else "ringlet",
        tuple(variables),
        tuple(choices),
        (),
        tuple(MachineInfo(f"m{s}", tuple(f"S{i}" for i in range(states[s])), ((),) * states[s]) for s in range(total)),
        tuple(all_slots),
        tuple(all_processes),
        writer.block(depth=1),
        writer.block(depth=1),
        (),
        (),
        tuple(FaultSite(f"E{i}", f"fault {i}", None) for i in range(FAULTS)),
    )


def _variable(draw: st.DrawFn, name: str) -> Var:
    kind: Type = draw(st.sampled_from(VARIABLE_TYPES))
    low, high = (kind.low, kind.high) if isinstance(kind, Int) else (-9, 9)
    length = draw(st.sampled_from((None, None, None, 1, 3, 4, 9)))
    is_output = draw(st.integers(0, 3)) == 3

    def value() -> int:
        if kind == UNBOUNDED and draw(st.integers(0, 4)) == 4:
            return draw(st.sampled_from((INT64_MIN, INT64_MAX)))
        return draw(st.integers(low, high))

    init = value() if length is None else tuple(value() for _ in range(length))
    free = not is_output and kind in (BOOL, Int(-3, 4)) and (length or 1) < 4 and draw(st.integers(0, 3)) == 3
    return Var(name, kind, init, Origin("output" if is_output else "machine"), length, is_output, free)


def _epilogue(writer: _Writer, turn: str, slots: int, ended: str | None) -> Block:
    kind = Int(0, slots - 1)
    now = Get(turn, None, kind)
    wrapped: list[Stmt] = [Set("cycle", None, const(1)), Set(turn, None, const(0))]
    if ended is not None:
        wrapped.append(Set(ended, None, writer.truth(_Scope(), 2)))
    following = applied("min", applied("add", now, const(1)), const(slots - 1))
    last = applied("eq", now, const(slots - 1))
    return (*writer.block(depth=1), If(last, tuple(wrapped), (Set(turn, None, following),)))

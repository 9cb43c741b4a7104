"""What a step program means, in plain Python: the oracle that the tests hold every other engine against.

Expressions and blocks are walked with explicit stacks, so that depth is never a crash. Nothing here is fast.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from llfsm_verify.backends.broken import BrokenProgramError
from llfsm_verify.program.program import (
    INT64_MAX,
    INT64_MIN,
    Block,
    Choice,
    Const,
    Emit,
    EventKind,
    Expr,
    Fault,
    Get,
    If,
    Int,
    Ite,
    Let,
    Local,
    Op,
    Program,
    Sample,
    Set,
    Stmt,
    Switch,
    Type,
)
from llfsm_verify.values import Value

Event = tuple[EventKind, int, tuple[int, ...]]
"""Kind, index of the machine, arguments."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What one step came to. With a `fault` or an `overflow` it has no successor: `values` and `outputs` are then those
    before the step; `samples` and `events` are what was read and emitted until then."""

    values: dict[str, Value]
    outputs: dict[str, Value]
    samples: tuple[tuple[str, int], ...]
    """Names and values of the choices, in the order of first reading."""
    events: tuple[Event, ...]
    fault: int | None
    overflow: bool
    read: int
    """How many of the samples the ringlet took; the letter shows the others, which no machine has sampled."""
    beyond: str = ""
    """Of an overflow: the variable or local that was to hold the value, where the statement is a store."""


class _FaultError(Exception):
    def __init__(self, fault: int) -> None:
        self.fault = fault


UNARY: Mapping[str, Callable[[int], int]] = {"neg": operator.neg, "abs": abs, "not": lambda a: 1 - a}
BINARY: Mapping[str, Callable[[int, int], int]] = {
    "add": operator.add, "sub": operator.sub, "mul": operator.mul, "min": min, "max": max,
    "div": lambda a, b: abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1),
    "mod": lambda a, b: abs(a) % abs(b) * (-1 if a < 0 else 1),
    "eq": operator.eq, "ne": operator.ne, "lt": operator.lt, "le": operator.le, "gt": operator.gt, "ge": operator.ge,
    "and": operator.and_, "or": operator.or_, "xor": operator.xor,
}  # fmt: skip


def apply(operation: Op, arguments: list[int]) -> int:
    """The exact value of an operation on evaluated arguments. Raises ZeroDivisionError where a check is missing."""
    match operation.op, arguments:
        case "wrap", [a] if isinstance(operation.type, Int):
            low, size = operation.type.low, operation.type.high - operation.type.low + 1
            return low + (a - low) % size
        case name, [a] if name in UNARY:
            return UNARY[name](a)
        case name, [a, b] if name in BINARY:
            return int(BINARY[name](a, b))
    raise BrokenProgramError(f"{operation.op} of {len(arguments)} arguments")


def _scalar(variables: Mapping[str, Value], name: str) -> int:
    value = variables[name]
    if isinstance(value, tuple):
        raise BrokenProgramError(f"{name} is an array")
    return value


def _array(variables: Mapping[str, Value], name: str, position: int) -> tuple[int, ...]:
    value = variables[name]
    if not isinstance(value, tuple) or not 0 <= position < len(value):
        raise BrokenProgramError(f"{name} has no element {position}")
    return value


@dataclass(frozen=True, slots=True)
class _Apply:
    """The arguments of an operation are computed: apply it."""

    operation: Op


@dataclass(frozen=True, slots=True)
class _Element:
    """The index of an array is computed: take the element."""

    array: str


@dataclass(frozen=True, slots=True)
class _Either:
    """The side of an Ite that its condition chooses; the other side is not evaluated."""

    choice: Ite


@dataclass(frozen=True, slots=True)
class _Held:
    """A value is computed: hold it as one of this type."""

    type: Type


def evaluate(
    expression: Expr, variables: Mapping[str, Value], locals_: Mapping[str, int], *, shared: bool = False
) -> int:
    """The value of an expression over persistent variables and outputs (`variables`) and locals.

    `shared`: operations may stand in many places, and each is computed once. Raises OverflowError when a value of type
    Unbounded leaves 64 bits.
    """
    known: dict[int, int] = {}
    todo: list[Expr | _Apply | _Element | _Either | _Held] = [expression]
    done: list[int] = []
    while todo:
        match todo.pop():
            case Const(value, kind):
                done.append(_held(value, kind))
            case Local(name, _):
                done.append(locals_[name])
            case Get(name, None, _):
                done.append(_scalar(variables, name))
            case Get(name, Const() | Get() | Local() | Op() | Ite() as index, _):
                todo += [_Element(name), index]
            case _Element(name):
                position = done.pop()
                done.append(_array(variables, name, position)[position])
            case Ite() as ite:
                todo += [_Either(ite), ite.condition]
            case _Either(ite):
                todo += [_Held(ite.type), ite.then if done.pop() else ite.otherwise]
            case _Held(kind):
                done.append(_held(done.pop(), kind))
            case Op() as operation if shared and id(operation) in known:
                done.append(known[id(operation)])
            case Op() as operation:
                todo += [_Apply(operation), *reversed(operation.args)]
            case _Apply(operation):
                count = len(operation.args)
                arguments = done[-count:]
                del done[-count:]
                kind = operation.type
                done.append(_held(apply(operation, [_held(a, kind) for a in arguments]), kind))
                if shared:
                    known[id(operation)] = done[-1]
    return done.pop()


def _held(value: int, kind: Type) -> int:
    """The value, as values of a type are held: one without bounds that leaves 64 bits is an OverflowError."""
    if not isinstance(kind, Int) and not INT64_MIN <= value <= INT64_MAX:
        raise OverflowError(value)
    return value


@dataclass(slots=True)
class _Run:
    """One step under way: `variables` are copies that it changes."""

    program: Program
    choices: Mapping[str, Choice]
    types: Mapping[str, Type]
    variables: dict[str, Value]
    choose: Callable[[Choice], int]
    samples: dict[str, int]
    events: list[Event]
    read: int = 0
    storing: str = ""

    def block(self, block: Block) -> None:
        """Run one block with locals of its own. Raises _FaultError or OverflowError where the step ends."""
        locals_: dict[str, int] = {}
        todo: list[Stmt] = list(reversed(block))
        while todo:
            statement = todo.pop()
            self.storing = ""
            match statement:
                case Set(name, index, value):
                    self.storing = name
                    self.store(name, index, self.value(value, locals_), locals_)
                case Let(local, value):
                    self.storing = local.name
                    locals_[local.name] = _held(self.value(value, locals_), local.type)
                case Sample(local, choice):
                    locals_[local.name] = self.sample(choice)
                case If(condition, then, otherwise):
                    todo += reversed(then if self.value(condition, locals_) else otherwise)
                case Switch(value, cases, default):
                    todo += reversed(dict(cases).get(self.value(value, locals_), default))
                case Fault(fault, when):
                    if self.value(when, locals_):
                        raise _FaultError(fault)
                case Emit(kind, machine, args):
                    self.events.append((kind, machine, tuple(self.value(a, locals_) for a in args)))

    def value(self, expression: Expr, locals_: Mapping[str, int]) -> int:
        return evaluate(expression, self.variables, locals_)

    def store(self, name: str, index: Expr | None, value: int, locals_: Mapping[str, int]) -> None:
        kind = self.types[name]
        if isinstance(kind, Int) and not kind.low <= value <= kind.high:
            raise BrokenProgramError(f"{name} = {value}")
        value = _held(value, kind)
        if index is None:
            self.variables[name] = value
        else:
            position = self.value(index, locals_)
            array = _array(self.variables, name, position)
            self.variables[name] = (*array[:position], value, *array[position + 1 :])

    def sample(self, name: str) -> int:
        if name not in self.samples:
            choice = self.choices[name]
            value = self.choose(choice)
            if not choice.type.low <= value <= choice.type.high:
                raise ValueError(f"{name} = {value} is outside {choice.type.low}..{choice.type.high}")
            self.samples[name] = value
        return self.samples[name]


class Interpreter:
    """The steps of one program. `values` and `outputs` are as `Layout.decode` and `Layout.decode_outputs` give them."""

    def __init__(self, program: Program) -> None:
        self.program = program
        self._choices = {c.name: c for c in program.choices}
        self._types = {v.name: v.type for v in program.vars}
        self._inits = {v.name: v.init for v in program.vars if v.output}

    def enabled(self, values: Mapping[str, Value]) -> list[int]:
        """The processes that may step; none is left of an arrangement that has ended."""
        return [i for i, p in enumerate(self.program.processes) if p.ended is None or values[p.ended] == 0]

    def step(
        self,
        values: Mapping[str, Value],
        outputs: Mapping[str, Value],
        process: int | None,
        choose: Callable[[Choice], int],
    ) -> Outcome:
        """One step of `process`, or the stutter (None). `choose` gives the value of a choice that the step reads.

        Raises ValueError when that step is not enabled.
        """
        enabled = self.enabled(values)
        if (process not in enabled) if process is not None else enabled:
            raise ValueError(f"process {process} may not step: enabled are {enabled}")
        program = self.program
        fresh = process is None or program.observe == "ringlet" or outputs[program.cycle] == 1
        start = dict(values) | (self._inits if fresh else dict(outputs))
        run = _Run(program, self._choices, self._types, start, choose, {}, [])
        fault, overflow = None, False
        try:
            if process is None:
                run.block(program.letter_stutter)
            else:
                self._ringlet(run, process)
        except _FaultError as faulted:
            fault = faulted.fault
        except OverflowError:
            overflow = True
        after = {**values, **outputs} if fault is not None or overflow else run.variables
        return Outcome(
            {name: after[name] for name in values},
            {name: after[name] for name in outputs},
            tuple(run.samples.items()),
            tuple(run.events),
            fault,
            overflow,
            len(run.samples) if fault is not None or overflow else run.read,
            run.storing if overflow else "",
        )

    def begun(
        self, values: Mapping[str, Value], outputs: Mapping[str, Value], process: int, choose: Callable[[Choice], int]
    ) -> Mapping[str, Value]:
        """Variables and outputs when the block of a state begins, in a step of `process`, which is enabled."""
        program, acting = self.program, self.program.processes[process]
        fresh = program.observe == "ringlet" or outputs[program.cycle] == 1
        start = dict(values) | (self._inits if fresh else dict(outputs))
        run = _Run(program, self._choices, self._types, start, choose, {}, [])
        run.block(program.slots[acting.slots[_scalar(start, acting.turn)]].prologue)
        return run.variables

    def _ringlet(self, run: _Run, process: int) -> None:
        program = self.program
        acting = program.processes[process]
        slot = program.slots[acting.slots[_scalar(run.variables, acting.turn)]]
        run.block(slot.prologue)
        run.block(slot.blocks[_scalar(run.variables, slot.state)])
        run.block(slot.epilogue)
        run.block(acting.epilogue)
        run.block(slot.canonical)
        run.read = len(run.samples)
        run.block(program.letter)

    def successors(
        self, values: Mapping[str, Value], outputs: Mapping[str, Value]
    ) -> Iterator[tuple[int | None, Outcome]]:
        """Every step from here: process by process, and for each all values of the choices that it reads.

        The choices run like an odometer whose last wheel is the choice read last: from their lows upwards.
        """
        processes: Sequence[int | None] = self.enabled(values) or (None,)
        for process in processes:
            wheels: tuple[tuple[str, int], ...] | None = ()
            while wheels is not None:
                fixed = dict(wheels)
                outcome = self.step(values, outputs, process, lambda c: fixed.get(c.name, c.type.low))  # noqa: B023
                yield process, outcome
                wheels = self._advance(outcome.samples)

    def _advance(self, samples: tuple[tuple[str, int], ...]) -> tuple[tuple[str, int], ...] | None:
        for i in reversed(range(len(samples))):
            name, value = samples[i]
            if value < self._choices[name].type.high:
                return (*samples[:i], (name, value + 1))
        return None

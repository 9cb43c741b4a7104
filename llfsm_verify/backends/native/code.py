"""Blocks of a step program as text of LLVM functions.

A function takes the record `%r` and the context `%c` (see `kernel`) and returns 0, 1 + the number of a fault, or one of
the negative statuses. All numbers are i64. Expressions and blocks are walked with explicit stacks; locals are allocas,
which LLVM turns into registers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import get_args

from llfsm_verify.backends.native.layout import WORD_BITS, BitField, Layout
from llfsm_verify.program.program import (
    INT64_MAX,
    INT64_MIN,
    Block,
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
    OpName,
    Sample,
    Set,
    Stmt,
    Switch,
)

OVERFLOW = -1
"""Status of a step in which an unbounded integer left 64 bits."""
BROKEN = -2
"""Status of a step in which the program broke its contract (`BrokenProgramError`)."""

EVENT_KINDS: tuple[EventKind, ...] = get_args(EventKind)
ALL_ONES = (1 << WORD_BITS) - 1

_PLAIN: dict[OpName, str] = {"add": "add", "sub": "sub", "mul": "mul"}
_COMPARISONS: dict[OpName, str] = {"eq": "eq", "ne": "ne", "lt": "slt", "le": "sle", "gt": "sgt", "ge": "sge"}
_LOGIC: dict[OpName, str] = {"and": "and", "or": "or", "xor": "xor"}

DECLARATIONS = """\
declare {i64, i1} @llvm.sadd.with.overflow.i64(i64, i64)
declare {i64, i1} @llvm.ssub.with.overflow.i64(i64, i64)
declare {i64, i1} @llvm.smul.with.overflow.i64(i64, i64)
declare i64 @llvm.abs.i64(i64, i1)
declare i64 @llvm.smin.i64(i64, i64)
declare i64 @llvm.smax.i64(i64, i64)
"""


@dataclass(frozen=True, slots=True)
class Operand:
    """A computed value: its LLVM text, and whether it is an i1 rather than an i64."""

    text: str
    truth: bool = False


@dataclass(frozen=True, slots=True)
class _Apply:
    """The arguments of an operation are computed: apply it."""

    operation: Op


@dataclass(frozen=True, slots=True)
class _Element:
    """The index of an array is computed: load the element."""

    get: Get


@dataclass(frozen=True, slots=True)
class _Branch:
    """The condition of an Ite is computed: branch, and compute one side."""

    ite: Ite


@dataclass(frozen=True, slots=True)
class _Other:
    """The first side is computed: compute the other."""

    ite: Ite
    otherwise: str
    join: str


@dataclass(frozen=True, slots=True)
class _Join:
    """Both sides are computed; the first one left its value and came from this label."""

    join: str
    first: str


def bounds(expression: Expr) -> tuple[int, int]:
    """The interval of an expression's value as an i64."""
    kind = expression.type
    if isinstance(expression, Const) and INT64_MIN <= expression.value <= INT64_MAX:
        return expression.value, expression.value
    return (kind.low, kind.high) if isinstance(kind, Int) else (INT64_MIN, INT64_MAX)


class FunctionText:
    """Writes one function. `choices` and `events` number the choices and say whether `Emit` is kept."""

    def __init__(self, layout: Layout, choices: dict[str, int], events: bool) -> None:
        self._layout = layout
        self._choices = choices
        self._events = events
        self._entry: list[str] = []
        self._lines: list[str] = []
        self._label = "start"
        self._count = 0
        self._locals: dict[str, str] = {}
        self._words: dict[int, str] = {}
        self._exits: dict[str, int] = {}
        self.emitted_arities: set[int] = set()

    # ------------------------------------------------------------ the parts of the text

    def text(self) -> str:
        """The body, from the opening to the closing brace."""
        exits = [f"{label}:\n  ret i32 {status}" for label, status in self._exits.items()]
        return "\n".join(["{", "entry:", *self._entry, "  br label %start", "start:", *self._lines, *exits, "}"])

    @property
    def can_fail(self) -> bool:
        return bool(self._exits)

    def line(self, text: str) -> None:
        self._lines.append("  " + text)

    def name(self, text: str) -> str:
        """A new register that holds the instruction `text`."""
        self._count += 1
        register = f"%v{self._count}"
        self._lines.append(f"  {register} = {text}")
        return register

    def new_label(self) -> str:
        self._count += 1
        return f"L{self._count}"

    def start_label(self, label: str) -> None:
        self._lines.append(label + ":")
        self._label = label

    def leave_if(self, condition: str, status: int) -> None:
        """Return `status` when the i1 `condition` holds."""
        label = {OVERFLOW: "overflow", BROKEN: "broken"}.get(status, f"fault{status - 1}")
        self._exits[label] = status
        after = self.new_label()
        self.line(f"br i1 {condition}, label %{label}, label %{after}")
        self.start_label(after)

    def number(self, operand: Operand) -> str:
        return self.name(f"zext i1 {operand.text} to i64") if operand.truth else operand.text

    def truth(self, operand: Operand) -> str:
        return operand.text if operand.truth else self.name(f"icmp ne i64 {operand.text}, 0")

    def _local(self, name: str) -> str:
        if name not in self._locals:
            self._locals[name] = f"%l{len(self._locals)}"
            self._entry.append(f"  {self._locals[name]} = alloca i64")
        return self._locals[name]

    # ------------------------------------------------------------ fields

    def _word(self, word: int) -> str:
        """A pointer to a word of the record."""
        if word == 0:
            return "%r"
        if word not in self._words:
            self._words[word] = f"%w{word}"
            self._entry.append(f"  %w{word} = getelementptr i64, ptr %r, i64 {word}")
        return self._words[word]

    def _place(self, field: BitField, index: Operand | None, low: int, high: int) -> tuple[str, str]:
        """Pointer to the word and shift (texts) of a scalar, or of the element `index` from `low` … `high`."""
        if index is None:
            return self._word(field.word), str(field.shift)
        if not (low >= 0 and high < field.elements):
            position = self.number(index)
            self.leave_if(self.name(f"icmp uge i64 {position}, {field.elements}"), BROKEN)
            index = Operand(position)
        if low == high and 0 <= low < field.elements:
            word, shift = field.place(low)
            return self._word(word), str(shift)
        position, pointer = self.number(index), self._word(field.word)
        if field.elements > field.per_word:
            offset = self.name(f"udiv i64 {position}, {field.per_word}")
            position = self.name(f"urem i64 {position}, {field.per_word}")
            pointer = self.name(f"getelementptr i64, ptr {pointer}, i64 {offset}")
        shift_text = self.name(f"mul i64 {position}, {field.bits}")
        return pointer, self.name(f"add i64 {shift_text}, {field.shift}") if field.shift else shift_text

    def load(self, name: str, index: Operand | None = None, low: int = 0, high: int = 0) -> Operand:
        """The value of a variable, or of its element `index`, which lies in `low` … `high`."""
        field = self._layout.fields[name]
        pointer, shift = self._place(field, index, low, high)
        if field.bits == 0:
            return Operand(str(field.low))
        value = self.name(f"load i64, ptr {pointer}")
        if shift != "0":
            value = self.name(f"lshr i64 {value}, {shift}")
        if field.bits < WORD_BITS:
            value = self.name(f"and i64 {value}, {(1 << field.bits) - 1}")
        return Operand(self.name(f"add i64 {value}, {field.low}") if field.low else value)

    def _store(self, statement: Set) -> None:
        field = self._layout.fields[statement.var]
        value = self.number(self.value(statement.value))
        low, high = bounds(statement.value)
        index, span = None, (0, 0)
        if statement.index is not None:
            index, span = self.value(statement.index), bounds(statement.index)
        pointer, shift = self._place(field, index, *span)
        if isinstance(statement.value, Const):
            value = str(_signed(int(value) - field.low & ALL_ONES))
        elif field.low:
            value = self.name(f"sub i64 {value}, {field.low}")
        if field.bits < WORD_BITS and not (field.low <= low and high <= field.high):
            self.leave_if(self.name(f"icmp ugt i64 {value}, {field.high - field.low}"), BROKEN)
        if field.bits == 0:
            return
        if field.bits < WORD_BITS:
            old, mask = self.name(f"load i64, ptr {pointer}"), (1 << field.bits) - 1
            if shift.isdigit():
                hole = str(_signed(ALL_ONES ^ mask << int(shift)))
            else:
                hole = self.name(f"xor i64 {self.name(f'shl i64 {mask}, {shift}')}, -1")
            kept = self.name(f"and i64 {old}, {hole}")
            if value.isdigit() and shift.isdigit():
                value = str(_signed(int(value) << int(shift) & ALL_ONES))
            elif shift != "0":
                value = self.name(f"shl i64 {value}, {shift}")
            value = self.name(f"or i64 {kept}, {value}") if value != "0" else kept
        self.line(f"store i64 {value}, ptr {pointer}")

    # ------------------------------------------------------------ expressions

    def value(self, expression: Expr) -> Operand:
        """The value of an expression. The side of an Ite that is not chosen is not computed."""
        todo: list[Expr | _Apply | _Element | _Branch | _Other | _Join] = [expression]
        done: list[Operand] = []
        while todo:
            match todo.pop():
                case Const(value, _):
                    if not INT64_MIN <= value <= INT64_MAX:
                        self.leave_if("true", OVERFLOW)
                        value = 0
                    done.append(Operand(str(value)))
                case Local(name, _):
                    done.append(Operand(self.name(f"load i64, ptr {self._local(name)}")))
                case Get(name, None, _):
                    done.append(self.load(name))
                case Get(_, Const() | Get() | Local() | Op() | Ite() as index, _) as get:
                    todo += [_Element(get), index]
                case _Element(Get(name, Const() | Get() | Local() | Op() | Ite() as index, _)):
                    done.append(self.load(name, done.pop(), *bounds(index)))
                case Op(_, args, _) as operation:
                    todo += [_Apply(operation), *reversed(args)]
                case _Apply(operation):
                    count = len(operation.args)
                    operands = done[-count:]
                    del done[-count:]
                    done.append(self._apply(operation, operands))
                case Ite(condition, _, _, _) as ite:
                    todo += [_Branch(ite), condition]
                case _Branch(ite):
                    then, otherwise, join = self.new_label(), self.new_label(), self.new_label()
                    self.line(f"br i1 {self.truth(done.pop())}, label %{then}, label %{otherwise}")
                    self.start_label(then)
                    todo += [_Other(ite, otherwise, join), ite.then]
                case _Other(ite, otherwise, join):
                    done.append(Operand(self.number(done.pop())))
                    todo += [_Join(join, self._label), ite.otherwise]
                    self.line(f"br label %{join}")
                    self.start_label(otherwise)
                case _Join(join, first):
                    second, last = self.number(done.pop()), self._label
                    self.line(f"br label %{join}")
                    self.start_label(join)
                    done.append(Operand(self.name(f"phi i64 [{done.pop().text}, %{first}], [{second}, %{last}]")))
        return done.pop()

    def _apply(self, operation: Op, operands: Sequence[Operand]) -> Operand:
        op, exact = operation.op, isinstance(operation.type, Int)
        if op in _LOGIC:
            return Operand(self.name(f"{_LOGIC[op]} i1 {', '.join(self.truth(o) for o in operands)}"), True)
        if op == "not":
            return Operand(self.name(f"xor i1 {self.truth(operands[0])}, true"), True)
        numbers = [self.number(o) for o in operands]
        both = ", ".join(numbers)
        if op in _COMPARISONS:
            return Operand(self.name(f"icmp {_COMPARISONS[op]} i64 {both}"), True)
        if op in _PLAIN:
            return Operand(self.name(f"{op} i64 {both}") if exact else self._checked(op, *numbers))
        if op == "neg":
            return Operand(self.name(f"sub i64 0, {both}") if exact else self._checked("sub", "0", *numbers))
        if op == "abs":
            if not exact:
                self.leave_if(self.name(f"icmp eq i64 {both}, {INT64_MIN}"), OVERFLOW)
            return Operand(self.name(f"call i64 @llvm.abs.i64(i64 {both}, i1 false)"))
        if op in ("min", "max"):
            return Operand(self.name(f"call i64 @llvm.s{op}.i64(i64 {numbers[0]}, i64 {numbers[1]})"))
        if op == "wrap" and isinstance(operation.type, Int):
            low, size = operation.type.low, operation.type.high - operation.type.low + 1
            if size > ALL_ONES:
                return Operand(both)
            offset = self.name(f"sub i64 {both}, {low}") if low else both
            offset = self.name(f"and i64 {offset}, {size - 1}")
            return Operand(self.name(f"add i64 {offset}, {low}") if low else offset)
        if op in ("div", "mod"):
            return self._divide(operation, *numbers)
        raise ValueError(f"unknown operation {op}")

    def _checked(self, op: str, left: str, right: str) -> str:
        pair = self.name(f"call {{i64, i1}} @llvm.s{op}.with.overflow.i64(i64 {left}, i64 {right})")
        self.leave_if(self.name(f"extractvalue {{i64, i1}} {pair}, 1"), OVERFLOW)
        return self.name(f"extractvalue {{i64, i1}} {pair}, 0")

    def _divide(self, operation: Op, left: str, right: str) -> Operand:
        (smallest, _), (low, high) = bounds(operation.args[0]), bounds(operation.args[1])
        if low <= 0 <= high:
            self.leave_if(self.name(f"icmp eq i64 {right}, 0"), BROKEN)
        if smallest == INT64_MIN and low <= -1 <= high:  # the one quotient outside 64 bits traps in hardware
            minus_one = self.name(f"icmp eq i64 {right}, -1")
            if operation.op == "mod":
                right = self.name(f"select i1 {minus_one}, i64 1, i64 {right}")
            else:
                extreme = self.name(f"icmp eq i64 {left}, {INT64_MIN}")
                self.leave_if(self.name(f"and i1 {minus_one}, {extreme}"), OVERFLOW)
        return Operand(self.name(f"{'sdiv' if operation.op == 'div' else 'srem'} i64 {left}, {right}"))

    # ------------------------------------------------------------ statements

    def block(self, block: Block) -> None:
        """The statements of a block, one after the other; the function does not return yet."""
        todo: list[Stmt | str] = list(reversed(block))  # a string is a label to go to and begin
        while todo:
            match todo.pop():
                case str(label):
                    join, _, following = label.partition(" ")
                    self.line(f"br label %{join}")
                    self.start_label(following)
                case Set() as store:
                    self._store(store)
                case Let(local, value):
                    result = self.number(self.value(value))
                    self.line(f"store i64 {result}, ptr {self._local(local.name)}")
                case Sample(local, choice):
                    result = self.name(f"call i64 @sample(ptr %c, i64 {self._choices[choice]})")
                    self.line(f"store i64 {result}, ptr {self._local(local.name)}")
                case If(condition, then, otherwise):
                    truth = self.truth(self.value(condition))
                    yes, join = self.new_label(), self.new_label()
                    no = self.new_label() if otherwise else join
                    self.line(f"br i1 {truth}, label %{yes}, label %{no}")
                    self.start_label(yes)
                    todo.append(f"{join} {join}")
                    if otherwise:
                        todo += [*reversed(otherwise), f"{join} {no}"]
                    todo += reversed(then)
                case Switch(value, cases, default):
                    self._switch(self.number(self.value(value)), dict(cases), default, todo)
                case Fault(fault, when):
                    self.leave_if(self.truth(self.value(when)), 1 + fault)
                case Emit() as emit:
                    if self._events:
                        self._emit(emit)

    def _switch(self, value: str, cases: dict[int, Block], default: Block, todo: list[Stmt | str]) -> None:
        labels = {k: self.new_label() for k in cases if INT64_MIN <= k <= INT64_MAX}
        otherwise, join = self.new_label(), self.new_label()
        table = " ".join(f"i64 {k}, label %{label}" for k, label in labels.items())
        self.line(f"switch i64 {value}, label %{otherwise} [{table}]")
        pending: list[Stmt | str] = [f"{join} {join}"]
        for k, label in labels.items():
            pending += [*reversed(cases[k]), f"{join} {label}"]
        self.start_label(otherwise)
        todo += [*pending, *reversed(default)]

    def _emit(self, emit: Emit) -> None:
        arguments = [self.number(self.value(a)) for a in emit.args]
        numbers = [str(EVENT_KINDS.index(emit.kind)), str(emit.machine), str(len(arguments)), *arguments]
        self.emitted_arities.add(len(arguments))
        self.line(f"call void @emit{len(arguments)}(ptr %c, {', '.join('i64 ' + n for n in numbers)})")


def _signed(word: int) -> int:
    return word - (1 << WORD_BITS) if word >> (WORD_BITS - 1) else word

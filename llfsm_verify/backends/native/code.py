"""Blocks of a step program as text of LLVM functions.

A function takes the record `%r` and the context `%c` (see `kernel`) and returns 0, 1 + the number of a fault, or one of
the negative statuses. A number is an i64, or an i128 where its type asks for one; an i128 whose type has values from
2^127 on is without a sign. Expressions and blocks are walked with explicit stacks; locals are allocas, which LLVM turns
into registers.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
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
    Type,
)
from llfsm_verify.program.terms import fits, is_wide

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
    """A computed value: its LLVM text, and its kind where that is not i64: an i1, or an i128 with a sign or without."""

    text: str
    truth: bool = False
    wide: bool = False
    unsigned: bool = False

    @classmethod
    def of(cls, text: str, kind: Type) -> Operand:
        """A number as values of a type are held."""
        wide = is_wide(kind)
        return cls(text, wide=wide, unsigned=wide and isinstance(kind, Int) and kind.high >= 1 << 127)

    @property
    def size(self) -> str:
        """The LLVM type of a number."""
        return "i128" if self.wide else "i64"


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

    ite: Ite
    join: str
    first: str


def bounds(expression: Expr) -> tuple[int, int]:
    """The interval of an expression's value as it is held."""
    kind = expression.type
    if isinstance(expression, Const) and fits(expression.value, expression.value):
        return expression.value, expression.value
    return (kind.low, kind.high) if isinstance(kind, Int) else (INT64_MIN, INT64_MAX)


class FunctionText:
    """Writes one function. `choices` and `events` number the choices and say which kinds of `Emit` are kept."""

    def __init__(self, layout: Layout, choices: dict[str, int], events: Collection[EventKind]) -> None:
        self._layout = layout
        self._choices = choices
        self._events = events
        self._entry: list[str] = []
        self._lines: list[str] = []
        self._label = "start"
        self._count = 0
        self._locals: dict[str, Operand] = {}
        self._words: dict[int, str] = {}
        self._exits: dict[str, int] = {}
        self.emitted_arities: set[int] = set()
        self.divides_wide = False

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
        """As an i64. A wide one that does not fit ends the step: what needs an i64 is of a type without bounds."""
        if operand.truth:
            return self.name(f"zext i1 {operand.text} to i64")
        if not operand.wide:
            return operand.text
        low = self.lowest(operand)
        if operand.unsigned:
            self.leave_if(self.name(f"icmp ugt i128 {operand.text}, {INT64_MAX}"), OVERFLOW)
            return low
        back = self.name(f"sext i64 {low} to i128")
        self.leave_if(self.name(f"icmp ne i128 {back}, {operand.text}"), OVERFLOW)
        return low

    def lowest(self, operand: Operand) -> str:
        """The lowest 64 bits."""
        return self.name(f"trunc i128 {operand.text} to i64") if operand.wide else self.number(operand)

    def widened(self, operand: Operand) -> str:
        """As an i128."""
        return operand.text if operand.wide else self.name(f"sext i64 {self.number(operand)} to i128")

    def held(self, operand: Operand, kind: Type) -> Operand:
        """The same value as values of a type are held."""
        return Operand.of(self.widened(operand) if is_wide(kind) else self.number(operand), kind)

    def truth(self, operand: Operand) -> str:
        if operand.truth:
            return operand.text
        return self.name(f"icmp ne {operand.size} {operand.text}, 0")

    def _local(self, local: Local) -> Operand:
        """The alloca of a local, as what is held there is held."""
        if local.name not in self._locals:
            place = Operand.of(f"%l{len(self._locals)}", local.type)
            self._locals[local.name] = place
            self._entry.append(f"  {place.text} = alloca {place.size}")
        return self._locals[local.name]

    def _assign(self, local: Local, operand: Operand) -> None:
        place = self._local(local)
        text = self.widened(operand) if place.wide else self.number(operand)
        self.line(f"store {place.size} {text}, ptr {place.text}")

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
            position = index.text if index.wide else self.number(index)
            self.leave_if(self.name(f"icmp uge {index.size} {position}, {field.elements}"), BROKEN)
            index = Operand(self.lowest(index) if index.wide else position)
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
            return Operand(str(field.low), wide=field.high > INT64_MAX)
        value = self.name(f"load i64, ptr {pointer}")
        if shift != "0":
            value = self.name(f"lshr i64 {value}, {shift}")
        if field.bits < WORD_BITS:
            value = self.name(f"and i64 {value}, {(1 << field.bits) - 1}")
        if field.high > INT64_MAX:
            value = self.name(f"zext i64 {value} to i128")
            return Operand(self.name(f"add i128 {value}, {field.low}") if field.low else value, wide=True)
        return Operand(self.name(f"add i64 {value}, {field.low}") if field.low else value)

    def _store(self, statement: Set) -> None:
        field = self._layout.fields[statement.var]
        operand = self.value(statement.value)
        low, high = bounds(statement.value)
        if operand.wide and not field.unbounded and not (field.low <= low and high <= field.high):
            self._leave_outside(operand, field)
            low, high = field.low, field.high
        elif field.bits == WORD_BITS and low < field.low and not field.unbounded:
            self.leave_if(self.name(f"icmp slt i64 {self.number(operand)}, {field.low}"), BROKEN)
        value = self.number(operand) if field.unbounded else self.lowest(operand)
        index, span = None, (0, 0)
        if statement.index is not None:
            index, span = self.value(statement.index), bounds(statement.index)
        pointer, shift = self._place(field, index, *span)
        if isinstance(statement.value, Const):
            value = str(_signed(statement.value.value - field.low & ALL_ONES))
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
                    if not fits(value, value):
                        self.leave_if("true", OVERFLOW)
                        value = 0
                    done.append(Operand.of(str(value), Int(value, value)))
                case Local() as local:
                    place = self._local(local)
                    done.append(replace(place, text=self.name(f"load {place.size}, ptr {place.text}")))
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
                    done.append(self.held(done.pop(), ite.type))
                    todo += [_Join(ite, join, self._label), ite.otherwise]
                    self.line(f"br label %{join}")
                    self.start_label(otherwise)
                case _Join(ite, join, first):
                    second = self.held(done.pop(), ite.type)
                    last = self._label
                    self.line(f"br label %{join}")
                    self.start_label(join)
                    text = f"phi {second.size} [{done.pop().text}, %{first}], [{second.text}, %{last}]"
                    done.append(replace(second, text=self.name(text)))
        return done.pop()

    def _apply(self, operation: Op, operands: Sequence[Operand]) -> Operand:
        op, exact = operation.op, isinstance(operation.type, Int)
        if op in _LOGIC:
            return Operand(self.name(f"{_LOGIC[op]} i1 {', '.join(self.truth(o) for o in operands)}"), True)
        if op == "not":
            return Operand(self.name(f"xor i1 {self.truth(operands[0])}, true"), True)
        if is_wide(operation.type) or any(o.wide for o in operands):
            if op == "wrap" or op in _COMPARISONS or exact:
                return self._apply_wide(operation, operands)
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

    def _apply_wide(self, operation: Op, operands: Sequence[Operand]) -> Operand:
        """An operation on 128 bits. All its sides and its result fit in these with a sign, or all without."""
        op, kind = operation.op, operation.type
        if op == "wrap" and isinstance(kind, Int):
            if kind.high <= INT64_MAX:
                narrow = Op(op, operation.args, kind)
                return self._apply(narrow, [Operand(self.lowest(o)) for o in operands])
            size = kind.high - kind.low + 1
            offset = self.lowest(operands[0])
            if kind.low:
                offset = self.name(f"sub i64 {offset}, {kind.low}")
            if size <= ALL_ONES:
                offset = self.name(f"and i64 {offset}, {size - 1}")
            inside = self.name(f"zext i64 {offset} to i128")
            return Operand(self.name(f"add i128 {inside}, {kind.low}") if kind.low else inside, wide=True)
        numbers = [self.widened(o) for o in operands]
        both, unsigned = ", ".join(numbers), any(o.unsigned for o in operands)
        sign = "u" if unsigned else "s"
        if op in _COMPARISONS:
            return Operand(self._compare_wide(operation, numbers, operands), True)
        if op in _PLAIN:
            made = self.name(f"{op} i128 {both}")
        elif op == "neg":
            made = self.name(f"sub i128 0, {both}")
        elif op == "abs":
            made = both if unsigned else self._size(both)
        elif op in ("min", "max"):
            first = self.name(f"icmp {sign}{'lt' if op == 'min' else 'gt'} i128 {both}")
            made = self.name(f"select i1 {first}, i128 {numbers[0]}, i128 {numbers[1]}")
        elif op in ("div", "mod"):
            made = self._divide_wide(operation, *numbers, signed=not unsigned)
        else:
            raise ValueError(f"unknown operation {op}")
        return Operand.of(made if is_wide(kind) else self.lowest(Operand(made, wide=True)), kind)

    def _compare_wide(self, operation: Op, numbers: Sequence[str], operands: Sequence[Operand]) -> str:
        op, unsigned = operation.op, any(o.unsigned for o in operands)
        text = _COMPARISONS[op]
        if unsigned and text.startswith("s"):
            text = "u" + text[1:]
        result = self.name(f"icmp {text} i128 {', '.join(numbers)}")
        if unsigned:  # a negative side is less than one without a sign
            for number, argument, known in zip(
                numbers, operation.args, (("lt", "le", "ne"), ("gt", "ge", "ne")), strict=True
            ):
                if bounds(argument)[0] < 0:
                    negative = self.name(f"icmp slt i128 {number}, 0")
                    truth = "true" if op in known else "false"
                    result = self.name(f"select i1 {negative}, i1 {truth}, i1 {result}")
        return result

    def _size(self, number: str) -> str:
        """The absolute value of an i128."""
        negative = self.name(f"icmp slt i128 {number}, 0")
        return self.name(f"select i1 {negative}, i128 {self.name(f'sub i128 0, {number}')}, i128 {number}")

    def _divide_wide(self, operation: Op, left: str, right: str, *, signed: bool) -> str:
        low, high = bounds(operation.args[1])
        if low <= 0 <= high:
            self.leave_if(self.name(f"icmp eq i128 {right}, 0"), BROKEN)
        self.divides_wide = True
        sizes = [self._size(x) if signed else x for x in (left, right)]
        quotient = self.name(f"call i128 @quotient(i128 {sizes[0]}, i128 {sizes[1]})")
        if signed:
            differ = self.name(f"icmp slt i128 {self.name(f'xor i128 {left}, {right}')}, 0")
            opposite = self.name(f"sub i128 0, {quotient}")
            quotient = self.name(f"select i1 {differ}, i128 {opposite}, i128 {quotient}")
        if operation.op == "div":
            return quotient
        return self.name(f"sub i128 {left}, {self.name(f'mul i128 {quotient}, {right}')}")

    def _leave_outside(self, operand: Operand, field: BitField) -> None:
        """BROKEN where a value is outside the type of its field."""
        offset = self.name(f"sub i128 {operand.text}, {field.low}")
        self.leave_if(self.name(f"icmp ugt i128 {offset}, {field.high - field.low}"), BROKEN)

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
                    self._assign(local, self.value(value))
                case Sample(local, choice):
                    result = self.name(f"call i64 @sample(ptr %c, i64 {self._choices[choice]})")
                    if is_wide(local.type):
                        result = self.name(f"zext i64 {result} to i128")
                    self._assign(local, Operand.of(result, local.type))
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
                    self._switch(self.value(value), dict(cases), default, todo)
                case Fault(fault, when):
                    self.leave_if(self.truth(self.value(when)), 1 + fault)
                case Emit() as emit:
                    if emit.kind in self._events:
                        self._emit(emit)

    def _switch(self, value: Operand, cases: dict[int, Block], default: Block, todo: list[Stmt | str]) -> None:
        text, size = (value.text, "i128") if value.wide else (self.number(value), "i64")
        labels = {k: self.new_label() for k in cases if value.wide or INT64_MIN <= k <= INT64_MAX}
        otherwise, join = self.new_label(), self.new_label()
        table = " ".join(f"{size} {k}, label %{label}" for k, label in labels.items())
        self.line(f"switch {size} {text}, label %{otherwise} [{table}]")
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

"""Blocks of a step program as bodies of C functions.

A number is computed as `numbers` says. What may fail, and what would be nested too deeply for a compiler or a reader,
becomes a statement of its own before the statement that needs it. Expressions and blocks are walked by generators that
yield what is to be done first (`performed`), so that depth is never a crash.
"""

from __future__ import annotations

import re
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, TypeVar

from llfsm_verify.extensions.c.names import EVENTS, KEPT, Names, identifier
from llfsm_verify.extensions.c.numbers import BITS, KINDS, PROMOTED, RAW, WIDE, Number, holds, kind_of, literal, written
from llfsm_verify.extensions.c.reading import readable
from llfsm_verify.extensions.c.texts import WIDTH
from llfsm_verify.plug import (
    INT64_MAX,
    INT64_MIN,
    Block,
    Const,
    Emit,
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
    branches,
    common_bits,
    distinct_nodes,
    expressions,
    fits,
)

T = TypeVar("T")
Work = Generator[Any, Any, T]
"""Yields work that is to be done first, and gets its result."""

OURS = frozenset({"state", "inputs", "status", "wide"})
"""Names that locals cannot have, since functions use them."""
DEEPEST = 10
"""Operations within each other in one expression."""
_SIGNS: dict[OpName, str] = {"add": "+", "sub": "-", "mul": "*", "div": "/", "mod": "%"}
_COMPARISONS: dict[OpName, str] = {"eq": "==", "ne": "!=", "lt": "<", "le": "<=", "gt": ">", "ge": ">="}
_OPPOSITES: dict[OpName, OpName] = {"eq": "ne", "ne": "eq", "lt": "ge", "ge": "lt", "gt": "le", "le": "gt"}
_ACTIONS = {"entry": "on_entry", "exit": "on_exit"}


def performed(work: Work[T]) -> T:
    """The result of work, and of all that it yields."""
    stack, given = [work], None
    while True:
        try:
            stack.append(stack[-1].send(given))
            given = None
        except StopIteration as done:
            stack.pop()
            given = done.value
            if not stack:
                return given  # type: ignore[no-any-return]


_UNSEEN = re.compile(
    "[\\x00-\\x1f\\x7f-\\x9f\\u061c\\u200b-\\u200f\\u2028-\\u202e\\u2060-\\u206f\\ud800-\\udfff\\ufeff]"
)
"""Controls, marks of direction, and halves of characters."""


def one_line(text: str) -> str:
    """A text as one line, with `?` for what cannot be seen and what turns the direction of what follows."""
    return _UNSEEN.sub("?", " ".join(text.split()))


def titled(name: str, mark: str) -> str:
    """A name, cut where it is long, and a mark: a comment of them is not broken, so the mark is in the first line."""
    line = one_line(name)
    return f"{line if len(comment(line)) <= WIDTH - len(f'. {mark}') else f'{line[:28]}…'}. {mark}"


def comment(text: str) -> str:
    """A comment of one line; nothing in the text can end it."""
    plain = one_line(text).replace("*/", "* /").replace("/*", "/ *").rstrip("\\")
    return f"/* {re.sub('[?](?=[?])', '? ', plain)} */"


def _call(name: str, *arguments: str) -> str:
    return f"{name}({', '.join(arguments)})"


def _truth(number: Number) -> Number:
    if number.value is not None:
        return Number("true" if number.value else "false", "bool", 0, 1, value=number.value)
    if number.type == "bool":
        return number
    text = f"{number.operand}.low" if number.type == WIDE else number.operand
    return Number(f"{text} != 0", "bool", 0, 1, False, depth=number.depth)


class BlockText:
    """Writes the body of one function, which may call those of `texts`."""

    def __init__(self, names: Names) -> None:
        self._names = names
        self._choices = {c.name: c for c in names.program.choices}
        self._lines: list[str] = []
        self._top: list[str] = []
        self._locals: dict[str, Number] = {}
        self._once: set[str] = set()
        self._used: set[str] = set(KEPT) | OURS
        self._scopes: dict[str, Block] = {}

    def text(self, block: Block) -> list[str]:
        """The lines of the body."""
        block = readable(block)
        self._once = _assigned_once(block)
        self._scopes = _scopes(block)
        performed(self._block(block))
        return _without_unread([*self._top, *self._lines], self._used - KEPT - OURS)

    def values(self, wanted: Mapping[str, Expr]) -> tuple[list[str], list[str]]:
        """Lines that compute truth values, each after a comment that tells its name, and what each is in C."""
        texts = []
        for name, expression in wanted.items():
            number = _truth(performed(self._value(expression)))
            if number.value is None:
                self._line(comment(name))
                local = self._fresh("atom")
                self._line(f"const bool {local} = {number.text};")
            texts.append(number.text if number.value is not None else local)
        return self._lines, texts

    # ------------------------------------------------------------ lines

    def _line(self, text: str) -> None:
        self._lines.append(text)

    def _fail(self, condition: str, status: str, why: str = "") -> None:
        self._lines += [f"if ({condition}) {{", f"    return {status};{' ' * bool(why)}{why}", "}"]

    def _overflow(self, condition: str) -> None:
        self._fail(condition, f"{self._names.prefix}_OVERFLOW")

    @contextmanager
    def _inside(self) -> Iterator[list[str]]:
        """Lines that are collected apart, one level deeper."""
        outside, self._lines = self._lines, []
        inside = self._lines
        try:
            yield inside
        finally:
            self._lines = outside
            inside[:] = [f"    {line}" for line in inside]

    def _fresh(self, wanted: str) -> str:
        name, number = identifier(wanted), 1
        while name in self._used:
            number += 1
            name = f"{identifier(wanted)}_{number}"
        self._used.add(name)
        return name

    def _named(self, number: Number) -> Number:
        """The same, computed before."""
        kind = kind_of(number.low, number.high) if number.type == RAW else number.type
        name = self._fresh("part")
        self._line(f"const {kind} {name} = {self._as(number, kind).text};")
        return Number(name, kind, number.low, number.high)

    def _made(self, number: Number) -> Number:
        return self._named(number) if number.depth > DEEPEST else number

    # ------------------------------------------------------------ conversions

    def _as(self, number: Number, kind: str) -> Number:
        """The same value in another type, which has it."""
        low, high, depth = number.low, number.high, number.depth
        if number.value is not None:
            return Number(written(number.value, kind), kind, low, high)
        if number.type in (kind, "enumerator"):
            return number
        if kind == "bool":
            return _truth(number)
        if kind == WIDE:
            text = _call("wide_signed", self._as(number, "int64_t").text)
            return Number(text, WIDE, low, high, depth=depth)
        if number.type == WIDE:
            text = f"{number.operand}.low"
            if kind == "uint64_t":
                return Number(text, kind, low, high, depth=depth)
            text = _call("signed64", text)
            return Number(text if kind == "int64_t" else f"({kind}){text}", kind, low, high, depth=depth)
        return Number(f"({kind}){number.operand}", kind, low, high, depth=depth)

    def _side(self, number: Number, kind: str, sign: str, *, left: bool) -> str:
        """As a side of an operator whose sides are of this type. What is an `int` there stays as it is."""
        if kind == "int16_t" and number.type in PROMOTED:
            return number.beside(sign, left=left)
        return self._as(number, kind).operand

    def _sides(self, args: Sequence[Number], kind: str, sign: str) -> str:
        """Two operands and the operator between them."""
        return f" {sign} ".join(self._side(n, kind, sign, left=i == 0) for i, n in enumerate(args))

    def _held(self, number: Number, kind: Type) -> Number:
        """As values of a type are held; an `int` that does not fit ends the step."""
        if isinstance(kind, Int):
            if kind.boolean and number.low >= 0 and number.high <= 1:
                return self._as(number, "bool")
            return self._as(number, kind_of(kind.low, kind.high))
        return self._int(number)

    def _int(self, number: Number) -> Number:
        """As an `int`. One that does not fit ends the step."""
        if number.value is not None and not INT64_MIN <= number.value <= INT64_MAX:
            self._overflow("true")
            return literal(0)
        if number.type == WIDE:
            number = self._named(number)
            self._overflow(f"!{_call('wide_fits', number.text, number.signed)}")
        low, high = max(number.low, INT64_MIN), min(number.high, INT64_MAX)
        made = self._as(number, "int64_t")
        return Number(made.text, made.type, low, high, made.simple, made.value, made.depth)

    # ------------------------------------------------------------ expressions

    def _value(self, expression: Expr) -> Work[Number]:
        match expression:
            case Const(value, _):
                if not fits(value, value):
                    self._overflow("true")
                    value = 0
                return literal(value)
            case Local() as local:
                return self._locals[local.name]
            case Get(name, None, _):
                return self._names.load(name)
            case Get(name, index, _):
                assert index is not None
                position = self._as((yield self._value(index)), "size_t").text
                return self._names.load(name, position)
            case Op("not", (Op(inner, sides, _),), kind) if inner in _OPPOSITES:
                opposite: Number = yield self._value(Op(_OPPOSITES[inner], sides, kind))
                return opposite
            case Op(op, args, _):
                bits = common_bits(expression) if op == "add" else None
                given: list[Number] = []
                if bits is not None:
                    for number in bits:
                        given.append((yield self._value(number)))  # noqa: PERF401 - a comprehension cannot yield
                    return self._made(self._common(*given))
                for argument in args:
                    given.append((yield self._value(argument)))  # noqa: PERF401 - a comprehension cannot yield
                if op in ("eq", "ne"):
                    given = self._enumerators(args, given)
                return self._made(self._apply(expression, given))
            case Ite():
                chosen: Number = yield self._either(expression)
                return chosen
        raise ValueError(f"unknown expression {expression}")

    def _enumerators(self, args: Sequence[Expr], given: list[Number]) -> list[Number]:
        """With the name of a value that a variable is compared with."""
        for i, j in ((0, 1), (1, 0)):
            variable, constant = args[i], args[j]
            if isinstance(variable, Get) and isinstance(constant, Const):
                name = self._names.value_name(variable.var, constant.value)
                if name is not None:
                    given[j] = Number(name, "enumerator", constant.value, constant.value)
        return given

    def _either(self, ite: Ite) -> Work[Number]:
        condition = _truth((yield self._value(ite.condition)))
        if condition.value is not None:
            chosen: Number = yield self._value(ite.then if condition.value else ite.otherwise)
            return chosen if isinstance(ite.type, Int) else self._int(chosen)
        sides: list[tuple[Number, list[str]]] = []
        for side in (ite.then, ite.otherwise):
            with self._inside() as lines:
                number: Number = yield self._value(side)
                number = number if isinstance(ite.type, Int) else self._int(number)
            sides.append((number, lines))
        (then, first), (otherwise, second) = sides
        low, high = min(then.low, otherwise.low), max(then.high, otherwise.high)
        truth = all(n.type == "bool" or n.value in (0, 1) for n in (then, otherwise)) and low >= 0 and high <= 1
        if truth and not first and not second and {then.value, otherwise.value} == {0, 1}:
            return condition if then.value else self._logic("not", [condition], condition.depth + 1)
        kind = "bool" if truth else kind_of(low, high)
        texts = [self._as(n, kind) for n in (then, otherwise)]
        if not first and not second:
            if texts[0].text == texts[1].text:
                return texts[0]
            text = f"{condition.operand} ? {texts[0].operand} : {texts[1].operand}"
            depth = 1 + max(condition.depth, then.depth, otherwise.depth)
            raw = RAW if kind == "int16_t" else kind
            return self._made(Number(text, raw, low, high, False, depth=depth))
        name = self._fresh("part")
        self._line(f"{kind} {name};")
        self._lines += [f"if ({condition.text}) {{", *first, f"    {name} = {texts[0].text};", "} else {"]
        self._lines += [*second, f"    {name} = {texts[1].text};", "}"]
        return Number(name, kind, low, high)

    def _apply(self, operation: Op, args: Sequence[Number]) -> Number:
        op, kind = operation.op, operation.type
        depth = 1 + max(a.depth for a in args)
        if op in ("and", "or", "xor", "not"):
            return self._logic(op, [_truth(a) for a in args], depth)
        if op in _COMPARISONS:
            return self._compare(op, args[0], args[1], depth)
        if not isinstance(kind, Int):
            return self._checked(op, [self._int(a) for a in args], depth)
        if op == "wrap":
            return self._wrap(args[0], kind, depth)
        low, high = kind.low, kind.high
        if op in ("div", "mod") and args[1].low == args[1].high == 0:
            return literal(0)  # nothing gets here
        for known, other in ((args[0], args[-1]), (args[-1], args[0])):
            if (op == "add" and known.value == 0) or (op == "div" and known is args[1] and known.value == 1):
                return other
        computed = kind_of(min(low, *(a.low for a in args)), max(high, *(a.high for a in args)))
        if computed == WIDE:
            return self._narrowed(self._wide(op, args, high), low, high, depth)
        return self._plain(op, args, kind, computed, depth)

    def _plain(self, op: OpName, args: Sequence[Number], kind: Int, computed: str, depth: int) -> Number:
        """Arithmetic of up to 64 bits."""
        low, high = kind.low, kind.high
        if op == "mod" and args[1].low <= -1 <= args[1].high and args[0].low == -(1 << BITS[computed] - 1):
            if computed == "int64_t":
                both = (self._as(a, computed).text for a in args)
                return Number(_call("mod64", *both), computed, low, high, depth=depth)
            computed = KINDS[KINDS.index(computed) + 1]
        seen = op in ("div", "mod") and args[1].low <= 0 <= args[1].high and args[1].depth
        if op in ("min", "max", "abs") or seen:  # compilers warn of divisors that they see to be 0, in what never runs
            texts = (self._as(a, computed).text for a in args)
            return Number(_call(f"{op}_{BITS[computed]}", *texts), computed, low, high, depth=depth)
        sign = _SIGNS.get(op, "")
        text = self._sides(args, computed, sign) if sign else f"-{self._as(args[0], computed).operand}"
        return Number(text, RAW if computed == "int16_t" else computed, low, high, False, depth=depth, sign=sign)

    def _logic(self, op: OpName, args: Sequence[Number], depth: int) -> Number:
        if op == "not":
            (only,) = args
            if only.value is not None:
                return _truth(literal(1 - only.value))
            return Number(f"!{only.operand}", "bool", 0, 1, depth=depth)
        left, right = args
        sign = {"and": "&&", "or": "||", "xor": "!="}[op]
        for known, other in ((left, right), (right, left)):
            if known.value is not None:
                if op == "xor":
                    return self._logic("not", [other], depth) if known.value else other
                return other if bool(known.value) == (op == "and") else known
        if left.text == right.text:
            return _truth(literal(0)) if op == "xor" else left
        text = f"{left.beside(sign, left=True)} {sign} {right.beside(sign, left=False)}"
        return Number(text, "bool", 0, 1, False, depth=depth, sign=sign)

    def _compare(self, op: OpName, left: Number, right: Number, depth: int) -> Number:
        known = _decided(op, left, right)
        if known is not None:
            return _truth(literal(int(known)))
        if op in ("eq", "ne"):
            for truth, other in ((left, right), (right, left)):
                if truth.type == "bool" and other.value is not None:
                    return truth if bool(other.value) == (op == "eq") else self._logic("not", [truth], depth)
        if left.type == right.type == "bool" and op in ("eq", "ne"):
            return Number(f"{left.operand} {_COMPARISONS[op]} {right.operand}", "bool", 0, 1, False, depth=depth)
        kind = kind_of(min(left.low, right.low), max(left.high, right.high))
        if kind != WIDE:
            sign = _COMPARISONS[op]
            return Number(self._sides((left, right), kind, sign), "bool", 0, 1, False, depth=depth, sign=sign)
        sides = [(self._as(n, WIDE).text, n.signed) for n in (left, right)]
        if op in ("gt", "le"):
            sides.reverse()
        name = "wide_equal" if op in ("eq", "ne") else "wide_less"
        text = _call(name, *sides[0], *sides[1])
        return Number(f"{'!' * (op in ('ne', 'le', 'ge'))}{text}", "bool", 0, 1, depth=depth)

    def _checked(self, op: OpName, args: Sequence[Number], depth: int) -> Number:
        """Arithmetic of an `int`."""
        low, high = INT64_MIN, INT64_MAX
        texts = [a.text for a in (self._as(a, "int64_t") for a in args)]
        if op in ("min", "max"):
            return Number(_call(f"{op}_64", *texts), "int64_t", low, high, depth=depth)
        if op in ("div", "mod") and args[1].low == args[1].high == 0:
            return literal(0)  # nothing gets here
        if op == "mod":
            return Number(_call("mod64", *texts), "int64_t", low, high, depth=depth)
        if op == "neg":
            op, texts = "sub", ["0", *texts]
        name = self._fresh("part")
        self._line(f"int64_t {name};")
        self._overflow(f"!{_call(f'{op}64', *texts, f'&{name}')}")
        return Number(name, "int64_t", low, high)

    def _wrap(self, number: Number, kind: Int, depth: int) -> Number:
        low, high, size = kind.low, kind.high, kind.high - kind.low + 1
        if high > INT64_MAX:
            word = f"{self._word(number, 64)} - {written(low, 'uint64_t')}" if low else self._word(number, 64)
            if size < 1 << 64:
                word = f"({word}) & {written(size - 1, 'uint64_t')}"
            made = _call("wide_of", "0", word)
            if low:
                made = _call("wide_add", made, self._as(literal(low), WIDE).text)
            return Number(made, WIDE, low, high, depth=depth)
        bits = 32 if holds("int32_t", min(low, number.low), max(high, number.high)) else 64
        if low == 0:
            word = f"{self._word(number, bits)} & {written(high, f'uint{bits}_t')}"
            return Number(f"(int{bits}_t)({word})", f"int{bits}_t", low, high, depth=depth)
        constants = (written(n % (1 << bits), f"uint{bits}_t") for n in (low, size - 1))
        text = _call(f"wrap{bits}", self._word(number, bits), *constants)
        return Number(text, f"int{bits}_t", low, high, depth=depth)

    def _word(self, number: Number, bits: int) -> str:
        """The lowest bits of a number, without a sign."""
        if number.value is not None:
            return written(number.value % (1 << bits), f"uint{bits}_t")
        if number.type == RAW:
            number = self._as(number, "int16_t")
        return self._as(number, f"uint{bits}_t").text

    def _common(self, left: Number, right: Number) -> Number:
        """The common bits of two numbers without a sign."""
        high, depth = min(left.high, right.high), 1 + max(left.depth, right.depth)
        kind = kind_of(0, max(left.high, right.high))
        if kind == WIDE:
            texts = [self._as(number, "uint64_t").operand for number in (left, right)]
            return self._narrowed(_call("wide_of", "0", " & ".join(texts)), 0, high, depth)
        text = self._sides((left, right), kind, "&")
        return Number(text, RAW if kind == "int16_t" else kind, 0, high, False, depth=depth)

    def _narrowed(self, wide: str, low: int, high: int, depth: int) -> Number:
        """A result of 128 bits, in 64 where it fits."""
        made = Number(wide, WIDE, low, high, depth=depth)
        return self._as(made, "int64_t") if holds("int64_t", low, high) else made

    def _wide(self, op: OpName, args: Sequence[Number], high: int) -> str:
        """Arithmetic of 128 bits. All its sides and its result have a sign, or none has."""
        texts = [self._as(a, WIDE).text for a in args]
        signed = "false" if max(high, *(a.high for a in args)) >= 1 << 127 else "true"
        if op in ("min", "max"):
            return _call(f"wide_{op}", texts[0], signed, texts[1], signed)
        return _call(f"wide_{op}", *texts, *([signed] if op in ("div", "mod", "abs") else []))

    # ------------------------------------------------------------ statements

    def _block(self, block: Block) -> Work[None]:
        for number, statement in enumerate(block):
            following = block[number + 1] if number + 1 < len(block) else None
            if isinstance(statement, Emit):
                told = self._told(statement, following)
                self._lines += [told] if told else []
                if statement.kind in self._names.counted:
                    self._line(f"state->{EVENTS}[{self._names.counted.index(statement.kind)}]++;")
            else:
                yield self._statement(statement, block)

    def _statement(self, statement: Stmt, block: Block) -> Work[None]:
        match statement:
            case Set():
                yield self._store(statement)
            case Let(local, value):
                number: Number = yield self._value(value)
                self._assign(local, self._held(number, local.type), block)
            case Sample(local, choice) if local.name in self._once:
                self._locals[local.name] = self._names.sample(self._choices[choice])
            case Sample(local, choice):
                self._assign(
                    local, self._names.sample(self._choices[choice]), block, f"in_{self._choices[choice].source}"
                )
            case If():
                yield self._if(statement)
            case Switch():
                yield self._switch(statement)
            case Fault(fault, when):
                site = self._names.program.faults[fault]
                where = "" if site.span is None else f"{site.span}: "
                condition = _truth((yield self._value(when)))
                if condition.value != 0:
                    self._fail(condition.text, str(fault + 1), comment(f"{where}{site.code} {site.message}"))

    def _told(self, emit: Emit, following: Stmt | None) -> str:
        """The comment on what happens there, in the next statement."""
        machine = self._names.program.machines[emit.machine]
        numbers = [argument.value if isinstance(argument, Const) else None for argument in emit.args]
        if emit.kind == "guard" and len(numbers) > 1 and numbers[0] is not None and numbers[1] is not None:
            transitions = machine.transitions[numbers[0]] if numbers[0] < len(machine.transitions) else ()
            if numbers[1] < len(transitions):
                span = transitions[numbers[1]].span
                where = "" if span is None else f"{span}: "
                return comment(f"{where}{machine.transition_text(numbers[0], numbers[1])}")
        if emit.kind in ("entry", "exit", "internal", "on_suspend", "on_resume"):
            if (
                following is None
                or isinstance(following, Emit)
                or (isinstance(following, Set) and "$" in following.var)
            ):
                return ""  # nothing of it is left
            return comment(_ACTIONS.get(emit.kind, emit.kind))
        return (
            comment(emit.kind)
            if emit.kind in ("suspend", "resume", "restart", "enter", "load", "unload", "refused")
            else ""
        )

    def _store(self, store: Set) -> Work[None]:
        number: Number = yield self._value(store.value)
        field = self._names.fields[store.var]
        index = ""
        if store.index is not None:
            index = f"[{self._as((yield self._value(store.index)), 'size_t').text}]"
        if not isinstance(field.var.type, Int):
            number = self._int(number)
        name = None if number.value is None else self._names.value_name(store.var, number.value)
        self._line(f"state->{field.path}{index} = {name or self._as(number, field.type).text};")

    def _assign(self, local: Local, number: Number, block: Block, wanted: str = "") -> None:
        kind = local.type
        held = self._as(number, _type_of(kind))
        if local.name in self._locals:
            self._line(f"{self._locals[local.name].text} = {held.text};")
            return
        name = self._fresh(wanted or local.name)
        low, high = (kind.low, kind.high) if isinstance(kind, Int) else (INT64_MIN, INT64_MAX)
        self._locals[local.name] = Number(name, held.type, low, high)
        if self._scopes.get(local.name) is block:
            self._line(f"{'const ' * (local.name in self._once)}{held.type} {name} = {held.text};")
        else:
            self._top.append(f"{held.type} {name} = {self._as(literal(0), held.type).text};")
            self._line(f"{name} = {held.text};")

    def _if(self, statement: If) -> Work[None]:
        condition = _truth((yield self._value(statement.condition)))
        if condition.value is not None:
            chosen = statement.then if condition.value else statement.otherwise
            yield self._block(chosen)
            return
        with self._inside() as then:
            yield self._block(statement.then)
        with self._inside() as otherwise:
            yield self._block(statement.otherwise)
        if has_code(then):
            self._lines += [f"if ({condition.text}) {{", *then]
            self._lines += _otherwise(otherwise)
        elif has_code(otherwise):
            opposite = self._logic("not", [condition], 0)
            self._lines += [f"if ({opposite.text}) {{", *otherwise, "}"]

    def _switch(self, statement: Switch) -> Work[None]:
        number: Number = yield self._value(statement.value)
        if number.value is not None:
            yield self._block(dict(statement.cases).get(number.value, statement.default))
            return
        if number.type == WIDE:
            number = self._named(number)
        elif number.type in (RAW, "bool"):
            number = self._as(number, kind_of(number.low, number.high))
        arms: list[tuple[int | None, list[str]]] = []
        for key, block in (*statement.cases, (None, statement.default)):
            with self._inside() as lines:
                yield self._block(block)
            if key is None or number.low <= key <= number.high:
                arms.append((key, lines))
        if not any(has_code(lines) for _, lines in arms):
            return
        if number.type == WIDE:
            self._chain(number, arms)
            return
        full = [(key, lines) for key, lines in arms if has_code(lines)]
        key, lines = full[0]
        if len(full) == 1 and key is not None:
            (side,) = self._enumerators([statement.value, Const(key, Int(key, key))], [number, literal(key)])[1:]
            condition = self._compare("eq", number, side, 0)
            self._lines += [f"if ({condition.text}) {{", *lines, "}"]
            return
        self._line(f"switch ({number.text}) {{")
        variable = statement.value.var if isinstance(statement.value, Get) else ""
        for key, lines in arms:
            name = (self._names.value_name(variable, key) if variable and key is not None else None) or key
            head = "default:" if key is None else f"case {name}:"
            self._lines += [f"{head} {{", *lines, "    break;", "}"] if has_code(lines) else [head, "    break;"]
        self._line("}")

    def _chain(self, number: Number, arms: Sequence[tuple[int | None, list[str]]]) -> None:
        """A decision on 128 bits."""
        for position, (key, lines) in enumerate(arms):
            if key is None:
                self._lines += ["} else {" if position else "{", *lines, "}"]
                continue
            constant = literal(key)
            same = _call("wide_equal", number.text, number.signed, self._as(constant, WIDE).text, constant.signed)
            self._lines += [f"{'} else ' if position else ''}if ({same}) {{", *lines]


def _otherwise(lines: Sequence[str]) -> list[str]:
    """What follows a branch: another decision, or a block."""
    if not has_code(lines):
        return ["}"]
    ends = [line for line in lines if not line.startswith("     ")]
    if (
        ends[0].startswith("    if (")
        and ends[-1] == "    }"
        and all(line.startswith("    } else") for line in ends[1:-1])
    ):
        return [f"}} else {lines[0].strip()}", *(line[4:] for line in lines[1:])]
    return ["} else {", *lines, "}"]


def has_code(lines: Sequence[str]) -> bool:
    """Whether some line is no comment."""
    return any(not line.lstrip().startswith("/*") for line in lines)


def _type_of(kind: Type) -> str:
    """The type of a local."""
    if not isinstance(kind, Int):
        return "int64_t"
    return "bool" if kind.boolean else kind_of(kind.low, kind.high)


def _decided(op: OpName, left: Number, right: Number) -> bool | None:
    """The truth of a comparison, where the intervals or equal texts tell it."""
    if left.text == right.text and left.value is None:
        return op in ("eq", "le", "ge")
    less, equal, more = left.low < right.high, left.high >= right.low and left.low <= right.high, left.high > right.low
    possible = {"eq": (equal,), "ne": (less, more), "lt": (less,), "le": (less, equal), "gt": (more,)}
    if not any(possible.get(op, (more, equal))):
        return False
    opposite = {"eq": (less, more), "ne": (equal,), "lt": (more, equal), "le": (more,), "gt": (less, equal)}
    same_point = left.low == left.high == right.low == right.high
    if same_point:
        return op in ("eq", "le", "ge")
    return None if any(opposite.get(op, (less,))) else True


def _assigned_once(block: Block) -> set[str]:
    """The locals to which one statement assigns."""
    counts: dict[str, int] = {}
    todo: list[Stmt] = list(block)
    while todo:
        statement = todo.pop()
        if isinstance(statement, Let | Sample):
            counts[statement.local.name] = counts.get(statement.local.name, 0) + 1
        elif isinstance(statement, If | Switch):
            todo += [s for branch in branches(statement) for s in branch]
    return {name for name, count in counts.items() if count == 1}


def _scopes(block: Block) -> dict[str, Block]:
    """By local: the block in which all of its uses are, where it begins with the local's first statement there."""
    paths: dict[str, tuple[Block, ...]] = {}
    seen: set[int] = set()
    first: dict[str, Block] = {}
    todo: list[tuple[Stmt, tuple[Block, ...]]] = [(s, (block,)) for s in reversed(block)]
    while todo:
        statement, path = todo.pop()
        named = [n.name for e in expressions(statement) for n in distinct_nodes(e) if isinstance(n, Local)]
        if isinstance(statement, Let | Sample):
            named.append(statement.local.name)
            first.setdefault(statement.local.name, path[-1])
        for name in named:
            known = paths.setdefault(name, path)
            shared = next((i for i, (a, b) in enumerate(zip(known, path, strict=False)) if a is not b), None)
            paths[name] = known[: min(len(known), len(path))] if shared is None else known[:shared]
        for inner in reversed(branches(statement)) if isinstance(statement, If | Switch) else ():
            if id(inner) in seen:
                return {}  # a block in two places is no place
            seen |= {id(inner)} if inner else set()
            todo += [(s, (*path, inner)) for s in reversed(inner)]
    return {name: path[-1] for name, path in paths.items() if first.get(name) is path[-1]}


def _without_unread(lines: list[str], names: set[str]) -> list[str]:
    """The lines without those that only give values to names which nothing reads."""
    while True:
        counts = dict.fromkeys(names, 0)
        given: dict[str, str] = {}
        for line in lines:
            head = re.match(r"\s*(?:(?:const )?\w+ )?(\w+)(?: = |;\Z)", line)
            rest = line.partition("/*")[0]
            if head is not None and head[1] in names and not line.lstrip().startswith("return "):
                given[line] = head[1]
                rest = rest[head.end() :]
            for word in re.findall(r"(?<![>.\w])[A-Za-z_]\w*", rest):
                if word in counts:
                    counts[word] += 1
        kept = [line for line in lines if line not in given or counts[given[line]]]
        if len(kept) == len(lines):
            return lines
        lines = kept

"""Expressions, lowered: typed trees become pure expressions, and the statements that must come before them."""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from functools import partial
from math import floor
from typing import TYPE_CHECKING
from typing import Literal as OneOf

from llfsm_verify.diagnostics import Span
from llfsm_verify.language import types as lt
from llfsm_verify.language.trees import nodes
from llfsm_verify.language.typed import (
    After,
    AtState,
    Binary,
    Choose,
    Conditional,
    Expression,
    Field,
    LetIn,
    Literal,
    Lookup,
    Query,
    Read,
    ReadLocal,
    Unary,
)
from llfsm_verify.language.types import digits_of
from llfsm_verify.program.program import (
    BOOL,
    Block,
    Const,
    Expr,
    Fault,
    Get,
    If,
    Int,
    Let,
    Local,
    Sample,
    Set,
    Stmt,
    Type,
)
from llfsm_verify.program.terms import (
    FALSE,
    TRUE,
    TooWideError,
    conjunction,
    const,
    found,
    interval,
    ite,
    may_overflow,
    op,
    wrapped,
)
from llfsm_verify.semantics.bits import bitwise, shifted
from llfsm_verify.semantics.context import Context
from llfsm_verify.semantics.letters import formula
from llfsm_verify.semantics.numbers import binary, choose, rescaled, sides, square_root, too_wide, unary
from llfsm_verify.semantics.queries import at_state, query
from llfsm_verify.semantics.samples import update
from llfsm_verify.semantics.storage import element_names, labels, leaves, machine_type
from llfsm_verify.semantics.vocabulary import Control, InputScalar

if TYPE_CHECKING:
    from llfsm_verify.semantics.parts import Parts

SURROUNDINGS = {"F001": "F011", "F002": "F012", "F003": "F013", "F004": "F014", "F005": "F015"}
"""The codes of faults in the model of the surroundings."""


@dataclass(frozen=True, slots=True)
class Location:
    """A scalar to load or store: a variable (its element `index`), or an element of an input."""

    var: str
    index: Expr | None
    type: lt.ScalarType
    among: tuple[tuple[Expr, str], ...] = ()
    """Elements of an input that it may be, each with the condition that it is that one."""


@dataclass(slots=True)
class Code:
    """Statements under construction for one machine, in one state, in one block.

    `fresh` tells (at run time) that the clock restarted in this ringlet; `entering`: the code runs before the snapshot
    that `snapshot: after_entry` takes. `clock_state` is the state whose bounds an untimed clock counts.
    """

    context: Context
    control: Control
    clock_state: int
    fresh: Expr = FALSE
    entering: bool = False
    out: list[Stmt] = field(default_factory=list)
    locals: dict[str, Expr] = field(default_factory=dict)
    _temporaries: list[int] = field(default_factory=lambda: [0])

    # ------------------------------------------------ blocks

    def inner(self) -> Code:
        """Code for a nested block that shares this one's locals."""
        return Code(
            self.context, self.control, self.clock_state, self.fresh, self.entering, [], self.locals, self._temporaries
        )

    def local(self, name: str, kind: Type) -> Local:
        """A local. Those of the model of the surroundings, whose states are in one block, have their state's number."""
        return Local(name if self.control.scheduled else f"{self.control.machine.name}.{self.clock_state}.{name}", kind)

    def temporary(self, kind: Type) -> Local:
        self._temporaries[0] += 1
        return self.local(f"t{self._temporaries[0]}", kind)

    def let(self, value: Expr) -> Expr:
        """`value` in a temporary, unless it is a constant or a local already."""
        if isinstance(value, (Const, Local)):
            return value
        local = self.temporary(value.type)
        self.out.append(Let(local, value))
        return local

    def branch(self, condition: Expr, then: Block, otherwise: Block = ()) -> None:
        if isinstance(condition, Const):
            self.out.extend(then if condition.value else otherwise)
        elif then or otherwise:
            self.out.append(If(condition, then, otherwise))

    def fault_when(self, condition: Expr, code: str, message: str, span: Span, variable: str = "") -> None:
        if condition != FALSE:
            if not self.control.scheduled:
                code, message = SURROUNDINGS[code], f"{message} (in the model of the surroundings)"
            self.out.append(Fault(self.context.fault(code, message, span, variable), condition))

    def watch(self, e: Expression, value: Expr) -> None:
        """Where steps are probed, and not only whole decisions: tell what the operand `e` is here."""
        if self.context.probes is not None and not self.context.probes.decisions:
            self._watch(e, value)

    def _watch(self, e: Expression, value: Expr) -> None:
        probes = self.context.probes
        if probes is not None and self.control.scheduled:
            from llfsm_verify.semantics.probes import Probe

            self.out.extend(probes.watch(Probe("condition", self.control.machine.name, e.span), value, e))

    def condition(self, e: Expression) -> Expr:
        """The value of the condition of an `if` or a `?:`; where steps are probed, it is told."""
        value = self._decision(e, "condition", -1, -1)
        self._watch(e, value)
        return value

    def _decision(self, e: Expression, kind: OneOf["guard", "condition"], state: int, number: int) -> Expr:
        """The value of a decision; where decisions are probed, its conditions are told."""
        probes, machine = self.context.probes, self.control.machine.name
        if probes is None or not probes.decisions or not self.control.scheduled or machine in probes.passed_over:
            return self.expr(e)
        from llfsm_verify.semantics.decisions import decided
        from llfsm_verify.semantics.probes import Probe

        span = self.control.states[state].transitions[number].span if kind == "guard" else e.span
        return decided(self, e, Probe(kind, machine, span, state, number), probes)

    # ------------------------------------------------ expressions

    def expr(self, e: Expression) -> Expr:
        """A pure expression with the value of `e`, after appending what must happen before it.

        Raises DiagnosticError (E193) where what is calculated may leave 128 bits.
        """
        try:
            value = self._expr(e)
        except TooWideError:
            raise too_wide(e.span) from None
        parts, probes = self.context.parts, self.context.probes
        if probes is not None and id(e) in probes.marks:
            value = self.let(value)
            self.out.append(Let(probes.marks[id(e)], value))
        return value if parts is None or not parts.open else self._told(parts, e, value)

    def guard(self, e: Expression, state: int, number: int) -> Expr:
        """The value of the guard of transition `number` of a state, in a temporary."""
        parts = self.context.parts
        if parts is None:
            return self.let(self._decision(e, "guard", state, number))
        parts.open = True
        try:
            return self.let(self.expr(e))
        finally:
            parts.open = False

    def _told(self, parts: Parts, e: Expression, value: Expr) -> Expr:
        """Where the parts of guards are told: what this one is."""
        from llfsm_verify.semantics.parts import asks_clock, is_told

        if not is_told(e):
            return value
        value = self.let(value)
        if asks_clock(e):
            name = self.control.var("clock" if self.context.arrangement.timing == "timed" else "age")
            if name in self.context.variables:
                clock = Get(name, None, self.context.variables[name].type)
                self.out.append(parts.tell_clock(self.control, clock))
        self.out.append(parts.tell(self.control, e, value))
        return value

    def _expr(self, e: Expression) -> Expr:
        if isinstance(e, Literal):
            return Const(int(e.value), BOOL) if isinstance(e.type, lt.BoolType) else const(int(e.value))
        if isinstance(e, Read):
            assert not isinstance(e.type, (lt.ArrayType, lt.RecordType))
            return self.load(self.place(e))
        if isinstance(e, ReadLocal):
            return self.locals[e.local.key]
        if isinstance(e, Unary):
            return self._square_root(e) if e.op == "sqrt" else unary(e, self._held(e, self.expr(e.operand)))
        if isinstance(e, Binary):
            return self._binary(e)
        if isinstance(e, Conditional):
            return self._conditional(e)
        if isinstance(e, LetIn):
            return self._let_in(e)
        if isinstance(e, Lookup):
            return self._lookup(e)
        if isinstance(e, After):
            return self._after(e)
        if isinstance(e, Choose):
            return self.choose(e, e.target)
        if isinstance(e, AtState):
            return at_state(self.context, e.machine, e.state)
        if isinstance(e, Query):
            return query(self.context, e.kind, e.machine)
        raise AssertionError(f"only properties may ask {e}")

    def _binary(self, e: Binary) -> Expr:
        if e.op in ("and", "or"):
            return self._short_circuit(e)
        if e.op in ("eq", "ne") and isinstance(e.left.type, (lt.ArrayType, lt.RecordType)):
            assert isinstance(e.left, Read)
            assert isinstance(e.right, Read)
            lefts = [self.load(p) for p in self.places(e.left)]
            rights = [self.load(p) for p in self.places(e.right)]
            same = conjunction([op("eq", a, b) for a, b in zip(lefts, rights, strict=True)])
            return same if e.op == "eq" else op("not", same)
        left, right = self.expr(e.left), self.expr(e.right)
        if e.op in ("div", "mod"):
            right = self.divisor(right, e.right, e.span)
        if isinstance(e.type, lt.FixedType):
            return self.bits(e.op, e.type, left, right, e.right, e.span)
        return binary(e, left, right)

    def bits(self, name: str, kind: lt.FixedType, left: Expr, right: Expr, written: Expression, span: Span) -> Expr:
        """A bit operation in a width; `written`: the right side."""
        if name not in ("shl", "shr"):
            return bitwise(name, kind, left, right, self.let)
        count = self.let(right)
        bounds = interval(count)
        if bounds is None or bounds[0] < 0 or bounds[1] >= kind.bits:
            outside = op("or", op("lt", count, const(0)), op("ge", count, const(kind.bits)))
            message = f"shift by too much: {text_of(written)} is not in 0..{kind.bits - 1}"
            self.fault_when(outside, "F005", message, span)
        return shifted(name, kind, left, count, self.let)

    def _held(self, e: Unary, value: Expr) -> Expr:
        """What is rounded is read twice, so it is kept in a temporary."""
        return self.let(value) if e.op in ("floor", "ceil", "round") else value

    def _square_root(self, e: Unary) -> Expr:
        value = self.let(self.expr(e.operand))
        bounds = interval(value)
        if bounds is None or bounds[0] < 0:
            message = f"square root of a negative number: {text_of(e.operand)} is below 0"
            self.fault_when(op("lt", value, const(0)), "F004", message, e.span)
            value = self.let(op("max", value, const(0)))
        return square_root(value, digits_of(e.operand.type), self.let, e.span)

    def divisor(self, value: Expr, written: Expression, span: Span) -> Expr:
        """`value` as a divisor: a fault where it is zero."""
        value = self.let(value)
        bounds = interval(value)
        if bounds is None or bounds[0] <= 0 <= bounds[1]:
            self.fault_when(op("eq", value, const(0)), "F002", f"division by zero: {text_of(written)} is 0", span)
            if bounds == (0, 0):
                return const(1)  # never reached: the fault before it always holds
        return value

    def _short_circuit(self, e: Binary) -> Expr:
        left = self.expr(e.left)
        self.watch(e.left, left)
        inner = self.inner()
        right = inner.expr(e.right)
        inner.watch(e.right, right)
        assert e.op in ("and", "or")
        if not inner.out and not may_overflow(right):
            return op(e.op, left, right)
        if isinstance(left, Const):
            if bool(left.value) == (e.op == "or"):
                return left
            self.out.extend(inner.out)
            return right
        result = self.temporary(BOOL)
        then: Block = (*inner.out, Let(result, right))
        known: Block = (Let(result, Const(int(e.op == "or"), BOOL)),)
        self.out.append(If(left, then, known) if e.op == "and" else If(left, known, then))
        return result

    def _conditional(self, e: Conditional) -> Expr:
        condition = self.condition(e.condition)
        first, second = self.inner(), self.inner()
        then, otherwise = sides(e, first.expr(e.then), second.expr(e.otherwise))
        if not first.out and not second.out:
            return choose(condition, then, otherwise)
        if isinstance(condition, Const):
            self.out.extend(first.out if condition.value else second.out)
            return then if condition.value else otherwise
        result = self.temporary(choose(condition, then, otherwise).type)
        self.out.append(If(condition, (*first.out, Let(result, then)), (*second.out, Let(result, otherwise))))
        return result

    def _let_in(self, e: LetIn) -> Expr:
        """For probes it is one condition. Of the parts that are told there are only those that read something."""
        parts, probes = self.context.parts, self.context.probes
        is_open, muted = parts is not None and parts.open, probes is not None and probes.muted
        if probes is not None:
            probes.muted = True
        for local, defined in e.definitions:
            if parts is not None:
                parts.open = is_open and any(isinstance(n, (Read, AtState, Query)) for n in nodes(defined))
            self.locals[local.key] = self.let(self.expr(defined))
        if parts is not None:
            parts.open = False
        value = self.expr(e.value)
        if parts is not None:
            parts.open = is_open
        if probes is not None:
            probes.muted = muted
        return value

    def _lookup(self, e: Lookup) -> Expr:
        size = len(e.values)
        index = self._inside(e.index, size, f"index outside the table `{e.table}`", e.span)
        return self.let(found(index, [const(value) for value in e.values]))

    def _after(self, e: After) -> Expr:
        arrangement = self.context.arrangement
        if arrangement.timing == "untimed":
            assert isinstance(e.bound, Fraction)
            rank = self.control.bounds[self.clock_state].index(e.bound)
            age = Get(self.control.var("age"), None, self.context.variables[self.control.var("age")].type)
            return op("and", op("not", self.fresh), op("gt", age, const(rank)))
        assert arrangement.cycle_ms is not None
        if isinstance(e.bound, Fraction):
            ticks = floor(e.bound / arrangement.cycle_ms)
            if ticks < 0:
                return TRUE
            return op("gt", self._clock(), const(ticks))
        bound = self.expr(e.bound)
        period = arrangement.cycle_ms
        return op(
            "gt",
            op("mul", self._clock(), const(period.numerator)),
            op("mul", bound, const(e.scale * period.denominator)),
        )

    def choose(self, e: Choose, target: str) -> Expr:
        """Any of the values, for `target`: one of a range, or one by its number in the list."""
        digits = digits_of(e.type)
        kind = BOOL if isinstance(e.type, lt.BoolType) else Int(e.low, e.high, digits=digits)
        if e.low == e.high:
            return Const(e.low, kind)
        names = labels(e.type)
        if isinstance(e.values, tuple) and len(e.values) <= kind.high - kind.low:
            texts = tuple(names[v] if names else lt.decimal_text(v, digits) for v in e.values)
            number = self._chosen(target, Int(0, len(e.values) - 1), texts)
            value: Expr = Const(e.values[-1], kind)
            for i, one in reversed(list(enumerate(e.values[:-1]))):
                value = ite(op("eq", number, const(i)), Const(one, kind), value)
            return value
        return self._chosen(target, kind, names[kind.low : kind.high + 1])

    def _chosen(self, target: str, kind: Int, texts: tuple[str, ...]) -> Local:
        local = self.temporary(kind)
        self.out.append(Sample(local, self.context.new_choice(self.control.machine.name, target, kind, texts)))
        return local

    def _clock(self) -> Expr:
        name = self.control.var("clock")
        return Get(name, None, self.context.variables[name].type)

    # ------------------------------------------------ variables

    def place(self, read: Read) -> Location:
        """The scalar that a read or an assignment's target means, its indices checked."""
        place = self._descend(read)
        assert len(place) == 1
        return place[0]

    def places(self, read: Read) -> list[Location]:
        """All scalars of a record or array, in order of declaration."""
        return self._descend(read)

    def _descend(self, read: Read) -> list[Location]:
        if self._is_input(read):
            return self._input_places(read)
        kind, suffix, index = read.variable.type, "", None
        flat: Expr | None = index
        for step in read.path:
            if isinstance(step, Field):
                assert isinstance(kind, lt.RecordType)
                suffix += f".{step.name}"
                kind = kind.fields[step.index][1]
            else:
                assert isinstance(kind, lt.ArrayType)
                position = self._inside(step.value, step.size, "index outside the array", step.span)
                flat = position if flat is None else op("add", op("mul", flat, const(step.size)), position)
                kind = kind.element
        if not isinstance(kind, (lt.ArrayType, lt.RecordType)):
            return [Location(read.variable.name + suffix, flat, kind)]
        result = []
        for leaf in leaves(kind):
            name = read.variable.name + suffix + leaf.suffix
            if leaf.length is None:
                assert not isinstance(kind, lt.ArrayType)
                result.append(Location(name, flat, leaf.type))
                continue
            for i in range(leaf.length):
                within = const(i) if flat is None else op("add", op("mul", flat, const(leaf.length)), const(i))
                result.append(Location(name, within, leaf.type))
        return result

    def _inside(self, written: Expression, size: int, what: str, span: Span) -> Expr:
        """The value of an index: a fault where there is nothing."""
        index = self.let(self.expr(written))
        bounds = interval(index)
        if bounds is None or bounds[0] < 0 or bounds[1] >= size:
            outside = op("or", op("lt", index, const(0)), op("ge", index, const(size)))
            self.fault_when(outside, "F003", f"{what}: {text_of(written)} is not in 0..{size - 1}", span)
        return index

    def load(self, place: Location) -> Expr:
        scalar = self.context.inputs.get(place.var)
        if scalar is not None:
            return self.read_input(scalar)
        if place.var.startswith("?"):
            return self._input_choice[place.var]
        return Get(place.var, place.index, machine_type(place.type))

    def store(self, place: Location, value: Expr, digits: int, span: Span, text: str) -> None:
        """Store a number of so many digits (0: anything else)."""
        value = self.stored(place.type, value, digits, span, text)
        if not place.among:
            self.out.append(Set(place.var, place.index, value))
            return
        value = self.let(value)
        for condition, name in place.among:
            self.branch(condition, (Set(name, None, value),))

    def stored(self, kind: lt.ScalarType, value: Expr, digits: int, span: Span, text: str) -> Expr:
        """`value`, of so many digits, as a variable of the type holds it: truncated, wrapped, or a fault."""
        try:
            value = rescaled(value, digits, digits_of(kind))
        except TooWideError:
            raise too_wide(span) from None
        if isinstance(kind, lt.FixedType):
            return wrapped(value, Int(kind.low, kind.high))
        if isinstance(kind, lt.RangeType | lt.DecimalType):
            assert kind.low is not None
            assert kind.high is not None
            bounds = interval(value)
            if bounds is None or bounds[0] < kind.low or bounds[1] > kind.high:
                value = self.let(value)
                outside = op("or", op("lt", value, const(kind.low)), op("gt", value, const(kind.high)))
                message = f"value outside its range: {text} is declared {kind}"
                self.fault_when(outside, "F001", message, span, text)
        return value

    # ------------------------------------------------ inputs

    def _is_input(self, read: Read) -> bool:
        return read.variable.scope == "whiteboard" and read.variable.name in self.context.input_variables

    def _input_places(self, read: Read) -> list[Location]:
        """The elements a path into an input can mean; a variable index selects among its elements at run time."""
        candidates: list[tuple[Expr, str]] = [(TRUE, read.variable.name)]
        kind = read.variable.type
        for step in read.path:
            if isinstance(step, Field):
                assert isinstance(kind, lt.RecordType)
                kind = kind.fields[step.index][1]
                candidates = [(c, f"{n}.{step.name}") for c, n in candidates]
            else:
                assert isinstance(kind, lt.ArrayType)
                kind = kind.element
                index = self._inside(step.value, step.size, "index outside the array", step.span)
                candidates = [
                    (op("and", c, op("eq", index, const(i))), f"{n}[{i}]")
                    for c, n in candidates
                    for i in range(step.size)
                ]
        # Where the index is outside for sure, the fault comes before, and any element will do.
        candidates = [(c, n) for c, n in candidates if c != FALSE] or candidates[:1]
        result = []
        for suffix, scalar in element_names("", kind):
            if len(candidates) == 1:
                result.append(Location(candidates[0][1] + suffix, None, scalar))
            else:
                result.append(self._select(candidates, suffix, scalar))
        return result

    def _select(self, candidates: list[tuple[Expr, str]], suffix: str, scalar: lt.ScalarType) -> Location:
        result = self.temporary(machine_type(scalar))
        chain: Block = ()
        for condition, name in reversed(candidates):
            inner = self.inner()
            value = inner.read_input(self.context.inputs[name + suffix])
            arm: Block = (*inner.out, Let(result, value))
            chain = arm if not chain else (If(condition, arm, chain),)
        self.out.extend(chain)
        name = f"?{result.name}"
        self._input_choice[name] = result
        return Location(name, None, scalar, tuple((condition, n + suffix) for condition, n in candidates))

    @property
    def _input_choice(self) -> dict[str, Expr]:
        return self.locals

    def read_input(self, scalar: InputScalar) -> Expr:
        """The value of an input here and now, by the profile's snapshot."""
        context, snapshot = self.context, self.context.arrangement.profile.snapshot
        if not self.control.scheduled:
            return Get(scalar.name, None, scalar.type)  # an input that it writes itself
        if snapshot == "after_entry" and self.entering and scalar.varies:
            name = f"{self.control.machine.name}.$seen.{scalar.name}"
            return Get(name, None, scalar.type)
        if scalar.stored:
            held = Get(scalar.name, None, scalar.type)
            self._sampled(scalar, held)
            return held
        choice = context.new_read(scalar) if snapshot == "none" else scalar.choice
        local = self.temporary(scalar.type)
        self.out.append(Sample(local, choice))
        if scalar.name in context.mentioned and context.tracks_samples:
            self.out.append(Set(f"{scalar.name}.$value", None, local))
            self.out.append(Set(f"{scalar.name}.$sampled", None, TRUE))
        self._sampled(scalar, local)
        return local

    def _sampled(self, scalar: InputScalar, value: Expr) -> None:
        """With `snapshot: none` an evaluated read is a sample."""
        context, machine = self.context, self.control.machine.name
        if context.arrangement.profile.snapshot == "none":
            lower = partial(formula, context)
            self.out += update(context, machine, scalar.source, {scalar.name: value}, lower)


def text_of(e: Expression) -> str:
    """What the user wrote, on one line."""
    return " ".join(e.span.text.split())

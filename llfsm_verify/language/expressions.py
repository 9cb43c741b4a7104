"""Name resolution and type checking of expressions: a tree and a scope in, a typed tree or a diagnostic out."""

from __future__ import annotations

import difflib
from dataclasses import replace
from fractions import Fraction
from typing import Literal as OneOf
from typing import cast

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Fragment, Span
from llfsm_verify.language import syntax, typed
from llfsm_verify.language.codes import HINTS
from llfsm_verify.language.constants import evaluate, interval
from llfsm_verify.language.habits import member_meant, word_meant
from llfsm_verify.language.scope import (
    ALL_DONE,
    CALLS,
    CHOOSE,
    COMMANDS,
    ELSEWHERE,
    FUNCTIONS,
    NO_MACHINES,
    ROUNDING,
    MachineSignature,
    Scope,
    Table,
    did_you_mean,
    near_names,
)
from llfsm_verify.language.trees import nodes
from llfsm_verify.language.types import (
    MAX_DIGITS,
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
    decimal_text,
    digits_of,
    is_integer,
    is_number,
)

BOOL = BoolType()
INT = IntType()
INT64_MIN, INT64_MAX = -(1 << 63), (1 << 63) - 1
LOWEST, HIGHEST = -(1 << 127), (1 << 128) - 1
"""Of the numbers in which values between are computed: 128 bits, with a sign or without."""

_ARITHMETIC = {"+": "add", "-": "sub", "*": "mul", "/": "div", "%": "mod"}
_COMPARISON = {"==": "eq", "!=": "ne", "<": "lt", "<=": "le", ">": "gt", ">=": "ge"}
_LOGIC = {"&&": "and", "||": "or"}
_BITS = {"&": "band", "|": "bor", "^": "bxor", "<<": "shl", ">>": "shr"}

BitOp = OneOf["band", "bor", "bxor", "shl", "shr"]
BinaryOp = (
    OneOf["add", "sub", "mul", "div", "mod", "min", "max", "eq", "ne", "lt", "le", "gt", "ge", "and", "or", "xor"]
    | BitOp
)


_BRACKETS = "put brackets around the part to which `!` or the comparison applies"
_COUNTING = f"write `… ? 1 : 0` to count a condition, or {_BRACKETS}"
ROUNDED = "write `floor(…)`, `ceil(…)` or `round(…)`"


class ExpressionChecker:
    """Checks expressions of one fragment in one scope. Every method raises DiagnosticError at the first error."""

    def __init__(self, scope: Scope, fragment: Fragment) -> None:
        self.scope = scope
        self.fragment = fragment
        self.locals: list[dict[str, tuple[typed.Local, bool]]] = []
        """Local variables of the open blocks by name, and whether they may be assigned."""

    # ------------------------------------------------------------ helpers

    def span(self, first: syntax.Node, last: syntax.Node | None = None) -> Span:
        return self.fragment.span(first.start, (last or first).end)

    def fail(self, code: str, message: str, node: syntax.Node, hint: str | None = None) -> DiagnosticError:
        return DiagnosticError(Diagnostic(code, message, self.span(node), hint=hint or HINTS.get(code)))

    def local(self, name: str) -> tuple[typed.Local, bool] | None:
        for block in reversed(self.locals):
            if name in block:
                return block[name]
        return None

    def visible(self) -> list[str]:
        """Names of the variables and constants that can be read here."""
        inner = [name for block in reversed(self.locals) for name in block]
        return [*inner, *self.scope.variables, *self.scope.constants, *self.scope.knowledge]

    def assignable(self) -> list[str]:
        """Names of the variables that can be written here."""
        inner = [name for block in reversed(self.locals) for name in block]
        inputs = frozenset() if self.scope.surroundings else self.scope.inputs
        return [*inner, *(name for name in self.scope.variables if name not in inputs)]

    # ------------------------------------------------------------ expectations

    def boolean(self, node: syntax.Expression, beside: syntax.Expression | None = None) -> typed.Expression:
        """A condition; `beside` is the one that `&&` or `||` joins to it."""
        e = self.expression(node, BOOL)
        if isinstance(e.type, BoolType):
            return e
        if is_number(e.type):
            if self.scope.integer_guards and is_integer(e.type):
                return typed.Binary("ne", e, typed.Literal(0, INT, e.span), BOOL, e.span)
            text = self.span(node).text
            text = f"({text})" if _is_loose(node) else text
            shown = f"`{text} != 0`" if len(text) <= 60 and "\n" not in text else "`… != 0`"
            shown = {"0": "`false`", "1": "`true`"}.get(text, shown)
            shown = self._compared_alike(node, beside) or shown
            what = "an integer" if is_integer(e.type) else "a decimal"
            raise self.fail("E120", f"a condition is expected, but this is {what}", node, f"write {shown}")
        alike = self._compared_alike(node, beside)
        hint = f"write {alike}" if alike else "compare it with a value"
        raise self.fail("E120", f"a condition is expected, but this is {a_type(e.type)}", node, hint)

    def _compared_alike(self, node: syntax.Expression, beside: syntax.Expression | None) -> str | None:
        """What is meant by `4` in `x == 3 || 4`."""
        if not isinstance(beside, syntax.Chain) or beside.operators[0] not in _COMPARISON or _is_loose(node):
            return None
        return f"`{self.span(beside.operands[0]).text} {beside.operators[0]} {self.span(node).text}`"

    def integer(self, node: syntax.Expression) -> typed.Expression:
        e = self.expression(node, INT)
        if not is_integer(e.type):
            hint = _COUNTING if isinstance(e.type, BoolType) else None
            hint = _rounded(e) if isinstance(e.type, DecimalType) else hint
            raise self.fail("E121", f"an integer is expected, but this is {a_type(e.type)}", node, hint)
        return e

    def number(self, node: syntax.Expression) -> typed.Expression:
        """An integer or a decimal."""
        e = self.expression(node, INT)
        if not is_number(e.type):
            hint = _COUNTING if isinstance(e.type, BoolType) else None
            raise self.fail("E121", f"a number is expected, but this is {a_type(e.type)}", node, hint)
        return e

    def value(self, node: syntax.Expression, target: Type, what: str) -> typed.Expression:
        """An expression that can be stored in a variable of type `target`."""
        e = self.expression(node, target)
        if isinstance(target, DecimalType) and is_number(e.type):
            self._storable(node, e, target, what)
            return e
        if is_integer(target) and is_integer(e.type):
            constant = evaluate(e)
            if constant is not None and isinstance(target, RangeType) and not target.low <= constant <= target.high:
                raise self.fail("E128", f"{int(constant)} is outside {what}'s range {target}", node)
            if constant is not None and isinstance(target, IntType) and not INT64_MIN <= constant <= INT64_MAX:
                message = f"{int(constant)} does not fit in 64 bits with a sign, as an `int` has to"
                raise self.fail("E128", message, node, "give it the type `uint64`")
            return e
        if e.type != target:
            hint = None
            if isinstance(target, BoolType) and is_number(e.type):
                hint = "write `true` or `false`" if isinstance(node, syntax.Integer) else "write `… != 0`"
            elif is_number(target) and isinstance(e.type, BoolType):
                hint = "write `… ? 1 : 0`"
            elif is_integer(target) and isinstance(e.type, DecimalType):
                hint = _rounded(e)
            elif isinstance(target, EnumType):
                hint = _one_of(target.values)
            raise self.fail("E123", f"{what} is {a_type(target)}, but this value is {a_type(e.type)}", node, hint)
        return e

    def _storable(self, node: syntax.Expression, e: typed.Expression, target: DecimalType, what: str) -> None:
        """A literal is a multiple of the step, and a constant inside the range."""
        constant = evaluate(e)
        if constant is None or target.low is None or target.high is None:
            return
        steps = constant * 10**target.digits
        if isinstance(e, typed.Literal) and steps != int(steps):
            near = decimal_text(int(steps), target.digits)
            step = decimal_text(1, target.digits)
            message = f"`{self.span(node).text}` is not a multiple of {step}, the step of {what}"
            raise self.fail("E160", message, node, f"write {near}, or give {what} a smaller step")
        if not target.low <= int(steps) <= target.high:
            shown = decimal_text(int(steps), target.digits)
            raise self.fail("E128", f"{shown} is outside {what}'s range {target}", node)

    # ------------------------------------------------------------ expressions

    def expression(self, node: syntax.Expression, expected: Type | None = None) -> typed.Expression:
        """Check `node`; `expected` only helps to tell which enumeration a bare enumerator belongs to, and how many bits
        a number has that is written down."""
        match node:
            case syntax.Integer():
                return self._number(node, node, False)
            case syntax.Truth():
                return typed.Literal(node.value, BOOL, self.span(node))
            case syntax.Path():
                return self.path(node, expected)
            case syntax.Prefix():
                return self._prefix(node, expected)
            case syntax.Chain():
                return self._chain(node, expected)
            case syntax.Ternary():
                return self._ternary(node, expected)
            case syntax.StateTest():
                return self._at(node)
            case syntax.Call():
                return self.call(node)
            case syntax.Interval():
                raise self.fail("E155", "a range of values is allowed only in `choose(…)`", node)
            case syntax.Decimal():
                return self._decimal(node, node, False)

    def _at(self, node: syntax.StateTest) -> typed.Expression:
        machine, span = self.machine_named(node.machine), self.span(node)
        numbers = dict.fromkeys(self.state_of(machine, state) for state in node.states)
        tests: list[typed.Expression] = [typed.AtState(machine.name, n, BOOL, span) for n in numbers]
        return self._balanced(tests, "or", BOOL)

    def _number(self, node: syntax.Integer, whole: syntax.Node, negative: bool) -> typed.Literal:
        text = node.text
        if len(text) > 1 and text.isdigit() and text[0] == "0":
            raise self.fail(
                "E134", f"`{text[:40]}` starts with 0", node, "write it without the leading 0 (octal in C), or as 0x…"
            )
        value = int(text, 0) if len(text) <= 160 else HIGHEST + 1
        value = -value if negative else value
        if not LOWEST <= value <= HIGHEST:
            raise self.fail("E129", "this number does not fit in 128 bits", node)
        return typed.Literal(value, INT, self.span(whole))

    def _decimal(self, node: syntax.Decimal, whole: syntax.Node, negative: bool) -> typed.Literal:
        before, _, after = node.text.partition(".")
        if len(before) > 1 and before[0] == "0":
            raise self.fail("E134", f"`{node.text[:40]}` starts with 0", node, "write it without the leading 0")
        if len(after) > MAX_DIGITS:
            message = f"this number has more than {MAX_DIGITS} digits after the point"
            raise self.fail("E129", message, node, "write fewer digits")
        value = int(before + after) if len(before) <= 40 else HIGHEST + 1
        value = -value if negative else value
        if not LOWEST <= value <= HIGHEST:
            raise self.fail("E129", "this number does not fit in 128 bits", node)
        return typed.Literal(value, DecimalType(len(after)), self.span(whole))

    def _prefix(self, node: syntax.Prefix, expected: Type | None) -> typed.Expression:
        if node.operator == "!":
            return typed.Unary("not", self.boolean(node.operand), BOOL, self.span(node))
        if node.operator == "-" and isinstance(node.operand, syntax.Integer):
            return self._number(node.operand, node, True)
        if node.operator == "-" and isinstance(node.operand, syntax.Decimal):
            return self._decimal(node.operand, node, True)
        if node.operator == "~":
            (operand,), kind = self.bit_operands((node.operand,), expected)
            return typed.Unary("bnot", operand, kind, self.span(node))
        value = self.number(node.operand)
        return value if node.operator == "+" else typed.Unary("neg", value, _number_type(value), self.span(node))

    def _ternary(self, node: syntax.Ternary, expected: Type | None) -> typed.Expression:
        condition = self.boolean(node.condition)
        if self._needs_context(node.then) and not self._needs_context(node.otherwise):
            otherwise = self.expression(node.otherwise, expected)
            then = self.expression(node.then, expected if isinstance(expected, FixedType) else otherwise.type)
        else:
            then = self.expression(node.then, expected)
            otherwise = self.expression(node.otherwise, expected if expected is not None else then.type)
        if isinstance(then.type, ArrayType | RecordType):
            raise self.fail(
                "E153", f"`?:` cannot choose between values of type {then.type}", node, "use `if` and two assignments"
            )
        result: ScalarType = then.type
        if then.type != otherwise.type:
            if not (is_number(then.type) and is_number(otherwise.type)):
                raise self.fail(
                    "E122", f"the two sides of `:` have different types, {then.type} and {otherwise.type}", node
                )
            result = _number_type(then, otherwise)
        return typed.Conditional(condition, then, otherwise, result, self.span(node))

    # ------------------------------------------------------------ chains of operators

    def _chain(self, node: syntax.Chain, expected: Type | None) -> typed.Expression:
        first = node.operators[0]
        if first in _LOGIC:
            parts = [self.boolean(o, before) for before, o in zip((None, *node.operands), node.operands, strict=False)]
            return self._balanced(parts, cast(BinaryOp, _LOGIC[first]), BOOL)
        if first in _COMPARISON:
            return self._comparison(node)
        if first in ("<<", ">>"):
            return self._shift(node, expected)
        if first in _BITS:
            parts, kind = self.bit_operands(node.operands, expected)
            return self._balanced(parts, cast(BinaryOp, _BITS[first]), kind)
        parts = [self.number(o) for o in node.operands]
        for operator, operand, part in zip(node.operators, node.operands[1:], parts[1:], strict=True):
            if operator in "/%":
                self.divisor(operand, part)
            if operator == "%" and any(isinstance(p.type, DecimalType) for p in parts):
                raise self.fail("E121", "`%` needs integers", node, ROUNDED)
        if first in "+-":
            return self._sum(parts, [True, *(o == "+" for o in node.operators)], 0, len(parts))
        return self._product(parts, node)

    # ------------------------------------------------------------ bits

    def bits(self, node: syntax.Expression, kind: FixedType) -> typed.Expression:
        """An operand of a bit operation: of the type `kind`, or of another whose values it has."""
        return self._as_bits(node, self._bit_operand(node, kind), kind)

    def _bit_operand(
        self, node: syntax.Expression, kind: FixedType | None, among: tuple[syntax.Expression, ...] = ()
    ) -> typed.Expression:
        """One `among` operands, beside others of the type `kind`. What `?:` chooses has the type of its sides and
        these."""
        if isinstance(node, syntax.Ternary):
            condition = self.boolean(node.condition)
            (then, otherwise), found = self._of_one_width((node.then, node.otherwise), kind)
            return typed.Conditional(condition, then, otherwise, found or INT, self.span(node))
        e = self.expression(node, kind or INT)
        if isinstance(e.type, BoolType):
            message = "`& | ^ ~` are for the bits of numbers, but this is a bool"
            raise self.fail("E105", message, node, self._brackets(node, among))
        if not is_integer(e.type):
            hint = _rounded(e) if isinstance(e.type, DecimalType) else None
            raise self.fail("E161", f"bits need an integer of a fixed width, but this is {a_type(e.type)}", node, hint)
        return e

    def _brackets(self, node: syntax.Expression, among: tuple[syntax.Expression, ...]) -> str | None:
        """Where brackets belong in ``u & 3 == 1``, of which `node` is the comparison; None: it is something else."""
        if not (isinstance(node, syntax.Chain) and node.operators[0] in _COMPARISON and len(among) > 1):
            return None
        if node is not among[-1] or node.start != node.operands[0].start or len(node.operands) > 2:
            return None
        text = f"({self.span(among[0], node.operands[0]).text}) {node.operators[0]} {self.span(node.operands[1]).text}"
        return f"write `{text}`" if len(text) <= 80 and "\n" not in text else None

    def _as_bits(self, node: syntax.Expression, e: typed.Expression, kind: FixedType) -> typed.Expression:
        if e.type == kind:
            return e
        bounds = interval(e)
        if bounds is not None and kind.low <= bounds[0] and bounds[1] <= kind.high:
            return e
        if bounds is not None and bounds[0] == bounds[1]:
            raise self.fail("E128", f"{bounds[0]} is outside {kind} ({kind.low}..{kind.high})", node)
        raise self.fail("E161", f"this is {a_type(e.type)}, but the bits here are those of {kind}", node)

    def bit_operands(
        self, nodes: tuple[syntax.Expression, ...], expected: Type | None
    ) -> tuple[list[typed.Expression], FixedType]:
        """The operands of one operation, all of one fixed-width type, and the type."""
        # What is written down alone has the bits of what it is stored in or compared with.
        bare = isinstance(expected, FixedType) and all(self._is_written_down(node) for node in nodes)
        operands, kind = self._of_one_width(nodes, cast(FixedType, expected) if bare else None)
        if kind is None:
            raise self.fail(
                "E161", f"bits need an integer of a fixed width, but this is {a_type(operands[0].type)}", nodes[0]
            )
        return operands, kind

    def _of_one_width(
        self, nodes: tuple[syntax.Expression, ...], kind: FixedType | None
    ) -> tuple[list[typed.Expression], FixedType | None]:
        """The operands in order, and the type of fixed width that has the values of all, `kind` among them; None: none
        of them has one. What is written down comes last: it takes the type of the others."""
        found: dict[int, typed.Expression] = {}
        for i in sorted(range(len(nodes)), key=lambda i: self._needs_width(nodes[i])):
            found[i] = self._bit_operand(nodes[i], kind, nodes)
            kind = _widest(kind, found[i].type)
        operands = [found[i] for i in range(len(nodes))]
        if kind is not None:
            operands = [self._as_bits(node, e, kind) for node, e in zip(nodes, operands, strict=True)]
        return operands, kind

    def _needs_width(self, node: syntax.Expression) -> int:
        """How much an operand takes its type from others: 0 not at all, 1 perhaps a part of it, 2 the whole of it."""
        return 2 if self._is_written_down(node) else int(isinstance(node, syntax.Ternary))

    def _is_written_down(self, node: syntax.Expression) -> bool:
        """Whether it consists of numbers and constants without a width, but for conditions and what shifts them."""
        match node:
            case syntax.Integer():
                return True
            case syntax.Prefix():
                return self._is_written_down(node.operand)
            case syntax.Chain():
                shifts = node.operators[0] in ("<<", ">>")
                return all(map(self._is_written_down, node.operands[:1] if shifts else node.operands))
            case syntax.Ternary():
                return self._is_written_down(node.then) and self._is_written_down(node.otherwise)
            case syntax.Path():
                constant = None if self.local(node.name.text) else self.scope.constants.get(node.name.text)
                return constant is not None and not isinstance(constant.type, FixedType)
        return False

    def shift_count(self, node: syntax.Expression, kind: FixedType) -> typed.Expression:
        """By how many bits a number of this type is shifted."""
        count = self.integer(node)
        constant = evaluate(count)
        if constant is not None and not 0 <= constant < kind.bits:
            hint = f"write a number from 0 to {kind.bits - 1}"
            raise self.fail("E131", f"{kind} cannot be shifted by {int(constant)} bits", node, hint)
        return count

    def _shift(self, node: syntax.Chain, expected: Type | None) -> typed.Expression:
        (result,), kind = self.bit_operands(node.operands[:1], expected)
        for operator, operand in zip(node.operators, node.operands[1:], strict=True):
            result = self._binary(cast(BinaryOp, _BITS[operator]), result, self.shift_count(operand, kind), kind)
        return result

    def divisor(self, node: syntax.Expression, divisor: typed.Expression) -> None:
        if evaluate(divisor) == 0:
            raise self.fail("E130", "division by zero", node)

    def _balanced(self, parts: list[typed.Expression], op: BinaryOp, result: ScalarType) -> typed.Expression:
        """An associative chain as a tree of logarithmic height; operands keep their order."""
        while len(parts) > 1:
            pairs = [self._binary(op, parts[i], parts[i + 1], result) for i in range(0, len(parts) - 1, 2)]
            parts = pairs + parts[len(pairs) * 2 :]
        return parts[0]

    def _binary(
        self, op: BinaryOp, left: typed.Expression, right: typed.Expression, result: ScalarType
    ) -> typed.Binary:
        return typed.Binary(op, left, right, result, Span(left.span.source, left.span.start, right.span.end))

    def _sum(self, parts: list[typed.Expression], plus: list[bool], low: int, high: int) -> typed.Expression:
        """The terms low … high - 1, the first taken as positive: exact integers let a sum be grouped at will, so a
        group after a minus has its signs turned."""
        if high - low == 1:
            return parts[low]
        middle = high - 1 if high - low <= 8 else (low + high) // 2
        left, sign = self._sum(parts, plus, low, middle), plus[middle]
        right = self._sum(parts, plus if sign else [not p for p in plus], middle, high)
        return self._arithmetic("add" if sign else "sub", left, right)

    def _product(self, parts: list[typed.Expression], node: syntax.Chain) -> typed.Expression:
        if all(o == "*" for o in node.operators):
            digits = sum(digits_of(p.type) for p in parts)
            if digits > MAX_DIGITS:
                hint = "keep a part of it in a variable with fewer digits"
                message = f"this product has {digits} digits after the point, more than {MAX_DIGITS}"
                raise self.fail("E129", message, node, hint)
            while len(parts) > 1:
                pairs = [self._arithmetic("mul", parts[i], parts[i + 1]) for i in range(0, len(parts) - 1, 2)]
                parts = [*pairs, *parts[len(pairs) * 2 :]]
            return parts[0]
        if len(parts) > 64:
            raise self.fail(
                "E107", "more than 64 factors with `/` or `%` among them", node, "use a variable for a part of it"
            )
        result = parts[0]
        for operator, part in zip(node.operators, parts[1:], strict=True):
            result = self._arithmetic(cast(BinaryOp, _ARITHMETIC[operator]), result, part)
            if digits_of(result.type) > MAX_DIGITS:
                raise self.fail("E129", f"this has more than {MAX_DIGITS} digits after the point", node)
        return result

    def _arithmetic(self, op: BinaryOp, left: typed.Expression, right: typed.Expression) -> typed.Binary:
        """An operation of two numbers with the type of its result."""
        digits = max(digits_of(left.type), digits_of(right.type))
        if op == "mul":
            digits = digits_of(left.type) + digits_of(right.type)
        elif op == "div":
            digits = digits_of(left.type)
        return self._binary(op, left, right, DecimalType(digits) if digits else INT)

    def _comparison(self, node: syntax.Chain) -> typed.Expression:
        if len(node.operators) > 1:
            a, b, c = (self.span(o).text for o in node.operands[:3])
            hint = (
                f"write `{a} {node.operators[0]} {b} && {b} {node.operators[1]} {c}`" if len(a + b + c) < 80 else None
            )
            raise self.fail("E106", "comparisons cannot be chained", node, hint)
        operator = node.operators[0]
        left_node, right_node = node.operands
        if isinstance(left_node, syntax.Prefix) and left_node.operator == "!" and not self.scope.integer_guards:
            negated = self.expression(left_node.operand, BOOL)
            if is_integer(negated.type):
                inner, right_text = self.span(left_node.operand).text, self.span(right_node).text
                message = "`!` takes only the condition next to it, and this is an integer"
                raise self.fail("E120", message, left_node.operand, f"write `!({inner} {operator} {right_text})`")
        if self._needs_context(left_node) and not self._needs_context(right_node):
            right = self.expression(right_node)
            left = self.expression(left_node, right.type)
        else:
            left = self.expression(left_node)
            right = self.expression(right_node, left.type)
        numbers = is_number(left.type) and is_number(right.type)
        if not numbers and left.type != right.type:
            hint = None
            if isinstance(left.type, BoolType) or isinstance(right.type, BoolType):
                hint = f"{_BRACKETS}, or compare a bool with `true` or `false`"
            raise self.fail("E122", f"{a_type(left.type)} cannot be compared with {a_type(right.type)}", node, hint)
        if operator not in ("==", "!=") and not numbers:
            raise self.fail("E152", f"values of type {left.type} have no order", node, "compare with `==` or `!=`")
        return typed.Binary(cast(BinaryOp, _COMPARISON[operator]), left, right, BOOL, self.span(node))

    def _needs_context(self, node: syntax.Expression) -> bool:
        """Whether only the other side of a comparison can tell what a bare enumerator means, or how many bits a number
        has that is written down."""
        if isinstance(node, syntax.Chain) and node.operators[0] in _BITS:
            return self._is_written_down(node)
        if isinstance(node, syntax.Ternary):
            return self._needs_context(node.then) and self._needs_context(node.otherwise)
        return isinstance(node, syntax.Path) and not node.steps and not self.is_value(node.name)

    def is_value(self, name: syntax.Name) -> bool:
        """Whether a bare name is a variable or constant (else it can only be an enumerator)."""
        scope, text = self.scope, name.text
        known = text in scope.variables or text in scope.constants or text in scope.knowledge
        return known or self.local(text) is not None

    # ------------------------------------------------------------ names

    def path(self, node: syntax.Path, expected: Type | None) -> typed.Expression:
        name = node.name.text
        if node.name.quoted:
            raise self.fail("E102", "guards and actions have no strings", node.name, f"write `{name}` without quotes")
        bound = self.local(name)
        if bound is not None:
            if node.steps:
                raise self.no_such_step(node.steps[0], bound[0].type)
            return typed.ReadLocal(bound[0], bound[0].type, self.span(node))
        if name in self.scope.variables:
            return self.read(self.scope.variables[name], node, node.steps)
        if name in self.scope.constants:
            constant = self.scope.constants[name]
            if node.steps:
                raise self.no_such_step(node.steps[0], constant.type)
            return typed.Literal(constant.value, constant.type, self.span(node))
        if name in self.scope.knowledge:
            return self.known(self.scope.knowledge[name], node, node.steps)
        if name in self.scope.tables:
            return self._lookup(self.scope.tables[name], node)
        if name == ALL_DONE and not node.steps:
            return self._all_done(node)
        return self.enumerator(node, expected)

    def known(
        self, entry: typed.LetIn, node: syntax.Path, steps: tuple[syntax.Member | syntax.Subscript, ...]
    ) -> typed.Expression:
        """What a theory says here."""
        if steps:
            raise self.no_such_step(steps[0], BOOL)
        if self.scope.surroundings and any(isinstance(n, typed.AtState | typed.Query) for n in nodes(entry)):
            message, hint = NO_MACHINES
            raise self.fail("E156", message, node, hint)
        return replace(entry, span=self.span(node))

    def _lookup(self, table: Table, node: syntax.Path) -> typed.Expression:
        if not node.steps or not isinstance(node.steps[0], syntax.Subscript):
            message = f"`{table.name}` is a table of {len(table.values)} numbers"
            raise self.fail("E162", message, node, f"write `{table.name}[i]` for one of them, counted from 0")
        if len(node.steps) > 1:
            raise self.no_such_step(node.steps[1], table.type)
        index = self.index(node.steps[0].index, len(table.values), "table")
        constant = evaluate(index)
        if constant is not None:
            return typed.Literal(table.values[int(constant)], table.type, self.span(node))
        return typed.Lookup(table.name, table.values, index, table.type, self.span(node))

    def _all_done(self, node: syntax.Path) -> typed.Expression:
        """Every machine that the state runs is done."""
        if not self.scope.runs:
            raise self.fail(
                "E159", "this state runs no machines", node, "write `runs: […]` beside the name of the state"
            )
        span = self.span(node)
        first, *rest = (typed.Query("done", name, BOOL, span) for name in self.scope.runs)
        found: typed.Expression = first
        for query in rest:
            found = typed.Binary("and", found, query, BOOL, span)
        return found

    def read(
        self, variable: typed.Variable, node: syntax.Node, steps: tuple[syntax.Member | syntax.Subscript, ...]
    ) -> typed.Read:
        """The part of `variable` that `steps` lead to."""
        kind: Type = variable.type
        path: list[typed.Field | typed.Index] = []
        for step in steps:
            if isinstance(step, syntax.Member) and isinstance(kind, RecordType):
                names = [n for n, _ in kind.fields]
                if step.name.text not in names:
                    hint = did_you_mean(step.name.text, names)
                    raise self.fail("E115", f"there is no field `{step.name.text}` in {kind}", step.name, hint)
                number = names.index(step.name.text)
                path.append(typed.Field(step.name.text, number))
                kind = kind.fields[number][1]
            elif isinstance(step, syntax.Subscript) and isinstance(kind, ArrayType):
                path.append(typed.Index(self.index(step.index, kind.size), kind.size, self.span(step)))
                kind = kind.element
            else:
                raise self.no_such_step(step, kind)
        return typed.Read(variable, tuple(path), kind, self.span(node))

    def index(self, node: syntax.Expression, size: int, what: str = "array") -> typed.Expression:
        index = self.integer(node)
        constant = evaluate(index)
        if constant is not None and not 0 <= constant < size:
            raise self.fail(
                "E131", f"index {int(constant)} is outside the {what}", node, f"write an index from 0 to {size - 1}"
            )
        return index

    def no_such_step(self, step: syntax.Member | syntax.Subscript, kind: Type) -> DiagnosticError:
        if isinstance(step, syntax.Subscript):
            return self.fail("E124", f"`[…]` needs an array, but this is {a_type(kind)}", step)
        return self.fail("E125", f"`.{step.name.text}` needs a record, but this is {a_type(kind)}", step)

    def enumerator(self, node: syntax.Path, expected: Type | None) -> typed.Expression:
        name = node.name.text
        qualifier = self.scope.types.get(name)
        if isinstance(qualifier, EnumType) and len(node.steps) == 1 and isinstance(node.steps[0], syntax.Member):
            member = node.steps[0].name
            if member.text not in qualifier.values:
                hint = did_you_mean(member.text, qualifier.values)
                raise self.fail("E114", f"{qualifier} has no value `{member.text}`", member, hint)
            return typed.Literal(qualifier.values.index(member.text), qualifier, self.span(node))
        owners = self.scope.enumerators.get(name, ())
        if node.steps or not (owners or isinstance(expected, EnumType)):
            if isinstance(expected, BoolType):
                near = None if near_names(name, self.visible()) else near_names(name, ["true", "false"])
                if name.lower() in ("true", "false", "yes", "no", "on", "off"):
                    near = "write `true` or `false`"
                if near is not None:
                    raise self.fail("E110", f"there is no variable `{name}` here", node.name, near)
            raise self.unknown(node)
        if isinstance(expected, EnumType):
            if name in expected.values:
                return typed.Literal(expected.values.index(name), expected, self.span(node))
            if not owners:
                message = f"there is neither a variable nor a value of {expected} called `{name}`"
                near = near_names(name, [*expected.values, *difflib.get_close_matches(name, self.visible())])
                raise self.fail("E110", message, node.name, near or _one_of(expected.values))
            others = " and ".join(str(o) for o in owners)
            near = did_you_mean(name, expected.values) or _one_of(expected.values)
            raise self.fail("E114", f"`{name}` is a value of {others}, not of {expected}", node, near)
        if len(owners) > 1:
            qualified = " or ".join(f"`{o}.{name}`" for o in owners)
            raise self.fail("E114", f"`{name}` is a value of several enumerations", node, f"write {qualified}")
        return typed.Literal(owners[0].values.index(name), owners[0], self.span(node))

    def unknown(self, node: syntax.Path, enumerators: tuple[str, ...] = ()) -> DiagnosticError:
        return self.no_variable(node, [*self.visible(), *enumerators, *self.scope.enumerators])

    def no_variable(self, node: syntax.Path, known: list[str]) -> DiagnosticError:
        """There is no variable of this name; `known` are those that could stand here."""
        name = node.name.text
        if name in self.scope.machines:
            instead = f"compare its state with `{name}@STATE`, or share a variable on the whiteboard"
            message = f"`{name}` is a machine, and others cannot read its variables"
            if node.steps and isinstance(node.steps[0], syntax.Member):
                member, machine = node.steps[0].name.text, self.scope.machines[name]
                meant = member_meant(name, member, machine.states, (*FUNCTIONS, *COMMANDS))
                known, shared = self.visible(), self.scope.variables.get(member)
                if name in ("self", self.scope.self_name):
                    message = f"`{name}` is this machine, and its variables are named without it"
                    meant = meant or (f"write `{member}`" if member in known else did_you_mean(member, known))
                elif shared is not None and shared.scope == "whiteboard":
                    meant = meant or f"`{member}` is on the whiteboard: write `{member}`"
                instead = meant or instead
            return self.fail("E148", message, node, instead)
        hint = self.state_meant(name) or word_meant(name, known)
        hint = hint or (f"write `{CALLS[name]}`" if name in FUNCTIONS else did_you_mean(name, known))
        return self.fail("E110", f"there is no variable `{name}` here", node.name, hint)

    def state_meant(self, name: str) -> str | None:
        """What to write when a state stands alone."""
        found = [machine for machine, signature in self.scope.machines.items() if name in signature.states]
        found = ["self"] if "self" in found else found[:3]
        return f"write {' or '.join(f'`{machine}@{name}`' for machine in found)}" if found else None

    def machine_named(self, name: syntax.Name) -> MachineSignature:
        if self.scope.surroundings:
            message, hint = NO_MACHINES
            raise self.fail("E156", message, name, hint)
        if name.text not in self.scope.machines and name.text in self.scope.unseen:
            hint = "read the inputs that it writes; only properties can refer to it"
            raise self.fail("E111", f"machines do not see the model of the surroundings, `{name.text}`", name, hint)
        if name.text not in self.scope.machines:
            known = [m for m in self.scope.machines if m != "self"]
            raise self.fail("E111", f"there is no machine `{name.text}`", name, did_you_mean(name.text, known))
        return self.scope.machines[name.text]

    def state_of(self, machine: MachineSignature, state: syntax.Name) -> int:
        number = machine.state(state.text)
        if number is None:
            hint = did_you_mean(state.text, machine.states)
            raise self.fail("E112", f"machine `{machine.name}` has no state `{state.text}`", state, hint)
        return number

    # ------------------------------------------------------------ functions

    def call(self, node: syntax.Call) -> typed.Expression:
        name = node.function.name.text
        span = self.span(node)
        if node.function.steps:
            raise self.unknown(node.function)
        match name:
            case "abs":
                (argument,) = self.arguments(node, 1)
                value = self.number(argument)
                return typed.Unary("abs", value, _number_type(value), span)
            case "min" | "max":
                left, right = self.arguments(node, 2)
                first, second = self.number(left), self.number(right)
                return typed.Binary(name, first, second, _number_type(first, second), span)
            case "floor" | "ceil" | "round":
                (argument,) = self.arguments(node, 1)
                value = self.number(argument)
                return typed.Unary(name, value, INT, span) if isinstance(value.type, DecimalType) else value
            case "sqrt":
                (argument,) = self.arguments(node, 1)
                value = self.number(argument)
                constant = evaluate(value)
                if constant is not None and constant < 0:
                    raise self.fail(
                        "E130", "square root of a negative number", argument, "write a number that is not negative"
                    )
                if interval(value) is None:
                    hint = "calculate it from variables with a range, such as 0..1000"
                    raise self.fail("E163", "nothing bounds this number, so nothing bounds its root", argument, hint)
                return typed.Unary("sqrt", value, _number_type(value), span)
            case "after":
                return self._after(node, 1000)
            case "after_ms":
                return self._after(node, 1)
            case "is_running" | "is_suspended":
                (argument,) = self.arguments(node, 1)
                machine = self.machine_argument(argument)
                return typed.Query("running" if name == "is_running" else "suspended", machine.name, BOOL, span)
            case "done":
                (argument,) = self.arguments(node, 1)
                machine = self.machine_argument(argument)
                if machine.nested is False:
                    hint = f"ask for `{machine.name}.finished`"
                    raise self.fail("E159", f"no state runs `{machine.name}`, so it is never done", node, hint)
                return typed.Query("done", machine.name, BOOL, span)
        if name in COMMANDS:
            raise self.fail("E140", f"`{name}` is a command and has no value", node, "put it into an action")
        if name == CHOOSE:
            hint = "write `x = choose(0..3);` in an action of a model, and then ask for `x`"
            raise self.fail("E155", "`choose(…)` must be the whole right side of an assignment", node, hint)
        if name in ("refused", "faulted", "fired"):
            raise self.fail("E145", f"only a property can ask for `{name}`", node)
        known = (*FUNCTIONS, *ROUNDING, *COMMANDS)
        near = None if name in ELSEWHERE else word_meant(name, known) or did_you_mean(name, known)
        raise self.fail("E113", f"there is no function `{name}`", node.function, near)

    def arguments(self, node: syntax.Call, count: int) -> tuple[syntax.Expression, ...]:
        if len(node.arguments) != count:
            name = self.span(node.function).text
            plural = "argument" if count == 1 else "arguments"
            message = f"`{name}` takes {count} {plural}, not {len(node.arguments)}"
            machine, _, function = name.rpartition(".")
            call = CALLS[function]
            call = f"{machine}{call.removeprefix('m')}" if machine and call.startswith("m.") else call
            raise self.fail("E117", message, node, f"write `{call}`")
        return node.arguments

    def machine_argument(self, node: syntax.Expression) -> MachineSignature:
        if not isinstance(node, syntax.Path) or node.steps:
            raise self.fail("E111", "the name of a machine is expected", node)
        return self.machine_named(node.name)

    def _after(self, node: syntax.Call, scale: int) -> typed.After:
        (argument,) = self.arguments(node, 1)
        bound: Fraction | typed.Expression
        if isinstance(argument, syntax.Decimal):
            if len(argument.text) > 80:
                raise self.fail("E129", "this number is too long", argument)
            bound = Fraction(argument.text) * scale
        elif (
            isinstance(argument, syntax.Prefix)
            and argument.operator == "-"
            and isinstance(argument.operand, syntax.Decimal)
        ):
            raise self.fail("E132", "a time span cannot be negative", argument, "write 0 or more")
        else:
            time = self.number(argument)
            if isinstance(time.type, DecimalType):
                text = self.span(argument).text if len(self.span(argument).text) <= 40 else "…"
                factor = "" if scale == 1 else " * 1000"
                hint = f"write `after_ms(round({text}{factor}))`"
                message = f"an integer or a constant such as 0.5 is expected, but this is {a_type(time.type)}"
                raise self.fail("E121", message, argument, hint)
            constant = evaluate(time)
            if constant is not None and constant < 0:
                raise self.fail("E132", "a time span cannot be negative", argument, "write 0 or more")
            bound = Fraction(constant) * scale if constant is not None else time
        return typed.After(bound, scale, BOOL, self.span(node))


def _number_type(*parts: typed.Expression) -> ScalarType:
    """The type of a number with as many digits as that of the parts with most of them."""
    digits = max(digits_of(p.type) for p in parts)
    return DecimalType(digits) if digits else INT


def _rounded(e: typed.Expression) -> str:
    """What to write instead of a decimal where an integer is expected."""
    return "write a number without a point" if isinstance(e, typed.Literal) else ROUNDED


def _is_loose(node: syntax.Expression) -> bool:
    """Whether it binds more loosely than a comparison, and has no brackets around it."""
    if isinstance(node, syntax.Ternary):
        return node.start == node.condition.start
    return (
        isinstance(node, syntax.Chain) and node.operators[0] in ("&", "|", "^") and node.start == node.operands[0].start
    )


def _widest(kind: FixedType | None, other: Type) -> FixedType | None:
    """That of two types of fixed width which has the values of both; the first one when neither has."""
    if not isinstance(other, FixedType) or (kind is not None and (other.low > kind.low or other.high < kind.high)):
        return kind
    return other


def _one_of(values: tuple[str, ...]) -> str:
    return "write one of " + ", ".join(f"`{v}`" for v in values[:8]) + (", …" if len(values) > 8 else "")


def a_type(kind: Type) -> str:
    """A type in a sentence: ``a bool``, ``an integer (0..15)``, ``a Colour``."""
    if isinstance(kind, BoolType):
        return "a bool"
    if is_integer(kind):
        return "an integer" if isinstance(kind, IntType) else f"an integer ({kind})"
    if isinstance(kind, DecimalType):
        return f"a {kind}" if kind.low is None else f"a decimal ({kind})"
    if isinstance(kind, EnumType):
        return f"a value of {kind}"
    return f"{'an' if isinstance(kind, ArrayType) else 'a'} {kind}"

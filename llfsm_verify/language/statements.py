"""Type checking of actions: every statement is checked, so that one run reports the errors of all of them."""

from __future__ import annotations

from fractions import Fraction
from typing import Literal as OneOf
from typing import cast

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Fragment
from llfsm_verify.language import syntax, typed
from llfsm_verify.language.codes import HINTS
from llfsm_verify.language.constants import evaluate
from llfsm_verify.language.expressions import INT, ROUNDED, BitOp, ExpressionChecker, a_type
from llfsm_verify.language.habits import WAITING, member_meant, word_meant
from llfsm_verify.language.limits import MAX_ITERATIONS, MAX_UNROLLED
from llfsm_verify.language.scope import (
    CALLS,
    CHOOSE,
    COMMANDS,
    DECIMAL_NAMES,
    DECIMAL_TYPE,
    RESERVED,
    TYPE_NAMES,
    Scope,
    did_you_mean,
)
from llfsm_verify.language.types import (
    ArrayType,
    BoolType,
    DecimalType,
    EnumType,
    FixedType,
    RangeType,
    RecordType,
    ScalarType,
    Type,
    decimal_text,
    digits_of,
    fits_in_64_bits,
    is_integer,
    is_number,
)

StoreOp = OneOf["add", "sub", "mul", "div", "mod"] | BitOp
_STORE: dict[str, StoreOp] = {
    "+": "add", "-": "sub", "*": "mul", "/": "div", "%": "mod",
    "&": "band", "|": "bor", "^": "bxor", "<<": "shl", ">>": "shr",
}  # fmt: skip
_OF_BOOLS = {"&": "&&", "|": "||", "^": "!="}


BEYOND = "write `uint64`, or a smaller range"
"""The hint beside a range that does not fit in 64 bits with a sign."""


def basic_type(name: str) -> ScalarType | None:
    """The built-in type called `name`."""
    if name == "bool":
        return BoolType()
    if name == "int":
        return INT
    for signed, prefix in ((True, "int"), (False, "uint")):
        if name in (f"{prefix}8", f"{prefix}16", f"{prefix}32", f"{prefix}64"):
            return FixedType(int(name.removeprefix(prefix)), signed)
    return None


class ActionChecker(ExpressionChecker):
    """Checks the statements of one action; `diagnostics` collects what is wrong."""

    def __init__(self, scope: Scope, fragment: Fragment) -> None:
        super().__init__(scope, fragment)
        self.diagnostics: list[Diagnostic] = []
        self._keys = 0
        self._multiplier = 1
        self._iterations = 0
        self._unrolled = 0

    def block(self, statements: tuple[syntax.Statement, ...]) -> tuple[typed.Statement, ...]:
        self.locals.append({})
        done: list[typed.Statement] = []
        for statement in statements:
            try:
                done += self.statement(statement)
            except DiagnosticError as e:
                self.diagnostics += e.diagnostics
                if isinstance(statement, syntax.Declaration):
                    self._declare_anyway(statement)
        self.locals.pop()
        return tuple(done)

    def statement(self, node: syntax.Statement) -> tuple[typed.Statement, ...]:
        match node:
            case syntax.Block():
                return self.block(node.statements)
            case syntax.Declaration():
                return (self._declare(node),)
            case syntax.Store():
                return (self._store(node),)
            case syntax.Choice():
                return (self._choice(node),)
            case syntax.RangeLoop():
                return self._loop(node, node.name, self._bound(node.first), self._bound(node.last), node.body)
            case syntax.CountingLoop():
                return self._counting(node)
            case syntax.Call():
                return self._command(node)

    # ------------------------------------------------------------ local variables

    def _declare(self, node: syntax.Declaration) -> typed.Declare:
        kind = self._local_type(node.type)
        self._new_name(node.name)
        if node.value is None:
            raise self.fail("E138", f"local variable `{node.name.text}` has no value", node, "write `= …` after it")
        value = self._right_side(node.value, kind, node.name)
        return typed.Declare(self._bind(node.name.text, kind, True), value, self.span(node))

    def _declare_anyway(self, node: syntax.Declaration) -> None:
        """Later uses of a variable whose declaration is wrong are not errors of their own."""
        try:
            kind = self._local_type(node.type)
        except DiagnosticError:
            kind = INT
        self.locals[-1].setdefault(node.name.text, (typed.Local(node.name.text, kind), True))

    def _bind(self, name: str, kind: ScalarType, writable: bool) -> typed.Local:
        self._keys += 1
        local = typed.Local(name if self._keys == 1 else f"{name}#{self._keys}", kind)
        self.locals[-1][name] = (local, writable)
        return local

    def _local_type(self, node: syntax.TypeName) -> ScalarType:
        if node.bounds is not None:
            low, high = node.bounds
            if low > high:
                raise self.fail("E116", f"the range {node.name} is empty", node, "write the smaller bound first")
            if not fits_in_64_bits(low, high):
                raise self.fail("E129", "this range does not fit in 64 bits with a sign", node, BEYOND)
            return RangeType(low, high)
        kind = basic_type(node.name) or self.scope.types.get(node.name)
        if kind is None:
            names = (*TYPE_NAMES, *self.scope.types)
            word = f"write `{CALLS[node.name]};`" if node.name in COMMANDS else word_meant(node.name, names)
            hint = DECIMAL_TYPE if node.name.lower() in DECIMAL_NAMES else word or did_you_mean(node.name, names)
            raise self.fail("E116", f"there is no type `{node.name}`", node, hint)
        if isinstance(kind, ArrayType | RecordType):
            raise self.fail(
                "E139", f"a local variable cannot be {kind}", node, "declare it among the state's variables"
            )
        return kind

    def _new_name(self, name: syntax.Name) -> None:
        text = name.text
        if text in RESERVED or name.quoted:
            raise self.fail("E119", f"`{text}` cannot be the name of a variable", name)
        if self.is_value(name) or text in self.scope.enumerators:
            raise self.fail("E118", f"there is already something called `{text}`", name, "choose another name")

    # ------------------------------------------------------------ assignments and branches

    def _store(self, node: syntax.Store) -> typed.Assign:
        target = self._target(node.target)
        what = f"`{self.span(node.target).text}`"
        if not node.operator:
            return typed.Assign(target, None, self._right_side(node.value, target.type, node.target), self.span(node))
        if node.operator in ("&", "|", "^", "<<", ">>"):
            if not isinstance(target.type, FixedType):
                hint: str | None = "give it a type with a fixed width, such as uint8"
                if isinstance(target.type, BoolType) and node.operator in _OF_BOOLS:
                    hint = f"write `{what[1:-1]} = {what[1:-1]} {_OF_BOOLS[node.operator]} …`"
                raise self.fail(
                    "E150", f"`{node.operator}=` needs a fixed width, {what} is {a_type(target.type)}", node, hint
                )
            check = self.shift_count if node.operator in ("<<", ">>") else self.bits
            return typed.Assign(target, _STORE[node.operator], check(node.value, target.type), self.span(node))
        if not is_number(target.type) or (node.operator == "%" and not is_integer(target.type)):
            needs = "a number" if node.operator != "%" else "an integer"
            hint = ROUNDED if isinstance(target.type, DecimalType) else None
            raise self.fail("E150", f"`{node.operator}=` needs {needs}, {what} is {a_type(target.type)}", node, hint)
        value = self.integer(node.value) if is_integer(target.type) else self.number(node.value)
        if node.operator in "/%":
            self.divisor(node.value, value)
        return typed.Assign(target, _STORE[node.operator], value, self.span(node))

    def _target(self, node: syntax.Path) -> typed.Read | typed.ReadLocal:
        name = node.name.text
        bound = self.local(name)
        if bound is not None and not bound[1]:
            raise self.fail("E127", f"`{name}` counts a loop and cannot be changed", node)
        if bound is None and name in self.scope.constants:
            raise self.fail("E127", f"`{name}` is a constant and cannot be changed", node)
        if bound is None and name in self.scope.tables and name not in self.scope.variables:
            raise self.fail("E127", f"`{name}` is a table and cannot be changed", node)
        if bound is None and name in self.scope.knowledge:
            raise self.fail("E127", f"`{name}` is what a theory says and cannot be changed", node)
        if not self.is_value(node.name):
            raise self.no_variable(node, self.assignable())
        target = self.path(node, None)
        assert isinstance(target, typed.Read | typed.ReadLocal)
        if isinstance(target, typed.Read) and target.variable.scope == "whiteboard":
            self._check_writer(target.variable.name, name, node)
        return target

    def _check_writer(self, variable: str, name: str, node: syntax.Path) -> None:
        """Machines write everything but inputs, the model of the surroundings nothing but them."""
        if self.scope.surroundings and variable not in self.scope.inputs:
            hint = "give it `role: input`, or let a machine write it"
            raise self.fail(
                "E156", f"the model of the surroundings writes only inputs, and `{name}` is not one", node, hint
            )
        if not self.scope.surroundings and variable in self.scope.inputs:
            raise self.fail(
                "E126", f"`{name}` is an input: only the environment changes it", node, "give it another role"
            )

    # ------------------------------------------------------------ choices

    def _right_side(self, node: syntax.Expression, target: Type, place: syntax.Path | syntax.Name) -> typed.Expression:
        """What is stored in a variable of type `target`, which stands at `place`."""
        what = self.span(place).text
        if isinstance(node, syntax.Call) and node.function.name.text == CHOOSE and not node.function.steps:
            return self._choose(node, target, what)
        return self.value(node, target, f"`{what}`")

    def _choose(self, node: syntax.Call, target: Type, what: str) -> typed.Choose:
        if not self.scope.chooses:
            hint = "write it in the `environment`, or in a machine with `model: true`"
            raise self.fail(
                "E155", f"only a model may choose, and machine `{self.scope.self_name}` is not one", node, hint
            )
        if not node.arguments:
            raise self.fail("E117", "`choose` needs the values that it chooses from", node, "write `choose(0..3)`")
        if isinstance(target, ArrayType | RecordType):
            hint = "choose its elements one by one"
            raise self.fail("E155", f"`choose` gives one value, and `{what}` is {target}", node, hint)
        kind: Type = target
        only = node.arguments[0] if len(node.arguments) == 1 else None
        named = self._type_named(only) if isinstance(only, syntax.Path) else None
        if isinstance(only, syntax.Path) and named is None and not only.steps and not self._is_known(only.name):
            near = did_you_mean(only.name.text, [*self.scope.types, *self.scope.enumerators])
            message = f"there is no type or value `{only.name.text}` here"
            raise self.fail("E110", message, only, near or "declare it under `types`, or write the values")
        values: range | tuple[int, ...]
        if isinstance(only, syntax.Interval):
            low, high = (self._end(n, target, f"`{what}`") for n in (only.low, only.high))
            kind = _between(target, low, high)
            if low > high:
                raise self.fail("E116", f"the range {kind} is empty", only, "write the smaller bound first")
            values = range(low, high + 1)
        elif named is not None and only is not None:
            values, kind = self._all_values(named, only), named
        else:
            for argument in node.arguments:
                if isinstance(argument, syntax.Interval):
                    raise self.fail(
                        "E155", "a range must be the only value in `choose(…)`", argument, "list all the values"
                    )
            found = []
            for argument in node.arguments:
                constant = evaluate(self.value(argument, target, f"`{what}`"))
                if constant is None:
                    raise self.fail("E136", "`choose` takes only constants", argument, HINTS["E155"])
                found.append(int(constant * 10 ** digits_of(target)))
            values = tuple(dict.fromkeys(found))
            if is_number(target):
                kind = _between(target, min(values), max(values))
        alike = digits_of(kind) == digits_of(target) and is_number(kind) and is_number(target)
        if kind != target and not alike:
            raise self.fail("E123", f"`{what}` is {target}, but these values are {kind}", node)
        chosen = typed.Choose(values, what, cast(ScalarType, kind), self.span(node))
        bounds = (target.low, target.high) if isinstance(target, RangeType | FixedType | DecimalType) else (None, None)
        least, most = bounds
        if least is not None and most is not None and not least <= chosen.low <= chosen.high <= most:
            beyond = decimal_text(chosen.low if chosen.low < least else chosen.high, digits_of(target))
            raise self.fail("E128", f"{beyond} is outside `{what}`'s range {target}", node)
        return chosen

    def _end(self, node: syntax.Expression, target: Type, what: str) -> int:
        """The end of a range of values for `target`, in its steps."""
        if not isinstance(target, DecimalType):
            return self._bound(node, "the ends of the range must be constants")
        constant = evaluate(self.value(node, target, what))
        if constant is None:
            raise self.fail("E136", "the ends of the range must be constants", node)
        return int(constant * 10**target.digits)

    def _type_named(self, node: syntax.Path) -> Type | None:
        """The type that an argument of `choose` names; None: it names a value."""
        if node.steps or self.is_value(node.name):
            return None
        return basic_type(node.name.text) or self.scope.types.get(node.name.text)

    def _is_known(self, name: syntax.Name) -> bool:
        return self.is_value(name) or name.text in self.scope.enumerators or name.text in self.scope.machines

    def _all_values(self, kind: Type, node: syntax.Node) -> range:
        if isinstance(kind, BoolType):
            return range(2)
        if isinstance(kind, EnumType):
            return range(len(kind.values))
        if isinstance(kind, RangeType | FixedType):
            return range(kind.low, kind.high + 1)
        if isinstance(kind, DecimalType) and kind.low is not None and kind.high is not None:
            return range(kind.low, kind.high + 1)
        message = f"`choose` cannot choose from all values of `{kind}`"
        raise self.fail("E155", message, node, "write a range, such as `choose(0..100)`")

    def _choice(self, node: syntax.Choice) -> typed.IfElse:
        try:
            condition = self.boolean(node.condition)
        except DiagnosticError as e:
            self.diagnostics += e.diagnostics
            condition = typed.Literal(True, BoolType(), self.span(node.condition))
        then = self.block((node.then,))
        otherwise = () if node.otherwise is None else self.block((node.otherwise,))
        return typed.IfElse(condition, then, otherwise, self.span(node))

    # ------------------------------------------------------------ loops

    def _bound(self, node: syntax.Expression, message: str = "the bounds of a loop must be constants") -> int:
        value = evaluate(self.integer(node))
        if value is None:
            raise self.fail("E136", message, node)
        return int(value)

    def _counting(self, node: syntax.CountingLoop) -> tuple[typed.Statement, ...]:
        shape = "write `for (int i = 0; i < 4; i++)` or `for (i in 0..3)`"
        begin, step, test = node.begin, node.step, node.condition
        if isinstance(begin, syntax.Declaration) and begin.value is not None:
            name, start = begin.name, begin.value
            if not is_integer(self._local_type(begin.type)):
                raise self.fail("E135", "a loop counts with an integer", begin.type, shape)
        else:
            raise self.fail("E135", "a loop declares its own counter", begin, shape)
        test_is_upper_bound = (
            isinstance(test, syntax.Chain)
            and test.operators in (("<",), ("<=",))
            and isinstance(test.operands[0], syntax.Path)
            and not test.operands[0].steps
            and test.operands[0].name.text == name.text
        )
        if not test_is_upper_bound:
            raise self.fail(
                "E135", f"the condition of a loop must be `{name.text} <` or `{name.text} <=` a constant", test, shape
            )
        counts_by_one = (
            isinstance(step, syntax.Store)
            and step.operator == "+"
            and step.target.name.text == name.text
            and not step.target.steps
            and isinstance(step.value, syntax.Integer)
            and step.value.text == "1"
        )
        if not counts_by_one:
            raise self.fail("E135", f"a loop counts up by one: `{name.text}++`", step, shape)
        chain = cast(syntax.Chain, test)
        last = self._bound(chain.operands[1]) - (1 if chain.operators == ("<",) else 0)
        return self._loop(node, name, self._bound(start), last, node.body)

    def _loop(
        self, node: syntax.Node, name: syntax.Name, first: int, last: int, body: syntax.Statement
    ) -> tuple[typed.Statement, ...]:
        self._new_name(name)
        count = max(0, last - first + 1)
        self._iterations += self._multiplier * count
        if self._iterations > MAX_ITERATIONS:
            raise self.fail("E137", f"the loops of this action run more than {MAX_ITERATIONS:,} times in total", node)
        self._unrolled += self._multiplier * count * (body.end - body.start)
        if self._unrolled > MAX_UNROLLED:
            size = f"{MAX_UNROLLED // 1024} KiB"
            raise self.fail("E137", f"the loops of this action, written out, are longer than {size}", node)
        self.locals.append({})
        local = self._bind(name.text, RangeType(first, last) if count else INT, False)
        outer, self._multiplier = self._multiplier, self._multiplier * count
        checked = self.block((body,))
        self._multiplier = outer
        self.locals.pop()
        return (typed.For(local, first, last, checked, self.span(node)),)

    # ------------------------------------------------------------ commands

    def _command(self, node: syntax.Call) -> tuple[typed.Statement, ...]:
        name, span = node.function.name.text, self.span(node)
        if name in COMMANDS and self.scope.surroundings and not node.function.steps:
            hint = "let it write an input that the machines read"
            raise self.fail("E156", "the model of the surroundings gives no commands", node, hint)
        if node.function.steps or name not in COMMANDS:
            if not node.function.steps and name not in RESERVED:
                near = word_meant(name, COMMANDS) or did_you_mean(name, COMMANDS)
                known = f"commands are {', '.join(f'`{c}`' for c in COMMANDS)}"
                raise self.fail("E113", f"there is no command `{name}`", node.function, near or known)
            steps, meant = node.function.steps, WAITING.get(name)
            if len(steps) == 1 and isinstance(steps[0], syntax.Member) and name in self.scope.machines:
                meant = member_meant(name, steps[0].name.text, (), COMMANDS)
            raise self.fail("E141", "a value alone does nothing", node, meant or "assign it, or use it in a condition")
        if name == "suspend_all":
            self.arguments(node, 0)
            return tuple(typed.Command("suspend", other, span) for other in self.scope.others)
        (argument,) = self.arguments(node, 1)
        return (typed.Command(cast(typed.CommandKind, name), self.machine_argument(argument).name, span),)


def _between(target: Type, low: int, high: int) -> ScalarType:
    """The numbers from `low` to `high`, in the steps of `target`."""
    return DecimalType(target.digits, low, high) if isinstance(target, DecimalType) else RangeType(low, high)


def check_actions(parsed: syntax.ParsedActions, scope: Scope) -> tuple[tuple[typed.Statement, ...], list[Diagnostic]]:
    """The typed statements and everything that is wrong with them (then the statements are incomplete)."""
    checker = ActionChecker(scope, parsed.fragment)
    return checker.block(parsed.statements), checker.diagnostics


def check_guard(parsed: syntax.ParsedExpression, scope: Scope) -> typed.Expression:
    """The typed condition. Raises DiagnosticError at the first error."""
    return ExpressionChecker(scope, parsed.fragment).boolean(parsed.root)


def check_constant(parsed: syntax.ParsedExpression, scope: Scope, target: ScalarType, what: str) -> int | bool:
    """The value of a constant expression of type `target`. Raises DiagnosticError."""
    checker = ExpressionChecker(scope, parsed.fragment)
    value = evaluate(checker.value(parsed.root, target, what))
    if value is None:
        raise checker.fail("E136", "a constant is expected", parsed.root)
    if isinstance(target, DecimalType):
        steps = value * 10**target.digits
        if steps != int(steps):
            step = decimal_text(1, target.digits)
            raise checker.fail("E160", f"this is not a multiple of {step}, the step of {what}", parsed.root)
        return int(steps)
    return int(value) if isinstance(value, Fraction) else value

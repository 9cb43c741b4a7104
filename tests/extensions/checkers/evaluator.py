"""A small evaluator of the SMV that we write: it parses a model and enumerates its states and steps.

Written after the NuSMV 2.6 user manual; it knows nothing of step programs. It reads only the part of the language that
our models use, and insists on its types: Booleans are no numbers, and a value outside its variable's range is an error.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import product

from lark import Lark, Token, Tree

from llfsm_verify.logic.formula import Formula, Op, apply, atom

_EXPRESSION = Lark(
    r"""
    ?expr: either | either "?" expr ":" expr -> conditional
    ?either: both | either (OR | XOR) both -> binary
    ?both: compared | both AND compared -> binary
    ?compared: sum | sum COMPARE sum -> binary
    ?sum: term | sum SIGN term -> binary
    ?term: unary | term TIMES unary -> binary
    ?unary: operand | (NOT | TEMPORAL) unary -> prefix
    ?operand: NAME -> name | INT -> number | NEGATIVE -> number | TRUE -> true | FALSE -> false | "(" inner ")"
    ?inner: expr | expr LOW expr -> binary
    LOW: "<->" | "->" | "U" | "V"
    TEMPORAL: "X" | "F" | "G"
    OR: "|"
    XOR: "xor"
    AND: "&"
    COMPARE: "!=" | "<=" | ">=" | "=" | "<" | ">"
    SIGN: "+" | "-"
    TIMES: "*" | "/" | "mod"
    NOT: "!"
    TRUE: "TRUE"
    FALSE: "FALSE"
    INT: /[0-9]+/
    NEGATIVE: /-[0-9]+/
    NAME: /[a-z_][A-Za-z0-9_]*/
    %import common.WS
    %ignore WS
    """,
    start="expr",
    parser="lalr",
)
State = tuple[int | bool, ...]
Code = Callable[[Mapping[str, int | bool]], int | bool]


@dataclass
class Model:
    """A parsed model. States give the variables of `names` their values, in that order."""

    names: list[str]
    values: dict[str, list[int | bool]]
    inputs: dict[str, list[int | bool]]
    defines: dict[str, Code]
    inits: dict[str, Code]
    nexts: dict[str, Code]
    justice: list[Tree[Token] | Token]
    formulas: dict[str, Tree[Token] | Token]
    invariants: dict[str, Code]

    def initial(self) -> Iterator[State]:
        free = [n for n in self.names if n not in self.inits]
        for chosen in product(*(self.values[n] for n in free)):
            env = _Environment(self, dict(zip(free, chosen, strict=True)))
            for name in self.names:
                if name in self.inits:
                    env.known[name] = self.inits[name](env)
            yield self._state(env.known)

    def successors(self, state: State) -> Iterator[State]:
        before = dict(zip(self.names, state, strict=True))
        for chosen in product(*self.inputs.values()):
            env = _Environment(self, before | dict(zip(self.inputs, chosen, strict=True)))
            yield self._state({name: self.nexts[name](env) for name in self.names})

    def _state(self, values: Mapping[str, int | bool]) -> State:
        for name in self.names:
            assert any(values[name] is x or values[name] == x for x in self.values[name]), (name, values[name])
            assert isinstance(values[name], bool) == isinstance(self.values[name][0], bool), name
        return tuple(values[n] for n in self.names)

    def reachable(self, most: int) -> dict[State, set[State]] | None:
        """Every reachable state with its successors; None when there are more than `most`."""
        found: dict[State, set[State]] = {}
        todo = list(self.initial())
        while todo:
            state = todo.pop()
            if state not in found:
                found[state] = set(self.successors(state))
                todo += found[state]
                if len(found) > most:
                    return None
        return found


class _Environment(dict[str, int | bool]):
    """Variables and inputs; defined names are computed when first asked for."""

    def __init__(self, model: Model, known: dict[str, int | bool]) -> None:
        super().__init__()
        self.model = model
        self.known = known

    def __missing__(self, name: str) -> int | bool:
        if name in self.known:
            return self.known[name]
        if name in self.model.inits and name not in self.model.defines:
            return self.model.inits[name](self)  # the init of one variable may read another
        self[name] = value = self.model.defines[name](self)
        return value


def read(text: str) -> Model:
    """The model in `text`, of which each line is a statement."""
    model = Model([], {}, {}, {}, {}, {}, [], {}, {})
    section = ""
    for line in text.splitlines():
        line = line.split("--")[0].strip()
        if line in ("VAR", "IVAR", "DEFINE", "ASSIGN", "MODULE main", ""):
            section = line or section
            continue
        head, _, rest = line.partition(" ")
        if head in ("JUSTICE", "INVARSPEC", "LTLSPEC"):
            _property(model, head, rest.removesuffix(";"))
        elif section in ("VAR", "IVAR"):
            name, _, kind = line.removesuffix(";").partition(" : ")
            low, _, high = kind.partition("..")
            values: list[int | bool] = [False, True] if kind == "boolean" else list(range(int(low), int(high) + 1))
            (model.values if section == "VAR" else model.inputs)[name] = values
            if section == "VAR":
                model.names.append(name)
        else:
            target, _, body = line.removesuffix(";").partition(" := ")
            code = _code(parsed(body))
            if section == "DEFINE":
                model.defines[target] = code
            else:
                which, _, name = target.removesuffix(")").partition("(")
                {"init": model.inits, "next": model.nexts}[which][name] = code
    return model


def _property(model: Model, head: str, rest: str) -> None:
    if head == "JUSTICE":
        model.justice.append(parsed(rest))
        return
    words, _, body = rest.partition(" := ")
    name = words.removeprefix("NAME ")
    if head == "LTLSPEC":
        model.formulas[name] = parsed(body)
    else:
        model.invariants[name] = _code(parsed(body))


def parsed(text: str) -> Tree[Token] | Token:
    """An expression or a formula."""
    return _EXPRESSION.parse(text)


# ---------------------------------------------------------------- numbers


def _boolean(x: int | bool) -> bool:
    assert isinstance(x, bool), x
    return x


def _number(x: int | bool) -> int:
    assert not isinstance(x, bool), x
    assert -(1 << 31) <= x < 1 << 31
    return x


def _same(a: int | bool, b: int | bool) -> bool:
    assert isinstance(a, bool) == isinstance(b, bool)
    return a == b


def _divided(a: int, b: int) -> int:
    """NuSMV's versions divide negative numbers in different ways, so models must not."""
    assert a >= 0 and b > 0
    return a // b


_BINARY: dict[str, Callable[[int | bool, int | bool], int | bool]] = {
    "|": lambda a, b: _boolean(a) | _boolean(b),
    "&": lambda a, b: _boolean(a) & _boolean(b),
    "xor": lambda a, b: _boolean(a) != _boolean(b),
    "<->": lambda a, b: _boolean(a) == _boolean(b),
    "=": lambda a, b: _same(_number(a), _number(b)),
    "!=": lambda a, b: not _same(_number(a), _number(b)),
    "<": lambda a, b: _number(a) < _number(b),
    "<=": lambda a, b: _number(a) <= _number(b),
    ">": lambda a, b: _number(a) > _number(b),
    ">=": lambda a, b: _number(a) >= _number(b),
    "+": lambda a, b: _number(_number(a) + _number(b)),
    "-": lambda a, b: _number(_number(a) - _number(b)),
    "*": lambda a, b: _number(_number(a) * _number(b)),
    "/": lambda a, b: _divided(_number(a), _number(b)),
    "mod": lambda a, b: _number(a) - _number(b) * _divided(_number(a), _number(b)),
}


def _code(tree: Tree[Token] | Token) -> Code:
    """An expression as a function of its names. Both sides are evaluated, as decision diagrams do."""
    assert isinstance(tree, Tree)
    parts = tree.children
    match tree.data:
        case "true" | "false":
            fixed = tree.data == "true"
            return lambda env: fixed
        case "number":
            value = int(str(parts[0]))
            return lambda env: value
        case "name":
            name = str(parts[0])
            return lambda env: env[name]
        case "prefix":
            assert str(parts[0]) == "!"
            inner = _code(parts[1])
            return lambda env: not _boolean(inner(env))
        case "conditional":
            condition, then, otherwise = (_code(p) for p in parts)
            return lambda env: _chosen(_boolean(condition(env)), then(env), otherwise(env))
    left, right, operation = _code(parts[0]), _code(parts[2]), _BINARY[str(parts[1])]
    return lambda env: operation(left(env), right(env))


def _chosen(condition: bool, then: int | bool, otherwise: int | bool) -> int | bool:
    assert isinstance(then, bool) == isinstance(otherwise, bool)
    return then if condition else otherwise


# ---------------------------------------------------------------- literals


def literal_divisors(text: str) -> list[frozenset[int | None]]:
    """What NuSMV 2.5.4 makes of each divisor before it evaluates a condition: its branches, None for no literal.

    It moves operations into the branches of their arguments, and computes those on literals. A divisor with a branch
    that is the literal 0 makes it end with "Division by zero", even where no state takes that branch.
    """
    bodies: dict[str, Tree[Token] | Token] = {}
    for line in text.splitlines():
        target, sign, body = line.split("--")[0].strip().removesuffix(";").partition(" := ")
        if sign and " " not in target:
            bodies[target] = parsed(body)
    seen: list[frozenset[int | None]] = []
    done: dict[str, frozenset[int | None]] = {}

    def branches(tree: Tree[Token] | Token) -> frozenset[int | None]:
        assert isinstance(tree, Tree)
        parts = tree.children
        match tree.data:
            case "number":
                return frozenset([int(str(parts[0]))])
            case "name":
                name = str(parts[0])
                if name not in done:
                    done[name] = branches(bodies[name]) if name in bodies else frozenset([None])
                return done[name]
            case "conditional":
                branches(parts[0])
                return branches(parts[1]) | branches(parts[2])
            case "binary":
                left, right, sign = branches(parts[0]), branches(parts[2]), str(parts[1])
                if sign in ("/", "mod"):
                    seen.append(right)
                return frozenset(_literal(sign, a, b) for a in left for b in right)
            case "prefix":
                branches(parts[1])
        return frozenset([None])

    for body in bodies.values():
        branches(body)
    return seen


def _literal(sign: str, a: int | None, b: int | None) -> int | None:
    """An operation on literals or other terms (None), simplified as NuSMV does."""
    if sign == "*" and 0 in (a, b):
        return 0
    if a is None or b is None or sign not in ("+", "-", "*", "/", "mod") or (sign in ("/", "mod") and b == 0):
        return None
    return _number(_BINARY[sign](a, b)) if sign not in ("/", "mod") or a >= 0 < b else None


# ---------------------------------------------------------------- formulas

_LTL: dict[str, Op] = {
    "|": "or", "&": "and", "xor": "xor", "<->": "iff", "->": "implies", "U": "U", "V": "R", "!": "not", "X": "X",
    "F": "F", "G": "G",
}  # fmt: skip


def formula(tree: Tree[Token] | Token) -> Formula:
    """A formula; its atoms are the names in it, ``fault != 0`` is called so."""
    assert isinstance(tree, Tree)
    parts = tree.children
    match tree.data:
        case "true" | "false":
            return apply("true" if tree.data == "true" else "false")
        case "name":
            return atom(str(parts[0]))
        case "prefix":
            return apply(_LTL[str(parts[0])], formula(parts[1]))
    if str(parts[1]) == "!=":
        return atom("fault != 0")
    return apply(_LTL[str(parts[1])], formula(parts[0]), formula(parts[2]))

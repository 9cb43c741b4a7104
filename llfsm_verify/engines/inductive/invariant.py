"""Inductive invariants: formulas over the scalars of a state, how they are read from terms of a solver, and their
texts: clauses as implications, sums on the side where they are positive.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import eq, ge, gt, le, lt, ne

import z3

from llfsm_verify.engines.inductive.observers import Scalar, Target
from llfsm_verify.language.types import decimal_text
from llfsm_verify.program.program import UNBOUNDED, Const, Expr, Get, Int, Ite, Local, Op, OpName, Type, Unbounded
from llfsm_verify.program.terms import FALSE, TRUE, conjunction, const, disjunction, is_wide, ite, op
from llfsm_verify.program.trees import nodes


class Unreadable(Exception):
    """A solver's term has something that step programs have not."""


@dataclass(frozen=True, slots=True)
class Invariant:
    """What proves that `target` is never reached.

    `formula` holds in the beginning and after every unit of steps that is not bad (units as `System` has them). Where
    it holds, no unit is bad that comes after `k` that are not, through k + 1 states that all differ (with k = 0 no
    unit at all). And the first k units of a run are not bad.
    """

    target: Target
    formula: Expr
    k: int = 0

    @property
    def conjuncts(self) -> tuple[Expr, ...]:
        """What `formula` is the conjunction of; none where it is true."""
        return tuple(e for e in _parts("and", self.formula) if not (isinstance(e, Const) and e.value == 1))

    @property
    def is_bounded(self) -> bool:
        """Every number in the formula has bounds inside 64 bits."""
        return not any(isinstance(n.type, Unbounded) for n in nodes(self.formula))


def read(term: z3.ExprRef, names: Mapping[int, Expr]) -> Expr:
    """A term over mathematical integers as an expression; `names` says by `get_id` what its constants are.

    Raises Unreadable.
    """
    done: dict[int, Expr] = {}
    stack: list[tuple[z3.ExprRef, bool]] = [(term, False)]
    while stack:
        node, ready = stack.pop()
        key = node.get_id()
        if key in done:
            continue
        if not z3.is_app(node):
            raise Unreadable("it has a quantifier")
        if key in names:
            done[key] = names[key]
        elif ready or not node.num_args():
            done[key] = _made(node, [done[c.get_id()] for c in node.children()])
        else:
            stack.append((node, True))
            stack.extend((c, False) for c in node.children())
    return done[term.get_id()]


def _made(node: z3.ExprRef, args: list[Expr]) -> Expr:
    if z3.is_int_value(node):
        value = int(node.as_long())
        return Const(value, UNBOUNDED) if is_wide(Int(value, value)) else const(value)
    make = _OPERATIONS.get(node.decl().kind())
    if make is None:
        raise Unreadable(f"it has `{node.decl().name()}`")
    return make(args)


def _chain(name: OpName) -> Callable[[Sequence[Expr]], Expr]:
    return lambda args: reduce(lambda a, b: op(name, a, b), args)


def _distinct(args: Sequence[Expr]) -> Expr:
    pairs = [op("eq", a, b) for i, a in enumerate(args) for b in args[:i]]
    return op("not", disjunction(pairs))


def _remainder(args: Sequence[Expr]) -> Expr:
    """Z3's, which is never negative; by a positive constant."""
    rest = op("mod", args[0], _positive(args[1]))
    return ite(op("lt", rest, const(0)), op("add", rest, args[1]), rest)


def _quotient(args: Sequence[Expr]) -> Expr:
    return op("div", op("sub", args[0], _remainder(args)), _positive(args[1]))


def _positive(e: Expr) -> Expr:
    if isinstance(e, Const) and e.value > 0:
        return e
    raise Unreadable("it divides by something that is not a positive constant")


def _implies(args: Sequence[Expr]) -> Expr:
    return op("or", op("not", args[0]), args[1])


_OPERATIONS: Mapping[int, Callable[[Sequence[Expr]], Expr]] = {
    z3.Z3_OP_TRUE: lambda _: TRUE,
    z3.Z3_OP_FALSE: lambda _: FALSE,
    z3.Z3_OP_AND: lambda args: conjunction(list(args)),
    z3.Z3_OP_OR: lambda args: disjunction(list(args)),
    z3.Z3_OP_NOT: lambda args: op("not", args[0]),
    z3.Z3_OP_XOR: _chain("xor"),
    z3.Z3_OP_IMPLIES: _implies,
    z3.Z3_OP_EQ: lambda args: op("eq", args[0], args[1]),
    z3.Z3_OP_IFF: lambda args: op("eq", args[0], args[1]),
    z3.Z3_OP_DISTINCT: _distinct,
    z3.Z3_OP_ITE: lambda args: ite(args[0], args[1], args[2]),
    z3.Z3_OP_LE: lambda args: op("le", args[0], args[1]),
    z3.Z3_OP_LT: lambda args: op("lt", args[0], args[1]),
    z3.Z3_OP_GE: lambda args: op("ge", args[0], args[1]),
    z3.Z3_OP_GT: lambda args: op("gt", args[0], args[1]),
    z3.Z3_OP_ADD: _chain("add"),
    z3.Z3_OP_SUB: _chain("sub"),
    z3.Z3_OP_MUL: _chain("mul"),
    z3.Z3_OP_UMINUS: lambda args: op("neg", args[0]),
    z3.Z3_OP_MOD: _remainder,
    z3.Z3_OP_IDIV: _quotient,
}


Comparison = Callable[[Scalar, Callable[[int], bool]], str | None]
Name = Callable[[Scalar], str]
SIGNS = {"eq": "==", "ne": "!=", "lt": "<", "le": "<=", "gt": ">", "ge": ">="}
OPPOSITE = {"eq": "ne", "ne": "eq", "lt": "ge", "ge": "lt", "gt": "le", "le": "gt"}
TURNED = {"eq": "eq", "ne": "ne", "lt": "gt", "le": "ge", "gt": "lt", "ge": "le"}
TESTS: dict[str, Callable[[int, int], bool]] = {"eq": eq, "ne": ne, "lt": lt, "le": le, "gt": gt, "ge": ge}
NUMBERS = {"add": " + ", "sub": " - ", "mul": " * ", "div": " / ", "mod": " % "}


def formula_text(formula: Expr, comparison: Comparison, name: Name) -> str:
    """A formula. `comparison` writes that a scalar has some of its values (None: as a number), `name` a scalar."""
    return _Writer(comparison, name).formula(formula)


class _Writer:
    def __init__(self, comparison: Comparison, name: Name) -> None:
        self._comparison = comparison
        self._name = name

    def formula(self, e: Expr) -> str:
        """A clause: what is negated implies the rest."""
        literals = list(_parts("or", e))
        if len(literals) == 1:
            return self.literal(literals[0])
        negated = [x for x in literals if _is_negative(x)]
        others = [x for x in literals if not _is_negative(x)]
        premise = " && ".join(sorted(self.literal(op("not", x)) for x in negated))
        conclusion = " || ".join(sorted(self.literal(x) for x in others))
        if not negated:
            return conclusion
        if not others:
            return f"!({premise})"
        return f"{premise} -> {conclusion}"

    def literal(self, e: Expr) -> str:
        match e:
            case Const(value, _):
                return "true" if value else "false"
            case Op("not", (Op(name, args, _),), kind) if name in OPPOSITE:
                return self.literal(Op(OPPOSITE[name], args, kind))  # type: ignore[arg-type]
            case Op("not", (inner,), _):
                text = self.literal(inner)
                return f"!{text}" if _is_word(text) else f"!({text})"
            case Op("and", _, _):
                return "(" + " && ".join(self.literal(x) for x in _parts("and", e)) + ")"
            case Op("or", _, _):
                return f"({self.formula(e)})"
            case Op(name, (a, b), _) if name in SIGNS:
                return self._compared(name, a, b)
            case Op("xor", (a, b), _):
                return f"({self.literal(a)} xor {self.literal(b)})"
            case Ite(condition, then, otherwise, _):
                return f"({self.literal(condition)} ? {self.literal(then)} : {self.literal(otherwise)})"
            case Get() | Local():
                return self._name(e)
        return self._number(e)

    def _compared(self, name: str, a: Expr, b: Expr) -> str:
        if isinstance(a, Const) and not isinstance(b, Const):
            name, a, b = TURNED[name], b, a
        if _is_boolean(a) and _is_boolean(b):
            if isinstance(b, Const):
                return self.literal(a if bool(b.value) == (name == "eq") else op("not", a))
            return f"({self.literal(a)} {'<->' if name == 'eq' else 'xor'} {self.literal(b)})"
        if name in ("gt", "lt") and isinstance(b, Const):  # `x >= 0`, not `x > -1`
            name, b = ("ge", const(b.value + 1)) if name == "gt" else ("le", const(b.value - 1))
        if isinstance(a, (Get, Local)) and isinstance(b, Const):
            name = _exact(name, a.type, b.value)
            text = self._comparison(a, lambda value: TESTS[name](value, b.value))
            if text is not None:
                return text
        left, right, constant, digits = self._sides(a, b)
        if not left:
            name, left, right, constant = TURNED[name], right, left, -constant
        tail = [decimal_text(abs(constant), digits)] if constant or not right else []
        if constant > 0 or not right:
            end = " + ".join([*right, *tail]) if right else decimal_text(constant, digits)
        else:
            end = " + ".join(right) + "".join(f" - {t}" for t in tail)
        return f"{' + '.join(left) or '0'} {SIGNS[name]} {end}"

    def _sides(self, a: Expr, b: Expr) -> tuple[list[str], list[str], int, int]:
        """`a` compared with `b` as sums left and right, the constant on the right, and its digits after the point."""
        sums: dict[Expr, int] = {}
        constant = 0
        for factor, e in ((1, a), (-1, b)):
            for times, term in _summands(e, factor):
                if isinstance(term, Const):
                    constant -= times * term.value
                else:
                    sums[term] = sums.get(term, 0) + times
        # A decimal is read as its number of steps: all is divided by so many of them as divide every summand.
        steps = {e: n * 10 ** _digits(e) for e, n in sums.items()}
        digits = max(
            (d for e in sums for d in range(_digits(e) + 1) if all(n % 10**d == 0 for n in steps.values())), default=0
        )
        sums = {e: n // 10**digits for e, n in steps.items()}
        left = [self._times(n, e) for e, n in sums.items() if n > 0]
        right = [self._times(-n, e) for e, n in sums.items() if n < 0]
        return left, right, constant, digits

    def _times(self, factor: int, e: Expr) -> str:
        text = self._number(e)
        return text if factor == 1 else f"{factor} * {text}"

    def _number(self, e: Expr) -> str:
        match e:
            case Const(value, _):
                return str(value)
            case Get() | Local():
                return self._name(e)
            case Op(name, (a, b), _) if name in NUMBERS:
                return f"({self._number(a)}{NUMBERS[name]}{self._number(b)})"
            case Op("neg", (a,), _):
                return f"-{self._number(a)}"
            case Op(("abs" | "min" | "max") as name, args, _):
                return f"{name}({', '.join(map(self._number, args))})"
            case Ite(condition, then, otherwise, _):
                return f"({self.literal(condition)} ? {self._number(then)} : {self._number(otherwise)})"
        return self.literal(e)


def _parts(name: str, e: Expr) -> Iterator[Expr]:
    stack = [e]
    while stack:
        match stack.pop():
            case Op(found, args, _) if found == name:
                stack.extend(reversed(args))
            case other:
                yield other


def _summands(e: Expr, factor: int) -> Iterator[tuple[int, Expr]]:
    stack = [(factor, e)]
    while stack:
        times, term = stack.pop()
        match term:
            case Op("add", args, _):
                stack.extend((times, a) for a in reversed(args))
            case Op("sub", (a, b), _):
                stack += [(-times, b), (times, a)]
            case Op("neg", (a,), _):
                stack.append((-times, a))
            case Op("mul", (Const(value, _), a), _) | Op("mul", (a, Const(value, _)), _):
                stack.append((times * value, a))
            case _:
                yield times, term


def _exact(name: str, kind: Type, value: int) -> str:
    """`==` for a comparison that only the last value of a range satisfies."""
    ends = (kind.low, kind.high) if isinstance(kind, Int) else ()
    return "eq" if (name, (value,)) in (("le", ends[:1]), ("ge", ends[1:])) else name


def _digits(e: Expr) -> int:
    """The digits after the point of a variable."""
    return e.type.digits if isinstance(e, Get | Local) and isinstance(e.type, Int) else 0


def _is_negative(e: Expr) -> bool:
    return isinstance(e, Op) and e.op in ("not", "ne")


def _is_boolean(e: Expr) -> bool:
    return isinstance(e.type, Int) and e.type.boolean


def _is_word(text: str) -> bool:
    return all(c.isalnum() or c in "_@.#" for c in text) or (text.endswith(")") and text.startswith(("then(", "(")))

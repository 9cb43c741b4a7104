"""Blocks of a step program as expressions: what each variable is afterwards, in terms of what all were before."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from llfsm_verify.limits import tick
from llfsm_verify.program.program import (
    Block,
    Choice,
    Const,
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
    Var,
)
from llfsm_verify.program.terms import FALSE, TRUE, const, interval, ite, op, wrapped
from llfsm_verify.program.trees import fold

FAULT = "$fault"
"""The variable that holds 1 + the number of the fault that ended the run, else 0."""
Key = tuple[str, int | None]
"""A scalar, or an element of an array; of locals the name has a ``%`` in front."""


class Values:
    """What is known of variables and locals at one point: changes on top of another point."""

    __slots__ = ("_below", "changes")

    def __init__(self, below: Values | None = None, changes: dict[Key, Expr] | None = None) -> None:
        self._below = below
        self.changes: dict[Key, Expr] = changes if changes is not None else {}

    def get(self, key: Key) -> Expr | None:
        """The value; None for a local that has none here."""
        point: Values | None = self
        while point is not None:
            if key in point.changes:
                return point.changes[key]
            point = point._below
        return None


@dataclass(slots=True)
class Definitions:
    """Named intermediate expressions, each over variables before the step, choices and earlier names.

    A subclass may say otherwise how operations are written (`operation`), and refuse what it cannot name (`name`).
    """

    variables: Mapping[str, Var]
    choices: Mapping[str, Choice]
    suffix: str = ""
    """What tells the choices of one ringlet from those of another in the same step."""
    made: dict[Expr, Local] = field(default_factory=dict)
    sampled: dict[str, Choice] = field(default_factory=dict)
    """The choices that are used, by the name of their local."""

    def start(self, outputs: bool = True) -> Values:
        """The values before a step: variables as they are, outputs (unless they are kept) at their `init`."""
        known: dict[Key, Expr] = {(FAULT, None): const(0)}
        for v in self.variables.values():
            single = isinstance(v.type, Int) and v.type.low == v.type.high
            for key, init in scalars(v):
                fixed = (v.output and outputs) or single
                index = None if key[1] is None else const(key[1])
                known[key] = Const(init, v.type) if fixed else Get(v.name, index, v.type)
        return Values(None, known)

    # ------------------------------------------------------------ statements

    def run(self, block: Block, values: Values) -> None:
        """Bring `values` to the end of `block`. After a fault they mean nothing, but FAULT stays."""
        tick()
        for s in block:
            self._statement(s, values)

    def _statement(self, s: Stmt, values: Values) -> None:
        match s:
            case Let(local, value):
                values.changes["%" + local.name, None] = self.stored(self.value(value, values), local.type)
            case Set(name, None, value):
                values.changes[name, None] = self.stored(self.value(value, values), self.variables[name].type)
            case Set(name, index, value) if index is not None:
                stored = self.stored(self.value(value, values), self.variables[name].type)
                self._store(name, self.value(index, values), stored, values)
            case Sample(local, choice):
                values.changes["%" + local.name, None] = self._sample(choice)
            case Fault(number, when):
                before = values.get((FAULT, None))
                assert before is not None
                now = self.value(when, values)
                first = op("and", op("eq", before, const(0)), now)
                values.changes[FAULT, None] = self.name(ite(self.name(first), const(number + 1), before))
            case If(condition, then, otherwise):
                self._branch([(self.value(condition, values), then)], otherwise, values)
            case Switch(value, cases, default):
                chosen = self.value(value, values)
                self._branch([(self.name(op("eq", chosen, const(k))), b) for k, b in cases], default, values)

    def _sample(self, name: str) -> Expr:
        choice = self.choices[name]
        if choice.type.low == choice.type.high:
            return Const(choice.type.low, choice.type)
        local = f"?{name}{self.suffix}"
        self.sampled[local] = choice
        return Local(local, choice.type)

    def _store(self, array: str, index: Expr, value: Expr, values: Values) -> None:
        for key, _ in scalars(self.variables[array]):
            old = values.get(key)
            assert old is not None
            assert key[1] is not None
            here = self.name(op("eq", index, const(key[1])))
            values.changes[key] = self.name(ite(here, value, old))

    def _branch(self, arms: list[tuple[Expr, Block]], default: Block, values: Values) -> None:
        ways: list[tuple[Expr, Values]] = []
        last = Values(values)
        for condition, block in [*arms, (TRUE, default)]:
            if condition == FALSE:
                continue
            way = Values(values)
            self.run(block, way)
            if condition == TRUE:
                last = way
                break
            ways.append((condition, way))
        for key in dict.fromkeys(k for way in [*(w for _, w in ways), last] for k in way.changes):
            merged = last.get(key)
            for condition, way in reversed(ways):
                mine = way.get(key)
                if mine is not None:
                    merged = mine if merged is None or merged == mine else self.name(ite(condition, mine, merged))
            assert merged is not None
            values.changes[key] = merged

    # ------------------------------------------------------------ expressions

    def value(self, e: Expr, values: Values) -> Expr:
        """An expression at a point, as a name, a variable or a constant."""

        def visit(node: Expr, args: list[Expr]) -> Expr:
            return self.name(self._visit(node, args, values))

        return fold(e, visit)

    def _visit(self, node: Expr, args: list[Expr], values: Values) -> Expr:
        match node:
            case Get(name, None, _):
                found = values.get((name, None))
                assert found is not None, name
                return found
            case Get(name, _, _):
                return self._element(name, args[0], values)
            case Local(name, _):
                found = values.get(("%" + name, None))
                assert found is not None, name
                return found
            case Ite():
                return ite(args[0], args[1], args[2])
            case Op(name, _, kind):
                return self.operation(name, args, kind)
        return node

    def _element(self, array: str, index: Expr, values: Values) -> Expr:
        elements = [values.get(key) for key, _ in scalars(self.variables[array])]
        if isinstance(index, Const) and 0 <= index.value < len(elements):
            found = elements[index.value]
            assert found is not None
            return found
        # An index outside has been a fault before; then any value will do.
        result = elements[-1]
        assert result is not None
        for i, element in reversed(list(enumerate(elements[:-1]))):
            assert element is not None
            result = self.name(ite(self.name(op("eq", index, const(i))), element, result))
        return result

    def stored(self, e: Expr, kind: Type) -> Expr:
        """A named value, as one of `kind`, in which it lies (the program has checked that)."""
        return typed(e, kind)

    def operation(self, name: OpName, args: list[Expr], kind: Type) -> Expr:
        """An operation on named arguments; `kind` is its type."""
        if name == "wrap":
            assert isinstance(kind, Int)
            return wrapped(args[0], kind)
        return op(name, *args)

    def name(self, e: Expr) -> Expr:
        """`e` itself when it is small, else its name."""
        if isinstance(e, (Const, Local, Get)):
            return e
        if e not in self.made:
            self.made[e] = Local(f"#{len(self.made)}", e.type)
        return self.made[e]


class BoundedDefinitions(Definitions):
    """Values that are stored have the bounds of the place where they are: else those of what comes after would grow."""

    def stored(self, e: Expr, kind: Type) -> Expr:
        if _inside(e, kind) or isinstance(e, Const):
            return typed(e, kind)
        return self.name(Ite(TRUE, e, e, kind))

    def operation(self, name: OpName, args: list[Expr], kind: Type) -> Expr:
        made = Definitions.operation(self, name, args, kind)
        # The program knows closer bounds than those of the arguments, where it has checked them.
        return Op(made.op, made.args, kind) if isinstance(made, Op) and not _inside(made, kind) else made


def _inside(e: Expr, kind: Type) -> bool:
    """The bounds of an expression are inside those of a type."""
    bounds = interval(e)
    return not isinstance(kind, Int) or (bounds is not None and kind.low <= bounds[0] and bounds[1] <= kind.high)


def typed(e: Expr, kind: object) -> Expr:
    """A constant stored as a Boolean is one."""
    return Const(e.value, kind) if isinstance(e, Const) and isinstance(kind, Int) and kind.boolean else e


def scalars(v: Var) -> Iterator[tuple[Key, int]]:
    """The scalars of a variable with what they start with."""
    if isinstance(v.init, tuple):
        yield from (((v.name, i), x) for i, x in enumerate(v.init))
    else:
        yield (v.name, None), v.init

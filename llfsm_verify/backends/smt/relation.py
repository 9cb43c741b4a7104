"""A ringlet as a relation over Z3 terms: every variable after it, in terms of those before and of the choices.

How many bits the numbers of a step can have: a solver computes exactly, and a number squared again and again is soon
larger than any time or memory.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass

import z3

from llfsm_verify.backends.smt.arithmetic import Arithmetic, BitVectors, Integers, Term, choose, is_bool, operate
from llfsm_verify.limits import tick
from llfsm_verify.program.program import (
    Block,
    Choice,
    Const,
    Expr,
    Get,
    Int,
    Ite,
    Local,
    Op,
    Program,
    Type,
    Unbounded,
    Var,
)
from llfsm_verify.program.symbolic import FAULT, BoundedDefinitions, Definitions, Key, Values, scalars
from llfsm_verify.program.terms import const
from llfsm_verify.program.trees import distinct_nodes, expressions, fold, ringlet, statements

MAX_BITS = 10_000
"""Larger numbers are given to no solver. Python reads up to 4,300 digits, about 14,000 bits, from a model."""
ANY_BITS = 64
"""What is assumed of an `int` about which nothing is known."""


class NumberTooLarge(MemoryError):
    """A value may have more than `MAX_BITS` bits."""

    def __init__(self) -> None:
        super().__init__(f"a value of type int may have more than {MAX_BITS:,} bits, and no solver is asked about it")


def multiplies(expressions: Iterable[Expr]) -> bool:
    """Some product has no bounds: without one, numbers grow by a bit for each operation at most."""
    return any(
        isinstance(node, Op) and node.op == "mul" and isinstance(node.type, Unbounded)
        for e in expressions
        for node in distinct_nodes(e)
    )


def size_of(root: Expr, before: Mapping[Key, int], locals_: Mapping[str, int]) -> int:
    """The bits that suffice for the value of an expression; `before` and `locals_` are those of what it reads, where
    the type does not tell. Raises NumberTooLarge for it and for every value on the way."""

    def visit(node: Expr, args: list[int]) -> int:
        match node:
            case Const(value, _):
                return value.bit_length()
            case Get(name, index, kind):
                bits = _element(before, name, index)
            case Local(name, kind):
                bits = locals_.get(name, ANY_BITS)
            case Ite(_, _, _, kind):
                bits = max(args[1], args[2])
            case Op(op, _, kind):
                bits = _operated(op, args)
        bits = _limited(bits, kind)
        if bits > MAX_BITS:
            raise NumberTooLarge
        return bits

    return fold(root, visit)


def _element(before: Mapping[Key, int], name: str, index: Expr | None) -> int:
    if index is None or isinstance(index, Const):
        return before.get((name, None if index is None else index.value), ANY_BITS)
    return max((bits for key, bits in before.items() if key[0] == name), default=ANY_BITS)


def _operated(op: str, args: list[int]) -> int:
    match op:
        case "add" | "sub":
            return max(args) + 1
        case "mul":
            return sum(args)
        case "div":
            return args[0]
        case "mod":
            return min(args)
    return max(args)


def _limited(bits: int, kind: Type) -> int:
    return min(bits, max(kind.low.bit_length(), kind.high.bit_length())) if isinstance(kind, Int) else bits


@dataclass(frozen=True, slots=True)
class Relation:
    """A step. It is a function: with the choices given, there is one `after`, or a fault.

    `after` has the variables and outputs that the step may change; all others keep their values. It means nothing where
    `fault` is not 0. `choices` are those that the step may read, by name.
    """

    choices: Mapping[str, Term]
    after: Mapping[Key, Term]
    fault: Term
    """1 + the number of the fault in which the step ends, 0 where it ends in none."""
    grown: Callable[[Mapping[Key, int]], Mapping[Key, int]]
    """The bits of numbers after a step that multiplies, given those before it. NumberTooLarge."""


class Terms:
    """The variables of a program as Z3 constants, and its steps as relations over them.

    One theory for the whole program, since solvers are worst at terms that change between two: bit-vectors where
    every value has bounds, else integers.
    """

    def __init__(self, program: Program, arithmetic: Arithmetic | None = None) -> None:
        """ValueError: bit-vectors were asked for, and some value has no bounds."""
        self.program = program
        bounded = is_bounded(program)
        if arithmetic is None:
            arithmetic = BitVectors() if bounded else Integers()
        elif isinstance(arithmetic, BitVectors) and not bounded:
            raise ValueError("a value without bounds is not a bit vector")
        self.arithmetic: Arithmetic = arithmetic
        self._variables = {v.name: v for v in program.vars}
        self._choices = {c.name: c for c in program.choices}
        self.before: dict[Key, Term] = {
            key: arithmetic.constant(_text(key), v.type) for v in program.vars for key, _ in scalars(v)
        }
        """Every scalar, outputs among them, as it is before a step."""
        self._choice_terms = {c.name: arithmetic.constant(f"?{c.name}", c.type) for c in program.choices}

    @property
    def configuration(self) -> Iterator[tuple[Key, Var, int]]:
        """The scalars of a configuration: key, variable, value in the beginning."""
        for v in self.program.vars:
            if not v.output:
                for key, init in scalars(v):
                    yield key, v, init

    @property
    def outputs(self) -> Iterator[tuple[Key, Var, int]]:
        for v in self.program.vars:
            if v.output:
                for key, init in scalars(v):
                    yield key, v, init

    def literal(self, key: Key, value: int) -> Term:
        """A value of a scalar."""
        return self.arithmetic.literal(value, self._variables[key[0]].type)

    def slot(self, number: int) -> Relation:
        """A step of the machine in slot `number` when it has the turn, with its letter."""
        program = self.program
        slot = program.slots[number]
        process = program.processes[slot.process]
        position = process.slots.index(number)
        known: dict[Key, Expr] = {(process.turn, None): const(position)}
        return self._relation((*ringlet(program, number), *program.letter), known)

    def stutter(self) -> Relation:
        """The step of an arrangement that has ended."""
        return self._relation(self.program.letter_stutter, {})

    def _relation(self, block: Block, known: Mapping[Key, Expr]) -> Relation:
        definitions = BoundedDefinitions(self._variables, self._choices)
        values = definitions.start(outputs=False)
        values.changes |= dict(known)
        before = dict(values.changes)
        definitions.run(block, values)
        grown = _growth(definitions, values)
        grown({})
        made: dict[str, Term] = {}
        for expression, local in definitions.made.items():
            tick()
            made[local.name] = self._term(expression, made, definitions.sampled)
        after = {
            key: self.arithmetic.cast(self._term(value, made, definitions.sampled), self._variables[key[0]].type)
            for key, value in values.changes.items()
            if key[0] in self._variables and before.get(key) != value and value != _unchanged(key, value)
        }
        for key, value in known.items():  # the turn is known, and may stay what it is
            after.setdefault(key, self.literal(key, _value(value)))
        fault = values.get((FAULT, None))
        assert fault is not None
        choices = {c.name: self._choice_terms[c.name] for c in definitions.sampled.values()}
        return Relation(choices, after, self._term(fault, made, definitions.sampled), grown)

    def expression(self, root: Expr, inputs: Mapping[str, Term]) -> Term:
        """An expression over variables before a step; `inputs` are its locals."""
        return self._term(root, inputs, {})

    def _term(self, root: Expr, made: Mapping[str, Term], sampled: Mapping[str, Choice]) -> Term:
        arithmetic = self.arithmetic

        def visit(node: Expr, args: list[Term]) -> Term:
            match node:
                case Const(value, kind):
                    return arithmetic.literal(value, kind)
                case Get(name, index, _):
                    return self._get(name, args[0] if index is not None else None)
                case Local(name, _):
                    return self._choice_terms[sampled[name].name] if name in sampled else made[name]
                case Ite(_, _, _, kind):
                    return choose(arithmetic, args[0], args[1], args[2], kind)
                case Op(name, _, kind):
                    return operate(arithmetic, name, args, kind)
            raise AssertionError(node)

        return fold(root, visit)

    def _get(self, name: str, index: Term | None) -> Term:
        if index is None:
            return self.before[name, None]
        keys = [key for key, _ in scalars(self._variables[name])]
        # Symbolic evaluation has resolved every index that is not known; those of atoms are few.
        result = self.before[keys[-1]]
        for key in reversed(keys[:-1]):
            assert key[1] is not None
            here = operate(self.arithmetic, "eq", [index, self.arithmetic.literal(key[1], const(key[1]).type)], _BOOL)
            result = choose(self.arithmetic, here, self.before[key], result, result.type)
        return result


_BOOL = Int(0, 1, True)


def _growth(definitions: Definitions, values: Values) -> Callable[[Mapping[Key, int]], Mapping[Key, int]]:
    """See `Relation.grown`."""
    if not multiplies(definitions.made):
        return lambda _: {}

    def grown(before: Mapping[Key, int]) -> Mapping[Key, int]:
        locals_: dict[str, int] = {}
        for expression, local in definitions.made.items():
            locals_[local.name] = size_of(expression, before, locals_)
        return {
            key: size_of(value, before, locals_)
            for key, value in values.changes.items()
            if key[0] in definitions.variables
        }

    return grown


def _unchanged(key: Key, value: Expr) -> Expr:
    """What `value` would be if the step left the scalar as it is."""
    return Get(key[0], None if key[1] is None else const(key[1]), value.type)


def _value(e: Expr) -> int:
    assert isinstance(e, Const)
    return e.value


def _text(key: Key) -> str:
    return key[0] if key[1] is None else f"{key[0]}[{key[1]}]"


def is_bounded(program: Program) -> bool:
    """Every value that a step computes, and every variable, has bounds inside 64 bits."""
    blocks = [ringlet(program, i) for i in range(len(program.slots))]
    blocks += [program.letter, program.letter_stutter]
    kinds: set[Type] = {v.type for v in program.vars}
    for block in blocks:
        for s in statements(block):
            for e in expressions(s):
                kinds |= {n.type for n in distinct_nodes(e)}
    kinds |= {n.type for a in program.atoms for n in distinct_nodes(a.expression)}
    return all(isinstance(k, Int) for k in kinds)


def distinct(terms: Mapping[Key, Term], others: Mapping[Key, Term]) -> z3.BoolRef:
    """Two configurations differ."""
    return z3.Or([terms[k].z3 != others[k].z3 for k in terms])


__all__ = ["Relation", "Term", "Terms", "distinct", "is_bool", "is_bounded"]

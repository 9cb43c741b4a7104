"""Edges in formulas, for searches: `rose(p)` is `p && Y !p`, `fell(p)` and `changed(p)` are alike.

In a step program an edge is a hidden variable, which takes part in the configurations of all properties. In a formula
it is a bit beside the formula's own automaton (`automata/ltl/history.py`). So a search has the operands as atoms, and
reads edges as past; runs are performed with the edges as they are written, which traces show. An edge stays a hidden
variable where it is a letter (of a rule, an automaton, a regular expression), where it compares values that are not
Boolean, and where a formula has so many that its automaton would grow by more than a factor of 2^MOST. That is decided
for each line: what one needs as hidden variables, others still read as past.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from types import MappingProxyType

from llfsm_verify.checking.problem import Problem, only_shown
from llfsm_verify.language.trees import of_kind
from llfsm_verify.language.typed import Binary, Edge, Expression, Literal, Unary
from llfsm_verify.language.types import BoolType
from llfsm_verify.logic.formula import (
    BINDING,
    FALSE,
    TRUE,
    Formula,
    Op,
    apply,
    atom,
    conjunction,
    disjunction,
    negation,
    operators,
    postorder,
)
from llfsm_verify.logic.properties import Property
from llfsm_verify.semantics.letters import Observed, TimePasses

MOST = 4
"""Operators of the past that edges may add to a formula."""
_OPERATORS: Mapping[str, Op] = {"and": "and", "or": "or", "xor": "xor", "ne": "xor", "eq": "iff"}


def with_edges_as_past(problem: Problem) -> Problem:
    """The problem whose searches read edges in formulas as past. Performed runs show the same atoms as before."""
    parts = _Operands(problem)
    found = {
        a.name: written
        for a in problem.atoms
        if not isinstance(a.expression, TimePasses)
        and any(of_kind(a.expression, Edge))
        and (written := parts.written(a.expression, a.name)) is not None
    }
    properties = tuple(_read_as_past(line, found) for line in problem.properties)
    assumptions = tuple(_read_as_past(line, found) for line in problem.assumptions)
    lines = (*properties, *assumptions)
    if not any(line.edges for line in lines):
        return problem
    read = {key for line in lines for key in line.searched}
    operands = (Observed(name, e) for name, e in parts.new.items() if name in read)
    return replace(
        problem,
        properties=properties,
        assumptions=assumptions,
        atoms=tuple(sorted((*problem.atoms, *operands), key=lambda a: a.name)),
        shown=only_shown(lines),
    )


def _read_as_past(line: Property, found: Mapping[str, Formula]) -> Property:
    """The line with its edges, where they may become past: all of them, or none."""
    if line.formula is None or operators(line.formula) & BINDING:
        return line
    edges = {key: found[key] for key in line.atoms if key in found}
    added = {node for f in edges.values() for node in postorder(f) if node.op == "Y"}
    return replace(line, edges=MappingProxyType(edges)) if edges and len(added) <= MOST else line


class _Operands:
    """What edges are about, as atoms: those of the problem, and `new` ones by their names."""

    def __init__(self, problem: Problem) -> None:
        self._names = {_shape(a.expression): a.name for a in problem.atoms}
        self._taken = {a.name for a in problem.atoms}
        self.new: dict[str, Expression] = {}

    def written(self, e: Expression, text: str) -> Formula | None:
        """The formula of a condition that has the name `text`; None: it has an edge that is no formula."""
        match e:
            case Edge():
                called = text.startswith(f"{e.kind}(")
                return self._edge(e, text[len(e.kind) + 1 : -1].strip() if called else _text(e.operand))
            case Literal():
                return TRUE if e.value else FALSE
            case Unary("not"):
                operand = self.written(e.operand, _text(e.operand))
                return None if operand is None else negation(operand)
            case Binary() if e.op in _OPERATORS and any(of_kind(e, Edge)) and isinstance(e.left.type, BoolType):
                sides = [self.written(side, _text(side)) for side in (e.left, e.right)]
                known = [side for side in sides if side is not None]
                return apply(_OPERATORS[e.op], *known) if len(known) == len(sides) else None
        return None if any(of_kind(e, Edge)) else atom(self._name(e, text))

    def _edge(self, e: Edge, text: str) -> Formula | None:
        now = self.written(e.operand, text) if isinstance(e.operand.type, BoolType) else None
        if now is None:
            return None
        rose = conjunction((now, apply("Y", negation(now))))
        fell = conjunction((negation(now), apply("Y", now)))
        return {"rose": rose, "fell": fell, "changed": disjunction((rose, fell))}[e.kind]

    def _name(self, e: Expression, text: str) -> str:
        """The name of the atom of a condition: the one that it has, or its text."""
        shape = _shape(e)
        if shape not in self._names:
            number, name = 1, text
            while name in self._taken:
                number, name = number + 1, f"{text} ({number + 1})"
            self._taken.add(name)
            self._names[shape], self.new[name] = name, e
        return self._names[shape]


def _text(e: Expression) -> str:
    return " ".join(e.span.text.split())


def _shape(e: object) -> object:
    """A typed tree without its places."""
    if isinstance(e, tuple):
        return tuple(map(_shape, e))
    return (type(e), *(_shape(getattr(e, f.name)) for f in fields(e) if f.name != "span")) if is_dataclass(e) else e

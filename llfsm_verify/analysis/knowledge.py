"""Whether two conditions are the same: of theories and expressions over their inputs, or of atoms of an arrangement.

Z3 is asked for values for which one of the two is true and the other is not. If there are none, the two are equal.
Values that it finds are brought near to those that variables begin with, and both conditions are evaluated for them
without it, a theory by its definition; another answer there is a `Disagreement`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Literal as OneOf

import z3

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.backends.smt.arithmetic import BitVectors, Term, truth
from llfsm_verify.backends.smt.relation import Terms
from llfsm_verify.backends.smt.solver import GaveUp, model_of, wait_for
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Disagreement, Fragment
from llfsm_verify.knowledge.compiled import compiled
from llfsm_verify.knowledge.explaining import explained
from llfsm_verify.knowledge.theory import Literal, Theory
from llfsm_verify.language import syntax, typed
from llfsm_verify.language.atoms import PropertyScope, check_atom
from llfsm_verify.language.expressions import ExpressionChecker
from llfsm_verify.language.parser import parse_guard
from llfsm_verify.language.scope import Scope, did_you_mean
from llfsm_verify.language.trees import nodes
from llfsm_verify.language.types import BoolType
from llfsm_verify.limits import Budget, LimitReached
from llfsm_verify.program.program import BOOL, Atom, Const, Expr, Get, Int, Origin, Program, Var
from llfsm_verify.program.symbolic import Key, scalars
from llfsm_verify.program.trees import constant_of, distinct_nodes, rebuilt, spelt_out
from llfsm_verify.semantics.letters import Observed
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.semantics.numbers import binary, choose, unary
from llfsm_verify.values import Shown, element_names, shown, text

ABOUT_MACHINES = (typed.AtState, typed.Observe, typed.Query, typed.Sampled, typed.Sampling, typed.Edge)
"""What of a property is not decided by the values of variables."""
_HELD = Int(-(1 << 63), (1 << 63) - 1)
"""The values of a variable without bounds."""


@dataclass(frozen=True, slots=True)
class Known:
    """An output of a theory: `atom`."""

    theory: Theory
    atom: str

    @property
    def text(self) -> str:
        """What users call it: by the file, and by the output where there are several."""
        return f"{self.theory.source.name}{f' ({self.atom})' if len(self.theory.outputs) > 1 else ''}"


Side = Known | Fragment
"""An output of a theory, or the text of an expression."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """Two conditions, and whether they are the same for all values of what they read."""

    sides: tuple[str, str]
    reads: tuple[str, ...]
    answer: OneOf["equal", "different", "unknown"] = "unknown"
    reason: str | None = None
    """Why it is unknown."""
    values: Mapping[str, Shown] = field(default_factory=dict)
    """What tells them apart: a value for each name in `reads`; `truths`: what the two are there."""
    truths: tuple[bool, ...] = ()
    alone: tuple[tuple[str, ...], ...] = ()
    """Of two theories, the inputs of each that the other one does not have."""
    arrangement: str | None = None
    """The name of the arrangement whose atoms they are."""

    @property
    def exit_code(self) -> int:
        """That of the command."""
        return {"equal": 0, "different": 1, "unknown": 4}[self.answer]


class _OverInputs(ExpressionChecker):
    """Expressions over inputs of theories."""

    def unknown(self, node: syntax.Path, enumerators: tuple[str, ...] = ()) -> DiagnosticError:
        name, known = node.name.text, [*self.scope.variables, *enumerators]
        hint = did_you_mean(name, known) or "name an input of the theory"
        return self.fail("E110", f"there is no input `{name}`", node.name, hint)


def compare(left: Side, right: Side, budget: Budget) -> Comparison:
    """Two outputs of theories, or one and an expression over its inputs; an input that both have is one input.

    DiagnosticError: a text is not an expression, or has more in it than truth values of inputs (E145).
    """
    theories = [side.theory for side in (left, right) if isinstance(side, Known)]
    inputs = {name: span for theory in theories for name, span in theory.inputs.items()}
    variables = {name: typed.Variable(name, BoolType(), False, "whiteboard", span) for name, span in inputs.items()}
    scope = Scope(variables, {}, {}, (), "", {}, {}, frozenset(variables))
    known: dict[str, Expr] = {name: Get(name, None, BOOL) for name in inputs}

    def lowered(side: Side) -> Expr:
        if isinstance(side, Fragment):
            return _logical(_OverInputs(scope, side).boolean(parse_guard(side).root), known)
        found, made = compiled(side.theory, Literal(side.atom)), dict(known)
        for local, definition in found.definitions:
            made[local.key] = _logical(definition, made)
        return _logical(found.value, made)

    def defined(side: Side, condition: Expr, values: Mapping[Key, int]) -> bool:
        if isinstance(side, Fragment):
            return evaluate(condition, values)
        valuation = {name: bool(value) for (name, _), value in values.items()}
        return explained(side.theory, Literal(side.atom), valuation).proved

    conditions = lowered(left), lowered(right)
    ways = [partial(defined, side, condition) for side, condition in zip((left, right), conditions, strict=True)]
    declared = [Var(name, BOOL, 0, Origin("input")) for name in inputs]
    result = _compared((left, right), declared, conditions, ways, budget)
    own = [theory.inputs for theory in theories]
    alone = tuple(tuple(n for n in one if n not in other) for one, other in zip(own, reversed(own), strict=True))
    return replace(result, alone=alone if len(own) == 2 else ())


def compare_in(arrangement: Arrangement, left: Fragment, right: Fragment, budget: Budget) -> Comparison:
    """Two atoms of properties of an arrangement, for all values of the types of the variables that they read.

    DiagnosticError: a text is not such an atom, or asks about more than values of variables (E145).
    """
    scope = PropertyScope.of(arrangement)
    atoms = [Observed(name, check_atom(side, scope)) for name, side in (("left", left), ("right", right))]
    for node in nodes(tuple(atom.expression for atom in atoms)):
        if isinstance(node, ABOUT_MACHINES):
            message = "this asks about machines or steps, and only conditions on the values of variables are compared"
            raise DiagnosticError(Diagnostic("E145", message, node.span, hint="leave it out on both sides"))
    program = lower(arrangement, atoms)
    inputs = [Var(i.name, i.type, i.init, Origin("input", labels=i.labels)) for i in program.inputs]
    order = [w.variable.name for w in arrangement.whiteboard]
    variables = sorted((*program.vars, *inputs), key=lambda v: (*order, _root(v.name)).index(_root(v.name)))
    stored = {f"input:{i.name}": Get(i.name, None, i.type) for i in program.inputs}
    conditions = [spelt_out(atom.expression, stored) for atom in program.atoms]
    ways = [partial(evaluate, condition) for condition in conditions]
    result = _compared((left, right), variables, conditions, ways, budget)
    return replace(result, arrangement=arrangement.name)


def _root(name: str) -> str:
    """The variable of which something is a part: ``ball`` of ``ball.x`` and ``ball[0]``."""
    return name.replace("[", ".").partition(".")[0]


def _key(node: Get) -> Key:
    return node.var, node.index.value if isinstance(node.index, Const) else None


def _logical(e: typed.Expression, known: Mapping[str, Expr]) -> Expr:
    """An expression of truth values; `known`: what variables and locals stand for. DiagnosticError (E145): another."""
    match e:
        case typed.Literal(value=bool(value)):
            return Const(int(value), BOOL)
        case typed.Read(variable=variable):
            return known[variable.name]
        case typed.ReadLocal(local=local):
            return known[local.key]
        case typed.Unary("not"):
            return unary(e, _logical(e.operand, known))
        case typed.Binary("and" | "or" | "eq" | "ne"):
            return binary(e, _logical(e.left, known), _logical(e.right, known))
        case typed.Conditional():
            return choose(*(_logical(part, known) for part in (e.condition, e.then, e.otherwise)))
    message = "inputs of theories are truth values, and this is something else"
    raise DiagnosticError(Diagnostic("E145", message, e.span, hint="join inputs by `&&`, `||`, `!`, `==` and `!=`"))


def evaluate(condition: Expr, values: Mapping[Key, int]) -> bool:
    """The truth of a condition for values of what it reads, without a solver."""
    known = rebuilt(condition, lambda node: Const(values[_key(node)], node.type) if isinstance(node, Get) else None)
    return bool(constant_of(known))


def _compared(
    sides: tuple[Side, Side],
    variables: Sequence[Var],
    conditions: Sequence[Expr],
    ways: Sequence[Callable[[Mapping[Key, int]], bool]],
    budget: Budget,
) -> Comparison:
    """The comparison of two conditions over variables; `ways` evaluate them without a solver. Disagreement."""
    read = {_key(node) for condition in conditions for node in distinct_nodes(condition) if isinstance(node, Get)}
    scalar = {key: (v, begin) for v in variables for key, begin in scalars(v) if key in read}
    names = {key: element_names(v)[key[1] or 0] for key, (v, _) in scalar.items()}
    left, right = (side.text.strip() for side in sides)
    result = Comparison((left, right), tuple(names.values()))
    try:
        values = _apart(scalar, conditions, budget)
    except (LimitReached, GaveUp) as reason:
        return replace(result, reason=str(reason))
    if values is None:
        return replace(result, answer="equal")
    told = {names[key]: shown(v.type, v.origin.labels, values[key]) for key, (v, _) in scalar.items()}
    truths = tuple(way(values) for way in ways)
    if truths[0] == truths[1]:
        where = ", ".join(f"{name}={text(value)}" for name, value in told.items())
        raise Disagreement(f"Z3 tells `{left}` and `{right}` apart where {where}, and they are the same there")
    return replace(result, answer="different", values=told, truths=truths)


def _apart(scalar: Mapping[Key, tuple[Var, int]], conditions: Sequence[Expr], budget: Budget) -> dict[Key, int] | None:
    """Values for which one condition is true and the other is not, as near as one after the other can be to where
    variables begin. LimitReached, GaveUp: that is not known."""
    variables = {v.name: v for v, _ in scalar.values()}
    atoms = tuple(Atom("", "", condition) for condition in conditions)
    terms = Terms(Program("", "cycle", tuple(variables.values()), (), (), (), (), (), (), (), atoms, (), ()))
    arithmetic, before = terms.arithmetic, terms.before
    solver = z3.SolverFor("QF_FD") if isinstance(arithmetic, BitVectors) else z3.Solver()
    for key in scalar:
        unknown = before[key]
        solver.add(arithmetic.within(unknown if isinstance(unknown.type, Int) else Term(unknown.z3, _HELD)))
    solver.add(z3.Xor(*(truth(arithmetic, terms.expression(condition, {})) for condition in conditions)))
    wait_for(solver.push, solver.ctx, budget.check)  # it takes in what was added: perhaps long work
    model = model_of(solver, budget.check)
    if model is None:
        return None
    with suppress(LimitReached, GaveUp):
        for key, (_, begin) in scalar.items():
            solver.push()
            solver.add(before[key].z3 == terms.literal(key, begin).z3)
            nearer = model_of(solver, budget.check)
            if nearer is None:
                solver.pop()
            else:
                model = nearer
    return {key: arithmetic.value(model, before[key]) for key in scalar}

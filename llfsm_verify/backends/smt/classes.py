"""Classes of inputs: valuations that give some terms the same values, found one by one with their smallest members."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import z3

from llfsm_verify.backends.smt.arithmetic import Term, operate
from llfsm_verify.backends.smt.relation import Terms
from llfsm_verify.backends.smt.solver import GaveUp, SolverBudget, model_of
from llfsm_verify.limits import LimitReached, reached
from llfsm_verify.program.outcomes import PREFIX
from llfsm_verify.program.program import BOOL, Choice, Expr, Get, Int, OpName
from llfsm_verify.program.terms import const
from llfsm_verify.program.trees import distinct_nodes

EFFORT = 20_000_000
"""Units of the solver's work for one question: some seconds."""
Tuple = tuple[int, ...]
"""A value for each choice of a group, in its order."""


@dataclass(frozen=True, slots=True)
class Class:
    """Valuations of a group of choices with one outcome: that of its smallest member, first choice first."""

    member: Tuple
    label: z3.BoolRef
    """Over the choices of the group: the members of the class, and nothing else inside the choices' types."""


class Group:
    """Choices that are split together, and the terms that must not tell the members of a class apart.

    `check` is called between attempts of the solver, and may raise to stop. What asks the solver raises GaveUp, and
    LimitReached where nothing is left of `effort`.
    """

    def __init__(
        self,
        terms: Terms,
        choices: Sequence[Choice],
        asked: Sequence[Expr],
        check: Callable[[], None],
        effort: SolverBudget,
    ) -> None:
        self._terms = terms
        self._check = check
        self._effort = effort
        self.choices = tuple(choices)
        arithmetic = terms.arithmetic
        self.constants = [arithmetic.constant(f"{PREFIX}{c.name}", c.type) for c in choices]
        """The choices, as labels name them."""
        locals_ = {f"{PREFIX}{c.name}": k for c, k in zip(choices, self.constants, strict=True)}
        self._asked = [terms.expression(e, locals_) for e in asked]
        self._mentioned = {n.var for e in asked for n in distinct_nodes(e) if isinstance(n, Get)}
        self._range = [arithmetic.within(k) for k in self.constants]

    def classes(self, variables: Mapping[Get, int], most: int, guessed: Sequence[int] = ()) -> list[Class] | None:
        """All classes where the variables have these values, by their smallest members, ascending; None: there are more
        than `most`. `guessed` are values of the only choice at which classes may begin: when they are all there are,
        the solver is asked no more than that."""
        asked = self._at(variables)
        solver = self._solver()
        if guessed:
            confirmed = self._confirmed(solver, asked, guessed)
            if confirmed is not None:
                return confirmed if len(confirmed) <= most else None
        found: list[Class] = []
        while True:
            member = self._smallest(solver, [])
            if member is None:
                return found
            if len(found) == most:
                return None
            label = z3.simplify(z3.And(*self._equal(asked, member), *self._range))
            found.append(Class(member, label))
            solver.add(z3.Not(label))

    def _confirmed(self, solver: z3.Solver, asked: Sequence[z3.ExprRef], guessed: Sequence[int]) -> list[Class] | None:
        """The classes of the values guessed, when below or at every value there is one of the same class."""
        (constant,) = self.constants
        found: dict[int, Class] = {}  # by the number of the label: Z3 has each term once
        for value in sorted(set(guessed)):
            label = z3.simplify(z3.And(*self._equal(asked, (value,)), *self._range))
            found.setdefault(label.get_id(), Class((value,), label))
        solver.push()
        for known in found.values():
            above = self._compared("ge", constant, known.member[0])
            solver.add(z3.Not(z3.And(above, known.label)))
        missing = self._model(solver)
        solver.pop()
        return None if missing is not None else list(found.values())

    def _model(self, solver: z3.Solver) -> z3.ModelRef | None:
        try:
            return model_of(solver, self._check, SolverBudget(EFFORT, self._effort))
        except GaveUp:
            if self._effort.most is None or self._effort.left:
                raise
            raise LimitReached(reached(self._effort.most, "work")) from None

    def _solver(self) -> z3.Solver:
        solver = z3.Solver()
        solver.add(*self._range)
        return solver

    def _at(self, variables: Mapping[Get, int]) -> list[z3.ExprRef]:
        given = [self._given(v, x) for v, x in variables.items()]
        return [z3.simplify(z3.substitute(t.z3, *given)) for t in self._asked]

    def _given(self, variable: Get, value: int) -> tuple[z3.ExprRef, z3.ExprRef]:
        term = self._terms.expression(variable, {})
        return z3.simplify(term.z3), self._terms.arithmetic.literal(value, variable.type).z3

    def _equal(self, asked: Sequence[z3.ExprRef], member: Tuple) -> list[z3.BoolRef]:
        """That the terms have the values that they have for a member."""
        given = [(k.z3, self._literal(k, x)) for k, x in zip(self.constants, member, strict=True)]
        values = [z3.simplify(z3.substitute(t, *given)) for t in asked]
        return [t == value for t, value in zip(asked, values, strict=True)]

    def _literal(self, constant: Term, value: int) -> z3.ExprRef:
        return self._terms.arithmetic.literal(value, constant.type).z3

    def _compared(self, comparison: OpName, constant: Term, value: int) -> z3.BoolRef:
        literal = self._terms.arithmetic.literal(value, const(value).type)
        return operate(self._terms.arithmetic, comparison, [constant, literal], BOOL).z3

    def _smallest(self, solver: z3.Solver, among: Sequence[z3.BoolRef]) -> Tuple | None:
        """The smallest valuation, first choice first, of what the solver knows and `among`; None: there is none."""
        arithmetic = self._terms.arithmetic
        solver.push()
        try:
            solver.add(*among)
            model = self._model(solver)
            if model is None:
                return None
            found: list[int] = []
            for constant in self.constants:
                assert isinstance(constant.type, Int)
                low, high = constant.type.low, arithmetic.value(model, constant)
                while low < high:
                    middle = (low + high) // 2
                    solver.push()
                    solver.add(self._compared("le", constant, middle))
                    smaller = self._model(solver)
                    solver.pop()
                    if smaller is None:
                        low = middle + 1
                    else:
                        model, high = smaller, arithmetic.value(smaller, constant)
                found.append(low)
                solver.add(constant.z3 == self._literal(constant, low))
                if len(found) < len(self.constants):
                    again = self._model(solver)
                    assert again is not None
                    model = again
            return tuple(found)
        finally:
            solver.pop()

    # ------------------------------------------------------------ representatives that are expressions

    def suffices(self, candidates: Sequence[Expr]) -> bool:
        """Whatever the variables: below or at every value of the only choice there is a candidate with its outcome."""
        (constant,) = self.constants
        arithmetic = self._terms.arithmetic
        solver = self._solver()
        solver.add(*(arithmetic.within(t) for (var, _), t in self._terms.before.items() if var in self._mentioned))
        for candidate in candidates:
            value = arithmetic.cast(self._terms.expression(candidate, {}), constant.type)
            below = operate(arithmetic, "le", [value, constant], BOOL).z3
            same = [t.z3 == z3.substitute(t.z3, (constant.z3, value.z3)) for t in self._asked]
            solver.add(z3.Not(z3.And(below, *same)))
        return self._model(solver) is None

    # ------------------------------------------------------------ labels in words

    def has(self, label: z3.BoolRef, member: Tuple) -> bool:
        """A valuation of the choices is one of a class."""
        given = [(k.z3, self._literal(k, x)) for k, x in zip(self.constants, member, strict=True)]
        return bool(z3.is_true(z3.simplify(z3.substitute(label, *given))))

    def intervals(self, label: z3.BoolRef, most: int) -> list[tuple[int, int]] | None:
        """The members of a class of one choice; None: in more than `most` intervals."""
        (constant,) = self.constants
        assert isinstance(constant.type, Int)
        solver = self._solver()
        found: list[tuple[int, int]] = []
        start = constant.type.low
        while start <= constant.type.high:
            here = self._compared("ge", constant, start)
            first = self._smallest(solver, [here, label])
            if first is None:
                break
            if len(found) == most:
                return None
            behind = self._compared("ge", constant, first[0])
            end = self._smallest(solver, [behind, z3.Not(label)])
            last = constant.type.high if end is None else end[0] - 1
            found.append((first[0], last))
            start = last + 1
        return found

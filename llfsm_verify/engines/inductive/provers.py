"""The provers: k-induction with simple paths, and property-directed reachability by Z3's Spacer over the relation of
one unit of steps.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import z3

from llfsm_verify.backends.smt import tolerant
from llfsm_verify.backends.smt.arithmetic import Term, is_bool
from llfsm_verify.backends.smt.solver import SolverBudget, wait_for
from llfsm_verify.engines.inductive.invariant import Invariant, Unreadable, read
from llfsm_verify.engines.inductive.observers import Scalar, State, text_of
from llfsm_verify.engines.inductive.system import (
    Answer,
    Course,
    Proved,
    Reached,
    System,
    Undecided,
    differ,
    undistinguished,
)
from llfsm_verify.engines.unrolled.question import Exhausted, Question
from llfsm_verify.limits import Budget, tick
from llfsm_verify.program.program import Const, Expr, Get, Int
from llfsm_verify.program.terms import TRUE, conjunction, op


class Induction:
    """Longer and longer runs, from the beginning and from anywhere, until no run from anywhere ends badly.

    Sources: M. Sheeran, S. Singh and G. Stålmarck, Checking safety properties using induction and a SAT-solver, FMCAD
    2000; N. Eén and N. Sörensson, Temporal induction by incremental SAT solving, BMC 2003 (states are told apart when a
    model has two that are equal).
    """

    name = "induction"
    depth = 30
    effort = 40_000_000
    integers = False

    def ask(
        self, system: System, budget: Budget, depth: int, effort: int, total: SolverBudget, known: Sequence[Expr] = ()
    ) -> Answer:
        """`depth`: the largest k."""
        finite = system.terms.arithmetic.name == "bit-vectors"
        begun, beginning = system.course("begun"), Question(finite=finite, effort=effort, total=total)
        going, anywhere = system.course("going", anywhere=True), Question(finite=finite, effort=effort, total=total)
        if z3.is_true(begun.bad):
            return Reached()
        anywhere.add([system.formula(lemma, going.state) for lemma in known])
        states: list[State] = [going.state]
        try:
            if not z3.is_false(begun.bad):
                beginning.learn(begun.constraints)
                if beginning.ask([begun.bad], budget) is not None:
                    return Reached()
                beginning.learn([z3.Not(begun.bad)])
            for k in range(depth + 1):
                if not _may_be_bad(going, anywhere, budget, states):
                    return Proved(Invariant(system.target, conjunction(list(known)), k))
                states.append(going.state)
                if _may_be_bad(begun, beginning, budget, ()):
                    return Reached()
        except Exhausted:
            return Undecided("the solver gave up on a question of k-induction")
        return Undecided(f"it is not k-inductive for k up to {depth:,}")


def _may_be_bad(course: Course, question: Question, budget: Budget, states: Sequence[State]) -> bool:
    """Go on by a unit, and whether it may be bad; `states` are all different."""
    possible = False
    sent = len(course.constraints)
    stages = course.advance()
    question.add(course.constraints[:sent])
    for stage in stages:
        question.add(course.constraints[sent : stage.known])
        sent = max(sent, stage.known)
        possible = possible or _reached(question, stage.bad, budget, states)
    question.add(course.constraints[sent:])
    return possible


def _reached(question: Question, bad: z3.BoolRef, budget: Budget, states: Sequence[State]) -> bool:
    while True:
        model = question.ask([bad], budget)
        if model is None:
            return False
        equal = undistinguished(model, states)
        if equal is None:
            return True
        question.add([differ(*equal)])


MAX_LABELS = 16
"""Enumerations and states of machines with up to so many values are Bools, one a value: lemmas are shorter by it."""


@dataclass(frozen=True, slots=True)
class _Argument:
    """An argument of the invariant: a scalar, or that it has this value."""

    scalar: Scalar
    value: int | None
    term: z3.ExprRef

    @property
    def expression(self) -> Expr:
        """What the argument stands for in formulas."""
        if self.value is None:
            return self.scalar
        return op("eq", self.scalar, Const(self.value, self.scalar.type))


class Spacer:
    """Sources: A. Komuravelli, A. Gurfinkel and S. Chaki, SMT-based model checking for recursive programs, CAV 2014;
    A. R. Bradley, SAT-based model checking without unrolling, VMCAI 2011.

    The system is to have mathematical integers, on which Spacer is at its best.
    """

    name = "pdr"
    depth = 1_000
    effort = 150_000_000
    """About a minute."""
    integers = True

    def ask(
        self, system: System, budget: Budget, depth: int, effort: int, total: SolverBudget, known: Sequence[Expr] = ()
    ) -> Answer:
        """`depth`: the largest frame."""
        arguments, start, hot = _arguments(system)
        rules = _Rules(arguments, depth, SolverBudget(effort, total))
        begun = system.course("begun")
        rules.bad([*begun.constraints, begun.bad])
        rules.state(begun.state, begun.constraints, None)
        going = system.course("going", start=start)
        assumed = [*hot, *(system.formula(lemma, start) for lemma in known), rules.here]
        for stage in going.advance():
            rules.bad([*assumed, *going.constraints[: stage.known], stage.bad])
        if not rules.can_be_bad:
            return Proved(Invariant(system.target, TRUE))
        rules.state(going.state, going.constraints, assumed)
        return _answer(rules, system, arguments, budget, known)


def _answer(
    rules: _Rules, system: System, arguments: Sequence[_Argument], budget: Budget, known: Sequence[Expr]
) -> Answer:
    found = rules.query(budget)
    if found == z3.sat:
        return Reached()
    if found != z3.unsat:
        why = f"({rules.reason})" if rules.reason not in ("", "ok") else "within its frames and its work"
        return Undecided(f"Spacer gave up {why}")
    try:
        formula = rules.invariant({i: a.expression for i, a in enumerate(arguments)})
        return Proved(Invariant(system.target, conjunction([*known, formula])))
    except Unreadable:
        # It says so of trivial ones, in its own way; the certificate tells whether this is one.
        return Proved(Invariant(system.target, conjunction(list(known))))


def _arguments(system: System) -> tuple[list[_Argument], State, list[z3.BoolRef]]:
    """The arguments, a state written with them, and what they satisfy."""
    arguments: list[_Argument] = []
    start: dict[Scalar, Term] = {}
    hot: list[z3.BoolRef] = []
    for scalar in system.scalars:
        values = _values(system, scalar)
        if values is None:
            term = system.terms.arithmetic.constant(text_of(scalar), scalar.type)
            arguments.append(_Argument(scalar, None, term.z3))
            start[scalar] = term
            continue
        bools = [z3.Bool(f"{text_of(scalar)}={value}") for value in values]
        arguments += [_Argument(scalar, v, b) for v, b in zip(values, bools, strict=True)]
        chosen = system.terms.arithmetic.literal(values[-1], scalar.type).z3
        for value, bool_ in reversed(list(zip(values[:-1], bools[:-1], strict=True))):
            chosen = z3.If(bool_, system.terms.arithmetic.literal(value, scalar.type).z3, chosen)
        start[scalar] = Term(chosen, scalar.type)
        hot += [z3.Or(bools), *(z3.Not(z3.And(a, b)) for i, a in enumerate(bools) for b in bools[:i])]
    return arguments, start, hot


def _values(system: System, scalar: Scalar) -> range | None:
    """The values of an enumeration or of the state of a machine; None: it is a number."""
    if not isinstance(scalar, Get) or not isinstance(scalar.type, Int) or is_bool(scalar.type):
        return None
    var = next(v for v in system.program.vars if v.name == scalar.var)
    size = scalar.type.high - scalar.type.low + 1
    return range(scalar.type.low, scalar.type.high + 1) if var.origin.labels and size <= MAX_LABELS else None


class _Rules:
    """Horn clauses over one relation, the invariant, and one fact, that the target is reached.

    They have a context of their own: what Spacer finds depends little on what Z3 was asked before.
    """

    def __init__(self, arguments: Sequence[_Argument], depth: int, effort: SolverBudget) -> None:
        self._arguments = arguments
        self._effort = effort
        self._context = tolerant(z3.Context())
        self._solver = z3.Fixedpoint(ctx=self._context)
        self._solver.set(
            engine="spacer",
            rlimit=effort.left,
            # Ctrl-C is for the thread that waits. The answer has to speak of the relation as it was given.
            **{"ctrl_c": False, "spacer.max_level": depth, "xform.slice": False, "xform.inline_eager": False,
               "xform.inline_linear": False},
        )  # fmt: skip
        sorts = [a.term.translate(self._context).sort() for a in arguments]
        self._invariant = z3.Function("invariant", *sorts, z3.BoolSort(self._context))
        self._reached = z3.Function("reached", z3.BoolSort(self._context))
        self._solver.register_relation(self._invariant, self._reached)
        self._declared: set[int] = set()
        self.can_be_bad = False

    @property
    def here(self) -> z3.BoolRef:
        """The invariant holds of the arguments."""
        return self._invariant(*(a.term.translate(self._context) for a in self._arguments))

    def state(self, state: State, constraints: Sequence[z3.BoolRef], assumed: Sequence[z3.BoolRef] | None) -> None:
        """The invariant holds in a state, under conditions."""
        values = [
            state[a.scalar].z3 if a.value is None else z3.simplify(state[a.scalar].z3 == a.value)
            for a in self._arguments
        ]
        head = self._invariant(*(v.translate(self._context) for v in values))
        self._rule(head, [*(assumed or ()), *constraints])

    def bad(self, conditions: Sequence[z3.BoolRef]) -> None:
        """The target is reached under conditions."""
        if not any(z3.is_false(c) for c in conditions):
            self.can_be_bad = True
            self._rule(self._reached(), conditions)

    def _rule(self, head: z3.BoolRef, body: Sequence[z3.BoolRef]) -> None:
        body = [b if b.ctx == self._context else b.translate(self._context) for b in body]
        for constant in _constants([*head.children(), *body], self._reached()):
            if constant.get_id() not in self._declared:
                self._declared.add(constant.get_id())
                self._solver.declare_var(constant)
        self._solver.rule(head, body or [z3.BoolVal(True, self._context)])

    def query(self, budget: Budget) -> z3.CheckSatResult:
        """LimitReached."""
        self.reason = "it took more work than it may"
        if self._effort.left == 0:
            return z3.unknown
        try:
            answer = wait_for(lambda: self._solver.query(self._reached()), self._context, budget.check)
        except z3.Z3Exception:  # so does the end of the effort come out, sometimes
            self._effort.spend(self._effort.left or 0)
            return z3.unknown
        self._effort.spend(int(self._solver.statistics().get_key_value("rlimit count")))
        self.reason = self._solver.reason_unknown()
        return answer

    def invariant(self, names: Mapping[int, Expr]) -> Expr:
        """What Spacer says of the relation; `names` are the expressions of the arguments. Unreadable."""
        for conjunct in _conjuncts(self._solver.get_answer()):
            if not z3.is_quantifier(conjunct) or not conjunct.is_forall():
                continue
            fresh = [z3.FreshConst(conjunct.var_sort(i)) for i in range(conjunct.num_vars())]
            body = z3.substitute_vars(conjunct.body(), *reversed(fresh))
            if body.num_args() == 2 and body.arg(0).decl().eq(self._invariant):
                known = {body.arg(0).arg(i).get_id(): name for i, name in names.items()}
                return read(body.arg(1), known)
        raise Unreadable("it says nothing about the states")


def _conjuncts(term: z3.BoolRef) -> Iterator[z3.BoolRef]:
    if z3.is_and(term):
        for child in term.children():
            yield from _conjuncts(child)
    else:
        yield term


def _constants(terms: Sequence[z3.ExprRef], but: z3.ExprRef) -> Iterator[z3.ExprRef]:
    """The unknowns in terms."""
    seen: set[int] = {but.get_id()}
    stack = list(terms)
    while stack:
        term = stack.pop()
        if term.get_id() in seen:
            continue
        tick()
        seen.add(term.get_id())
        if z3.is_const(term) and term.decl().kind() == z3.Z3_OP_UNINTERPRETED:
            yield term
        stack.extend(term.children())

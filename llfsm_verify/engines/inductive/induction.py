"""k-induction with simple paths, incrementally."""

from __future__ import annotations

from collections.abc import Sequence

import z3

from llfsm_verify.backends.smt.solver import SolverBudget
from llfsm_verify.engines.inductive.invariant import Invariant
from llfsm_verify.engines.inductive.observers import State
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
from llfsm_verify.limits import Budget
from llfsm_verify.program.program import Expr
from llfsm_verify.program.terms import conjunction


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

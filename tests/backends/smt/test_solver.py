"""Work in a context of Z3's that is ended, and what can be asked there afterwards."""

from __future__ import annotations

from collections.abc import Callable

import pytest
import z3

from llfsm_verify.backends.smt import solver as asking


class Ended(Exception):
    pass


@pytest.mark.parametrize("make", [z3.main_ctx, z3.Context], ids=["main", "own"])
def test_a_context_whose_work_was_ended_can_be_asked_again(
    make: Callable[[], z3.Context], monkeypatch: pytest.MonkeyPatch
) -> None:
    context = make()
    monkeypatch.setattr(asking, "LOOK_SECONDS", 0.002)
    word = z3.BitVec("w", 8, context)

    def is_simplified() -> bool:
        return z3.simplify(word + word - word).eq(word)

    def until_interrupted() -> None:
        while is_simplified():
            pass

    def end() -> None:
        raise Ended

    with pytest.raises(Ended):
        asking.wait_for(until_interrupted, context, end)
    assert is_simplified()
    solver = z3.Solver(ctx=context)
    solver.add(z3.UGT(word, 3))
    assert (solver.check(word == 4), solver.check(word == 2)) == (z3.sat, z3.unsat)


def test_a_solver_that_gives_up_says_why_and_effort_that_is_spent_says_that() -> None:
    def asked(effort: asking.SolverBudget | None, rlimit: int | None = None) -> z3.ModelRef | None:
        context = z3.Context()
        a, b, c = (z3.Int(name, context) for name in "abc")
        solver = z3.Solver(ctx=context)
        solver.add(a * a * a + b * b * b == c * c * c + 2, a > 10, b > 10, c > 10, c != a, c != b)
        if rlimit is not None:
            solver.set("rlimit", rlimit)
        return asking.model_of(solver, lambda: None, effort)

    with pytest.raises(asking.GaveUp, match="the solver gave up: "):
        asked(None, 2_000)
    effort = asking.SolverBudget(2_000)
    with pytest.raises(asking.GaveUp, match="finds no answer with 2,000 units of work"):
        asked(effort)
    assert effort.left == 0 and effort.spent >= 2_000
    with pytest.raises(asking.GaveUp, match="finds no answer with 2,000 units of work"):
        asked(asking.SolverBudget(None, effort))  # a part of what is spent
    assert (
        asking.SolverBudget(5, asking.SolverBudget(3)).left == 3
        and asking.SolverBudget(3, asking.SolverBudget(5)).left == 3
    )
    assert asking.SolverBudget().left is None and asking.SolverBudget(None, asking.SolverBudget(4)).left == 4

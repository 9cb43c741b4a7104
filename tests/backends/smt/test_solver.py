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
        asking.waited(until_interrupted, context, end)
    assert is_simplified()
    solver = z3.Solver(ctx=context)
    solver.add(z3.UGT(word, 3))
    assert (solver.check(word == 4), solver.check(word == 2)) == (z3.sat, z3.unsat)

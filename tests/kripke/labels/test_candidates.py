"""The values at which comparisons with an input may change, as expressions over variables."""

from __future__ import annotations

from itertools import pairwise

import pytest

from llfsm_verify.backends.reference import evaluate
from llfsm_verify.kripke.labels import candidates as module
from llfsm_verify.kripke.labels.candidates import candidates, suggest
from llfsm_verify.program.outcomes import PREFIX
from llfsm_verify.program.program import BOOL, UNBOUNDED, Choice, Const, Expr, Get, Int, Local, Op, OpName
from llfsm_verify.program.terms import const, op
from tests.program.test_outcomes import text

BYTE = Int(0, 255)
X, Y = Local(f"{PREFIX}x", BYTE), Local(f"{PREFIX}y", BYTE)
N = Get("n", None, Int(10, 99))
CHOICE = Choice("x", BYTE, 0, "x", "input")


def compared(name: OpName, left: Expr, right: Expr) -> Expr:
    return Op(name, (left, right), BOOL)


def values(found: tuple[Expr, ...] | None, n: int) -> list[int] | None:
    """What the expressions are where `n` has a value."""
    return None if found is None else [evaluate(e, {"n": n}, {}) for e in found]


@pytest.mark.parametrize(
    ("term", "at", "found"),
    [
        (compared("lt", X, N), 40, [40, 41, 0]),
        (compared("ge", N, X), 40, [40, 41, 0]),
        (compared("eq", op("add", X, const(7)), N), 40, [33, 34, 0]),
        (compared("eq", op("add", const(7), X), N), 40, [33, 34, 0]),
        (compared("le", op("sub", X, const(7)), N), 40, [47, 48, 0]),
        (compared("gt", op("sub", const(100), X), N), 40, [60, 61, 0]),
        (compared("ne", op("neg", X), op("neg", N)), 40, [40, 41, 0]),
        (compared("lt", op("mul", const(3), X), N), 40, [12, 13, 14, 0]),
        (compared("lt", op("mul", X, const(3)), N), 40, [12, 13, 14, 0]),
        (compared("lt", op("sub", op("mul", const(2), op("add", X, const(1))), const(4)), N), 40, [20, 21, 22, 0]),
        (compared("lt", X, op("mul", N, const(9))), 40, [255, 255, 0]),
        (compared("lt", op("add", X, X), N), 40, None),
        (compared("lt", op("mul", X, Y), N), 40, None),
        (compared("lt", op("mul", X, N), N), 40, None),
        (compared("lt", op("div", X, const(2)), N), 40, None),
        (compared("lt", X, op("add", X, N)), 40, None),
        (compared("lt", op("add", X, const(1)), Get("k", None, UNBOUNDED)), 40, None),
        (compared("lt", op("add", Y, N), const(3)), 40, None),
    ],
)
def test_where_a_comparison_with_a_variable_may_change(term: Expr, at: int, found: list[int] | None) -> None:
    assert values(candidates(CHOICE, [term], []), at) == found


def test_fixed_values_come_first_and_the_lowest_last() -> None:
    assert values(candidates(CHOICE, [compared("lt", X, N)], [9, 3]), 40) == [9, 3, 40, 41, 0]
    assert values(candidates(CHOICE, [compared("lt", X, const(5))], [9]), 40) == [9, 0]  # no variable: nothing new


def test_too_many_are_none(monkeypatch: pytest.MonkeyPatch) -> None:
    terms = [compared("lt", op("add", X, const(k)), N) for k in range(2)]
    found = candidates(CHOICE, terms, [])
    assert values(found, 40) == [40, 41, 39, 40, 0]
    for most, fine in ((5, True), (4, False)):
        monkeypatch.setattr(module, "MOST", most)
        assert (candidates(CHOICE, terms, []) is not None) is fine


def test_terms_without_variables_suggest_values_and_others_nothing() -> None:
    part = compared("lt", X, const(5))
    assert [text(e) for e in suggest(CHOICE, [op("and", part, compared("lt", Y, const(9)))])] == ["0", "5", "6"]
    assert all(isinstance(e, Const) for e in suggest(CHOICE, [part]))
    assert [text(e) for e in suggest(CHOICE, [compared("lt", op("mul", X, Y), const(5))])] == ["0"]
    for low, high in pairwise(sorted(evaluate(e, {}, {}) for e in suggest(CHOICE, [part]))):
        assert low < high

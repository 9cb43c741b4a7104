"""Types of expressions are the smallest that hold their values."""

from __future__ import annotations

import pytest

from llfsm_verify.semantics.program import BOOL, UNBOUNDED, Get, Int, Type
from llfsm_verify.semantics.terms import ite, join, wrapped

DIGIT = Int(0, 9)


@pytest.mark.parametrize(
    ("a", "b", "both"),
    [
        (BOOL, BOOL, BOOL),
        (BOOL, DIGIT, DIGIT),
        (BOOL, Int(5, 9), DIGIT),
        (BOOL, Int(0, 1), Int(0, 1)),
        (Int(-3, 2), Int(1, 7), Int(-3, 7)),
        (DIGIT, UNBOUNDED, UNBOUNDED),
        (UNBOUNDED, BOOL, UNBOUNDED),
    ],
)
def test_a_choice_has_the_smallest_type_of_both_values(a: Type, b: Type, both: Type) -> None:
    assert join(a, b) == join(b, a) == both
    condition = Get("c", None, BOOL)
    assert ite(condition, Get("a", None, a), Get("b", None, b)).type == both


def test_what_fits_is_stored_as_it_is() -> None:
    number = Get("a", None, DIGIT)
    assert wrapped(number, Int(0, 9)) is number
    assert wrapped(number, Int(0, 8)).type == Int(0, 8)

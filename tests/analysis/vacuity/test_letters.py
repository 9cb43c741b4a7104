"""What the letters of a space alone tell: atoms that are always or never shown, formulas that no letter satisfies."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from llfsm_verify.analysis.vacuity import check as letters
from llfsm_verify.analysis.vacuity.check import Letters
from llfsm_verify.logic.formula import FALSE, Formula, apply, atom, negation

A, B, C, D = map(atom, "abcd")
KEYS = ("a", "b", "c", "d")


def shown(*masks: int) -> Letters:
    """Letters as masks: bit 0 is `a`, bit 3 is `d`."""
    return Letters(SimpleNamespace(masks=list(masks), names=list(KEYS)))  # type: ignore[arg-type]


def test_atoms_that_every_letter_shows_or_none() -> None:
    found = shown(0b0110, 0b0100)
    assert (found.always(KEYS), found.never(KEYS)) == (("c",), ("a", "d"))
    assert (shown(0b1001).always(KEYS), shown(0b1001).never(KEYS)) == (("a", "d"), ("b", "c"))
    assert (shown().always(KEYS), shown().never(KEYS)) == ((), KEYS)
    assert found.always(("a",)) == found.never(("c",)) == ()


def test_formulas_that_no_letter_satisfies() -> None:
    found = shown(0b0110, 0b0100)
    asked = [A, B, apply("and", B, C), apply("and", B, negation(C)), negation(C)]
    assert found.unmatched(asked) == [A, asked[3], asked[4]]


@pytest.mark.parametrize(
    ("formula", "answer"),
    [
        (apply("G", C), True),
        (apply("G", B), False),
        (apply("F", C), None),
        (apply("G", apply("X", C)), None),
        (apply("and", apply("G", C), apply("G", apply("or", B, C))), True),
        (apply("and", apply("G", C), apply("F", B)), None),
        (apply("and", apply("G", B), apply("F", B)), False),
        (FALSE, None),
    ],
)
def test_what_letters_decide(monkeypatch: pytest.MonkeyPatch, formula: Formula, answer: bool | None) -> None:
    assert shown(0b0110, 0b0100).decide(formula) is answer
    monkeypatch.setattr(letters, "MOST_LETTERS", 2)
    assert shown(0b0110, 0b0100).decide(formula) is answer
    monkeypatch.setattr(letters, "MOST_LETTERS", 1)
    assert shown(0b0110, 0b0100).decide(formula) is None

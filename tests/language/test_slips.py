"""Habits of other languages are met with what to write here."""

from __future__ import annotations

import pytest

from llfsm_verify.diagnostics import DiagnosticError, Fragment, Source
from llfsm_verify.language.parser import parse_actions, parse_guard


@pytest.mark.parametrize(
    ("text", "slip", "instead"),
    [
        ("n => 3", "=>", "`>=`"),
        ("n =< 3", "=<", "`<=`"),
        ("Colour::RED == light", "::", "`.`"),
        ("ready AND car", "AND", "`and`"),
        ("ready OR car", "OR", "`or`"),
        ("NOT ready", "NOT", "`not`"),
    ],
)
def test_guards(text: str, slip: str, instead: str) -> None:
    with pytest.raises(DiagnosticError) as raised:
        parse_guard(Fragment.whole(Source("m.yaml", text)))
    (found,) = raised.value.diagnostics
    assert found.code == "E101"
    assert found.span is not None
    assert found.span.text == slip
    assert instead in (found.hint or "")


@pytest.mark.parametrize(
    ("text", "slip", "instead"),
    [("n := 3;", ":=", "`=`"), ("while (n < 3) { n = n + 1; }", "while", "`for`")],
)
def test_actions(text: str, slip: str, instead: str) -> None:
    with pytest.raises(DiagnosticError) as raised:
        parse_actions(Fragment.whole(Source("m.yaml", text)))
    (found,) = raised.value.diagnostics
    assert found.span is not None
    assert found.span.text == slip
    assert instead in (found.hint or "")


def test_a_word_of_the_model_before_the_mistake_is_no_slip() -> None:
    """`OR` is a value of an enumeration here, and it is not what is wrong."""
    with pytest.raises(DiagnosticError) as raised:
        parse_guard(Fragment.whole(Source("m.yaml", "gate == OR && count > 3 3")))
    (found,) = raised.value.diagnostics
    assert found.span is not None
    assert found.span.start > 20
    assert "or" not in (found.hint or "").split("`")

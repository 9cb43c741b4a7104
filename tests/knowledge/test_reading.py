"""Theories as they are read, and what is said about wrong ones."""

from __future__ import annotations

import pytest

from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.knowledge.reading import read_theory
from tests.knowledge.wrong import WRONG, Wrong


@pytest.mark.parametrize("case", WRONG, ids=lambda c: c.reason)
def test_a_wrong_theory_gets_its_diagnostic_at_its_place(case: Wrong) -> None:
    assert case.text.count("§") == 1
    source = Source("wrong.d", case.text.replace("§", ""))
    with pytest.raises(DiagnosticError) as caught:
        read_theory(source)
    expected = (case.code, *source.position(case.text.index("§")))
    found = caught.value.diagnostics
    assert [(d.code, d.span and d.span.line, d.span and d.span.column) for d in found] == [expected]
    assert found[0].message.startswith(case.message) and found[0].hint
    assert max(map(len, found[0].render().split("\n"))) < 400

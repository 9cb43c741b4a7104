"""What is said of properties that a recording, or a run, decides."""

from __future__ import annotations

from dataclasses import replace

import pytest

from llfsm_verify.cli.io.decided import say_decided, when_decided
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.report.text import result_text
from llfsm_verify.runtime.deciding.recordings import Decided
from tests.report.results import GOOD, result

LINE = parse_properties([Source("p", "a: G p")]).properties[0]


def test_when_a_property_is_decided(capsys) -> None:
    decided = {
        "before the first step": Decided(LINE, "violated", 0, 1),
        "at step 1,200, in frame 13": Decided(LINE, "violated", 1200, 13),
        "because the run was not over": Decided(LINE, "undecided", reason="the run was not over"),
        "": Decided(LINE, "satisfied"),
    }
    for said, one in decided.items():
        assert when_decided(one) == said
    assert say_decided([(one, said) for said, one in decided.items() if one.verdict != "violated"]) == 4
    assert capsys.readouterr().out.splitlines() == [
        "undecided  a  G p",
        "              because the run was not over",
        "satisfied  a  G p",
    ]


@pytest.mark.parametrize("table", ["verify", "check-recording"])
def test_a_long_name_does_not_make_rows_wide(table: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Its beginning and its end are shown, and the other rows are as wide as without its middle."""
    name = "first" + "n" * 5000 + "last"
    long = replace(LINE, name=name)
    if table == "verify":
        items = (replace(GOOD, name=name), GOOD)
        printed = "\n".join(str(line) for line in result_text(result(*items), quiet=True))
    else:
        say_decided([(Decided(long, "satisfied"), ""), (Decided(LINE, "satisfied"), "")])
        printed = capsys.readouterr().out
    assert max(map(len, printed.splitlines())) <= 120
    assert "first" + "n" * 25 in printed and "nlast" in printed

"""What is said of properties that a recording, or a run, decides."""

from __future__ import annotations

from llfsm_verify.cli.io.decided import say_decided, when_decided
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.runtime.recording.check import Decided

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

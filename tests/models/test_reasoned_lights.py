"""Traffic lights that ask Prolog: each of the promises is needed, and none of them is enough for a hasty light."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from llfsm_verify.arrangement.loader import load_arrangement
from llfsm_verify.checking.verdict import Result, Verdict
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.logic.reading import read_source
from llfsm_verify.verification.verify import verify

FOLDER = Path("models/reasoned_lights")
PROMISED = Path("properties/reasoned_lights_promised.ltl")


def check(version: str, text: str) -> Result:
    return verify(load_arrangement(FOLDER / f"{version}.yaml"), parse_properties([Source("a.ltl", text)]))


def violated(result: Result) -> set[str]:
    assert result.complete
    return {p.name for p in result.properties if p.verdict is Verdict.VIOLATED}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["cars_stay", "turns", "goes"])
def test_without_one_of_the_promises_somebody_starves(name: str) -> None:
    text = PROMISED.read_text("utf-8")
    left = re.sub(rf"^assume {name}: .*\n(?:  .*\n)*", "", text, flags=re.MULTILINE)
    assert left != text and violated(check("arrangement", left))


@pytest.mark.slow
def test_right_answers_do_not_make_a_hasty_light_safe() -> None:
    """An answer is right at the moment at which it is posted; the light acts later."""
    instant = read_source(FOLDER / "instant.ltl")
    assert violated(check("faulty_hasty", instant.text)) == {"mutual_exclusion"}
    never = "assume never_both: G !(go_ns.sampled(may_go_ns) && go_ew.sampled(may_go_ew))\n"
    assert violated(check("faulty_hasty", f"{never}both: G !(ns@GREEN && ew@GREEN)")) == {"both"}
    assert not violated(check("arrangement", instant.text))

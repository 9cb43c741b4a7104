"""No property of a case study holds emptily; some are weaker than what is true, which is no mistake."""

from __future__ import annotations

from pathlib import Path

import pytest

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.checking.verdict import Options, Verdict
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.verification.verify import verify

FILES = sorted(Path("properties").glob("*.ltl"))


def model_of(properties: Path) -> Path:
    """The folder that has the name of a property file, or the beginning of it."""
    folders = [f for f in Path("models").iterdir() if f.is_dir() and properties.stem.startswith(f.name)]
    return max(folders, key=lambda folder: len(folder.name)) / "arrangement.yaml"


AT_LENGTH = {"batman", "fruit_picking", "press", "reasoned_lights_promised", "robocup", "turtle"}


@pytest.mark.parametrize(
    "properties",
    [pytest.param(f, marks=pytest.mark.long if f.stem in AT_LENGTH else pytest.mark.slow, id=f.stem) for f in FILES],
)
def test_nothing_holds_because_nothing_happens(properties: Path) -> None:
    lines = parse_properties([Source(str(properties), properties.read_text(encoding="utf-8"))])
    result = verify(load_arrangement(str(model_of(properties))), lines, Options(vacuity="all"))
    assert {p.verdict for p in result.properties} == {Verdict.HOLDS}
    assert {p.vacuity.looked for p in result.properties} == {"all"}
    assert {f.kind for p in result.properties for f in p.vacuity.findings} <= {"subformula"}

"""Automata of files as properties: what is empty about them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.automata.ltl.translate import translate
from llfsm_verify.checking.verdict import Options, PropertyResult
from llfsm_verify.diagnostics import Source
from llfsm_verify.extensions.hoa.writing import write_hoa
from llfsm_verify.logic.properties import FEATURES, parse_properties
from llfsm_verify.verification.verify import verify
from tests.checking.replaying import lines_of

LIGHTS = load_arrangement("models/traffic_lights/arrangement.yaml")


def result_of(folder: Path, line: str, formula: str) -> PropertyResult:
    (stated,) = lines_of(f"x: {formula}")
    assert stated.formula is not None
    (folder / "a.hoa").write_text(write_hoa(translate(stated.formula), "a"))
    properties = parse_properties([Source(str(folder / "p.ltl"), f"{line}: a.hoa")], features=FEATURES)
    (found,) = verify(LIGHTS, properties, replace(Options(), strict=True, vacuity="all"), engine="explicit").properties
    return found


@pytest.mark.parametrize(
    ("line", "formula", "kinds"),
    [
        ("automaton a", "G !(ns@GREEN && ew@GREEN)", []),
        ("automaton a", "G (ns_light == GREEN -> ew_light != GREEN)", []),
        ("automaton a", "G (car -> !car) || true", ["valid"]),
        ("automaton never a", "F (car && ns@GREEN && false)", ["valid"]),
        ("automaton a", "G (ns.suspended -> X ns@RED)", ["letter"]),
        ("automaton a", "G !ns.suspended", []),
        ("automaton never a", "F ns.suspended", []),
        ("automaton a", "false", ["unsatisfiable"]),
        ("automaton a", "G ns@GREEN", []),
    ],
)
def test_what_is_empty_about_an_automaton(tmp_path: Path, line: str, formula: str, kinds: list[str]) -> None:
    assert [f.kind for f in result_of(tmp_path, line, formula).vacuity.findings] == kinds


def test_what_cannot_be_told_is_not_called_looked_at(tmp_path: Path) -> None:
    """Which words are not accepted is not known of an automaton without a complement."""
    vacuity = result_of(tmp_path, "automaton never a", "F G ns.suspended").vacuity
    assert vacuity.looked == "no"
    assert vacuity.reason is not None and "`ns.suspended`" in vacuity.reason

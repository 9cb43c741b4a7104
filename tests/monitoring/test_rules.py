"""Rules that follow from a machine's text: they hold of it, and another machine breaks them."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from llfsm_verify.arrangement.loader import build_arrangement, load_arrangement, load_arrangement_text
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.verdict import Options
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.monitoring.rules import rules_of
from llfsm_verify.testing.arrangements import Document, arrangements
from llfsm_verify.verification.verify import verify
from tests.cli.running import llfsm
from tests.models.mutants import mutants
from tests.quick import AtLeast, many, spread

LIGHTS = "models/traffic_lights/arrangement.yaml"
MODELS = sorted(Path("models").glob("*/arrangement.yaml"))


def lines_of(arrangement: Arrangement, machine: str) -> PropertySet:
    text = "\n".join(rule.line for rule in rules_of(arrangement, machine))
    return parse_properties([Source("rules.ltl", text)])


def together(arrangement: Arrangement) -> PropertySet:
    """The rules of all machines."""
    lines = [rule.line for machine in arrangement.machines for rule in rules_of(arrangement, machine.name)]
    return parse_properties([Source("rules.ltl", "\n".join(lines))])


def verdicts(arrangement: Arrangement, properties: PropertySet, most: int) -> Counter[str]:
    result = verify(arrangement, properties, Options(limits=Limits(max_states=most)))
    return Counter(outcome.verdict for outcome in result.properties)


def test_the_rules_of_a_light() -> None:
    assert [rule.line for rule in rules_of(load_arrangement(LIGHTS), "ew")] == [
        "ew_begins: ew@RED",
        "ew_after_RED: G (ew@RED -> X (ew@{RED, GREEN}))",
        "ew_after_GREEN: G (ew@GREEN -> X (ew@{GREEN, AMBER}))",
        "ew_after_AMBER: G (ew@AMBER -> X (ew@{RED, AMBER}))",
        "ew_in_RED: G (ew.entered(RED) -> ew_light == RED)",
        "ew_in_GREEN: G (ew.entered(GREEN) -> ew_light == GREEN)",
        "ew_in_AMBER: G (ew.entered(AMBER) -> ew_light == AMBER)",
    ]


def test_the_command(tmp_path: Path) -> None:
    path = tmp_path / "ns.ltl"
    assert llfsm("monitor", "--from-machine", "ns", "--arrangement", LIGHTS, "-o", str(path)).returncode == 0
    assert llfsm("monitor", str(path), "--arrangement", LIGHTS).returncode == 0
    done = llfsm("verify", LIGHTS, str(path))
    assert done.returncode == 0 and done.stdout.count("holds  ns_") == 7
    for wrong, said in (
        (["--from-machine", "ns"], "--arrangement FILE"),
        (["--from-machine", "no", "--arrangement", LIGHTS], "no machine `no`, but timer, ns, ew"),
        (["--from-machine", "ns", "--arrangement", LIGHTS, "--as", "dot"], "another `llfsm monitor`"),
        ([], "PROPERTY is missing"),
    ):
        done = llfsm("monitor", *wrong)
        assert done.returncode == 2 and said in done.stderr


@pytest.mark.long
@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.parent.name)
def test_rules_hold_of_every_model(path: Path) -> None:
    arrangement = load_arrangement(str(path))
    found = verdicts(arrangement, together(arrangement), 100_000)
    assert not found["violated"], found


@pytest.mark.long
def test_rules_hold_of_random_machines() -> None:
    tally: Counter[str] = Counter()

    def check(document: Document) -> None:
        try:
            arrangement = build_arrangement(document)
        except DiagnosticError:
            return
        properties = together(arrangement)
        if properties.goals:
            found = verdicts(arrangement, properties, 3_000)
            assert not found["violated"], [line.text for line in properties.goals]
            tally.update(found)

    amount = settings(max_examples=many(400), deadline=None, suppress_health_check=list(HealthCheck))
    spread(check, amount, arrangements(), until=AtLeast(tally, {"holds": 50}))


@pytest.mark.long
def test_other_machines_break_them() -> None:
    """Of the mutants of a light, most break a rule that follows from the light."""
    properties = together(load_arrangement(LIGHTS))
    tally: Counter[str] = Counter()
    for mutant in mutants(Path(LIGHTS)):
        try:
            arrangement = load_arrangement_text(mutant.text)
            found = verdicts(arrangement, properties, 10_000)
        except DiagnosticError:
            continue
        tally["broken" if found["violated"] else "kept"] += 1
    assert tally["broken"] >= 10 and tally["broken"] * 3 >= tally["kept"], tally

"""States without transitions in which machines do not finish."""

from __future__ import annotations

from llfsm_verify.analysis.lint.run import lint
from llfsm_verify.api.building import MachineDefinition, StateDefinition
from llfsm_verify.arrangement import build_arrangement
from llfsm_verify.checking.verdict import Options
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.verification.verify import verify


def plant(**more: object) -> dict[str, object]:
    state = {"name": "RUN", "internal": "n = (n + 1) % 4;", **more}
    machines = {"m": {"inline": {"machine": "M", "states": [state]}}}
    return {"whiteboard": {"n": {"type": "0..3"}}, "machines": machines, "schedule": ["m"]}


def verdicts(document: dict[str, object], text: str) -> dict[str, str]:
    lines = parse_properties([Source("p", text)])
    result = verify(build_arrangement(document), lines, Options(), "explicit")
    return {p.name: p.verdict.value for p in result.properties}


def test_a_machine_that_stays_goes_on_forever() -> None:
    text = "again: G F n == 0\nfinished: G !m.finished\nruns: G is_running(m)"
    assert verdicts(plant(stays="true"), text) == dict.fromkeys(("again", "finished", "runs"), "holds")
    assert verdicts(plant(stays="false"), text) == dict.fromkeys(("again", "finished", "runs"), "violated")


def test_it_does_the_same_as_a_transition_that_never_fires() -> None:
    text = "a: G F n == 3\nb: X X X X n == 0\nc: G m.entered || !m.entered"
    idiom = plant(transitions=[{"when": "false", "to": "RUN"}])
    assert verdicts(plant(stays="true"), text) == verdicts(idiom, text)


def test_lint_has_nothing_against_it() -> None:
    assert "L015" in {f.code for f in lint(build_arrangement(plant())).shown}
    assert "L015" not in {f.code for f in lint(build_arrangement(plant(stays="true"))).shown}


def test_a_check_says_what_runs_once() -> None:
    lines = parse_properties([Source("p", "G n < 2")])
    note = "`m` finishes in `RUN` for good, and the `internal` action there runs once; with `stays: true` it goes on"
    assert verify(build_arrangement(plant()), lines, Options(), "explicit").notes == (note,)
    assert verify(build_arrangement(plant(stays="true")), lines, Options(), "explicit").notes == ()
    accepted = plant(lint={"L015": "it is to run once"})
    assert verify(build_arrangement(accepted), lines, Options(), "explicit").notes == ()


def test_a_definition_in_python_has_it() -> None:
    machine = MachineDefinition("M", {"RUN": StateDefinition(internal="", stays=True)})
    assert isinstance(machine.states["RUN"], StateDefinition)
    assert machine.states["RUN"].stays

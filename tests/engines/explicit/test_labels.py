"""The explicit engine with symbolic labels and without: the same verdicts and traces; limits; certificates."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, settings
from jsonschema import Draft202012Validator

from benchmarks.sensors import sensors as sensors_text
from llfsm_verify.arrangement.loader import load_arrangement, load_arrangement_text
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.trace import Trace
from llfsm_verify.checking.verdict import Options, Result, Verdict
from llfsm_verify.diagnostics import Source
from llfsm_verify.engines.explicit import engine
from llfsm_verify.engines.explicit.options import ExplicitOptions
from llfsm_verify.kripke.labels import sizes
from llfsm_verify.kripke.labels.wide import labels_of
from llfsm_verify.limits import Budget, Limits
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.logic.reading import read_source
from llfsm_verify.program.program import Program
from llfsm_verify.report.json import result_object
from llfsm_verify.report.schema import load
from llfsm_verify.report.text import result_text
from llfsm_verify.verification.verify import checker, verify
from tests.cli.running import llfsm
from tests.kripke.labels.sensors import NARROW, Width, sensors
from tests.quick import each, examples, many, spread

CHECKS = [HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large, HealthCheck.large_base_example]
MIDDLE = Width(300, (0, 1, 17, 250, 299, 300))
MODEL = Path("models/distance_sensor/arrangement.yaml")
PROPERTIES = Path("properties/distance_sensor.ltl")


def verdicts(result: Result) -> list[Verdict]:
    return [result.faults.verdict, *(p.verdict for p in result.properties)]


def shape(trace: Trace | None) -> tuple[int, int | None, tuple[object, ...]] | None:
    """What a trace has in common with another one of the same property that reads other members of the classes."""
    if trace is None:
        return None
    return len(trace.steps), trace.loop, tuple((s.machine, s.state, s.fired) for s in trace.steps)


def agreed(count: int, width: Width, kind: str) -> None:
    """Compare that many, and more until one of that kind has come."""
    tally: Counter[str] = Counter()
    amount = settings(
        max_examples=count, deadline=None, suppress_health_check=CHECKS, phases=[Phase.generate, Phase.shrink]
    )

    def checked(problem: tuple[Arrangement, Problem]) -> None:
        arrangement, bound = problem
        if not bound.properties:
            return
        options = Options(Limits(max_states=300))
        plain = checker("explicit")(bound, replace(options, own=(ExplicitOptions(labels=False),)))
        split = checker("explicit")(bound, options)
        if not plain.complete or not split.complete:
            tally["too large"] += 1
            for a, b in zip(verdicts(plain), verdicts(split), strict=True):
                if Verdict.UNKNOWN not in (a, b):
                    assert a is b
                    tally[a.value] += 1
            return
        assert verdicts(plain) == verdicts(split)
        assert plain.exploration.states == split.exploration.states
        assert plain.exploration.transitions == split.exploration.transitions
        for a, b in zip(plain.properties, split.properties, strict=True):
            tally[a.verdict.value] += 1
            joint = any(len(n.inputs) > 1 for n in split.exploration.inputs)
            if not joint and arrangement.observe == "ringlet":
                assert shape(a.trace) == shape(b.trace)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(sizes, "WIDE", 2)
        spread(checked, amount, sensors(width), size=8, until=each(tally, [kind]))


@pytest.mark.slow
def test_same_verdicts_and_traces() -> None:
    agreed(examples(8), NARROW, "violated")


@pytest.mark.long
@pytest.mark.parametrize("width", [NARROW, MIDDLE], ids=["narrow", "wide"])
def test_same_verdicts_and_traces_of_many(width: Width) -> None:
    # Of wide inputs, most spaces are too large without classes; what is then found within the limit is compared.
    agreed(many(200), width, "violated" if width is NARROW else "too large")


# ---------------------------------------------------------------- the distance sensor


def checked(options: Options) -> Result:
    return verify(load_arrangement(MODEL), parse_properties([read_source(PROPERTIES)]), options, engine="explicit")


@pytest.mark.slow
def test_four_classes_a_reading() -> None:
    result = checked(Options())
    assert [(n.inputs, n.values, n.classes) for n in result.exploration.inputs] == [(("distance",), 65536, 4)]
    assert result.complete and set(verdicts(result)) == {Verdict.HOLDS}


@pytest.mark.slow
def test_the_sensor_value_by_value() -> None:
    with_labels, without = checked(Options()), checked(Options(own=(ExplicitOptions(labels=False),)))
    assert (with_labels.exploration.states, with_labels.exploration.transitions) == (
        without.exploration.states,
        without.exploration.transitions,
    )
    assert verdicts(with_labels) == verdicts(without) and without.exploration.inputs == ()


@pytest.mark.slow
def test_reductions_with_labels() -> None:
    plain, reduced = checked(Options()), checked(Options(own=(ExplicitOptions(cone="on", compression="on"),)))
    assert verdicts(plain) == verdicts(reduced) and reduced.exploration.inputs == plain.exploration.inputs
    path = MODEL.with_name("faulty_brake.yaml")
    fast = parse_properties([Source("p.ltl", "a: G !(speed == 3 && zone == AHEAD && X X speed == 2)")])
    one = verify(load_arrangement(path), fast, Options(own=(ExplicitOptions(compression="off"),)), engine="explicit")
    two = verify(load_arrangement(path), fast, Options(own=(ExplicitOptions(compression="on"),)), engine="explicit")
    assert verdicts(one) == verdicts(two) and one.exploration.states == two.exploration.states
    assert two.exploration.stored is not None and two.exploration.stored < one.exploration.states


def test_a_time_limit_that_ends_the_split() -> None:
    result = checked(Options(Limits(timeout=1e-6)))
    assert set(verdicts(result)) == {Verdict.UNKNOWN} and not result.complete
    assert "time limit" in (result.faults.reason or "")


def test_ctrl_c_while_the_solver_works(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("llfsm_verify.kripke.labels.planning.Planner.classes", interrupted)
    result = checked(Options())
    assert result.interrupted and set(verdicts(result)) == {Verdict.UNKNOWN}


def test_cycles_that_a_limit_cuts_short() -> None:
    """Of whole cycles, nodes are more than configurations: the limit on these must end the search."""
    xray = load_arrangement("models/xray/arrangement.yaml")
    result = verify(xray, parse_properties([]), Options(Limits(max_states=400)), engine="explicit")
    assert not result.complete and "limit of 400" in (result.faults.reason or "")


# ---------------------------------------------------------------- what certificates can hold

TWO = """
name: two
whiteboard:
  near: {type: uint16, init: 0, role: input}
  far: {type: uint16, init: 0, role: input}
  stop: {type: bool, init: false}
machines:
  m:
    inline:
      machine: M
      states:
        - name: LOOK
          internal: stop = near < 100 || far < 200;
          transitions: [{when: "false", to: LOOK}]
schedule: [m]
"""


@pytest.mark.slow
def test_what_is_too_wide_for_a_certificate_is_said(tmp_path: Path) -> None:
    """Its checker tries every value; two sensors of 16 bits are too many, and the verdict stands without one."""
    (tmp_path / "two.yaml").write_text(TWO, encoding="utf-8")
    done = llfsm("verify", str(tmp_path / "two.yaml"), "-p", "p: G !(m.fired(LOOK, 0))", "--certificate",
                 str(tmp_path / "two.json"))  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    assert "more than 16,777,216 steps" in done.stdout + done.stderr


def test_what_is_said_of_inputs(tmp_path: Path) -> None:
    """The notes as text and as JSON, by the published schema."""
    text = TWO.replace("stop = near < 100 || far < 200;", "stop = near < 100; last = far;")
    (tmp_path / "two.yaml").write_text(
        text.replace("  stop: ", "  last: {type: uint16, init: 0}\n  stop: "), encoding="utf-8"
    )
    result = verify(
        load_arrangement(tmp_path / "two.yaml"), parse_properties([]), Options(Limits(max_states=50)), engine="explicit"
    )
    found = result_object(result)
    Draft202012Validator(load("result")).validate(found)
    assert found["inputs"] == [
        {"inputs": ["near"], "values": 65536, "classes": 2, "reason": None},
        {"inputs": ["far"], "values": 65536, "classes": None, "reason": "it is stored in `last`"},
    ]
    lines = [str(line) for line in result_text(result)]
    assert lines[-2:] == [
        "near: 2 classes of 65,536 values",
        "far: all 65,536 values, because it is stored in `last`",
    ]


@pytest.mark.slow
def test_classes_of_a_program_are_looked_for_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where a search with reductions comes between two searches of the whole program, the second for the trace."""
    asked: list[Program] = []

    def noted(program: Program, budget: Budget) -> object:
        asked.append(program)
        return labels_of(program, budget)

    monkeypatch.setattr(engine, "labels_of", noted)
    monkeypatch.setattr(engine, "REDUCE_FROM", 100)
    lines = parse_properties([Source("p", "never: G !(z0 == 3 && z3 == 2)\n")])
    (found,) = verify(load_arrangement_text(sensors_text(4)), lines, Options(), engine="explicit").properties
    assert found.verdict is Verdict.VIOLATED and found.trace is not None
    assert len(asked) == 2 and asked[0] is not asked[1]

"""Traces: steps counted from 1, values by name, tables, files, and the same run again."""

from __future__ import annotations

import sys
from types import SimpleNamespace

import pytest

import llfsm_verify as lv
from tests.outside import load, needs


@pytest.fixture
def trace(result: lv.CheckResult) -> lv.TraceView:
    found = result["both"].trace
    assert found is not None
    return found


def test_steps_are_counted(trace):
    assert len(trace) == 65 == len(trace.steps) and trace
    assert trace.steps[64].fired == "RED -> GREEN when turn"
    assert trace.loop is None and trace.fault is None
    assert trace.because == "`ns@GREEN` is true at step 65 while `ew@GREEN` is true"


def test_values_have_types(trace):
    assert trace.values(0) == {
        "ns_turn": True, "ew_turn": False, "ns_light": "RED", "ew_light": "RED",
        "timer": "NS_PRIORITY", "ns": "RED", "ew": "RED",
    }  # fmt: skip
    last = trace.values(65)
    assert (last["ns"], last["ew"], last["ns_turn"]) == ("GREEN", "GREEN", True)
    assert trace.values(-1) == last and trace.values(35)["ns"] == "AMBER"
    for step in (66, -67):
        with pytest.raises(IndexError, match=f"no step {step}: the run has 65 steps"):
            trace.values(step)


def test_values_follow_each_change(trace):
    """Against the changes themselves: each step's values differ from those before in what it changed, and no more."""
    for number, step in enumerate(trace.steps, 1):
        before, after = trace.values(number - 1), trace.values(number)
        assert {n for n in after if after[n] != before[n]} == {c.variable for c in step.changes}


def test_numbers_and_arrays():
    machine = lv.MachineDefinition(
        "M",
        {"A": lv.StateDefinition(internal="n = n - 2; a[1] = 3;", transitions=[("n > 4", "A")])},
        variables={"a": {"type": {"array": "0..5", "size": 2}}},
    )
    model = lv.build("numbers", {"m": machine}, whiteboard={"n": {"type": "-4..4", "init": 4}})
    run = model.simulate(3, seed=1)
    assert [run.values(i)["n"] for i in range(4)] == [4, 2, 0, -2]
    assert run.values(1)["m.a[1]"] == 3 and run.values(0)["m.a[0]"] == 0
    assert all(type(run.values(i)["n"]) is int for i in range(4))


def test_inputs_and_atoms(trace):
    assert trace.inputs(1) == {"car": True} and trace.inputs(64) == {"car": False} and trace.inputs(0) == {}
    assert trace.atoms(0) == {"ew@GREEN": False, "ns@GREEN": False}
    assert trace.atoms(2) == {"ew@GREEN": False, "ns@GREEN": True}
    assert trace.atoms(-1) == {"ew@GREEN": True, "ns@GREEN": True}


def test_the_table(trace):
    lines = trace.table().splitlines()
    assert lines[0].split() == ["step", "cycle", "time", "machine", "state", "fired", "inputs", "changes", "property"]
    assert any("25 steps without an event" in line for line in lines)
    assert len([line for line in trace.table(fold=False).splitlines() if not line.startswith("─")]) == 67
    assert max(map(len, trace.table(width=80).splitlines())) <= 80
    assert str(trace).splitlines()[-1].startswith("It fails because") and trace.table() in str(trace)


def test_other_forms(trace, result):
    assert trace.to_dict() == result.to_dict()["properties"][0]["trace"]
    assert "NS_PRIORITY" in trace._repr_html_() and repr(trace) == "<TraceView of traffic_lights_faulty: 65 steps>"
    rows = trace.to_rows()
    assert [row["$time_ms"] for row in rows[:5]] == [0, 0, 0, 0, 1000] and rows[65]["$time_ms"] == 21_000
    assert len(rows) == 66 and rows[0]["$machine"] is None and rows[2]["$fired"] == "RED -> GREEN when turn"
    assert [{k: v for k, v in row.items() if not k.startswith("$")} for row in rows] == [
        trace.values(i) for i in range(66)
    ]


@needs("pandas")
def test_a_data_frame_where_pandas_is(trace):
    frame = load("pandas").DataFrame(trace.to_rows()).set_index("$step")
    assert trace.to_pandas().equals(frame)
    assert trace.to_pandas().loc[65, "ns"] == "GREEN"


@needs("pandas")
def test_a_data_frame_is_made_of_the_rows(trace, monkeypatch):
    made = []

    class DataFrame:
        def __init__(self, rows):
            made.append(rows)

        def set_index(self, name):
            return name

    monkeypatch.setitem(sys.modules, "pandas", SimpleNamespace(DataFrame=DataFrame))
    assert trace.to_pandas() == "$step" and made == [trace.to_rows()]


def test_without_pandas(trace, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ModuleNotFoundError, match=r"needs pandas.*pip install 'llfsm-verify\[pandas\]'"):
        trace.to_pandas()


@pytest.mark.slow
def test_a_trace_is_saved_and_run_again(trace, lights, faulty, tmp_path):
    path = trace.save(tmp_path / "new" / "both.trace.yaml")
    again = lv.replay(path)
    assert again.happens is True and again.as_expected and again.notes == ()
    assert again.run is not None and len(again.run) == 65
    assert str(again) == "the failure still happens: the run ends in a bad prefix of both"
    mended = lv.replay(path, lights)
    assert mended.happens is False and not mended.as_expected
    assert "the arrangement has changed since the trace was saved" in mended.notes
    assert lv.replay(path, faulty).happens is True


def test_a_trace_of_a_built_arrangement_is_run_again_on_it(tmp_path):
    step = lv.StateDefinition(internal="n = n + 1;", transitions=[("n > 2", "A")])
    model = lv.build("x", {"m": lv.MachineDefinition("M", {"A": step})}, whiteboard={"n": {"type": "0..2"}})
    (fault,) = model.check().faults
    path = fault.trace.save(tmp_path / "fault.trace.yaml")
    assert lv.replay(path, model).happens is True
    with pytest.raises(lv.DiagnosticError, match=r"E410.*did not come from a file"):
        lv.replay(path)


def test_a_file_that_is_no_trace_is_spared(trace, tmp_path):
    (tmp_path / "x").write_text("precious\n")
    with pytest.raises(lv.DiagnosticError, match="E405"):
        trace.save(tmp_path / "x")
    assert (tmp_path / "x").read_text() == "precious\n"


@pytest.mark.slow
def test_a_lasso_and_several_counterexamples(faulty):
    result = faulty.check("never: F ns@AMBER && F !ns@RED", traces=2)
    found = result["never"]
    assert found.trace is not None and found.trace.loop is not None
    assert 1 <= found.trace.loop <= len(found.trace)
    several = faulty.check("n: G !ns@GREEN", traces=3)["n"].traces
    assert 1 <= len(several) <= 3 and len({str(trace) for trace in several}) == len(several)
    assert several[0].wrapped == faulty.check("n: G !ns@GREEN")["n"].trace.wrapped


@pytest.mark.slow
def test_witnesses(lights):
    found = lights.check("served: G (car -> F ew@GREEN)", witnesses=True)["served"]
    assert found.verdict == "violated" or found.witness is not None
    held = lights.check("served: G (timer.ran && car -> F ew@GREEN)", witnesses=True)["served"]
    assert held.verdict == "holds" and held.witness is not None and len(held.witness) > 0

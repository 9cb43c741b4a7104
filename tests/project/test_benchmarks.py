from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks import engines, naive, nusmv, ours, spin, table
from benchmarks.children import ChildFailed, run
from benchmarks.measure import Measurement, Wrong, medians
from benchmarks.tasks import RING_STATES, SPIN_RING_STATES, Task, tasks
from llfsm_verify.arrangement.loader import load_arrangement, load_arrangement_text
from llfsm_verify.checking.verdict import Options, Result
from llfsm_verify.checking.verify import verify
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.report.json import result_json
from tests.outside import needs

ROOT = Path(__file__).parents[2]
TASKS = {task.key: task for task in tasks(range(4, 5), ROOT)}

REPORT = """
State-vector 28 byte, depth reached 203, errors: {errors}
      251 states, stored
      503 transitions (= stored+matched)
"""


def measurement(states: int = 5, cpu: float = 1.0) -> Measurement:
    return Measurement("tool", states, 6, {}, cpu, cpu, cpu, cpu, 0.0, 100)


def check(task: Task) -> Result:
    path = task.arrangement
    arrangement = load_arrangement(path) if isinstance(path, Path) else load_arrangement_text(path)
    properties = parse_properties([Source("task.ltl", task.properties)])
    return verify(arrangement, properties, Options(keep_all_bits="--keep-all-bits" in task.options))


def test_the_counts_are_the_published_ones():
    assert list(RING_STATES.values()) == [17_826, 174_971, 1_649_017, 15_110_015]
    assert list(SPIN_RING_STATES.values()) == [17_820, 174_960, 1_648_998, 15_109_983]


@pytest.mark.parametrize(
    ("name", "states", "transitions"),
    [
        (("ring", 3, 2), 507, 821),
        (("ring", 4, 3), 17_826, 28_846),
        (("microwave",), 5_092, 8_133),
        (("traffic",), 135, 152),
    ],
)
def test_plain_python_counts_as_we_do(name, states, transitions):
    assert naive.search(*naive.model(*name)) == (states, transitions)


@pytest.mark.parametrize("key", TASKS)
def test_our_answers_are_those_that_the_table_expects(key):
    task = TASKS[key]
    result = check(task)
    assert {p.name: p.verdict.value for p in result.properties} == task.verdicts
    assert result.complete and result.faults.verdict.value == "holds" and task.states in (None, result.states)


def test_peers_are_asked_about_the_same_properties():
    for task in TASKS.values():
        assert task.peer is None or task.peer.claims == tuple(task.verdicts)


def test_a_program_is_measured(tmp_path):
    code = "import sys; big = bytearray(60_000_000); print(sum(range(3_000_000)), file=sys.stderr); sys.exit(3)"
    used = run([sys.executable, "-c", code], timeout=60, cwd=tmp_path)
    assert (used.code, used.output, used.errors) == (3, "", f"{sum(range(3_000_000))}\n")
    assert 60_000_000 < used.peak < 120_000_000 and 0.01 < used.cpu <= used.wall + 0.1
    # Neither this process nor the one that starts it count.
    assert run([sys.executable, "-I", "-S", "-c", ""], timeout=60).peak < 20_000_000


def test_a_program_that_takes_too_long_or_is_not_there():
    with pytest.raises(ChildFailed, match=r"took more than 0 s"):
        run(["sleep", "30"], timeout=0.2)
    with pytest.raises(ChildFailed, match=r"could not be started:(.|\n)*No such file"):
        run(["no-such-program"], timeout=60)


def test_medians_are_of_equal_answers():
    assert medians([measurement(cpu=3.0), measurement(cpu=1.0), measurement(cpu=1.5)]) == replace(
        measurement(cpu=1.5), runs=3
    )
    with pytest.raises(Wrong, match="tool counted 5 states in one run and 6 in another"):
        medians([measurement(), measurement(states=6)])


def test_a_verifier_that_was_cut_short_is_noticed():
    report = REPORT.format(errors=0)
    assert spin.read(report) == (251, 503, 0)
    for words in (*spin.CUT_SHORT, "Search not completed"):
        with pytest.raises(Wrong, match="did not search everything"):
            spin.read(f"{words}\n{report}")
    # What stops at a violation has searched enough.
    assert spin.read("Warning: Search not completed\n" + REPORT.format(errors=1)) == (251, 503, 1)
    with pytest.raises(ChildFailed, match="no report"):
        spin.read("pan: unknown option")


@pytest.mark.parametrize(
    ("field", "value"), [("states", 134), ("verdicts", {"s1": "violated", "l1": "holds", "l2": "violated"})]
)
def test_wrong_answers_are_noticed(field, value):
    task = TASKS["traffic: 3 properties"]
    answer = json.loads(result_json(check(task)))
    assert ours.judge(task, answer) == task.verdicts
    with pytest.raises(Wrong, match="instead of"):
        ours.judge(replace(task, **{field: value}), {**answer, "states": 135})
    with pytest.raises(Wrong, match="did not search everything"):
        ours.judge(task, {**answer, "complete": False})


def test_a_wrong_answer_makes_the_benchmark_fail(monkeypatch, capsys):
    def measure(*arguments):
        raise Wrong("found 6 states instead of 7")

    monkeypatch.setattr(ours, "measure", measure)
    assert table.main(["--quick", "--only", "traffic: all"]) == 1
    assert "wrong: found 6 states instead of 7" in capsys.readouterr().err
    assert table.main(["--only", "no such question"]) == 1


@pytest.mark.slow
def test_without_spin_the_rest_still_runs(monkeypatch, capsys):
    monkeypatch.setattr(spin.shutil, "which", lambda name: None)
    assert table.main(["--quick", "--only", "traffic: all"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("question ") and [line.split()[:2] for line in lines[1:3]] == [
        ["traffic:", "all"], ["Python", "dictionary"]
    ]  # fmt: skip
    assert lines[3].split() == ["SPIN:", "spin", "is", "not", "installed"]


@pytest.mark.slow
@needs("spin", "gcc")
def test_spin_agrees(tmp_path):
    task = TASKS["microwave: 4 properties"]
    found = spin.measure(task, task.peer, tmp_path)
    assert found.verdicts == task.verdicts and found.build_cpu < found.whole_cpu


@pytest.mark.slow
@needs("spin", "gcc")
def test_a_stack_that_is_too_small_is_said(tmp_path):
    task = TASKS["traffic: all states"]
    with pytest.raises(Wrong, match="did not search everything"):
        spin.measure(task, replace(task.peer, depth=10), tmp_path)


@pytest.mark.slow
@needs("spin", "gcc")
def test_the_small_models_in_one_table():
    command = [sys.executable, "-m", "benchmarks.table", "--quick", "--json", "--only", "ring(4,3)"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    found = json.loads(done.stdout)
    assert done.returncode == 0 and found["wrong"] == []
    assert [row["tool"] for row in found["rows"]].count("SPIN") == 3


def test_what_nusmv_prints_is_read():
    said = "@@a\n-- specification  G !((p & q) is true\n@@b\n-- no counterexample found with bound 60\n@@c\n"
    said += "-- invariant x  is false\n"
    assert nusmv.read(said, ["a", "b", "c"]) == {"a": "holds", "b": "unknown", "c": "violated"}


@pytest.mark.parametrize(
    ("formula", "inside"),
    [("(G (! (p0 & p1)))", "(! (p0 & p1))"), ("(G (p -> (X q)))", None), ("((G p) & (G q))", None), ("(F p)", None)],
)
def test_invariants_for_nusmv(formula, inside):
    assert nusmv.invariant(formula) == inside


@needs("nusmv")
def test_nusmv_beside_the_engines(tmp_path):
    case = engines.Case("ring", engines.ring(3, 2), "off: G !(m0@ON && m1@ON)\nback: G F m0@OFF\n", {})
    arrangement, lines = engines.written(case, tmp_path)
    assert nusmv.exported(arrangement, lines, tmp_path / "m.smv")
    found = [nusmv.asked(way, tmp_path / "m.smv", 60).verdicts for way in nusmv.WAYS]
    result = verify(load_arrangement(arrangement), parse_properties([Source("p.ltl", case.properties)]))
    expected = {p.name: p.verdict.value for p in result.properties}
    assert found[0] == expected
    assert all(v in ("unknown", expected[n]) for verdicts in found[1:] for n, v in verdicts.items())

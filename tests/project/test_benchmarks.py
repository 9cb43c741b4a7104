from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks import (
    chain,
    engines,
    images,
    lift,
    models,
    naive,
    nusmv,
    ours,
    practice,
    rosport,
    running,
    shards,
    spin,
    table,
    timescales,
    writing,
)
from benchmarks.children import ChildFailed, TooLong, Usage, run
from benchmarks.measure import Measurement, Wrong, medians
from benchmarks.monitors import monitors_of
from benchmarks.ring import ring
from benchmarks.tasks import AS_USERS_RUN_IT, RING_STATES, SEARCHED, SPIN_RING_STATES, Task, tasks
from llfsm_verify.arrangement.loader import load_arrangement, load_arrangement_text
from llfsm_verify.checking.verdict import Options, Result
from llfsm_verify.diagnostics import Source
from llfsm_verify.engines.explicit.options import ExplicitOptions
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.report.json import result_json
from llfsm_verify.verification.verify import verify
from tests.outside import demand, needs
from tools import oracles

ROOT = Path(__file__).parents[2]
SPEEDS = ROOT / "docs" / "benchmarks.md"
CASE_STUDIES = ROOT / "models" / "README.md"
TASKS = {task.key: task for task in tasks(range(4, 5), ROOT)}

WITHOUT_NUSMV = {**os.environ, "PATH": str(Path(sys.executable).parent), "LLFSM_ORACLES": os.devnull}
"""There is a test of its own for NuSMV, which is slow on rings."""

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
    searched = Options(keep_all_bits=True, own=(ExplicitOptions(cone="off", compression="off"),))
    options, engine = {SEARCHED: (searched, "explicit"), AS_USERS_RUN_IT: (Options(), "auto")}[task.options]
    return verify(arrangement, properties, options, engine)


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


@pytest.mark.slow
@pytest.mark.parametrize("key", TASKS)
def test_our_answers_are_those_that_the_table_expects(key):
    task = TASKS[key]
    result = check(task)
    assert {p.name: p.verdict.value for p in result.properties} == task.verdicts
    assert (
        result.complete and result.faults.verdict.value == "holds" and task.states in (None, result.exploration.states)
    )


def test_where_search_is_measured_nothing_is_proved_instead():
    """Every row whose states are counted, at every size: `auto` proves what has many configurations."""
    for task in tasks(range(4, 8), ROOT):
        assert task.options == (AS_USERS_RUN_IT if task.states is None else SEARCHED), task.key
    assert SEARCHED[:2] == ("--engine", "explicit") and "--engine" not in AS_USERS_RUN_IT


def test_peers_are_asked_about_the_same_properties():
    for task in TASKS.values():
        assert task.peer is None or task.peer.claims == tuple(task.verdicts)


@pytest.mark.slow
def test_a_program_is_measured(tmp_path):
    code = "import sys; big = bytearray(60_000_000); print(sum(range(3_000_000)), file=sys.stderr); sys.exit(3)"
    used = run([sys.executable, "-c", code], timeout=600, cwd=tmp_path)
    assert (used.code, used.output, used.errors) == (3, "", f"{sum(range(3_000_000))}\n")
    assert 60_000_000 < used.peak < 120_000_000 and 0.01 < used.cpu <= used.wall + 0.1
    # Neither this process nor the one that starts it count.
    assert run([sys.executable, "-I", "-S", "-c", ""], timeout=600).peak < 20_000_000


@pytest.mark.slow
def test_a_program_that_takes_too_long_or_is_not_there():
    with pytest.raises(ChildFailed, match=r"took more than 0 s"):
        run(["sleep", "10000"], timeout=0.2)
    with pytest.raises(ChildFailed, match=r"could not be started:(.|\n)*No such file"):
        run(["no-such-program"], timeout=600)


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
    with pytest.raises(Wrong, match="says of faults: unknown"):
        ours.judge(task, {**answer, "faults": {"verdict": "unknown"}})


@pytest.mark.parametrize("other", [{"complete": False}, {"engine": "auto"}])
def test_what_was_proved_is_no_measurement_of_search(other):
    task = TASKS["traffic: all states"]
    answer = json.loads(result_json(check(task)))
    assert ours.judge(task, answer) == {}
    with pytest.raises(Wrong, match="did not search everything"):
        ours.judge(task, {**answer, **other})


def test_a_proof_has_no_states(tmp_path, monkeypatch):
    """As users run it, an engine that counts nothing may answer: the row is there, without states."""
    task = TASKS["traffic: 3 properties"]
    answer = {**json.loads(result_json(check(task))), "states": 200, "complete": False}

    def answered(command: Sequence[str], **_: object) -> Usage:
        search = {"states": 200, "wall": 1.0, "cpu": 1.0, "build": 0.0}
        return Usage(json.dumps(search if "benchmarks.ours" in command else answer), "", 0, 1.0, 1.0, 1000)

    monkeypatch.setattr(ours, "run", answered)
    found = ours.measure(task, tmp_path, ROOT)
    assert (found.states, found.transitions, found.bytes_each) == (0, 0, 0.0)
    assert next(table.rows(task, [found], True))[2:4] == (
        "",
        "",
    ) and "| traffic, 3 properties | | 1.00," in table.front([(task, [found])])


def test_a_wrong_answer_makes_the_benchmark_fail(monkeypatch, capsys):
    def measure(*arguments):
        raise Wrong("found 6 states instead of 7")

    monkeypatch.setattr(ours, "measure", measure)
    assert table.main(["--quick", "--only", "traffic: all"]) == 1
    assert "wrong: found 6 states instead of 7" in capsys.readouterr().err
    assert table.main(["--only", "no such question"]) == 1


def front_cells(text: str) -> list[list[str]]:
    """The rows of a page's table of speeds, headings first."""
    body = writing.part(text, table.NAME)
    return [[cell.strip() for cell in line[1:-1].split("|")] for line in body.splitlines() if line.startswith("| ")]


def form(cells: list[list[str]]) -> list[list[str]]:
    """What a measurement does not change: questions, and where there are numbers of what kind."""
    return [[first, *(re.sub(r"[\d.,]*\d", "0", cell) for cell in rest)] for first, *rest in cells]


def measured(task: Task, runs: int, with_spin: bool, all_runs: bool) -> list[Measurement]:
    """As `table.measure` would say, with invented numbers."""
    found = [Measurement(ours.NAME, task.states or 200, 1, {}, 2.0, 2.0, 1.0, 1.0, 0.5, 1 << 24)]
    if task.shared:
        found.append(replace(found[0], tool=ours.SHARED))
    if with_spin and task.peer is not None:
        found.append(replace(found[0], tool=spin.NAME))
    return [*found, replace(found[0], tool=table.NAIVE)] if task.naive else found


@pytest.fixture
def with_spin_of_our_own(monkeypatch):
    """As where SPIN is installed, wherever this runs."""
    monkeypatch.setattr(table, "measure", measured)
    monkeypatch.setattr(spin, "missing", lambda: None)
    monkeypatch.setattr(spin, "version", lambda: "SPIN 6.5.2, gcc 12.2.0 -O2")


SIGNED = re.compile(
    r"^Written by `python -m (\S+)` on \d{4}-\d\d-\d\d: llfsm-verify [\w.]+, Python 3\.[\d.]+"
    r"(, SPIN \d[\d.]+, gcc \d[\d.]* -O2)?; \d+ cores? \(\w+, \w+\); .*\.$",
    re.MULTILINE,
)


def test_the_table_on_the_page_is_one_that_the_benchmark_writes(tmp_path, with_spin_of_our_own):
    shown = SPEEDS.read_text(encoding="utf-8")
    page = tmp_path / "page.md"
    page.write_text(shown, encoding="utf-8")
    assert table.main(["--write", str(page)]) == 0
    written = page.read_text(encoding="utf-8")
    assert form(front_cells(shown)) == form(front_cells(written))
    for task in tasks(range(4, 8), ROOT):
        if task.front and task.states is not None:
            assert [f"{task.name}, {task.question}", f"{task.states:,}"] in [row[:2] for row in front_cells(shown)]
    for text in (shown, written):
        found = SIGNED.search(writing.part(text, table.NAME))
        assert found is not None and found[1] == table.NAME and found[2] and "medians of 3 runs" in found[0]
    # What is outside the marks stays.
    assert [text.partition(writing.marks(table.NAME)[0])[0] for text in (shown, written)] == [
        shown[: shown.index(writing.marks(table.NAME)[0])]
    ] * 2
    assert written.endswith(shown[shown.index(writing.marks(table.NAME)[1]) :])


def test_a_page_without_a_place_for_the_table_is_refused_at_once(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(table, "measure", lambda *arguments: pytest.fail("it was measured first"))
    first, last = writing.marks(table.NAME)
    page = tmp_path / "page.md"
    for text in ("no marks\n", f"{first}\n", f"{last}\n{first}\n", f"{first}\n{first}\n{last}\n"):
        page.write_text(text, encoding="utf-8")
        with pytest.raises(SystemExit):
            table.main(["--write", str(page)])
        assert "the page needs the lines" in capsys.readouterr().err and page.read_text(encoding="utf-8") == text
    with pytest.raises(SystemExit):
        table.main(["--write", str(tmp_path / "none.md")])
    assert "No such file" in capsys.readouterr().err


def test_a_wrong_answer_is_not_written(tmp_path, monkeypatch):
    def measure(task: Task, *arguments: object) -> list[Measurement]:
        if task.name == "microwave":
            raise Wrong("found 6 states instead of 7")
        return [measurement()]

    monkeypatch.setattr(table, "measure", measure)
    page = tmp_path / "page.md"
    page.write_text("\n".join(writing.marks(table.NAME)), encoding="utf-8")
    assert table.main(["--quick", "--write", str(page)]) == 1
    assert page.read_text(encoding="utf-8") == "\n".join(writing.marks(table.NAME))


@pytest.mark.parametrize(
    "with_spin",
    [pytest.param(True, marks=pytest.mark.long), pytest.param(False, marks=pytest.mark.long)],
    ids=["with SPIN", "without SPIN"],
)
def test_the_quick_form_of_the_benchmark(with_spin, tmp_path, monkeypatch, capsys):
    """All of it on small instances: every question, each tool, the table for the page.

    Where SPIN is installed, the form without it asks a few of the questions: the others are then the same.
    """
    asked, only = TASKS, []
    if not with_spin and spin.missing() is None:
        only = ["--only", "traffic"]
        asked = {key: task for key, task in TASKS.items() if "traffic" in key}
    if not with_spin:
        find = oracles.find
        monkeypatch.setattr(oracles, "find", lambda name: None if name == "spin" else find(name))
    else:
        demand("spin", "gcc")
    page = tmp_path / "page.md"
    page.write_text("before\n\n" + "\n\n".join(writing.marks(table.NAME)) + "\n\nafter\n", encoding="utf-8")
    assert table.main(["--quick", "--json", "--write", str(page), *only]) == 0
    found = json.loads(capsys.readouterr().out)
    tools = {key: {row["tool"] for row in found["rows"] if row["question"] == key} for key in asked}
    assert found["wrong"] == [] and tools == {
        key: {m.tool for m in measured(task, 1, with_spin, all_runs=False)} for key, task in asked.items()
    }
    text = page.read_text(encoding="utf-8")
    assert [row[0] for row in front_cells(text)[1:]] == [
        f"{task.name}, {task.question}" for task in asked.values() if task.front
    ]
    found = SIGNED.search(text)
    assert with_spin == (found is not None and found[2] is not None)
    assert with_spin or "without SPIN: spin is not installed" in text
    assert text.startswith("before\n\n<!--") and text.endswith("-->\n\nafter\n")


def test_without_spin_its_rows_say_so():
    task = TASKS["traffic: all states"]
    cells = list(table.rows(task, measured(task, 1, with_spin=False, all_runs=False), with_spin=False))
    lines = table.lay_out(cells).splitlines()
    assert lines[0].startswith("question ") and [line.split()[:2] for line in lines[1:3]] == [
        ["traffic:", "all"], ["Python", "dictionary"]
    ]  # fmt: skip
    assert lines[3].split()[:1] == ["SPIN:"] and lines[3].endswith("is not installed")


@pytest.mark.long
def test_the_table_of_the_case_studies_is_what_their_benchmark_writes(tmp_path, capsys):
    shown = CASE_STUDIES.read_text(encoding="utf-8")
    page = tmp_path / "page.md"
    page.write_text(shown, encoding="utf-8")
    models.main(["--write", str(page)])
    printed, written = capsys.readouterr().out, page.read_text(encoding="utf-8")
    body, before = writing.part(written, models.NAME), writing.part(shown, models.NAME)
    assert body == printed.strip() and SIGNED.search(body)[1] == SIGNED.search(before)[1] == models.NAME

    def rows(text: str) -> list[str]:
        return [line.rpartition(" | ")[0] for line in text.splitlines() if line.startswith("|")]

    assert rows(body) == rows(before) and len(rows(body)) == 2 + len(list((ROOT / "models").glob("*/arrangement.yaml")))


SCRIPTS = {
    "attacks": ("--commands", "2", "--attackers", "1"),
    "automata": ("FACTS",),
    "clocked": ("50", "1"),
    "compiling": ("1", "2", "2"),
    "engines": ("--only", "ring(8,3)", "--timeout", "60"),
    "limits": ("models/traffic_lights", "--engine", "explicit", "--timeout", "60"),
    "monitors": ("--letters", "1000", "--runs", "1"),
    "naive": ("traffic",),
    "pingpong": ("--ringlets", "1000", "--repeat", "1"),
    "ring": ("2", "2"),
    "timescales": ("--bounds", "10", "--letters", "1000", "--runs", "1"),
}
"""Each script at its smallest size. What the table starts runs with its quick form."""
OF_THE_TABLE = {
    "chain",
    "children",
    "guarding",
    "launch",
    "lift",
    "measure",
    "models",
    "nusmv",
    "ours",
    "practice",
    "ros",
    "rospeer",
    "rosport",
    "running",
    "sensors",
    "spin",
    "table",
    "tasks",
    "writing",
}
FACTS = """\
formula\tmp_class\ttgba_s\taccepted_word\tba_s\tmonitor_s
G p0\tS\t1\tcycle{p0}\t1\t1
F p0\tG\t2\tcycle{p0}\t2\t1
"""


def test_every_script_is_run_by_a_test():
    assert {path.stem for path in (ROOT / "benchmarks").glob("*.py")} == SCRIPTS.keys() | OF_THE_TABLE | {
        "images",
        "shards",
        "sweep",
        "viewing",
    }


@pytest.mark.slow
@needs("gcc")
def test_images_are_measured_beside_the_executor():
    _, arrangement, held = next(row for row in images.subjects() if row[0] == "traffic_lights")
    assert len(images.measure(arrangement, held, 2_000, 1)) == 3
    with pytest.raises(SystemExit, match="different records"):
        images.measure(arrangement, held, 2_000, 1, off=1)


@pytest.mark.long
@needs("rospy")
def test_topics_are_relayed_beside_rospy(capsys):
    rosport.main(0.1)
    assert len(capsys.readouterr().out.splitlines()) == 5


@pytest.mark.long
@pytest.mark.parametrize("name", SCRIPTS)
def test_each_script_runs(name, tmp_path):
    facts = tmp_path / "facts.tsv"
    facts.write_text(FACTS, encoding="utf-8")
    arguments = [str(facts) if word == "FACTS" else word for word in SCRIPTS[name]]
    done = subprocess.run(
        [sys.executable, "-m", f"benchmarks.{name}", *arguments],
        cwd=ROOT, capture_output=True, text=True, check=False, env=WITHOUT_NUSMV,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "") and len(done.stdout.splitlines()) > 0
    said = {
        "attacks": "calls ",
        "automata": "classes: 2 of 2 agree",
        "clocked": " cycles a second ",
        "compiling": "machines  load s",
        "engines": "| ring(8,3) | ",
        "limits": "s beyond the limit: traffic_lights explicit --timeout 60",
        "monitors": "a step and property",
        "naive": '"states": 135, "transitions": 152',
        "pingpong": "machines  compile s",
        "ring": "schedule: [m0, m1]",
        "timescales": "RecurGLB10 ",
    }
    assert said[name] in done.stdout


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
def test_the_benchmark_as_a_command():
    command = [sys.executable, "-m", "benchmarks.table", "--quick", "--only", "traffic: all"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("question ") and "\ntraffic: all states  llfsm-verify " in done.stdout


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


@pytest.mark.slow
@needs("nusmv")
def test_nusmv_beside_the_engines(tmp_path):
    case = engines.Case("ring", engines.ring(3, 2), "off: G !(m0@ON && m1@ON)\nback: G F m0@OFF\n", {})
    arrangement, lines = engines.written(case, tmp_path)
    assert nusmv.exported(arrangement, lines, tmp_path / "m.smv")
    found = [nusmv.asked(way, tmp_path / "m.smv", 60).verdicts for way in nusmv.WAYS]
    result = verify(
        load_arrangement(arrangement), parse_properties([Source("p.ltl", case.properties)]), engine="explicit"
    )
    expected = {p.name: p.verdict.value for p in result.properties}
    assert found[0] == expected
    assert all(v in ("unknown", expected[n]) for verdicts in found[1:] for n, v in verdicts.items())


def small(name: str) -> practice.Row:
    """A row of the second table at its smallest size, which every tool decides in a moment."""
    if name == "lift":
        verdicts = {"bound": lift.verdicts(2)["bound"]}
        texts = [lift.arrangement(2), lift.PROPERTIES, lift.promela(2), lift.smv(2)]
        return practice.Row(name, *texts, verdicts, 300, 100_000, fair=True)
    if name == "crossing":
        return next(row for row in practice.rows() if row.name.startswith(name))
    verdicts = {f"{letter}{i}": "holds" for i in range(2) for letter in "qrd"}
    writers = (chain.arrangement, chain.properties, chain.promela, chain.smv)
    return practice.Row(name, *(write(2, name) for write in writers), verdicts, 300)


@pytest.mark.long
@needs("spin", "gcc")
@pytest.mark.parametrize("name", [*chain.KINDS, "lift", "crossing"])
def test_spin_agrees_about_models_as_people_write_them(name, tmp_path):
    assert practice.ask_spin(small(name), tmp_path).failed == ""


@pytest.mark.long
@needs("nusmv")
@pytest.mark.parametrize("name", chain.KINDS)
def test_nusmv_agrees_about_models_as_people_write_them(name, tmp_path):
    assert practice.ask_nusmv(small(name), tmp_path).failed == ""


@pytest.mark.long
@pytest.mark.parametrize("people", [2, 3])
def test_the_lift_is_as_the_benchmark_expects(people, tmp_path):
    texts = [lift.arrangement(people), lift.PROPERTIES, "", ""]
    row = practice.Row("lift", *texts, lift.verdicts(people), 300)
    assert practice.ask_us(row, tmp_path).failed == ""


@pytest.mark.parametrize(
    ("verdicts", "failed"),
    [({"safe": "violated"}, ""), ({"safe": "unknown", "faults": "holds"}, "1 of 2 unknown")],
)
def test_an_answer_or_none(verdicts, failed):
    used = [Usage("", "", 0, 1.0, 0.5, 0), Usage("", "", 0, 2.0, 0.5, 0)]
    assert practice.judge(small("crossing"), "tool", verdicts, used) == practice.Answer(1.0, 3.0, failed)


def test_the_bounds_of_timescales():
    assert timescales.with_bounds(timescales.OURS["RespondGLB"], 10) == "(s -> O[3:10] p) && (p -> X F[0:9] s)"
    assert timescales.with_bounds(timescales.THEIRS["AbsentBQR"], 100).endswith("((not {p}) since[30:100] {q})")
    _, monitors = monitors_of("property: G O[0:2] p")
    assert timescales.stream(monitors["property"], [1, 0, 0, 1, 0, 0, 0, 1]) == [True] * 6 + [False] * 2


@pytest.mark.parametrize("verdicts", [{"safe": "holds"}, {}, {"safe": "violated", "faults": "violated"}])
def test_tools_that_disagree_are_noticed(verdicts):
    with pytest.raises(Wrong, match="tool says"):
        practice.judge(small("crossing"), "tool", verdicts, [])


def test_what_takes_too_long_is_said_and_not_asked_again(monkeypatch, tmp_path):
    asked: list[str] = []

    def ask(tool: str) -> Callable[..., practice.Answer]:
        def answer(row: practice.Row, folder: Path) -> practice.Answer:
            asked.append(tool)
            if tool == spin.NAME:
                raise TooLong("took more than 30 s")
            return practice.Answer(float(len(asked)), 1.0)

        return answer

    monkeypatch.setattr(practice, "ASK", {tool: ask(tool) for tool in practice.TOOLS})
    monkeypatch.setattr(practice, "missing", lambda tool: tool == practice.TOOLS[2])
    row = small("crossing")
    found = practice.measure(row, 3)
    assert asked == [ours.NAME, spin.NAME, ours.NAME, ours.NAME]
    assert practice.cells(row, found) == [row.name, "3.00/1.00", ">30", "not installed"]


@pytest.mark.long
def test_the_second_table_is_one_that_its_benchmark_writes(tmp_path, monkeypatch):
    shown = SPEEDS.read_text(encoding="utf-8")
    page = tmp_path / "page.md"
    page.write_text(shown, encoding="utf-8")
    answers = {tool: practice.Answer(1.0, 2.0) for tool in practice.TOOLS}
    monkeypatch.setattr(practice, "measure", lambda row, runs: answers)
    assert practice.main(["--write", str(page)]) == 0

    def questions(text: str) -> list[str]:
        return [line.split(" | ")[0] for line in writing.part(text, practice.NAME).splitlines() if line[:2] == "| "]

    assert questions(shown) == questions(page.read_text(encoding="utf-8")) and len(questions(shown)) == 14


@pytest.mark.long
def test_runs_are_measured(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LLFSM_WHITEBOARDS", "set by the benchmark")
    assert running.main(["--quick"]) == 0
    said = capsys.readouterr().out
    assert said.count("| lateness of ") == 8 and said.count("| ringlets a second, ") == 4
    assert ("rospy's publish" in said) != ("Without ROS: " in said)


def test_what_shards_send_is_counted() -> None:
    """Beside a count by hand, edge by edge."""
    space = shards.explored("ring(3,2)", load_arrangement_text(ring(3, 2)))
    for number in shards.SHARDS:
        owner = [int(value) % number for value in space.hashes]
        edges = list(zip(space.sources.tolist(), space.targets.tolist(), strict=True))
        crossing = [(source, target) for source, target in edges if owner[source] != owner[target]]
        last: dict[tuple[int, int], int] = {}
        sent = 0
        for source, target in crossing:
            slot = owner[source], (int(space.hashes[target]) >> 32) % 8
            sent += last.get(slot) != target
            last[slot] = target
        found = shards.traffic(space, number, 8)
        assert (found.crossing, found.sent) == (len(crossing), sent)
        assert found.largest == max(map(owner.count, range(number)))


def test_the_table_of_shards_is_one_that_the_benchmark_writes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shards, "spaces", lambda: [("ring(3,2)", load_arrangement_text(ring(3, 2)))])
    shown = (ROOT / "docs" / "scale.md").read_text(encoding="utf-8")
    page = tmp_path / "page.md"
    page.write_text(shown, encoding="utf-8")
    assert shards.main(["--write", str(page)]) == 0
    one, other = (writing.part(text, shards.NAME).splitlines() for text in (shown, page.read_text(encoding="utf-8")))
    assert one[:2] == other[:2] and other[2].startswith("| ring(3,2) | ")


def test_two_jobs_are_beside_one() -> None:
    task = TASKS["ring(4,3): all states"]
    one = Measurement(ours.NAME, 200_000, 1, {}, 4.0, 4.0, 3.0, 3.0, 0.0, 2_000_000)
    two = replace(one, tool=ours.SHARED, whole_wall=2.0, search_wall=2.0, memory=4_000_000)
    assert "| 10 | 2.00×, 1.50× | 20 |" in table.front([(replace(task, front=True), [one, two])])

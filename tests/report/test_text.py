from __future__ import annotations

import io

import pytest
from rich.console import Console
from rich.text import Text

from llfsm_verify.checking.trace import Trace
from llfsm_verify.report.text import result_text
from llfsm_verify.report.tracetable import atom_text, loop_text, rows
from tests.report.results import ALL, EVERY, FAULT, GOOD, LASSO, PATH, RESUMED, UNKNOWN_FAULTS, result, sampled, step


def printed(value, **options) -> str:
    file = io.StringIO()
    console = Console(file=file, width=300, highlight=False, markup=False)
    for item in result_text(value, **options):
        console.print(item, soft_wrap=isinstance(item, Text))
    return file.getvalue()


def test_a_line_for_each_property_and_one_for_faults():
    lines = printed(ALL, quiet=True).splitlines()
    assert [line.split()[0] for line in lines if not line.startswith(" ")] == [
        "holds",
        "violated",
        "violated",
        "unknown",
        "violated",
    ]
    assert any("because the time limit of 1 s was reached" in line for line in lines)
    assert any("note: it is trivially true" in line for line in lines)


WHOLE = """\
holds on fault-free runs  good     G a
                                   note: it is trivially true
violated                  bad      G !(x == 3)
violated                  looping  F b
unknown                   open     F b
                                   because the time limit of 1 s was reached
violated                  faults   1 place where a run ends in a fault

bad is violated (assuming fair): G !(x == 3)
Initially x = 0, m = A.
step  machine  state  fired                     inputs       changes   property
 0                    initially                                        !(x == 3)
 1    m        A                                car = false
 2–7  m, n            6 steps without an event
 8    m        A      → B when car              car = true   x: 0 → 3
 9    m        B                                                       x == 3
Violated after step 9, however the run goes on.

looping is violated (assuming fair): F b
Initially x = 0.
step  machine  state  fired      changes   property
 0                    initially            !b
 1    m        A                 x: 0 → 1
┌2    m        A                 x: 1 → 2
└3    (ended)
Steps 2 to 3 repeat forever.

props.ltl:2:1: warning[F001]: `x` would become 4, outside 0..3
    2 | bad: G !(x == 3)
      | ^^^
Initially x = 3.
step  machine  state  fired      changes
 0                    initially
 1    m        A                 x: 3 → 2
 2    m        A      FAULT
Step 2 ends the run in a fault.

1,234 configurations, 5,678 transitions, complete, 0.25 s, engine explicit
"""

ENDING = "then every machine that is loaded stands in a state without transitions"
SUMMARY = f"""\
1,234 configurations, 5,678 transitions, complete (resumed from old.ckpt), 0.25 s, engine explicit
every run ends, after at most 12 steps: {ENDING} (resumed from old.ckpt)
counted without what no property depends on: m.k, n
far: 4 classes of 65,536 values
a, b: 1 class of 1,200 combinations of values
wide: all 1,024 values, because the action adds it up
"""


def test_a_whole_report():
    assert [line.rstrip() for line in printed(ALL).splitlines()] == WHOLE.splitlines()


def test_what_follows_the_traces():
    *verdicts, _, _ = printed(RESUMED).partition(SUMMARY.splitlines()[0])
    assert printed(RESUMED).endswith("\n\n" + SUMMARY)
    lines = [line.split()[0] for line in verdicts[0].splitlines() if line]
    assert lines == [
        "holds",
        "fails",
        "fails",
        "holds",
        "fails",
        "accepted:",
        "holds",
        "fails",
        "unknown",
        "unknown",
        "because",
        "holds",
        "fails",
    ]


def test_quiet_leaves_out_traces_and_summary():
    assert "configurations" not in printed(ALL, quiet=True)
    assert "1,234 configurations, 5,678 transitions, complete, 0.25 s" in printed(ALL)


@pytest.mark.parametrize("faults_known", [True, False])
def test_holds_is_qualified_while_faults_are_open(faults_known):
    value = result(GOOD) if faults_known else result(GOOD, faults=UNKNOWN_FAULTS)
    assert ("holds on fault-free runs" in printed(value)) is not faults_known


def test_the_fault_shows_its_source_line():
    text = printed(ALL)
    assert "props.ltl:2:1" in text and "F001" in text and "bad: G !(x == 3)" in text and "FAULT" in text


@pytest.mark.parametrize("name", EVERY)
def test_every_result_prints(name):
    assert printed(EVERY[name])


def test_quiet_stretches_fold_into_one_row():
    folded = list(rows(PATH))
    assert [row.step for row in folded] == ["0", "1", "2–7", "8", "9"]
    assert folded[2].fired == "6 steps without an event" and folded[2].machine == "m, n"
    assert [row.step for row in rows(PATH, fold=False)] == [str(i) for i in range(10)]


def test_three_quiet_steps_stay_as_they_are():
    trace = Trace((), (), (), tuple(step(atoms=()) for _ in range(3)), None)
    assert [row.step for row in rows(trace)] == ["0", "1", "2", "3"]


def test_a_fold_never_crosses_the_start_of_the_loop():
    trace = Trace((), (), (), tuple(step(atoms=()) for _ in range(12)), 5)
    assert [(row.step, row.mark) for row in rows(trace)] == [("0", ""), ("1–5", ""), ("6–12", "only")]


def test_an_input_that_changes_is_an_event():
    assert [row.inputs for row in rows(PATH)][3] == "car = true"


def test_the_state_of_the_machine_that_fired_is_not_repeated():
    row = list(rows(PATH))[3]
    assert row.fired == "→ B when car" and row.changes == "x: 0 → 3"


def test_atoms_appear_where_they_change():
    assert [row.atoms for row in rows(PATH)] == ["!(x == 3)", "", "", "", "x == 3"]
    assert atom_text("ns@RED", False) == "!ns@RED"


def test_loop_marks():
    assert [row.mark for row in rows(LASSO)] == ["", "", "first", "last"]
    assert loop_text(LASSO) == "steps 2 to 3 repeat forever"
    assert list(rows(LASSO))[3].machine == "(ended)"


@pytest.mark.parametrize(
    ("trace", "sentence"),
    [
        (PATH, "violated after step 9, however the run goes on"),
        (FAULT, "step 2 ends the run in a fault"),
        (Trace((), (), (), (), None), "already violated in the initial configuration"),
        (Trace((), (), (), (step(),), 0), "step 1 repeats forever"),
    ],
)
def test_how_a_trace_ends(trace, sentence):
    assert loop_text(trace) == sentence


def test_atoms_that_other_columns_show_are_left_out():
    ran = step(sampled=(sampled("true"),), atoms=(("car", True), ("m.ran", True), ("x.ran", True)))
    trace = Trace((), (), (("car", False), ("m.ran", False)), (ran,), None)
    assert [row.atoms for row in rows(trace)] == ["!car", "x.ran"]

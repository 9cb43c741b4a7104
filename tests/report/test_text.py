from __future__ import annotations

import io
from dataclasses import replace
from fractions import Fraction

import pytest
from rich.console import Console
from rich.text import Text

from llfsm_verify.checking.trace import Cause, Change, Sampled, Trace
from llfsm_verify.checking.verdict import Exploration
from llfsm_verify.report.cycles import Times
from llfsm_verify.report.steptable import Listed
from llfsm_verify.report.text import result_text
from llfsm_verify.report.tracetable import atom_text, rows
from llfsm_verify.report.wording import loop_text
from tests.report.results import (
    ALL,
    BAD,
    EVERY,
    FAULT,
    GOOD,
    LASSO,
    OPEN,
    PATH,
    RESUMED,
    UNKNOWN_FAULTS,
    result,
    sampled,
    step,
)


def printed(value, **options) -> str:
    file = io.StringIO()
    console = Console(file=file, width=300, highlight=False, markup=False)
    for item in result_text(value, **options):
        console.print(item, soft_wrap=isinstance(item, Text))
    return file.getvalue()


def test_each_command_of_an_operator_is_told_and_what_it_writes():
    """Also where the same came before; an operator that stays away is not told."""

    operator = {"enter": "operator.enter(m)", "state": "operator.state(m)", "value": "operator.value(x)"}
    given = (
        {"enter": "true", "state": "A"},
        {"enter": "false"},
        {"enter": "true", "state": "A", "value": "false"},
    )
    read = [tuple(Sampled(operator[kind], "", 0, text) for kind, text in each.items()) for each in given]
    trace = Trace((), (), (), tuple(step(sampled=choices) for choices in read), None)
    told = [row.inputs for row in rows(trace, fold=False)][1:]
    assert told == ["operator.enter(m) = true, operator.state(m) = A", "", told[0] + ", operator.value(x) = false"]


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
step  cycle  machine  state  fired                     inputs       changes   property
 0                           initially                                        !(x == 3)
 1–7  1      m, n            7 steps without an event  car = false
 8           m        A      → B when car              car = true   x: 0 → 3
 9           m        B                                                       x == 3
Violated after step 9, however the run goes on.

looping is violated (assuming fair): F b
Initially x = 0.
step  cycle  machine  state  fired      changes   property
 0                           initially            !b
 1    1      m        A                 x: 0 → 1
┌2           m        A                 x: 1 → 2
──────────────────────────────────────────────────────────
└3    1      (ended)
Steps 2 to 3 repeat forever.

props.ltl:2:1: error[F001]: `x` would become 4, outside 0..3
    2 | bad: G !(x == 3)
      | ^^^
Initially x = 3.
step  cycle  machine  state  fired      changes
 0                           initially
 1    1      m        A                 x: 3 → 2
 2           m        A      FAULT
Step 2 ends the run in a fault.

holds on fault-free runs  good
violated                  bad
violated                  looping
unknown                   open
violated                  faults

1,234 configurations, 5,678 transitions, complete, 0.25 s, engine explicit
"""

ENDING = "then every machine that is loaded is in a state without transitions"
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


def test_an_engine_of_bounded_runs_names_one_that_is_not():
    auto = "`--engine auto` also asks engines"
    bounded = Exploration(complete=False, depth=60)
    assert auto in printed(replace(result(OPEN), exploration=bounded)) and auto not in printed(result(OPEN))
    assert auto not in printed(replace(result(BAD), exploration=bounded))


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
    assert [row.step for row in folded] == ["0", "1–7", "8", "9"]
    assert folded[1].fired == "7 steps without an event" and folded[1].machine == "m, n"
    assert [row.step for row in rows(PATH, fold=False)] == [str(i) for i in range(10)]


def test_one_quiet_step_stays_as_it_is():
    quiet, eventful = step(atoms=()), step(atoms=(), fired="A -> B when car")
    trace = Trace((), (), (), (quiet, eventful, quiet, quiet), None)
    assert [row.step for row in rows(trace)] == ["0", "1", "2", "3–4"]


def test_a_fold_never_crosses_the_start_of_the_loop():
    trace = Trace((), (), (), tuple(step(atoms=()) for _ in range(12)), 5)
    assert [(row.step, row.mark) for row in rows(trace)] == [("0", ""), ("1–5", ""), ("6–12", "only")]


def test_an_input_is_shown_where_its_value_changes():
    assert [row.inputs for row in rows(PATH)] == ["", "car = false", "car = true", ""]
    assert [row.inputs for row in rows(PATH, fold=False)] == ["", "car = false", *[""] * 6, "car = true", ""]


def test_inputs_that_change_in_a_folded_stretch_are_named():
    values = [step(sampled=(sampled(text),), atoms=()) for text in ("true", "false", "true")]
    fires = step(sampled=(sampled("true"),), atoms=(), fired="A -> B when car")
    assert [row.inputs for row in rows(Trace((), (), (), (*values, fires), None))] == ["", "car varies", "car = true"]


def test_an_input_that_is_stored_stands_in_one_column():
    stored = step(sampled=(sampled("true"),), changes=(Change("car", "false", "true"), Change("x", "0", "1")), atoms=())
    row = list(rows(Trace((("car", "false"), ("x", "0")), (), (), (stored,), None)))[1]
    assert (row.inputs, row.changes) == ("car = true", "x: 0 → 1")


def test_an_input_that_is_an_atom_of_the_property_is_an_event():
    asked = [step(sampled=(sampled(text),), atoms=(("car", text == "true"),)) for text in ("false", "false", "true")]
    trace = Trace((), (), (("car", False),), tuple(asked), None)
    assert [(row.step, row.inputs) for row in rows(trace)] == [("0", ""), ("1–2", ""), ("3", "car = true")]
    other = Cause("x == 3", True, (("x", "3"),))
    causes = replace(trace, because="of `x`", steps=(*asked[:2], replace(asked[2], causes=(other,))))
    assert [(row.step, row.inputs) for row in rows(causes)] == [("0", ""), ("1–3", "car varies")]


def test_what_follows_a_violation_is_one_row():
    moving = step(changes=(Change("x", "0", "1"),), atoms=())
    trace = Trace((), (), (), (moving,) * 6, 3, failed_at=2)
    assert [(row.step, row.mark, row.fired) for row in rows(trace)][3:] == [("3–6", "", "4 steps after the violation")]
    assert [row.mark for row in rows(replace(trace, loop=2))][3:] == ["only"]
    assert len(list(rows(trace, fold=False))) == 7


def test_cycles_and_their_times():
    cycle = [step(fired="A -> B when car", atoms=()), replace(step("n", atoms=(), fired="A -> B when car"), cycle=True)]
    trace = Trace((), (), (), tuple(cycle * 3), None, period=Fraction(500))
    said = [("1", "0.0 s"), ("", ""), ("2", "0.5 s"), ("", ""), ("3", "1.0 s"), ("", "")]
    assert [(row.cycle, row.time) for row in rows(trace)][1:] == said
    table = [line.rstrip() for line in printed(result(replace(BAD, trace=trace))).splitlines()]
    assert [line[:14] for line in table if line.startswith("──")] == ["─" * 14] * 2
    quiet = replace(trace, steps=tuple(replace(s, fired=None) for s in trace.steps))
    (folded,) = list(rows(quiet))[1:]
    assert (folded.cycle, folded.time) == ("1–3", "0.0–1.0 s")
    assert "time" not in printed(result(replace(BAD, trace=replace(trace, period=None))))


def test_times_have_one_unit_and_as_many_decimals_as_they_need():
    texts = [(Fraction(20), 3, "40 ms"), (Fraction(20), 60, "1.18 s"), (Fraction(1, 3), 2, "0.333333 ms")]
    assert [Times.until(period, last).of(last, last) for period, last, _ in texts] == [text for *_, text in texts]


def test_many_values_are_a_list():
    console = Console(file=io.StringIO(), width=40)
    console.print(Listed("Initially", tuple((f"name_{i}", str(i)) for i in range(5))))
    lines = ["Initially:", "  name_0 = 0   name_2 = 2   name_4 = 4", "  name_1 = 1   name_3 = 3"]
    assert console.file.getvalue().splitlines() == lines


def test_the_state_of_the_machine_that_fired_is_not_repeated():
    row = list(rows(PATH))[2]
    assert row.fired == "→ B when car" and row.changes == "x: 0 → 3"


def test_atoms_appear_where_they_change():
    assert [row.atoms for row in rows(PATH)] == ["!(x == 3)", "", "", "x == 3"]
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

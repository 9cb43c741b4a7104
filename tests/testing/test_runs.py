"""Runs in stretches: what machine code does with held inputs, what fails, how a run is told again."""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement import build_arrangement, load_arrangement_text
from llfsm_verify.checking.replay.confirm import Schedule
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.testing import RunFailed, Stretch, Subject, load
from llfsm_verify.testing.arrangements import arrangements
from llfsm_verify.testing.properties import properties, regular_properties
from llfsm_verify.testing.stateful import polish
from llfsm_verify.verification.replay import replay
from tests.cli.running import llfsm
from tests.quick import examples, many

FAULTY = "models/traffic_lights/faulty.yaml"
BOTH = "both: G !(ns@GREEN && ew@GREEN)"


def random_subject(data):
    arrangement = build_arrangement(data.draw(arrangements()))
    # Two letters on, so that few are violated before the run begins.
    lines = [f"p{i}: X X ({t})" for i, t in enumerate(data.draw(st.lists(properties(arrangement), max_size=2)))]
    if data.draw(st.booleans()):
        kind, text = data.draw(regular_properties(arrangement))
        lines.append(f"{kind} r: {text}")
    return Subject(arrangement, parse_properties([Source("test", "\n".join(lines))]))


def random_stretch(run, chance):
    """Drawn by a generator of its own: Hypothesis makes most of what it draws last as small as it can."""
    stimuli = list(run.subject.stimuli.values())
    changes = {k.name: chance.choice(k.likely) for k in stimuli if chance.random() < 0.4}
    single = [(choice, k) for k in stimuli for choice in k.choices if chance.random() < 0.2]
    reads = {choice: chance.choice(k.likely) for choice, k in single}
    process = chance.choice((None, None, *run.simulation.enabled))
    unit = chance.choice(("ringlets", "cycles"))
    return Stretch(changes, process=process, reads=reads, **{unit: chance.randint(0, 6)})


def same_verdicts(data):
    """What the monitors said during a run, and what the evaluation of `llfsm replay` says about it afterwards."""
    try:
        subject = random_subject(data)
    except Exception as error:
        if "E342" in str(error) or "E344" in str(error):  # a void regular property
            return
        raise
    chance = Random(data.draw(st.integers(0, 1 << 32)))
    try:
        run = subject.start({name: chance.choice(each.likely) for name, each in subject.free.items()})
        for _ in range(6):
            run.take(random_stretch(run, chance))
    except RunFailed as failed:
        run = failed.run
    if run.failure is not None and run.failure.fault is None and not run.failure.violated:
        return  # it left 64 bits
    schedule = run.schedule
    if run.failure is not None and run.failure.fault is not None:
        assert run.findings[0].trace.fault == run.failure.fault
        # What the properties saw is the run up to the fault.
        schedule = Schedule(schedule.free, schedule.ringlets[:-1], None)
    for name, line in subject.tested.items():
        again = replay(subject.arrangement, PropertySet((line,)), schedule)
        violated = run.failure is not None and name in run.failure.names
        assert again.outcome == ("fails" if violated else "passes"), (name, again.reason)


@pytest.mark.slow
@given(st.data())
@settings(max_examples=examples(6))
def test_monitors_agree_with_the_evaluation_of_the_run(data):
    same_verdicts(data)


@pytest.mark.slow
@given(st.data())
@settings(max_examples=40)
def test_monitors_agree_with_the_evaluation_of_many_runs(data):
    same_verdicts(data)


def same_steps(data):
    """A stretch in machine code ends where ringlets one by one do."""
    subject = Subject(build_arrangement(data.draw(arrangements())))
    chance = Random(data.draw(st.integers(0, 1 << 32)))
    free = {name: chance.choice(each.likely) for name, each in subject.free.items()}
    fast, slow = subject.start(free), subject.start(free)
    for _ in range(5):
        stretch = random_stretch(fast, chance)
        ends = []
        for run, after_each in ((fast, None), (slow, lambda: None)):
            try:
                run.take(stretch, after_each)
                ends.append(None)
            except RunFailed as failed:
                ends.append(failed.failure)
        assert (ends[0], fast.stretches) == (ends[1], slow.stretches)
        assert (fast.steps, fast.simulation.record) == (slow.steps, slow.simulation.record)
        if ends[0] is not None:
            return


@pytest.mark.slow
@given(st.data())
@settings(max_examples=examples(8))
def test_stretches_in_machine_code(data):
    same_steps(data)


@pytest.mark.long
@given(st.data())
@settings(max_examples=many(400))
def test_many_stretches_in_machine_code(data):
    same_steps(data)


@pytest.mark.slow
def test_a_fault_of_the_model_fails_and_is_saved(tmp_path):
    subject = load("models/ball_conditions/faulty_vision.yaml")
    run = subject.start()
    run.ringlets(1, {"see_pixels": 1})
    with pytest.raises(RunFailed) as failed:
        run.ringlets(50, {"see_pixels": 0})
    assert failed.value.failure.fault.code == "F002" and (run.steps, run.changes) == (5, 2)
    assert "[F002]: division by zero" in str(failed.value) and "FAULT" in str(failed.value)
    (saved,) = run.save(tmp_path)
    assert saved.name == "fault-F002.trace.yaml"
    assert llfsm("replay", str(saved), "--quiet").returncode == 1
    # Once is enough, and a file that shows something else stays.
    assert run.save(tmp_path) == [saved]
    saved.write_text(other := saved.read_text().replace("division", "multiplication"))
    (second,) = run.save(tmp_path)
    assert second.name == "fault-F002-2.trace.yaml" and saved.read_text() == other
    assert len(list(tmp_path.iterdir())) == 2
    with pytest.raises(RuntimeError, match="the run has ended: division by zero"):
        run.ringlets(1)


@pytest.mark.slow
def test_a_run_that_does_not_fail_is_saved_as_one(tmp_path):
    run = load("models/traffic_lights/arrangement.yaml", BOTH).start()
    run.cycles(30, {"car": True})
    assert run.steps == 90 and run.findings == ()
    (saved,) = run.save(tmp_path, "both")
    done = llfsm("replay", str(saved), "--quiet")
    assert (done.returncode, done.stdout.count("(expected: holds)")) == (0, 1)
    with pytest.raises(ValueError, match="is saved for one of: both"):
        run.save(tmp_path, "none")


def test_a_violation_that_needs_the_assumption_is_no_trace(tmp_path):
    """Every prefix can go on to satisfy `F G !car`, but not together with what is assumed."""
    text = "assume cars: G F car\nnever: F G (!car && ns@RED) || F G (!car && ns@GREEN)\n"
    with pytest.raises(RunFailed) as failed:
        load("models/traffic_lights/arrangement.yaml", text).start()
    run = failed.value.run
    assert "without these one may" in str(failed.value) and run.save(tmp_path) == []


def test_polishing_leaves_out_what_is_not_needed():
    run = load(FAULTY, BOTH).start()
    for changes, ringlets in (({}, 20), ({"car": True}, 10), ({"car": False}, 30)):
        run.ringlets(ringlets, changes)
    with pytest.raises(RunFailed):
        run.ringlets(400, {"car": True})
    shorter = polish(run)
    assert run.steps > 65 and (shorter.steps, shorter.changes) == (65, 1)
    assert shorter.stretches == (Stretch({"car": True}, ringlets=65),)


THRICE = """
machines:
  m:
    inline:
      machine: M
      states:
        - {name: A, transitions: [{when: go, to: B}]}
        - {name: B, transitions: [{when: not go, to: C}]}
        - {name: C, transitions: [{when: go, to: D}]}
        - {name: D}
whiteboard: {go: {type: bool, role: input}}
schedule: [m]
"""


def test_polishing_shortens_each_stretch():
    """None of the three can be left out, and the first two are too long for trying all pairs of their lengths."""
    subject = Subject(load_arrangement_text(THRICE), parse_properties([Source("p.ltl", "never: G !m@D")]))
    run = subject.start()
    run.ringlets(30, {"go": True})
    run.ringlets(30, {"go": False})
    with pytest.raises(RunFailed):
        run.ringlets(30, {"go": True})
    shorter = Stretch({"go": True}, ringlets=1), Stretch({"go": False}, ringlets=1), Stretch({"go": True}, ringlets=1)
    assert polish(run).stretches == shorter


def test_a_run_is_told_in_few_stretches():
    run = load(FAULTY, BOTH).start()
    run.ringlets(2, {"car": False})
    run.ringlets(0, {"car": True})
    run.ringlets(3)
    assert run.stretches == (Stretch(ringlets=2), Stretch({"car": True}, ringlets=3))
    assert run.program().endswith("run = subject.start()\nrun.ringlets(2)\nrun.ringlets(3, {'car': True})\n")


def test_stretches_as_python_writes_them():
    stretch = Stretch({"a": True}, cycles=2, process="main", reads={"a#1": False})
    assert eval(repr(stretch)) == stretch
    with pytest.raises(ValueError, match="a number of ringlets, or of cycles"):
        Stretch({})


def test_names_that_are_not_there():
    run = load(FAULTY).start()
    with pytest.raises(ValueError, match="no input 'truck' that can change, only car"):
        run.ringlets(1, {"truck": True})
    with pytest.raises(ValueError, match="no process 'side', only main"):
        run.ringlets(1, process="side")
    with pytest.raises(ValueError, match="no input 'limit' is free at first"):
        load(FAULTY).start({"limit": 1})


def test_properties_from_a_file_and_a_path_in_the_program():
    subject = load(Path(FAULTY), "properties/traffic_lights_rules.ltl")
    assert set(subject.tested) == {"ns_order", "ew_order", "both_green", "skipped_amber", "ew_in_time"}
    assert subject.untested_text == ""
    assert (
        "load('models/traffic_lights/faulty.yaml', 'properties/traffic_lights_rules.ltl')" in subject.start().program()
    )


def small(state, whiteboard, **more):
    """One machine with the states S, as given, and T."""
    body = {"machine": "M", "states": [{"name": "S", **state}, {"name": "T"}]}
    return {"name": "small", "whiteboard": whiteboard, "machines": {"m": {"inline": body}}, "schedule": ["m"], **more}


def test_free_inputs_keep_their_value():
    whiteboard = {"limit": {"type": "0..3", "role": "input", "changes": "never"}, "n": {"type": "0..9"}}
    document = small({"internal": "if (n < limit) n += 1;", "transitions": [{"when": "false", "to": "T"}]}, whiteboard)
    subject = Subject(build_arrangement(document), parse_properties([Source("test", "few: G n < 3")]))
    with pytest.raises(RunFailed) as failed:
        subject.start({"limit": 3}).ringlets(9)
    assert failed.value.run.steps == 3 and "subject.start({'limit': 3})" in failed.value.run.program()
    subject.start({"limit": 2}).ringlets(9)


def test_ages_of_untimed_states_can_be_set():
    document = small({"transitions": [{"when": "after(5)", "to": "T"}]}, {"n": {"type": "bool"}}, timing="untimed")
    subject = Subject(build_arrangement(document), parse_properties([Source("test", "stays: G m@S")]))
    assert set(subject.stimuli) == {"m.S.age"}
    run = subject.start()
    run.ringlets(5)
    with pytest.raises(RunFailed):
        run.ringlets(5, {"m.S.age": 1})
    assert run.steps == 6


def test_single_reads_can_be_set():
    """Two reads of one input in a ringlet differ, as `snapshot: none` allows."""
    whiteboard = {"go": {"type": "bool", "role": "input"}, "both": {"type": "bool"}}
    state = {"internal": "bool was = go; both = was != go;", "transitions": [{"when": "false", "to": "T"}]}
    document = small(state, whiteboard, profile="clfsm")
    subject = Subject(build_arrangement(document), parse_properties([Source("test", "never: G !both")]))
    run = subject.start()
    run.ringlets(2)
    run.ringlets(5, {"go": True})
    with pytest.raises(RunFailed):
        run.ringlets(5, reads={subject.stimuli["go"].choices[0]: False})
    assert (run.steps, run.changes) == (8, 2)
    assert "reads={'go#1': False}" in run.program()


def test_a_schedule_names_the_process_of_each_ringlet():
    """They go round, also from one that took turns alone."""
    body = {"machine": "M", "states": [{"name": "S", "transitions": [{"when": "false", "to": "S"}]}]}
    names = ("a", "b", "c")
    document = {
        "name": "three",
        "machines": {name: {"inline": body} for name in names},
        "processes": {name: [name] for name in names},
    }
    run = Subject(build_arrangement(document), parse_properties([Source("test", "some: G a@S")])).start()
    run.ringlets(4)
    run.ringlets(2, process="b")
    run.ringlets(3)
    assert [move.process for move in run.schedule.ringlets] == [0, 1, 2, 0, 1, 1, 2, 0, 1]

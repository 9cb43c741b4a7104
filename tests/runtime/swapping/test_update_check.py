"""Machines are checked before they are loaded: what is accepted goes on well, what is refused is performed."""

from __future__ import annotations

import errno
import os
import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.limits import Budget, Limits
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.runtime.live import control
from llfsm_verify.runtime.live.loop import LiveCode, Loop
from llfsm_verify.runtime.live.plan import drawn_choices, monitored, safe_values, starting_values
from llfsm_verify.runtime.recording.file import Recorder, Recording
from llfsm_verify.runtime.recording.replay import replay
from llfsm_verify.runtime.swapping.check_process import Check, CheckAnswer, Interleaved, record_counterexample
from llfsm_verify.runtime.swapping.hot_swap import _compare
from llfsm_verify.testing.arrangements import Document, arrangements
from llfsm_verify.verification.changes.state_transfer import Accepted, Untransferable, transferred, update_point
from llfsm_verify.verification.changes.update_check import Question, Refusal, check_update
from tests.quick import AtLeast, many, spread
from tests.runtime.swapping.test_hot_swap import POLICY, pair

LIMITS = Limits(max_states=4_000, max_steps=150_000)


def properties_of(*lines):
    return parse_properties([Source("test", "\n".join(lines))])


def code_of(arrangement: Arrangement, properties) -> LiveCode:
    program, monitors, _ = monitored(arrangement, properties)
    return LiveCode(program, monitors, safe_values(arrangement))


def loop_of(code: LiveCode, seed: int) -> Loop:
    loop = Loop(code, seed=seed, drawn=drawn_choices(code.program, {}), held=starting_values(code.program))
    loop.begin(0)
    return loop


def asked(running, following, machine, properties, loop, budget=LIMITS):
    question = Question(running, following, machine, properties, loop.code, loop.record, loop.states)
    return check_update(question, Budget(budget))


def lines_about(arrangement: Arrangement, choose: int) -> list[str]:
    """Properties of a random arrangement: what some machine never does, and what it does again and again."""
    states = [f"{m.name}@{state.name}" for m in arrangement.machines for state in m.states if not m.nested]
    one, other = states[choose % len(states)], states[choose // 7 % len(states)]
    return [f"never: G !({one} && {other} && X X {one})", f"after: G({one} -> X X !{other})", f"again: G F !{other}"]


def random_checks(folder: Path, count: int) -> None:
    tally: Counter[str] = Counter()

    def check(document: Document, seed: int, how: int) -> None:
        found = pair(document, seed, how)
        if found is None:
            return
        running, following, machine = found
        try:
            properties = properties_of(*lines_about(running, seed))
            code, next_code = code_of(running, properties), code_of(following, properties)
        except (DiagnosticError, KeyError):
            return  # the others ask for what is gone
        loop = loop_of(code, seed)
        if loop.go(1 + seed % 5) != control.DONE:
            return
        replaced = None if how == POLICY else machine.name
        outcome = asked(running, following, replaced, properties, loop)
        lost = [verdict == "violated" for verdict in loop.verdicts]
        if isinstance(outcome, Refusal):
            tally["refused"] += 1
            if outcome.counterexample is None:
                return
            path = folder / "refused"
            path.unlink(missing_ok=True)
            header = {"name": "test", "loaded": [[machine.name, "m.yaml", "", False]]}
            try:
                record_counterexample(outcome, following, properties, header, path)
            except Interleaved:
                return
            with Recording(path) as recording:
                assert len(list(replay(next_code, recording, goes_on=True))) >= 2
            tally["performed"] += 1
            return
        tally["accepted"] += 1
        tally["policies accepted"] += replaced is None
        for again in range(4):  # each time a little later
            if any(v == "violated" and not was for v, was in zip(loop.verdicts, lost, strict=True)):
                return
            try:
                record = transferred(code, loop.record, next_code, next_code.layout.first(), replaced)
            except Untransferable:
                assert update_point(code, loop.record, loop.states) not in outcome.points
                return
            assert update_point(code, loop.record, loop.states) in outcome.points
            following_loop = loop_of(next_code, seed + again)
            following_loop.take_over(loop, record)
            for _ in range(30):
                if following_loop.go(1) != control.DONE:
                    assert following_loop.status <= 0
                    break
                for verdict, was in zip(following_loop.verdicts, lost, strict=True):
                    assert was or verdict != "violated"
            tally["went on"] += 1
            if loop.go(1) != control.DONE:
                return

    amount = settings(max_examples=count, deadline=None, suppress_health_check=list(HealthCheck))
    least = {"accepted": count // 8, "performed": count // 8, "went on": count // 8, "policies accepted": count // 50}
    spread(
        check,
        amount,
        arrangements(),
        st.integers(1, 1 << 40),
        st.integers(0, POLICY),
        size=10,
        until=AtLeast(tally, least),
    )


@pytest.mark.long
def test_what_is_accepted_goes_on_well_and_what_is_refused_is_performed(tmp_path: Path) -> None:
    random_checks(tmp_path, many(150))


COUNTER = {
    "name": "counter", "cycle_ms": 10,
    "whiteboard": {"out": {"type": "0..9", "role": "output"}, "go": {"type": "bool", "role": "input"}},
    "machines": {"count": {"inline": {
        "machine": "Count", "variables": {"n": {"type": "0..9", "init": 0}},
        "states": [{"name": "UP", "internal": "n = (n + 1) % 9; out = n;", "stays": True}],
    }}},
    "schedule": ["count"],
}  # fmt: skip


def counter(action: str, board: Mapping[str, object] = COUNTER["whiteboard"]) -> Arrangement:
    other = dict(COUNTER["machines"]["count"]["inline"])
    other["states"] = [{"name": "OTHER", "internal": action, "stays": True}]
    return build_arrangement({**COUNTER, "whiteboard": board, "machines": {"count": {"inline": other}}})


@pytest.mark.slow
@pytest.mark.parametrize(
    ("action", "lines", "reason"),
    [
        ("n = (n + 8) % 9; out = n;", ["small: G out < 9"], None),
        ("n = (n + 1) % 10; out = n;", ["small: G out < 9"], "`small` would be violated"),
        ("out = 9 / n;", ["few: G out <= 9"], "a run would end in a fault: division by zero"),
        ("out = go ? 1 : 0;", ["again: G F out == 1"], "`again` would be violated"),
        ("out = 1;", ["again: G F out == 1"], None),
        ("out = 1;", ["first: out == 1"], None),  # violated already: of the run from its next letter on
    ],
)
def test_an_answer_says_why(action, lines, reason, tmp_path):
    running, following = counter("n = (n + 1) % 9; out = n;"), counter(action)
    properties = properties_of(*lines)
    loop = loop_of(code_of(running, properties), 1)
    loop.go(3)
    outcome = asked(running, following, "count", properties, loop)
    if reason is None:
        assert isinstance(outcome, Accepted), outcome
        assert any("from now on" in note for note in outcome.notes) == (lines[0][0] in "af")
    else:
        assert isinstance(outcome, Refusal)
        assert outcome.reason.startswith(reason)
        header = {"name": "test", "loaded": [["count", "m.yaml", "", False]]}
        assert outcome.counterexample is not None
        turns = [
            move for move in outcome.counterexample.moves if move.process is not None
        ]  # the schedule has one machine
        assert record_counterexample(outcome, following, properties, header, tmp_path / "r") == len(turns)


@pytest.mark.slow
def test_a_violation_by_one_of_many_values_of_an_input_is_performed(tmp_path):
    """The letter reads the input, in classes that depend on `out`; one value at each `out` is the wrong one."""
    board = {**COUNTER["whiteboard"], "go": {"type": "0..65535", "role": "input"}}
    running, following = counter("n = (n + 1) % 9; out = n;", board), counter("n = (n + 1) % 8; out = n;", board)
    properties = properties_of("a: G !(go == 500 * out + 3 && out > 6)")
    loop = loop_of(code_of(running, properties), 1)
    outcome = asked(running, following, "count", properties, loop)
    assert isinstance(outcome, Refusal)
    assert outcome.counterexample is not None
    assert outcome.counterexample.moves[-1].choices == {"go": 3503}
    header = {"name": "test", "loaded": [["count", "m.yaml", "", False]]}
    record_counterexample(outcome, following, properties, header, tmp_path / "r")


def test_what_would_happen_is_not_recorded_on_a_full_disk(tmp_path, monkeypatch):
    reach = Recorder.reach

    def full(recorder):
        if recorder.used:
            raise OSError(errno.ENOSPC, "No space left on device")
        reach(recorder)

    running, following = counter("n = (n + 1) % 9; out = n;"), counter("n = (n + 1) % 9; out = 2;")
    properties = properties_of("again: G F out == 1")
    loop = loop_of(code_of(running, properties), 1)
    loop.go(3)
    outcome = asked(running, following, "count", properties, loop)
    header = {"name": "test", "loaded": [["count", "m.yaml", "", False]]}
    monkeypatch.setattr(Recorder, "reach", full)
    with pytest.raises(DiagnosticError, match="No space left on device") as raised:
        record_counterexample(outcome, following, properties, header, tmp_path / "r")
    assert raised.value.diagnostics[0].code == "E480" and not (tmp_path / "r").exists()


LASTING = [
    # What is monitored, whether 7 was there before, the new action, whether it is accepted.
    ("F out == 7", False, "out = 1;", False),
    ("F out == 7", True, "out = 1;", True),
    ("F out == 7", False, "out = go ? 7 : 1;", False),
    ("F out == 7", False, "out = out < 9 ? out + 1 : out;", True),
    ("G out < 9 && G F out == 7", True, "out = 1;", False),
    ("G out < 9 && G F out == 7", True, "n = (n + 1) % 9; out = n;", True),
    ("G (out == 2 -> out < 8 U out == 7)", False, "out = 1;", False),  # it waits for 7 since 2 was there
    ("G (out == 2 -> out < 8 U out == 7)", False, "out = 7;", True),
    ("(F out == 3) || G F go", False, "out = 1;", False),
]


@pytest.mark.slow
@pytest.mark.parametrize(("line", "later", "action", "accepted"), LASTING)
def test_what_a_monitor_waits_for_must_come(line, later, action, accepted, tmp_path):
    """No finite run shows that something never happens, so no monitor sees it."""
    running, following = counter("n = (n + 1) % 9; out = n;"), counter(action)
    properties = properties_of(f"p: {line}")
    loop = loop_of(code_of(running, properties), 1)
    loop.go(8 if later else 2)
    outcome = asked(running, following, "count", properties, loop)
    assert isinstance(outcome, Accepted) == accepted, outcome
    assert not any("from now on" in note for note in outcome.notes)
    if isinstance(outcome, Refusal):
        assert outcome.counterexample is not None and outcome.counterexample.endless
        header = {"name": "test", "loaded": [["count", "m.yaml", "", False]]}
        assert record_counterexample(outcome, following, properties, header, tmp_path / "r")


@pytest.mark.slow
@pytest.mark.parametrize(("assumed", "accepted"), [("G F go", True), ("F go", False), ("G F !go", False)])
def test_what_a_monitor_waits_for_may_be_assumed(assumed, accepted):
    running, following = counter("n = (n + 1) % 9; out = n;"), counter("out = go ? 7 : 1;")
    properties = properties_of(f"assume a: {assumed}", "p: G (out == 3 -> out < 9 U out == 7)")
    loop = loop_of(code_of(running, properties), 1)
    loop.go(4)
    assert isinstance(asked(running, following, "count", properties, loop), Accepted) == accepted


@pytest.mark.slow
def test_a_machine_that_no_run_meets_the_assumptions_with_is_refused():
    """Otherwise nothing would be said of it."""
    running, following = counter("n = (n + 1) % 9; out = n;"), counter("out = 1;")
    for line in ("p: G (out == 3 -> F out == 5)", "p: F out == 8", "p: G out < 9"):
        properties = properties_of("assume a: G F out == 7", line)
        loop = loop_of(code_of(running, properties), 1)
        loop.go(2)
        assert isinstance(asked(running, running, "count", properties, loop), Accepted)
        refusal = asked(running, following, "count", properties, loop)
        assert isinstance(refusal, Refusal) and refusal.reason.endswith("no run from there on meets the assumptions")


PLANT = {
    "machine": "Tank", "variables": {"height": {"type": "0..9", "init": 5}},
    "states": [{"name": "T", "internal": "height = max(0, min(9, height + (pump ? 1 : -1))); level = height;",
                "stays": True}],
}  # fmt: skip
TANK = {
    "name": "tank", "cycle_ms": 10,
    "whiteboard": {"level": {"type": "0..9", "role": "input", "init": 5}, "pump": {"type": "bool", "role": "output"}},
    "machines": {"keeper": {"inline": {
        "machine": "Keeper", "states": [{"name": "K", "internal": "pump = level < 5;", "stays": True}]}}},
    "schedule": ["keeper"], "environment": {"inline": PLANT},
}  # fmt: skip


@pytest.mark.slow
def test_a_run_in_the_world_takes_all_states_of_the_model_that_fit():
    """The program that runs has no tank; that of the check has one, at the heights that it can have then."""

    def tank(action: str) -> Arrangement:
        keeper = {"machine": "Keeper", "states": [{"name": "K", "internal": action, "stays": True}]}
        return build_arrangement({**TANK, "machines": {"keeper": {"inline": keeper}}})

    properties = properties_of("kept: G (level > 2 && level < 8)")
    running = tank("pump = level < 5;")
    code = code_of(replace(running, plants=()), properties)
    loop = loop_of(code, 1)

    def outcome(action: str):
        return asked(running, tank(action), "keeper", properties, loop)

    assert isinstance(outcome("pump = level < 6;"), Accepted)
    refusal = outcome("pump = level < 8;")
    assert isinstance(refusal, Refusal) and refusal.reason == "`kept` would be violated"
    loop.begin_at(code.layout.encode_record({**code.layout.decode_record(loop.record), "pump": 1}), [1])
    strange = outcome("pump = level < 6;")
    assert isinstance(strange, Refusal) and "surroundings excludes" in strange.reason


@pytest.mark.slow
def test_a_run_in_the_world_takes_the_states_of_the_model_that_earlier_machines_have_led_to():
    """The first machine charges a battery, which nobody sees; the second does not, so it would never be charged."""

    def charging(action: str) -> Arrangement:
        keeper = {"machine": "Keeper", "states": [{"name": "K", "internal": action, "stays": True}]}
        battery = {
            "machine": "Battery", "variables": {"charged": {"type": "bool"}},
            "states": [{"name": "B", "stays": True,
                        "internal": "if (use == 1) charged = true; spark = charged && use == 2;"}],
        }  # fmt: skip
        return build_arrangement(
            {"name": "battery", "cycle_ms": 10, "schedule": ["keeper"], "machines": {"keeper": {"inline": keeper}},
             "whiteboard": {"spark": {"type": "bool", "role": "input"}, "use": {"type": "0..2", "role": "output"}},
             "environment": {"inline": battery}}
        )  # fmt: skip

    properties = properties_of("p: G !spark")
    first, second, third = charging("use = use == 1 ? 0 : 1;"), charging("use = 0;"), charging("use = 2;")
    loop = loop_of(code_of(replace(second, plants=()), properties), 1)
    question = Question(second, third, "keeper", properties, loop.code, loop.record, loop.states)
    assert isinstance(check_update(question, Budget(LIMITS)), Accepted)
    refusal = check_update(replace(question, earlier=((first, "keeper"),)), Budget(LIMITS))
    assert isinstance(refusal, Refusal) and refusal.reason == "`p` would be violated"


AFTER_ITS_END = {
    "name": "rising", "cycle_ms": 10,
    "whiteboard": {"level": {"type": "0..9", "role": "input", "init": 0}, "rise": {"type": "0..9", "role": "output"}},
    "machines": {
        "starter": {"inline": {"machine": "Starter", "states": [{"name": "S"}]}},
        "meter": {"inline": {"machine": "Meter", "variables": {"last": {"type": "0..9"}}, "states": [
            {"name": "M", "internal": "rise = (level + 10 - last) % 10; last = level;", "stays": True}]}},
    },
    "schedule": ["starter", "meter"],
    "environment": {"inline": {
        "machine": "Tide", "states": [{"name": "T", "internal": "level = (level + 1) % 10;", "stays": True}]}},
}  # fmt: skip


@pytest.mark.slow
def test_a_machine_in_the_place_of_one_that_has_finished_begins_the_cycle():
    """Otherwise the surroundings would stand still for a cycle, and operators wait: only the first turn has them."""
    lasting = {"machine": "Lasting", "states": [{"name": "L", "stays": True}]}
    machines = {**AFTER_ITS_END["machines"], "starter": {"inline": lasting}}
    running, following = build_arrangement(AFTER_ITS_END), build_arrangement({**AFTER_ITS_END, "machines": machines})
    properties = properties_of("rises: G (meter.ran -> rise == 1)")
    code, next_code = code_of(running, properties), code_of(following, properties)
    loop = loop_of(code, 1)
    loop.go(5)
    assert isinstance(asked(running, following, "starter", properties, loop), Accepted)
    next_loop = loop_of(next_code, 1)
    steps = loop.steps
    next_loop.take_over(loop, transferred(code, loop.record, next_code, next_code.layout.first(), "starter"))
    next_loop.go(1)
    assert next_loop.steps == steps + 2 and next_loop.verdicts == ("undecided",)


@pytest.mark.slow
def test_a_machine_is_not_resumed_in_another_state_than_it_was_suspended_in():
    """Where nothing could resume it, the run does not keep that state."""

    def arrangement(action: str) -> Arrangement:
        steps = [
            {"name": n, "transitions": [{"when": "true", "to": t}]} for n, t in (("A", "B"), ("B", "C"), ("C", "A"))
        ]
        commander = {"machine": "Commander", "states": [{"name": "S", "internal": action, "stays": True}]}
        return build_arrangement(
            {"name": "resuming", "cycle_ms": 10, "schedule": ["commander", "worker"], "machines": {
                "commander": {"inline": commander}, "worker": {"inline": {"machine": "Worker", "states": steps}}}}
        )  # fmt: skip

    running = arrangement("if (worker@C) suspend(worker);")
    following = arrangement("if (worker@C) suspend(worker); if (is_suspended(worker)) resume(worker);")
    properties = properties_of("p: G (commander@S)")
    code, next_code = code_of(running, properties), code_of(following, properties)
    loop = loop_of(code, 1)
    loop.go(1)
    outcome = asked(running, following, "commander", properties, loop)
    assert isinstance(outcome, Accepted)  # the worker is not suspended yet
    while update_point(code, loop.record, loop.states) in outcome.points:
        loop.go(1)
    with pytest.raises(
        Untransferable, match="`worker` is suspended, and the run does not keep where it would be resumed"
    ):
        transferred(code, loop.record, next_code, next_code.layout.first(), "commander")


@pytest.mark.slow
@pytest.mark.parametrize("line", ["F out == 1", "G F out == 1"])
def test_where_the_run_has_ended_nothing_is_loaded(line):
    """So it does not matter that the property would be violated from there on."""
    ending = [{"name": "S", "transitions": [{"when": "go", "to": "E"}]}, {"name": "E"}]
    other = [{**ending[0], "internal": "out = 1;"}, {"name": "E", "on_entry": "out = 1;"}]
    running, following = (
        build_arrangement({**COUNTER, "machines": {"count": {"inline": {"machine": "Count", "states": states}}}})
        for states in (ending, other)
    )
    properties = properties_of(f"p: {line}")
    loop = loop_of(code_of(running, properties), 1)
    assert loop.go(1) == control.DONE
    outcome = asked(running, following, "count", properties, loop)
    assert isinstance(outcome, Accepted) and len(outcome.points) == 2


@pytest.mark.slow
def test_what_is_not_known_is_refused():
    running = build_arrangement(
        {**COUNTER, "machines": {"count": {"inline": {
            "machine": "Count", "variables": {"n": {"type": "int", "init": 0}},
            "states": [{"name": "UP", "internal": "n = n + 1; out = n % 9;", "stays": True}]}}}}
    )  # fmt: skip
    properties = properties_of("small: G out < 9")
    loop = loop_of(code_of(running, properties), 1)
    outcome = asked(running, running, "count", properties, loop)
    assert isinstance(outcome, Refusal)
    assert outcome.reason == "it is unknown whether it may be loaded: the limit of 4,000 configurations was reached"


def test_a_check_that_takes_too_long_is_ended(monkeypatch):
    check = Check(lambda: time.sleep(1000) or CheckAnswer(None, "late", ()), Limits(timeout=-10))
    assert check.ready
    assert check.answer.reason == "it is unknown whether it may be loaded: the time limit of -10 s was reached"


def test_a_check_whose_process_dies_is_no_answer():
    check = Check(lambda: os._exit(3), Limits())
    while not check.ready:
        time.sleep(0.001)
    assert check.answer.accepted is None
    assert "its process failed" in check.answer.reason


def test_places_come_back_as_they_were():
    places = frozenset(bytes([i, 2 * i, 10, 0]) for i in range(100))
    check = Check(lambda: CheckAnswer(Accepted(places, ("a",)), "", ("a",)), Limits())
    while not check.ready:
        time.sleep(0.001)
    assert check.answer.accepted == Accepted(places, ("a",))


def test_other_monitors_are_not_carried_over():
    running = counter("out = 1;")
    loops = [
        loop_of(code_of(running, properties_of(line)), 1) for line in ("p: G out < 9", "p: G out < 9", "p: F out < 9")
    ]
    _compare(loops[0], loops[1], frozenset())
    with pytest.raises(Untransferable, match="another monitor"):
        _compare(loops[0], loops[2], frozenset())

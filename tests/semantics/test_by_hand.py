"""Small arrangements whose verdicts follow from the semantics page by hand, and a microwave on which SPIN agrees."""

from __future__ import annotations

import pytest

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.checking.verdict import Options, Result
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.verification.verify import verify

Document = dict[str, object]


def agree(document: Document, expected: dict[str, str], *, keep_all_bits: bool = False) -> Result:
    """`expected` maps each formula to its verdict by hand."""
    properties = parse_properties([Source("answers.ltl", "\n".join(expected))])
    result = verify(build_arrangement(document), properties, Options(keep_all_bits=keep_all_bits))
    assert {p.text: p.verdict.value for p in result.properties} == expected
    return result


def machine(*states: Document, **more: object) -> Document:
    return {"inline": {"machine": "M", **more, "states": list(states)}}


def state(name: str, *transitions: tuple[str, str], **actions: str) -> Document:
    arrows = {"transitions": [{"when": w, "to": t} for w, t in transitions]} if transitions else {}
    return {"name": name, **actions, **arrows}


@pytest.mark.parametrize("finished", ["leave", "keep"])
def test_a_machine_of_a_process_that_has_ended_is_not_running(finished: str) -> None:
    document: Document = {
        "name": "a",
        "finished": finished,
        "fairness": "processes",
        "machines": {
            "m": machine(state("A", ("true", "B")), state("B")),
            "c": machine(state("ON", ("not is_running(m)", "OFF")), state("OFF", ("is_running(m)", "ON"))),
        },
        "processes": {"one": ["m"], "other": ["c"]},
    }
    agree(document, {"F c@OFF": "holds", "F G c@OFF": "holds", "G (c@OFF -> m@B)": "holds", "G !c@OFF": "violated"})


@pytest.mark.parametrize("thresholds", [(1, 8), (8, 1), (16, 8, 1), (3, 64, 32, 2)])
def test_an_untimed_clock_passes_its_bounds_in_ascending_order(thresholds: tuple[int, ...]) -> None:
    low, *_, high = sorted(thresholds)
    passed = " && ".join(f"after_ms({t})" for t in thresholds)
    document: Document = {
        "name": "a",
        "timing": "untimed",
        "machines": {
            "m": machine(
                state("A", (f"after_ms({high}) && not after_ms({low})", "WRONG"), (passed, "B")),
                state("B", (f"after_ms({low}) && not after_ms({high})", "C")),
                state("C"),
                state("WRONG"),
            )
        },
        "schedule": ["m"],
    }
    agree(document, {"G !m@WRONG": "holds", "F m@B": "holds", "G !m@C": "violated"})


@pytest.mark.parametrize("keep_all_bits", [False, True])
def test_resume_after_a_restart_into_the_suspend_state_goes_to_the_remembered_state(keep_all_bits: bool) -> None:
    document: Document = {
        "name": "a",
        "whiteboard": {"k": {"type": "0..1"}},
        "machines": {
            "m": machine(state("S", ("k == 0", "B")), state("B", ("false", "B")), suspend="S", initial="S"),
            "c": machine(
                state("C0", ("m@B", "C1")),
                state("C1", ("m@S", "C2"), on_entry="k = 1; suspend(m);"),
                state("C2", ("m@B", "C3"), on_entry="resume(m);"),
                state("C3", ("m@S", "C4"), on_entry="restart(m);"),
                state("C4", ("m@B", "C5"), on_entry="resume(m);"),
                state("C5", ("false", "C5")),
            ),
        },
        "schedule": ["m", "c"],
    }
    agree(document, {"G !c@C5": "violated", "F c@C5": "holds"}, keep_all_bits=keep_all_bits)


def test_an_untimed_clock_passes_each_bound_in_the_end_but_no_one_knows_when() -> None:
    document: Document = {
        "name": "a",
        "timing": "untimed",
        "machines": {
            "a": machine(state("P", ("after(5)", "Q")), state("Q", ("false", "Q"))),
            "b": machine(state("P", ("after(50)", "Q")), state("Q")),
        },
        "schedule": ["a", "b"],
    }
    agree(
        document,
        {
            "F a@Q": "holds",
            "F b@Q": "holds",
            "a@P W b@Q": "violated",
            "b@P W a@Q": "violated",
            "F G b.finished": "holds",
            "G F b.ran": "violated",
        },
    )


@pytest.mark.parametrize(("profile", "verdict"), [("llfsm", "holds"), ("swiftfsm", "violated")])
@pytest.mark.parametrize("timing", [{"timing": "untimed"}, {"cycle_ms": "100"}], ids=["untimed", "timed"])
def test_a_self_transition_restarts_the_clock_in_swiftfsm_only(profile: str, verdict: str, timing: Document) -> None:
    patient = machine(state("P", ("after_ms(200)", "Q"), ("true", "P")), state("Q", ("false", "Q")))
    document: Document = {"name": "a", **timing, "profile": profile, "machines": {"a": patient}, "schedule": ["a"]}
    agree(document, {"F a@Q": verdict})


def test_without_fairness_a_process_may_stop_and_time_stands_still_with_it() -> None:
    document: Document = {
        "name": "a",
        "timing": "untimed",
        "fairness": "none",
        "machines": {
            "a": machine(state("P", ("after(3)", "Q")), state("Q", ("false", "Q"))),
            "b": machine(state("P", ("after(4)", "Q")), state("Q")),
        },
        "processes": {"one": ["a"], "two": ["b"]},
    }
    agree(document, {"F b@Q": "violated", "G F b.ran -> F b@Q": "holds", "G F a.ran -> F a@Q": "holds"})
    agree({**document, "fairness": "processes"}, {"F b@Q": "holds", "F a@Q": "holds"})


def test_a_cycle_shows_its_last_sample_and_nothing_in_between() -> None:
    document: Document = {
        "name": "a",
        "observe": "cycle",
        "whiteboard": {
            "n": {"type": "0..3"},
            "i": {"type": "bool", "role": "input"},
            "x": {"type": "bool"},
            "y": {"type": "bool"},
        },
        "machines": {
            "a": machine(state("P", ("n == 3", "E"), internal="x = i;"), state("E")),
            "b": machine(state("P", ("n == 3", "E"), internal="y = i; n += 1;"), state("E")),
        },
        "schedule": ["a", "b"],
    }
    agree(
        document,
        {
            "G (x <-> y)": "violated",
            "X X (i <-> y)": "holds",
            "X X (i <-> x)": "violated",
            "F G (a.finished && b.finished)": "holds",
            "F G (!a.ran && !b.ran && !cycle)": "holds",
            "F G i": "violated",
            "F G !i": "violated",
            "X X X X a.fired(P, 0)": "holds",
        },
    )


def test_an_index_into_an_input_reads_that_element_only() -> None:
    document: Document = {
        "name": "a",
        "types": {"P": {"record": {"x": "0..1", "v": {"array": "bool", "size": 2}}}},
        "whiteboard": {
            "g": {"type": {"array": "P", "size": 2}, "role": "input"},
            "k": {"type": "0..1"},
            "m": {"type": "0..1"},
            "got": {"type": "bool"},
        },
        "machines": {
            "a": machine(state("P", ("false", "P"), internal="got = g[k].v[m]; if (m == 1) { k = 1 - k; } m = 1 - m;"))
        },
        "schedule": ["a"],
    }
    agree(
        document,
        {
            "X (got <-> g[0].v[0])": "holds",
            "X X (got <-> g[0].v[1])": "holds",
            "X X X (got <-> g[1].v[0])": "holds",
            "X X X X (got <-> g[1].v[1])": "holds",
            "X X X X (got <-> g[0].v[1])": "violated",
        },
    )


@pytest.mark.slow
def test_more_than_64_atoms() -> None:
    counter = machine(state("P", ("false", "P"), internal="x = (x + 1) % 80;"))
    document: Document = {
        "name": "a",
        "whiteboard": {"x": {"type": "0..79"}},
        "machines": {"a": counter},
        "schedule": ["a"],
    }
    agree(document, {f"G F (x == {i})": "holds" for i in range(70)})


@pytest.mark.slow
def test_the_microwave_that_spin_knows() -> None:
    """5,092 configurations by a search in plain Python over SPIN's model (27,841 with the inputs stored)."""
    bools = {n: {"type": "bool", "role": "input"} for n in ("door", "button", "tick")}
    lights = {n: {"type": "bool"} for n in ("motor", "light", "sound")}
    document: Document = {
        "name": "microwave",
        "whiteboard": {**bools, **lights, "timeLeft": {"type": "0..15"}},
        "machines": {
            "cook": machine(
                state("NOT", ("!door && timeLeft > 0", "COOK"), on_entry="motor = false;"),
                state("COOK", ("door || timeLeft == 0", "NOT"), on_entry="motor = true;"),
            ),
            "timer": machine(
                state("TEST", ("button && timeLeft < 15", "ADD"), ("!door && timeLeft > 0 && tick", "DEC")),
                state("ADD", ("!button", "TEST"), on_entry="timeLeft += 1;"),
                state("DEC", ("true", "TEST"), on_entry="timeLeft -= 1;"),
            ),
            "lamp": machine(
                state("DARK", ("door || timeLeft > 0", "LIT"), on_entry="light = false;"),
                state("LIT", ("!door && timeLeft == 0", "DARK"), on_entry="light = true;"),
            ),
            "alarm": machine(
                state("QUIET", ("timeLeft > 0", "ARMED"), on_entry="sound = false;"),
                state("ARMED", ("timeLeft == 0", "RINGING"), on_entry="sound = false;"),
                state("RINGING", ("tick", "QUIET"), on_entry="sound = true;"),
            ),
        },
        "schedule": ["cook", "timer", "lamp", "alarm"],
    }
    expected = {
        "G ((G door) -> F G !motor)": "holds",
        "G (motor -> F !motor)": "violated",
        "G (motor && G F (tick && timer.ran) && G !button -> F !motor)": "violated",
        "G (timeLeft <= 15)": "holds",
        "G (sound -> F !sound)": "violated",
        "(G F (tick && alarm.ran)) -> G (sound -> F !sound)": "holds",
        "(F G !door && G F (timer.ran && tick) && F G !button) -> F G (timeLeft == 0)": "holds",
        "F G !button -> F G !timer@ADD": "holds",
    }
    assert agree(document, expected, keep_all_bits=True).exploration.states == 5092

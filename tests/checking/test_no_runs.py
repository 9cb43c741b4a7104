"""Saved runs run again: what is no run, or breaks an assumption, fails nothing; another text of a fault is said."""

from __future__ import annotations

from llfsm_verify.arrangement import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.replay.confirm import Schedule
from llfsm_verify.program.moves import Move
from llfsm_verify.verification.replay import Replay, replay
from tests.checking.replaying import lines_of


def machine(when: str, **options: object) -> Arrangement:
    """A machine that goes from A to B when its guard holds, and stays there."""
    states = [{"name": "A", "transitions": [{"when": when, "to": "B"}]}]
    states.append({"name": "B", "transitions": [{"when": "false", "to": "A"}]})
    whiteboard = {"go": {"type": "0..2", "init": "0", "role": "input"}}
    machines = {"m": {"inline": {"machine": "M", "states": states}}}
    return build_arrangement({"whiteboard": whiteboard, "machines": machines, "schedule": ["m"], **options})


def staying(*choices: dict[str, int], complete: bool = False) -> Replay:
    """One step, forever, of a machine that leaves A when time has passed."""
    schedule = Schedule((), tuple(Move(0, given) for given in choices), 0)
    return replay(machine("after(5)", timing="untimed"), lines_of("p: F m@B"), schedule, complete=complete)


def test_a_loop_in_which_time_stands_still_is_no_failure() -> None:
    still = staying({"m.A.age": 0})
    assert still.outcome == "passes"
    assert still.reason.startswith("forever the run would not be fair (time passes for m)")
    assert staying({}).outcome == "misfit"
    assert staying({}, complete=True).outcome == "passes"


def test_a_bad_prefix_that_breaks_an_assumption_is_no_failure() -> None:
    lines = lines_of("p: G m@A\nassume low: G go < 2\nassume again: G F go == 0")
    outcomes = [replay(machine("go > 0"), lines, Schedule((), (Move(0, {"go": n}),), None)) for n in range(3)]
    assert [o.outcome for o in outcomes] == ["passes", "fails", "passes"]
    assert outcomes[2].reason == "no run that goes on like this satisfies the assumptions"


def test_a_fault_of_the_same_code_with_another_text_is_said() -> None:
    schedule = Schedule((), (Move(0, {"go": 1}),), None)
    faulty = machine("3 / (1 - go) > 0")
    message = "division by zero: 1 - go is 0"
    same, other = (replay(faulty, lines_of(""), schedule, ("F002", text)) for text in (message, "a text"))
    assert (same.outcome, other.outcome) == ("fails", "fails")
    assert same.reason == f"the run ends in the fault: {message}"
    assert other.reason == f"{same.reason} (when it was saved: a text)"

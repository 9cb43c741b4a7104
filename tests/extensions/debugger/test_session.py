"""A debugger by its commands."""

from __future__ import annotations

import pytest

from llfsm_verify.arrangement import build_arrangement, load_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.extensions.debugger.commands import BY_NAME, COMMANDS
from llfsm_verify.extensions.debugger.debugger import Debugger
from llfsm_verify.extensions.debugger.paths import Free
from llfsm_verify.extensions.debugger.session import Session
from llfsm_verify.report.debugging import DebugError, Steps, Table
from llfsm_verify.runtime.stepping.simulation import Simulation
from llfsm_verify.semantics.lowering import lower

LIGHTS = "models/traffic_lights/arrangement.yaml"
COUNTING = {
    "name": "counting",
    "cycle_ms": 10,
    "whiteboard": {
        "go": {"type": "bool", "role": "input", "init": False},
        "n": {"type": "0..9"},
        "d": {"type": "0..3", "role": "input", "init": 1},
    },
    "machines": {
        "m": {
            "inline": {
                "machine": "M",
                "states": [
                    {
                        "name": "IDLE",
                        "transitions": [{"when": "go && n < 2", "to": "BUSY"}, {"when": "after_ms(30)", "to": "DONE"}],
                    },
                    {
                        "name": "BUSY",
                        "on_entry": "n = n + 1;",
                        "transitions": [{"when": "n / d >= 1", "to": "IDLE"}],
                    },
                    {"name": "DONE"},
                ],
            }
        }
    },
    "schedule": ["m"],
}


@pytest.fixture(scope="module")
def lights() -> Arrangement:
    return load_arrangement(LIGHTS)


@pytest.fixture(scope="module")
def counting() -> Arrangement:
    return build_arrangement(COUNTING)


def session(arrangement: Arrangement, *lines: str, seed: int | None = None, most: int = 10_000) -> Session:
    made = Session(Debugger(arrangement, lambda execution: Free(execution, seed), most=most))
    for line in lines:
        made.do(line)
    return made


def last(made: Session, line: str) -> str:
    """The last line of an answer."""
    part = made.do(line).parts[-1]
    assert isinstance(part, str)
    return part


def rows(made: Session, line: str) -> tuple[tuple[str, ...], ...]:
    (table,) = [part for part in made.do(line).parts if isinstance(part, Table)]
    return table.rows


@pytest.mark.slow
def test_steps_are_those_of_a_simulation(lights: Arrangement) -> None:
    made = session(lights, "set car true").debugger
    simulation = Simulation(lower(lights, keep_all_bits=True))
    for _ in range(120):
        made.step()
        simulation.ringlet({"car": True})
        assert made.states == {name: simulation.state(name) for name in made.states}
        assert made.record() == simulation.record
    assert made.cycles == 40


def test_back_and_forth_leads_through_the_same_records(lights: Arrangement) -> None:
    made = session(lights, "step 60", seed=3).debugger
    records = [made.record(k) for k in range(61)]
    made.back(60)
    assert made.position == 0
    made.step(60)
    assert [made.record(k) for k in range(61)] == records
    made.go(30)
    made.go(75)
    assert made.position == 75 and [made.record(k) for k in range(61)] == records


def test_until_and_break_points_both_ways(lights: Arrangement) -> None:
    made = session(lights, "set car true")
    assert "ew@GREEN" in last(made, "until ew@GREEN")
    green = made.debugger.position
    made.do("break ns@AMBER")
    assert made.do("reverse").parts[-2] == "Break point 1: `ns@AMBER` is true."
    amber = made.debugger.position
    before = next(k for k in range(green, 0, -1) if made.debugger.go(k) and made.debugger.states["ns"] == "AMBER")
    while made.debugger.states["ns"] == "AMBER":
        made.debugger.back()
    assert made.debugger.position == amber - 1 < before
    assert made.do("continue").parts[-2] == "Break point 1: `ns@AMBER` is true."
    assert made.debugger.position == amber
    made.do("goto 0")
    assert made.debugger.until_back("ns@RED").end == 0
    assert last(made, "delete") == "there are no break points"


def test_cycles_both_ways(lights: Arrangement) -> None:
    made = session(lights, "cycle 3", "step 1").debugger
    assert (made.position, made.cycles) == (10, 3)
    assert made.back_cycle().end == 9
    assert made.back_cycle(2).end == 3


@pytest.mark.slow
def test_temporal_formulas_are_read_by_monitors(lights: Arrangement) -> None:
    made = session(lights, "set car true")
    answer = made.do("until F ew@GREEN")
    assert answer.parts[-2] == "`F ew@GREEN` is satisfied, read from step 0 on."
    assert made.debugger.states["ew"] == "GREEN"
    assert made.do("value G !ew@GREEN").parts == ("G !ew@GREEN: violated",)
    assert made.do("expect G !(ns@GREEN && ew@GREEN)").expected is False, "it is not decided"
    assert made.do("expect ew@GREEN").expected is True
    made.do("back 1")
    assert made.do("value F ew@GREEN").parts == ("F ew@GREEN: undecided",)
    with pytest.raises(DebugError, match="never decided"):
        made.do("until G F car")


def test_fired_transitions_are_break_points(lights: Arrangement) -> None:
    made = session(lights, "set car true", "until ew.fired(RED, 0)").debugger
    assert made.described(made.position).fired == "RED -> GREEN when turn && other@RED"


def test_why_shows_what_the_guards_saw(counting: Arrangement) -> None:
    made = session(counting, "step")
    assert rows(made, "why") == (
        ("m", "IDLE -> BUSY when go && n < 2", "false", "go = false"),
        ("m", "IDLE -> DONE when after_ms(30)", "false", "clock of m = 0 cycles"),
    )
    made.do("set go true")
    made.do("step")
    assert rows(made, "why") == (("m", "IDLE -> BUSY when go && n < 2", "true", "go = true, n = 0, n < 2 = true"),)
    made.do("step")  # on_entry runs first: the guard sees n = 1
    assert rows(made, "why") == (("m", "BUSY -> IDLE when n / d >= 1", "true", "n = 1, d = 1, n / d = 1"),)


@pytest.mark.parametrize(
    ("guard", "whole"),
    [
        ("after(1) && (not cold || away)", "cold = false"),
        ("(not cold || away) && ((after(1)) || (cold && away))", "(after(1)) || (cold && away) = true"),
        ("((not (cold)) || (away)) && after(1)", "(not (cold)) || (away) = true"),
    ],
)
def test_parts_of_guards_have_their_brackets(guard: str, whole: str) -> None:
    states = [{"name": "A", "transitions": [{"when": guard, "to": "B"}]}, {"name": "B"}]
    inputs = {name: {"type": "bool", "role": "input", "init": False} for name in ("cold", "away")}
    document = {
        "name": "w", "cycle_ms": 1000, "whiteboard": inputs,
        "machines": {"m": {"inline": {"machine": "M", "states": states}}}, "schedule": ["m"],
    }  # fmt: skip
    (row,) = rows(session(build_arrangement(document), "step", "step", "step"), "why")
    because = row[-1].split(", ")
    assert whole in because
    assert all(part.count("(") == part.count(")") for part in because)


def test_a_fault_can_be_looked_at_and_gone_back_from(counting: Arrangement) -> None:
    made = session(counting, "set go true", "set d 0", "step 1")
    answer = made.do("step")
    assert "division by zero" in str(answer.parts[0]) and made.debugger.position == 1
    assert made.do("why").parts[0] == "step 2 fails"
    assert rows(made, "why") == (("", "", "fails", "n = 1, d = 0"),)
    assert "division by zero" in str(made.do("step").parts[0])
    made.do("set d 1")
    assert made.debugger.step().reason is None and made.debugger.position == 2


def test_setting_an_input_forgets_what_came_after(counting: Arrangement) -> None:
    made = session(counting, "step 3", "back 2")
    assert made.do("set go true").parts == ("go = true from here on (2 later steps forgotten)",)
    assert made.do("free go").parts == ("go is not set any more",)
    assert rows(made, "inputs") == (("go", "false", ""), ("d", "1", ""))


def test_the_end_of_an_arrangement_stops(counting: Arrangement) -> None:
    made = session(counting)
    assert "The arrangement has ended." in made.do("until n == 7").parts
    assert made.debugger.states["m"] == "DONE"


def test_the_room_for_steps_is_said_to_be_full(counting: Arrangement) -> None:
    made = session(counting, most=2)
    assert "no room for more" in str(made.do("step 5").parts[1])
    assert made.debugger.position == 2


def test_a_break_point_reads_what_no_machine_reads(lights: Arrangement) -> None:
    made = session(lights, "break car", "set car true")
    assert made.do("continue").parts[-2] == "Break point 1: `car` is true."


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("jump", "there is no command `jump`"),
        ("step x", "`x` is not a whole number from 1"),
        ("step 1 2", "this command is written `step [N]`"),
        ("until", "this command is written `until FORMULA`"),
        ("until ns@", "something is missing"),
        ("until nobody@RED", "there is no machine `nobody`"),
        ("set lorry true", "there is no input `lorry`; what can be set: car"),
        ("set car maybe", "car: `maybe` is neither true nor false"),
        ("set car", "this command is written `set NAME VALUE`"),
        ("turn other", "there is no process `other`"),
        ("delete 7", "there is no break point 7"),
        ("continue", "nothing stops the run"),
        ("why", "no step has been taken yet"),
        ("show nobody", "there is no machine or variable `nobody`"),
        ("list nobody", "there is no machine `nobody`"),
        ("help nobody", "there is no command `nobody`"),
        ("fork", "inputs can be set already"),
        ("back-until F ns@RED", "monitors read only forwards"),
        ("break assume a: ns@RED", "is not one property"),
        ("break initially ns@RED", "leave out `initially`"),
    ],
)
def test_what_cannot_be_done_is_said(lights: Arrangement, line: str, said: str) -> None:
    with pytest.raises(DebugError) as error:
        session(lights).do(line)
    assert said in str(error.value)


@pytest.mark.slow
def test_every_command_is_done_and_helped(lights: Arrangement) -> None:
    assert len(BY_NAME) == 2 * len(COMMANDS), "no two commands have one name"
    given = {"formula": "ns@RED", "number": "2", "word": "car", "name value": "car=true"}
    made = session(lights, "step 2")
    for command in COMMANDS:
        line = f"{command.short} {given.get(command.takes, '')}"
        if command.name in ("continue", "fork"):
            continue
        if command.name == "turn":
            line = "t main"
        made.do("goto 2")
        answer = made.do(line)
        assert answer.parts or answer.quits
        assert made.do(f"help {command.short}").parts
    assert made.do("  ").parts == made.do("# nothing").parts == ()


def test_steps_are_told_as_traces_show_them(lights: Arrangement) -> None:
    answer = session(lights).do("step 12")
    steps = answer.parts[0]
    assert isinstance(steps, Steps) and (steps.first, len(steps.steps), steps.left_out) == (3, 10, 2)
    history = session(lights, "step 12").do("history 2").parts[0]
    assert isinstance(history, Steps) and history.first == 11

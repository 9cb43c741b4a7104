"""Stepping an arrangement: chosen and random inputs, cycles, runs, faults."""

from __future__ import annotations

from dataclasses import replace

import pytest

from llfsm_verify.arrangement import build_arrangement
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.program.program import (
    BOOL,
    INT64_MAX,
    UNBOUNDED,
    Choice,
    Emit,
    Fault,
    Get,
    If,
    Input,
    Int,
    Local,
    Op,
    Origin,
    Process,
    Program,
    Sample,
    Set,
    Slot,
    Stmt,
    Var,
)
from llfsm_verify.runtime.stepping.simulation import Simulation, SimulationFault, SimulationOverflow
from llfsm_verify.semantics.lowering import lower
from tests.backends.tiny import constant, tiny, variable

COLOUR = Int(0, 2)
LABELS = ("RED", "AMBER", "GREEN")


def light(*more: Stmt) -> Program:
    """Copies the input `wanted` into `shown`, read by two choices (the later one counts)."""
    first, second = Local("l1", COLOUR), Local("l2", COLOUR)
    shown = Var("shown", COLOUR, 0, Origin("whiteboard", "", LABELS))
    body = (Sample(first, "r1"), Sample(second, "r2"), Set("shown", None, second), Emit("entry", 0, (second,)), *more)
    choices = [Choice(f"r{i}", COLOUR, "read", "wanted", LABELS) for i in (1, 2)]
    unread = Input("unread", BOOL, 0)
    return tiny(body, [shown, variable("flags", BOOL, (0, 1))], choices, inputs=(unread,))


def two_processes(rounds: int) -> Program:
    """Process A with two slots ends after some rounds; process B with one never does. `last` is the slot that ran."""
    control = Origin("control")
    one = constant(1)
    kind = Int(0, rounds)
    variables = [
        Var("turnA", Int(0, 1), 0, control),
        Var("endedA", BOOL, 0, control),
        Var("n", kind, 0, control),
        variable("last", Int(0, 3)),
    ]
    more = Op("min", (constant(rounds), Op("add", (Get("n", None, kind), one), Int(1, rounds + 1))), kind)
    tick = If(
        Op("eq", (Get("turnA", None, Int(0, 1)), one), BOOL),
        (
            Set("cycle", None, one),
            Set("turnA", None, constant(0)),
            Set("n", None, more),
            Set("endedA", None, Op("eq", (Get("n", None, kind), constant(rounds)), BOOL)),
        ),
        (Set("turnA", None, one),),
    )
    slots = tuple(Slot(0, 0, "state", (), ((Set("last", None, constant(i)),),), (), ()) for i in (1, 2, 3))
    processes = (
        Process("A", (0, 1), "turnA", "endedA", (tick,)),
        Process("B", (2,), "turn", None, (Set("cycle", None, one),)),
    )
    return tiny((), variables, slots=slots, processes=processes)


def test_chosen_inputs_by_label_number_and_in_every_read() -> None:
    simulation = Simulation(light())
    simulation.ringlet({"wanted": "GREEN", "unread": True})
    assert simulation.values["shown"] == "GREEN"
    assert simulation.events == (("entry", 0, (2,)),)
    simulation.ringlet({"wanted": 1})
    assert simulation.values == {"turn": 0, "state": 0, "shown": "AMBER", "flags": (False, True)}
    simulation.ringlet()
    assert simulation.values["shown"] == "RED"
    assert simulation.steps == 3


@pytest.mark.parametrize(
    ("inputs", "message"),
    [
        ({"wished": 1}, "no input 'wished', only unread, wanted"),
        ({"wanted": "BLUE"}, "input 'wanted': `BLUE` is not one of RED, AMBER, GREEN"),
        ({"wanted": 3}, "input 'wanted': `3` is not one of"),
        ({"unread": 2}, "input 'unread': `2` is neither true nor false"),
    ],
)
def test_wrong_inputs_are_refused(inputs: dict[str, int | str], message: str) -> None:
    simulation = Simulation(light())
    with pytest.raises(ValueError, match=message):
        simulation.ringlet(inputs)
    assert simulation.steps == 0


def test_equal_seeds_give_equal_runs_and_inputs_vary() -> None:
    def colours(seed: int) -> list[object]:
        simulation = Simulation(light(), seed)
        seen: list[object] = []
        for _ in range(20):
            simulation.ringlet()
            seen.append(simulation.values["shown"])
        simulation.run(1000)
        return [*seen, simulation.record]

    assert colours(1) == colours(1)
    assert set(colours(1)[:20]) == set(LABELS)
    assert colours(1) != colours(2)


def test_processes_go_round_until_they_end() -> None:
    simulation = Simulation(two_processes(rounds=2))
    seen = []
    for _ in range(10):
        simulation.ringlet()
        seen.append(simulation.values["last"])
    assert seen == [1, 3, 2, 3, 1, 3, 2, 3, 3, 3]
    with pytest.raises(ValueError, match="process 'A' has ended"):
        simulation.ringlet(process="A")
    with pytest.raises(ValueError, match="no process 'C', only A, B"):
        simulation.ringlet(process="C")


def test_run_continues_the_round_of_the_processes() -> None:
    single, many = Simulation(two_processes(5)), Simulation(two_processes(5))
    for portion in (1, 2, 4, 3):
        for _ in range(portion):
            single.ringlet()
        assert many.run(portion) == portion
        assert many.record == single.record


def test_a_cycle_of_one_process_alone() -> None:
    simulation = Simulation(two_processes(2))
    assert simulation.cycle(process="A") == 2
    assert simulation.values["last"] == 2
    assert simulation.outputs["cycle"] == 1
    assert simulation.cycle(process="B") == 1


def test_the_end_is_a_stutter() -> None:
    ended = variable("ended", BOOL)
    process = Process("main", (0,), "turn", "ended", (Set("cycle", None, constant(1)), Set("ended", None, constant(1))))
    program = tiny((), [ended], processes=(process,))
    simulation = Simulation(program)
    ends = [simulation.ended]
    assert simulation.run(10) == 2
    ends.append(simulation.ended)
    assert ends == [False, True]
    before = simulation.values
    simulation.ringlet()
    assert simulation.cycle() == 1
    assert simulation.values == before


def test_only_steps_after_the_end_stutter() -> None:
    states = [{"name": "A", "transitions": [{"when": "true", "to": "B"}]}, {"name": "B"}]
    machines = {name: {"inline": {"machine": "M", "states": states}} for name in ("m", "n")}
    document = {"name": "short", "machines": machines, "schedule": ["m", "n"]}
    simulation = Simulation(lower(build_arrangement(document)))
    assert not simulation.stuttered
    stutters = []
    while not simulation.ended:
        simulation.ringlet()
        stutters.append(simulation.stuttered)
    assert stutters == [False] * len(stutters) and len(stutters) >= 4
    simulation.ringlet()
    assert simulation.stuttered


def test_faults_and_overflows_leave_the_simulation_where_it_was() -> None:
    amber = Op("eq", (Get("shown", None, COLOUR), constant(1)), BOOL)
    simulation = Simulation(light(Fault(2, amber)))
    simulation.ringlet({"wanted": "GREEN"})
    with pytest.raises(SimulationFault, match="fault 2") as error:
        simulation.ringlet({"wanted": "AMBER"})
    assert error.value.site.code == "E2"
    assert simulation.values["shown"] == "GREEN"
    random = Simulation(NativeProgram(light(Fault(2, amber))), seed=4)
    with pytest.raises(SimulationFault):
        random.run(1000)
    assert random.values["shown"] != "AMBER"
    assert random.steps < 1000
    big = replace(variable("big", UNBOUNDED), init=INT64_MAX - 5)
    more = Op("add", (Get("big", None, UNBOUNDED), constant(1)), UNBOUNDED)
    counter = Simulation(tiny((Set("big", None, more),), [big]))
    with pytest.raises(SimulationOverflow, match=r"^an integer left 64 bits$"):
        counter.run(100)
    assert counter.values["big"] == INT64_MAX
    assert counter.steps == 5

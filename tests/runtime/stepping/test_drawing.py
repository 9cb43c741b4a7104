"""How random runs draw: as before where nothing is held, by the law of stretches otherwise, in Python and in machine
code, and only what the executor does."""

from __future__ import annotations

import hashlib
import re
from collections import Counter
from collections.abc import Iterator
from fractions import Fraction
from functools import cache
from itertools import pairwise
from random import Random
from statistics import mean

import pytest
import yaml

from llfsm_verify import load
from llfsm_verify.arrangement.loader import build_arrangement, load_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.backends.native.executor import NativeProgram, _nonzero_seed
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Choice, Int, Program
from llfsm_verify.runtime.live.plan import plan
from llfsm_verify.runtime.stepping.drawing import (
    ALL,
    ANEW,
    Drawing,
    DrawingError,
    Draws,
    default_hold,
    drawing_of,
    free_inputs,
    hold_of,
    representatives,
)
from llfsm_verify.runtime.stepping.random_run import RandomRun, Script
from llfsm_verify.runtime.stepping.simulation import Simulation
from llfsm_verify.runtime.stepping.visited import Visits, never_visited
from llfsm_verify.semantics.lowering import lower

MIXED = """
name: mixed
timing: untimed
profile: {base: clfsm, snapshot: none}
types:
  Colour: [RED, GREEN, BLUE]
whiteboard:
  go: {type: bool, role: input}
  speed: {type: 0..5, role: input, changes: cycle}
  heat: {type: {decimal: 0.1, range: 0.0..2.0}, role: input}
  call: {type: {array: bool, size: 2}, role: input}
  colour: {type: Colour, role: input}
  n: {type: 0..7}
  k: {type: 0..7}
machines:
  a:
    inline:
      machine: A
      states:
        - name: UP
          internal: "if (go && speed > 2) n = n < 7 ? n + 1 : 0;"
          transitions:
            - {when: "go && call[0] && after(2)", to: DOWN}
            - {when: "colour == BLUE", to: STILL}
        - name: DOWN
          internal: "if (go != (speed > 3)) n = n > 0 ? n - 1 : 7;"
          transitions: [{when: "call[1] || heat > 1.0", to: UP}]
        - name: STILL
          transitions: [{when: "go", to: DOWN}]
  b:
    inline:
      machine: B
      states:
        - name: RUN
          internal: k = speed;
          transitions: [{when: "go && after(5)", to: IDLE}]
        - name: IDLE
          transitions: [{when: "colour == RED", to: RUN}]
  b2:
    inline:
      machine: B2
      states:
        - name: RUN
          internal: k = speed;
          transitions: [{when: "go", to: IDLE}]
        - name: IDLE
          transitions: [{when: "colour == RED", to: RUN}]
processes: {p: [a, b], q: [b2]}
operators: {suspend: [b], resume: [b], write: [n]}
"""
"""Untimed, of two processes, with reads that are choices of their own, ages, operators and inputs of every type."""
LIGHTS = "models/traffic_lights/arrangement.yaml"
LIFT = "models/lift/arrangement.yaml"
WORKSHOP = "tests/outputs/workshop.yaml"
BEFORE = {
    LIGHTS: ("737cced176cf6a91", "ac2dc3b1d6cb361f", "437d984decad7003"),
    LIFT: ("4ac46d4159a99299", "c97adeb7baa5d229", "edf5534be0254c01"),
    WORKSHOP: ("130bb73cba25fa9f", "a8bb4cfe159412c7", "2ccec38a3ee029d7"),
    MIXED: ("18346447d9ba0ba9", "a62bfca77176df0b", "2f831685d273508a"),
}
"""Digests of runs of commit f7d90b57, which knew no stretches."""
ALL_OF_THEM = pytest.mark.parametrize("which", BEFORE, ids=["lights", "lift", "workshop", "mixed"])


@cache
def arrangement(which: str) -> Arrangement:
    return build_arrangement(yaml.safe_load(which)) if which == MIXED else load_arrangement(which)


@cache
def program(which: str) -> Program:
    return lower(arrangement(which), keep_all_bits=True)


def law_of(which: str, hold: str | None = None, **draw: str) -> Drawing:
    return drawing_of(program(which), hold, draw)


def moves(which: str, law: Drawing = ANEW, seed: int = 5) -> Iterator[Move]:
    run = RandomRun(Execution(program(which)), Script({}), Random(seed), law=law)
    for _ in run.steps(300, None):
        assert run.move is not None
        yield run.move


def frames(which: str, law: Drawing = ANEW, seed: int = 5, turns: int = 300) -> list[list[int]]:
    """The values of all choices in each turn of a run in machine code."""
    how = plan(arrangement(which), simulated=True, cycle_ms=None if arrangement(which).cycle_ms else Fraction(100))
    loop = how.loop(how.code(), period=0, seed=seed, law=law)
    at, found = loop.code.frames.choices, []
    loop.begin(0)
    for _ in range(turns):
        loop.go(1)
        found.append(list(loop.frame[at : at + len(how.program.choices)]))
    return found


def digest(found: object) -> str:
    return hashlib.sha256(repr(found).encode()).hexdigest()[:16]


@pytest.mark.slow
@ALL_OF_THEM
def test_without_stretches_runs_are_as_they_were_before(which: str) -> None:
    drawn, live, stepped = BEFORE[which]
    law = law_of(which, "none")
    assert digest([(move.process, sorted(move.choices.items())) for move in moves(which, law)]) == drawn
    assert digest(frames(which, law)) == live
    lowest = {name: choice.type.low for name, choice in free_inputs(program(which)).items()}
    simulation, records = Simulation(program(which), 5, law).anew(5, lowest), []
    for _ in range(40):
        simulation.ringlet()
        records.append(simulation.record.hex())
    simulation.run(3000)
    assert digest([*records, simulation.record.hex()]) == stepped


@pytest.mark.slow
@ALL_OF_THEM
@pytest.mark.parametrize("hold", [None, "1cycle", "3cycles"])
def test_each_step_is_one_that_the_explicit_engine_has(which: str, hold: str | None) -> None:
    native = NativeProgram(program(which))
    record = native.layout.first({})
    for move in list(moves(which, law_of(which, hold)))[:60]:
        after = native.step(record, move.process, move.choices).record
        sample = native.step(record, move.process, move.choices).samples
        edges = [edge for edge in native.successors(record) if edge.process == move.process]
        assert any(edge.record == after and edge.samples == sample for edge in edges)
        record = after


@pytest.mark.slow
@ALL_OF_THEM
def test_simulations_hold_and_are_repeatable_whether_stepped_or_run(which: str) -> None:
    def records(seed: int) -> list[str]:
        simulation, found = Simulation(program(which), seed, law_of(which, "4cycles")), []
        for ringlets in (1, 1, 1, 50, 1, 2000, 1):
            if ringlets == 1:
                simulation.ringlet()
            else:
                simulation.run(ringlets)
            found.append(simulation.record.hex())
        return found

    assert records(1) == records(1) != records(2)


def test_changes_come_as_often_as_is_said() -> None:
    """An input with 6 values is drawn anew in 1 of 40 parts: it changes in 1 of 48."""
    choice = Choice("x", Int(0, 5), "input", "x")
    draws, source = Draws(Drawing(Fraction(20)), 2), Random(1)
    values = [draws.next([choice], source)["x"] for _ in range(48_000)]
    assert sum(a != b for a, b in pairwise(values)) == pytest.approx(1000, rel=0.1)
    assert max(Counter(values).values()) < 2 * min(Counter(values).values())


def test_weights_are_shares_of_the_time() -> None:
    choice = Choice("x", Int(-2, 5), "input", "x")
    inside = drawing_of(_reads(choice), "10cycles", {"x": "3:0.5, -2:0.1"})
    assert [(piece.low, piece.size) for piece in inside.pieces["x"]] == [(3, 1), (-2, 1), (-1, 4), (4, 2)]
    draws, source = Draws(inside, 1), Random(2)
    shares = Counter(draws.next([choice], source)["x"] for _ in range(100_000))
    assert shares[3] == pytest.approx(50_000, rel=0.1) and shares[-2] == pytest.approx(10_000, rel=0.15)
    assert all(shares[value] == pytest.approx(40_000 / 6, rel=0.25) for value in (-1, 0, 1, 2, 4, 5))
    certain = drawing_of(_reads(choice), "none", {"x": "0:1"})
    assert {Draws(certain, 1).next([choice], source)["x"] for _ in range(99)} == {0}


def _reads(choice: Choice) -> Program:
    from dataclasses import replace

    return replace(program(LIGHTS), choices=(choice,))


class Twin:
    """`draw` of `backends.native.loops`, by its description: xorshift64*, and the rows of the table."""

    def __init__(self, seed: int) -> None:
        self._state = _nonzero_seed(seed) & ALL

    def random(self, size: int) -> int:
        x = self._state
        x ^= x >> 12
        x ^= x << 25 & ALL
        x ^= x >> 27
        self._state = x
        word = x * 2685821657736338717 & ALL
        return word * size >> 64 if size else word

    def draw(self, of: Program, law: Drawing, names: set[str], parts: int, values: list[int], fresh: bool) -> None:
        for number, (choice, like) in enumerate(zip(of.choices, representatives(of, names), strict=True)):
            if like >= 0 and like != number:
                values[number] = values[like]
            if like != number:
                continue
            keep = int(ALL * (1 - law.change(parts))) if law.holds(choice) else 0
            if keep and not fresh and self.random(0) < keep:
                continue
            pieces = law.of(choice)
            low, size = choice.type.low, choice.type.high - choice.type.low + 1
            if pieces:
                word = self.random(0)
                low, size = next((p.low, p.size) for p in pieces if word <= p.until)
            values[number] = low + self.random(size)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("which", "hold", "draw"),
    [
        (LIGHTS, "5s", {"car": "0.1"}),
        (LIFT, "3cycles", {"env.choose(call[1])": "0.9"}),
        (WORKSHOP, "none", {"order": "CUT:0.7"}),
        (MIXED, "6cycles", {"speed": "0:0.5,4:0.25", "heat": "1.5:0.4"}),
        (MIXED, None, {}),
    ],
)
def test_machine_code_draws_as_its_twin_in_python(which: str, hold: str | None, draw: dict[str, str]) -> None:
    law = drawing_of(program(which), hold, draw)
    how = plan(arrangement(which), simulated=True, cycle_ms=None if arrangement(which).cycle_ms else Fraction(100))
    names = {choice.name for choice in how.program.choices if not choice.name.startswith("operator.")}
    twin, values, seen = Twin(7), [0] * len(how.program.choices), frames(which, law, 7, 200)
    for number, found in enumerate(seen):
        twin.draw(how.program, law, names, len(how.program.processes), values, number == 0)
        drawn = [value for value, choice in zip(values, how.program.choices, strict=True) if choice.name in names]
        assert [v for v, c in zip(found, how.program.choices, strict=True) if c.name in names] == drawn


def test_reads_of_one_input_agree_and_commands_come_now_and_then() -> None:
    commands, reads = [], Counter[int]()
    for move in moves(MIXED, law_of(MIXED, "10cycles")):
        found = {value for name, value in move.choices.items() if name.startswith("go")}
        reads[len(found)] += 1
        commands += [value for name, value in move.choices.items() if name == "operator.suspend(b)"]
    assert max(reads) == 1
    assert 0 < mean(commands) < 0.2 and len(commands) > 100


def test_a_formula_that_is_looked_for_does_not_change_a_run() -> None:
    first = [move.choices for move in moves(LIGHTS, law_of(LIGHTS))]
    run = RandomRun(Execution(program(LIGHTS)), Script({}), Random(5), drawn=["car"], law=law_of(LIGHTS))
    assert [run.move.choices for _ in run.steps(300, None) if run.move is not None] == first


@pytest.mark.parametrize(
    ("text", "cycles"), [("5s", 5), ("500ms", Fraction(1, 2)), ("20cycles", 20), ("1 cycle", 1), ("none", None)]
)
def test_how_long_a_stretch_is(text: str, cycles: Fraction | None) -> None:
    assert hold_of(text, program(LIGHTS)) == cycles


def test_how_long_a_stretch_is_by_default() -> None:
    """As the longest timer, at least 5 cycles."""
    assert default_hold(program(LIFT)) == default_hold(program(MIXED)) == 5
    for seconds, period, cycles in (
        (30, 1000, 31),
        (100, 1000, 60),
        (100, 4000, 15),
        (100, 10000, 6),
        (100, 20000, 5),
        (1, 10, 101),
    ):
        timer = yaml.safe_load(TIMER.replace("TIME", str(seconds))) | {"cycle_ms": period}
        assert default_hold(lower(build_arrangement(timer))) == cycles


TIMER = """
name: t
cycle_ms: 1000
whiteboard: {go: {type: bool, role: input}, x: {type: 0..3, role: input}}
machines:
  m:
    inline:
      machine: M
      states:
        - name: A
          transitions: [{when: "go && x == 1 && after(TIME)", to: A}]
schedule: [m]
"""


@pytest.mark.parametrize(
    ("which", "hold", "draw", "message"),
    [
        (LIGHTS, "5", "", "hold `5` is neither a time such as 5s, a number of cycles such as 20cycles, nor `none`"),
        (LIGHTS, "0cycles", "", "hold `0cycles` is neither"),
        (LIGHTS, "1000000001s", "", "hold `1000000001s` is longer than the longest time, 1,000,000,000 s"),
        (LIGHTS, f"{'9' * 99}h", "", f"hold `{'9' * 40}` is longer than the longest time, 1,000,000,000 s"),
        (LIGHTS, "1e999999999s", "", "hold `1e999999999s` is neither"),
        (MIXED, "1000000000000cycles", "", "hold `1000000000000cycles` is more than the largest number of cycles, 99"),
        (LIGHTS, "-3s", "", "hold `-3s` is neither"),
        (LIGHTS, "", "", "hold `` is neither"),
        (MIXED, "5s", "", "hold `5s` is a time, and the arrangement is untimed: write cycles, such as 20cycles"),
        (LIGHTS, None, "cra=0.5", "draw `cra` is not an input of the arrangement; inputs: car; did you mean `car`?"),
        (LIGHTS, None, "car=1.5", "draw car: `1.5` is not a probability, a number from 0 to 1"),
        (LIGHTS, None, "car=nan", "draw car: `nan` is not a probability"),
        (LIGHTS, None, "car=1/2", "draw car: `1/2` is not a probability"),
        (LIGHTS, None, "car=", "draw car: `` is not a probability"),
        (LIGHTS, None, "car=1e-9999999999", "draw car: `1e-9999999999` is not a probability"),
        (LIGHTS, None, "car=yes:0.1", "draw car: `yes` is neither true nor false"),
        (LIGHTS, None, "car=true:0.1,true:0.1", "draw car: the value `true` is given twice"),
        (LIGHTS, None, "car=true:0.1,false", "draw car: `` is not a probability"),
        (LIGHTS, None, "car=true:0.3,false:0.4", "draw car: its probabilities add up to 0.7, not to 1"),
        (MIXED, None, "speed=0:0.8,1:0.4", "draw speed: its probabilities add up to 1.2, not to 1"),
        (MIXED, None, "speed=0.5", "draw `speed` is not true or false: write speed=VALUE:PROBABILITY"),
        (MIXED, None, "heat=1.5:0.1,1.50:0.2", "draw heat: the value `1.50` is given twice"),
        (MIXED, None, "a.UP.age=0.5", "draw `a.UP.age` is not an input"),
        (WORKSHOP, None, "limit=3:0.5", "draw limit: `3` is not a number from 1 to 2"),
        (LIFT, None, "level=0.5", "draw `level` is written by the model of the surroundings"),
    ],
)
def test_what_is_wrong_is_said(which: str, hold: str | None, draw: str, message: str) -> None:
    name, _, law = draw.partition("=")
    with pytest.raises(DrawingError, match=f"^{re.escape(message)}"):
        drawing_of(program(which), hold, {name: law} if draw else {})


def test_an_input_that_has_a_value_is_not_drawn() -> None:
    with pytest.raises(ValueError, match="`car` has a value, so it is not drawn"):
        drawing_of(program(LIGHTS), None, {"car": "0.5"}, {"car"})


@pytest.mark.slow
def test_states_that_were_never_visited() -> None:
    """In a run step by step and in machine code: those that no frame and no step shows."""
    model = load(LIGHTS)
    for run in (model.simulate(cycles=n, seed=3, draw={"car": 0.05}) for n in (1, 10, 100)):
        machines = set(run.never_visited) | set(run.values(0)) & {"ns", "ew", "monitor"}
        for machine in machines:
            seen = {run.values(step)[machine] for step in range(len(run) + 1)}
            assert seen.isdisjoint(run.never_visited.get(machine, ()))
    assert never_visited({}) == "Every state was visited."
    assert never_visited({"a": ("X", "Y"), "b": ("Z",)}) == "Never visited: a@X, a@Y, b@Z."
    assert never_visited({"a": tuple(map(str, range(40)))}).endswith("a@29 and 10 more.")


@pytest.mark.slow
@pytest.mark.parametrize("which", [LIGHTS, LIFT, "tests/cli/crossing.yaml"])
def test_a_run_in_machine_code_visits_what_its_frames_show(which: str) -> None:
    how = plan(arrangement(which), simulated=True)
    loop = how.loop(how.code(), period=0, seed=2, law=law_of(which, "2cycles"))
    visits = Visits(how.program, loop.code.layout)
    assert loop.never_visited is not None
    loop.begin(0)
    for turn in range(200):
        visits.see(loop.record)
        assert loop.never_visited == visits.never
        if turn == 100:
            after = how.loop(how.code(), period=0, seed=2)
            after.take_over(loop, loop.record)
            loop = after
        loop.go(1)
    assert how.loop(how.code(), period=0).never_visited is None

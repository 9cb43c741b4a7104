"""Monitors beside a simulation read the observed word, whether it runs in machine code or ringlet by ringlet."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement import build_arrangement, load_arrangement
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.backends.reference import evaluate
from llfsm_verify.checking.problem import bind
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import FEATURES, parse_properties
from llfsm_verify.monitoring.properties import Timing, monitor_properties
from llfsm_verify.monitoring.states import MonitorVerdict
from llfsm_verify.runtime.stepping import monitored as watching
from llfsm_verify.runtime.stepping.monitored import MonitoredSimulation
from llfsm_verify.runtime.stepping.simulation import Simulation, SimulationError
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.testing.arrangements import arrangements
from llfsm_verify.testing.properties import properties
from tests.quick import examples

LIGHTS = "models/traffic_lights/{}.yaml"
TEXT = """
both: G !(ns@GREEN && ew@GREEN)
enforce order: (ew@RED ew@GREEN ew@AMBER)*
"""


def watched(arrangement, text, seed):
    """A simulation of the arrangement with the monitors of some properties, its program and the monitors."""
    lines = parse_properties([Source("test", text)], features=FEATURES)
    bound = bind(arrangement, lines)
    program = lower(arrangement, bound.atoms)
    monitors = {line.name: monitor_properties(line, timing=Timing(bound.clock)).monitor for line in lines}
    return MonitoredSimulation(program, monitors, seed), program, monitors


def letters_of(program, record, layout):
    outputs = layout.decode_outputs(record)
    return {a.name for a in program.atoms if outputs[a.output]}


def first_letter(program, simulation):
    values = simulation._layout.decode(simulation.record) | {v.name: v.init for v in program.vars if v.output}
    inputs = {f"input:{i.name}": i.init for i in program.inputs}
    return {a.name for a in program.atoms if evaluate(a.expression, values, inputs)}


def random_case(data):
    arrangement = build_arrangement(data.draw(arrangements()))
    texts = data.draw(st.lists(properties(arrangement), min_size=1, max_size=2))
    return arrangement, "\n".join(f"p{i}: {t}" for i, t in enumerate(texts))


class Expected:
    """The states of the monitors along the letters of a plain simulation."""

    def __init__(self, program, monitors, simulation):
        self.program, self.monitors, self.layout = program, monitors, simulation._layout
        letter = first_letter(program, simulation)
        self.states = {name: m.step(0, m.letter(letter)) for name, m in monitors.items()}

    def read(self, plain, stutters):
        if self.program.observe == "ringlet" or plain.outputs[self.program.cycle] or stutters:
            letter = letters_of(self.program, plain.record, self.layout)
            self.states = {name: m.step(self.states[name], m.letter(letter)) for name, m in self.monitors.items()}


@pytest.mark.slow
@given(st.data())
@settings(max_examples=examples(10))
def test_ringlet_by_ringlet(data):
    simulation, program, monitors = watched(*random_case(data), 3)
    plain = Simulation(program, 3)
    expected = Expected(program, monitors, simulation)
    assert simulation.monitor_states == expected.states
    try:
        for _ in range(12):
            ended = plain.ended
            simulation.ringlet()
            plain.ringlet()
            expected.read(plain, ended)
            assert simulation.monitor_states == expected.states
    except SimulationError:
        return


@pytest.mark.slow
@given(st.data())
@settings(max_examples=examples(12))
def test_runs_in_machine_code(data):
    simulation, program, monitors = watched(*random_case(data), 11)
    native = NativeProgram(program)
    expected = Expected(program, monitors, simulation)
    failed = None
    try:
        simulation.run(15)
    except SimulationError as error:
        failed = type(error)
    ended = False
    for count in range(1, simulation.steps + 1):
        # A plain run of so many ringlets from the beginning makes the same random choices.
        plain = Simulation(native, 11)
        plain.run(count)
        expected.read(plain, ended)
        ended = plain.ended
    assert simulation.monitor_states == expected.states
    plain = Simulation(native, 11)
    if failed is None:
        assert plain.run(15) == simulation.steps
    else:
        with pytest.raises(failed):
            plain.run(15)
    assert plain.record == simulation.record


@pytest.mark.slow
def test_the_first_violation_is_found_at_its_ringlet():
    arrangement = load_arrangement(LIGHTS.format("faulty"))
    fast, program, monitors = watched(arrangement, TEXT, 5)
    fast.run(100_000, stop=True)
    assert set(fast.settled) == {"both"} and fast.settled["both"] == fast.steps < 1_000
    m = monitors["both"]
    # A plain run of as many ringlets reaches the violation, one of a ringlet less does not.
    for steps, violates in ((fast.steps, True), (fast.steps - 1, False)):
        plain = Simulation(program, 5)
        plain.run(steps)
        assert (m.step(0, m.letter(letters_of(program, plain.record, plain._layout))) != 0) == violates
    fast.run(10_000)
    assert fast.settled["both"] < fast.steps


@pytest.mark.slow
def test_the_sound_lights_are_never_settled():
    simulation, _, _ = watched(load_arrangement(LIGHTS.format("arrangement")), TEXT, 5)
    assert simulation.run(200_000) == 200_000
    assert simulation.settled == {}
    simulation.cycle()
    assert simulation.settled == {}


def test_deadlines_are_watched_too():
    text = "soon: F[<=3s] ns@AMBER\nlater: F[<=9s] ns@GREEN\n"
    simulation, program, monitors = watched(load_arrangement(LIGHTS.format("arrangement")), text, 2)
    expected = Expected(program, monitors, simulation)
    native = NativeProgram(program)
    simulation.run(60)
    for count in range(1, 61):
        plain = Simulation(native, 2)
        plain.run(count)
        expected.read(plain, False)
        assert ("soon" in simulation.settled and simulation.settled["soon"] <= count) == (
            monitors["soon"].verdicts[expected.states["soon"]] is MonitorVerdict.FALSE
        )
    assert simulation.monitor_states == expected.states
    # The three ringlets of a cycle are at the same time, the first ones at 0 s: time passes beyond 3 s behind the 12th.
    assert simulation.settled == {"later": 2, "soon": 12}


@pytest.mark.slow
def test_inputs_can_be_held():
    """In machine code, ringlet by ringlet, and by cycles, to the same end; a copy made anew shares nothing but code."""
    first, _, _ = watched(load_arrangement(LIGHTS.format("arrangement")), TEXT, None)
    for taken in ((31, None), (None, 10)):
        held, single = first.anew(), first.anew()
        ringlets, cycles = held.hold({"car": True}, ringlets=taken[0], cycles=taken[1])
        assert (ringlets, cycles) == ((31, 10) if taken[1] is None else (30, 10))
        for _ in range(ringlets):
            single.ringlet({"car": True})
        assert (held.record, held.monitor_states, held.steps) == (single.record, single.monitor_states, single.steps)
        assert held.state("timer") == ("EW_TURN" if ringlets == 31 else "CAR_WAITING")
    assert (first.steps, first.state("timer"), first.settled) == (0, "NS_PRIORITY", {})
    with pytest.raises(KeyError, match="no machine 'timr', only timer, ns, ew"):
        first.state("timr")
    with pytest.raises(ValueError, match="a number of ringlets or of cycles"):
        first.hold({})


@pytest.mark.slow
def test_holding_ends_with_the_first_verdict():
    simulation, _, _ = watched(load_arrangement(LIGHTS.format("faulty")), TEXT, None)
    assert simulation.hold({"car": True}, cycles=1_000) == (65, 21)
    assert simulation.settled == {"both": 65}
    assert simulation.hold({"car": True}, cycles=3) == (7, 3)


def test_a_run_with_a_seed_draws_its_inputs():
    simulation, _, _ = watched(load_arrangement(LIGHTS.format("arrangement")), TEXT, 3)
    with pytest.raises(ValueError, match="a run with a seed draws its inputs"):
        simulation.run(10, {"car": True})
    plain = Simulation(simulation.program)
    assert plain.run(31, {"car": True}) == 31 and plain.state("timer") == "EW_TURN"


@pytest.mark.parametrize("text", ["never: forbid_ && !forbid_", "never: X X false", "forbid r: [ns@RED] | [!ns@RED]"])
def test_monitors_that_no_letter_changes_the_way_of(text):
    """Each step leads to the next state whatever the letter shows: there is no atom to read."""
    text = text.replace("forbid_", "ns@RED")
    simulation, _, monitors = watched(load_arrangement(LIGHTS.format("arrangement")), text, None)
    ((name, monitor),) = monitors.items()
    simulation.hold({}, ringlets=3)
    simulation.hold({}, ringlets=3)
    assert monitor.verdicts[simulation.monitor_states[name]] is MonitorVerdict.FALSE


@pytest.mark.slow
def test_the_monitors_are_compiled_once_for_short_runs_and_once_for_long_ones(monkeypatch):
    made = []

    class Noted(watching._WatchCode):
        def __init__(self, text, quick):
            made.append(quick)
            super().__init__(text, quick)

    monkeypatch.setattr(watching, "_WatchCode", Noted)
    simulation, *_ = watched(load_arrangement(LIGHTS.format("arrangement")), TEXT, None)
    for ringlets in (1, 2, watching.LONG_RUN, watching.LONG_RUN, 3):
        simulation.run(ringlets)
    assert made == [True, False]


def test_a_run_goes_on_with_the_process_whose_turn_it_is():
    """As without monitors: processes go round, also from a run to the next one and to single ringlets."""
    count = {"name": "S", "internal": "n = (n + 1) % 9;", "transitions": [{"when": "false", "to": "S"}]}
    machine = {"inline": {"machine": "M", "variables": {"n": {"type": "0..8"}}, "states": [count]}}
    arrangement = build_arrangement(
        {"name": "two", "cycle_ms": 10, "machines": dict.fromkeys("ab", machine), "processes": {"p": ["a"], "q": ["b"]}}
    )
    simulation, program, _ = watched(arrangement, "p: G a@S", None)
    plain = Simulation(NativeProgram(program))
    for ringlets in (1, 3, 2, 5, 1):
        simulation.run(ringlets)
        plain.run(ringlets)
        assert simulation.record == plain.record
        simulation.ringlet()
        plain.ringlet()
        assert simulation.record == plain.record

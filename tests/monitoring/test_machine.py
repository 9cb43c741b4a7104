"""A monitor machine in the schedule gives the verdicts of its automaton on the letters of its own turns."""

import random
from itertools import islice
from pathlib import Path

import pytest
import yaml
from hypothesis import HealthCheck, given, reject, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement import build_arrangement, load_arrangement
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.backends.reference import Interpreter
from llfsm_verify.checking.problem import bind
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.logic.bounds import TICK
from llfsm_verify.logic.properties import FEATURES, parse_properties
from llfsm_verify.monitoring import machine as writer
from llfsm_verify.monitoring.machine import Action, monitor_machine, sight
from llfsm_verify.monitoring.machine_reads import reads
from llfsm_verify.monitoring.properties import Timing, monitor_properties
from llfsm_verify.monitoring.states import Monitorability, MonitorVerdict
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.testing.arrangements import arrangements
from llfsm_verify.testing.properties import state_formulas
from llfsm_verify.verification.verify import verify
from tests.quick import examples, many

TEMPLATES = (
    "p: G ({0})",
    "p: F ({0}) || G ({1})",
    "p: ({0}) U ({1})",
    "p: G (({0}) -> X ({1}))",
    "p: G (({0}) -> O ({1}))",
    "p: X ({0}) && G (({1}) || X X ({0}))",
    "p: F[0:3] ({0})",
    "p: G (({0}) -> F[<=20ms] ({1}))",
    "p: G (({0}) -> F[10ms:20ms] ({1}))",
    "p: G (({0}) -> H[0:2] ({1}) || O[10ms:20ms] ({1}))",
    "p: G (({0}) -> O[0:12] ({1}) || (X ({0}) S[<=120ms] ({1})))",
    "p: (({0}) -> G F ({1})) && (!({0}) -> X G ({1}))",
    "forbid p: [{0}] [{1}] [{0}]",
    "enforce p: ([{0}] | [{1}])* [!({0})] true*",
)


def lines_of(text):
    return parse_properties([Source("test", text)], features=FEATURES)


def is_read(text, arrangement):
    try:
        reads(lines_of(f"p: {text}").atoms, arrangement)
    except DiagnosticError:
        return False
    return True


def machine_of(text, arrangement=None, action=None):
    """The automaton and the machine of one property, as a document, with the parameters of its instance."""
    lines = lines_of(text)
    (line,) = lines.goals
    clock = None if arrangement is None else bind(arrangement, lines).clock
    found = monitor_properties(line, lines.assumptions, Timing(clock, every_letter_ticks=True))
    made = monitor_machine(found, lines.atoms, arrangement, action or Action())
    document = yaml.load(made.text, Loader=yaml.BaseLoader)
    return found.monitor, {"inline": document, "parameters": {name: name for name in document.get("parameters", {})}}


def placed(document, machine, place):
    """The arrangement with the monitor as one more machine, somewhere in a schedule; letters are those of ringlets."""
    schedules = document.get("processes") or {"": document["schedule"]}
    name = sorted(schedules)[place % len(schedules)]
    order = list(schedules[name])
    order.insert(place % (len(order) + 1), "monitor")
    result = {k: v for k, v in document.items() if k != "observe"}
    result["machines"] = {**document["machines"], "monitor": machine}
    if "processes" in document:
        result["processes"] = {**schedules, name: order}
    else:
        result["schedule"] = order
    return result


def flags(monitor, state):
    """The flags that should be set, of those the machine has."""
    verdict = monitor.verdicts[state]
    all_flags = {
        "violated": verdict is MonitorVerdict.FALSE,
        "satisfied": verdict is MonitorVerdict.TRUE,
        "undecidable": monitor.hopeless[state],
    }
    possible = {
        "violated": MonitorVerdict.FALSE in monitor.verdicts,
        "satisfied": MonitorVerdict.TRUE in monitor.verdicts,
        "undecidable": any(monitor.hopeless),
    }
    return {f"monitor.{name}": int(value) for name, value in all_flags.items() if possible[name]}


def agree(data):
    """The machine is where its automaton is, in both executors, on random runs of a random arrangement."""
    document = data.draw(arrangements())
    arrangement = build_arrangement(document)
    readable = [text for text in state_formulas(arrangement) if is_read(text, arrangement)]
    atoms = st.sampled_from(readable)
    text = data.draw(st.sampled_from(TEMPLATES)).format(data.draw(atoms), data.draw(atoms))
    try:
        monitor, machine = machine_of(text, arrangement)
    except DiagnosticError as error:
        if {d.code for d in error.diagnostics} <= {"E344", "E342", "E432", "E336"}:
            reject()
        raise
    whole = build_arrangement(placed(document, machine, data.draw(st.integers(0, 11))))
    program = lower(whole, bind(whole, lines_of(text)).atoms)
    slots = [program.machines[slot.machine].name for slot in program.slots]
    own = slots.index("monitor") + 1
    native, interpreter = NativeProgram(program), Interpreter(program)
    layout = native.layout
    source = random.Random(data.draw(st.integers(0, 1000)))
    record, state = layout.first(), 0
    for _ in range(40):
        steps = list(islice(interpreter.successors(layout.decode(record), layout.decode_outputs(record)), 40))
        process, outcome = source.choice(steps)
        result = native.step(record, process, dict(outcome.samples))
        if outcome.fault is not None or outcome.overflow:
            assert result.status != 0
            return
        # The native executor and the reference agree, so the machine is looked at in both.
        record = layout.encode(outcome.values) + layout.encode_outputs(outcome.outputs)
        assert result.record == record
        if process is None:
            return
        outputs, values = outcome.outputs, outcome.values
        if outputs[program.ran] == own and outputs[program.spent] == 0:
            letter = {a.name for a in program.atoms if outputs[a.output]}
            state = monitor.step(state, monitor.letter(letter))
        if len(monitor.verdicts) > 1:
            assert values["monitor.state"] == state
            if state or outputs[program.ran] == own:
                expected = flags(monitor, state)
                assert {name: values[name] for name in expected} == expected


@pytest.mark.slow
def test_a_counter_is_written_in_a_few_lines():
    monitor, machine = machine_of("p: G (q -> O[0:1000] p)")
    (observe, _) = machine["inline"]["states"]
    counting = [line for line in observe["internal"].splitlines() if "next =" in line]
    assert len(monitor.verdicts) == 1_002 and len(counting) == 7
    assert "if (state >= 3 && state <= 1000 && !seen_1) next = state + 1;" in counting
    assert "if (state >= 3 && seen_1) next = 1;" in counting


SLOW = [HealthCheck.too_slow, HealthCheck.filter_too_much]


@pytest.mark.slow
@given(st.data())
@settings(max_examples=examples(15), suppress_health_check=SLOW)
def test_the_machine_agrees_with_the_automaton_on_its_own_turns(data):
    agree(data)


@pytest.mark.long
@given(st.data())
@settings(max_examples=many(600), suppress_health_check=SLOW)
def test_the_machine_agrees_with_the_automaton_on_many_arrangements(data):
    agree(data)


LIGHTS = Path("models/traffic_lights")
BOTH = "both: G !(ns@GREEN && ew@GREEN)"


def lights_with(name, machine, order=("timer", "ns", "ew", "monitor"), alarm=False):
    """The traffic lights with a monitor."""
    text = (LIGHTS / f"{name}.yaml").read_text().replace("file: ", f"file: {LIGHTS}/")
    document = yaml.load(text, Loader=yaml.BaseLoader)
    if alarm:
        document["whiteboard"]["alarm"] = {"type": "bool", "init": "false"}
    return {
        **document,
        "machines": {**document["machines"], "monitor": machine},
        "schedule": list(order),
    }


BETWEEN = ("timer", "ns", "monitor", "ew")


def verdict_of(document, text):
    """Whether a property holds in the arrangement."""
    whole = build_arrangement(document)
    (found,) = verify(whole, lines_of(text), engine="explicit").properties
    return found.verdict.value


@pytest.mark.slow
def test_the_place_in_the_schedule_decides_what_is_seen():
    _, machine = machine_of(BOTH)
    # Both lights are green between the ringlets of ns and ew only.
    assert verdict_of(lights_with("faulty", machine), BOTH) == "violated"
    assert verdict_of(lights_with("faulty", machine), "p: G !monitor.violated") == "holds"
    assert verdict_of(lights_with("faulty", machine, BETWEEN), "p: G !monitor.violated") == "violated"
    assert verdict_of(lights_with("arrangement", machine, BETWEEN), "p: G !monitor.violated") == "holds"


@pytest.mark.parametrize("place", range(4))
def test_one_cycle_passes_between_two_turns(place):
    _, machine = machine_of(BOTH)
    order = ["timer", "ns", "ew"]
    order.insert(place, "monitor")
    whole = build_arrangement(lights_with("arrangement", machine, order))
    program = lower(whole, bind(whole, lines_of("p: F[<=3s] ns@AMBER")).atoms)
    native = NativeProgram(program)
    tick = next(a.output for a in program.atoms if a.name == TICK)
    own = [program.machines[slot.machine].name for slot in program.slots].index("monitor") + 1
    record = native.layout.first()
    ticks, seen = 0, []
    for _ in range(40):
        record = native.run(record, 1).record
        outputs = native.layout.decode_outputs(record)
        if outputs[program.ran] == own:
            seen.append(ticks)
            ticks = 0
        ticks += outputs[tick]
    assert set(seen[1:]) == {1} and len(seen) == 10


def test_deadlines_count_turns():
    arrangement = load_arrangement(str(LIGHTS / "arrangement.yaml"))
    monitor, machine = machine_of("p: F[<=3s] ns@AMBER", arrangement)
    program = lower(build_arrangement(lights_with("arrangement", machine)))
    native = NativeProgram(program)
    record, turns = native.layout.first(), 0
    while not native.layout.get(record, "monitor.violated"):
        record = native.run(record, 4).record
        turns += 1
        assert native.layout.get(record, "monitor.state") == monitor.step(0, 0) or turns > 1
    # Its turns are at 0, 1, 2 and 3 s.
    assert turns == 4


def test_a_violation_sets_and_suspends_at_once():
    monitor, machine = machine_of(BOTH, action=Action(("alarm",), ("ns",)))
    assert monitor.monitorability is Monitorability.ALWAYS
    program = lower(build_arrangement(lights_with("faulty", machine, BETWEEN, alarm=True)))
    native = NativeProgram(program)
    record = native.layout.first()
    for seed in range(400):
        record = native.run(record, 1, mode="random", seed=seed).record
        values = native.layout.decode(record)
        if values["alarm"]:
            break
    assert values["alarm"] == values["monitor.violated"] == 1
    ended = native.run(record, 8).record
    states = {s.machine: s.state for s in program.slots}
    names = {m.name: m for m in program.machines}
    ns = next(i for i, m in enumerate(program.machines) if m.name == "ns")
    assert names["ns"].states[native.layout.get(ended, states[ns])] == "__suspend"
    mine = next(i for i, m in enumerate(program.machines) if m.name == "monitor")
    assert names["monitor"].states[native.layout.get(ended, states[mine])] == "VIOLATED"


def test_machine_files_are_valid_and_follow_the_pattern(tmp_path):
    arrangement = load_arrangement(str(LIGHTS / "arrangement.yaml"))
    (line,) = lines_of("p: G (ns_light == GREEN && ns_turn -> car || X ns@AMBER)")
    made = monitor_machine(
        monitor_properties(line), line.atoms, arrangement, notes=sight(reads(line.atoms, arrangement), None)
    )
    assert made.reads.parameters == {
        "ns_light": {"whiteboard": "Colour"}, "ns_turn": {"whiteboard": "bool"}, "car": {"whiteboard": "bool"},
        "ns": "machine",
    }  # fmt: skip
    document = yaml.load(made.text, Loader=yaml.BaseLoader)
    sections = [part for part in document["states"][0]["internal"].split("\n") if part.startswith("//")]
    assert sections == ["// observe", "// test", "// act"]
    machine = {"inline": document, "parameters": {name: name for name in document["parameters"]}}
    assert build_arrangement(lights_with("arrangement", machine)).warnings == ()


def test_inputs_that_several_atoms_read_are_read_once():
    document = {
        "profile": "clfsm",
        "whiteboard": {"level": {"type": "0..5", "role": "input"}},
        "machines": {"m": {"inline": {"machine": "M", "states": [{"name": "S"}]}}},
        "schedule": ["m"],
        "finished": "keep",
    }
    arrangement = build_arrangement(document)
    monitor, machine = machine_of("p: G (level > 1 -> level < 4)", arrangement)
    internal = machine["inline"]["states"][0]["internal"]
    assert "0..5 input_0 = level;" in internal
    assert internal.count("level") == 1
    assert len(monitor.verdicts) == 2
    assert build_arrangement(placed(document, machine, 1)).machine("monitor").kind == "Monitor_p"


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("p: G m.ran", "E430"),
        ("p: G m.finished", "E430"),
        ("p: G m.fired(A, 0)", "E430"),
        ("p: G (cycle -> q)", "E430"),
        ("p: G !refused(m)", "E430"),
        ("p: G (x == 3)", "E431"),
        ("p: G ball.x", "E431"),
        ("p: G array", "E430"),
        ("p: G (m -> m@S)", "E430"),
        ("p: G F q", "E432"),
        ("p: F G m@S", "E432"),
    ],
)
def test_what_a_machine_cannot_monitor_is_refused(text, code):
    with pytest.raises(DiagnosticError) as caught:
        machine_of(text)
    assert [d.code for d in caught.value.diagnostics] == [code]


def test_variables_of_other_machines_are_their_own():
    document = {
        "machines": {
            "m": {"inline": {"machine": "M", "variables": {"n": {"type": "bool"}}, "states": [{"name": "S"}]}}
        },
        "schedule": ["m"],
    }
    with pytest.raises(DiagnosticError, match=r"cannot read `m\.n`"):
        machine_of("p: G m.n", build_arrangement(document))


def test_actions_that_make_no_sense_are_refused():
    arrangement = load_arrangement(str(LIGHTS / "arrangement.yaml"))
    for action in (Action(("car",)), Action(("nothing",)), Action(("ns_light",)), Action((), ("nobody",))):
        with pytest.raises(DiagnosticError, match="E435"):
            machine_of(BOTH, arrangement, action)
    for action in (Action(("two words",)), Action(("for",)), Action(("ns",)), Action(("a",), ("a",))):
        with pytest.raises(DiagnosticError, match="E435"):
            machine_of(BOTH, None, action)
    with pytest.raises(DiagnosticError, match="`q` is a variable"):
        machine_of("p: G q", None, Action((), ("q",)))
    with pytest.raises(DiagnosticError, match="E436"):
        machine_of("p: F q", None, Action(("alarm",)))


def test_a_large_monitor_is_no_machine(monkeypatch):
    monkeypatch.setattr(writer, "MAX_LENGTH", 1_000)
    with pytest.raises(DiagnosticError, match="E433"):
        machine_of("p: G (a -> X X X X X b)")


def test_names_that_are_taken_get_a_number():
    _, machine = machine_of("p: G (violated && state && seen_0)")
    variables = machine["inline"]["variables"]
    assert list(variables) == ["state_2", "violated_2"]
    document = {
        "whiteboard": {name: {"type": "bool"} for name in ("violated", "state", "seen_0")},
        "machines": {"monitor": machine},
        "schedule": ["monitor"],
    }
    assert build_arrangement(document).warnings == ()


def test_what_is_missed_is_said():
    arrangement = load_arrangement(str(LIGHTS / "arrangement.yaml"))
    said = " ".join(sight(reads(lines_of(BOTH).atoms, arrangement), arrangement))
    assert "1 letter of 4" in said and "timer, ns and ew" in said and "two states at the same time" in said
    said = " ".join(sight(reads(lines_of("p: G (car -> ns_light == RED)").atoms, arrangement), arrangement))
    assert "no value is skipped: ns_light" in said and "Inputs are seen only" in said
    assert "all other machines" in " ".join(sight(reads(lines_of(BOTH).atoms, None), None))


def test_an_input_of_decimals_is_read_once():
    document = {
        "cycle_ms": "100",
        "whiteboard": {"speed": {"type": {"decimal": "0.1", "range": "-1.0..1.0"}, "role": "input"}},
        "machines": {"m": {"inline": {"machine": "M", "states": [{"name": "A", "stays": "true"}]}}},
        "schedule": ["m"],
    }
    _, machine = machine_of("p: G (speed > 0.5 -> F[<=1s] speed < 0.2)", build_arrangement(document))
    internal = machine["inline"]["states"][0]["internal"]
    assert internal.count("speed") == 1 and "input_0 > 0.5" in internal
    document |= {"machines": {**document["machines"], "monitor": machine}, "schedule": ["m", "monitor"]}
    assert verdict_of(document, "p: G !monitor.violated") == "violated"

"""What a switch does to other machines: its text, the rights that it needs, what is proved, and what runs show."""

from __future__ import annotations

from collections import Counter

import pytest
from hypothesis import reject, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.resolve.arrangement import resolve
from llfsm_verify.backends.broken import BrokenProgramError
from llfsm_verify.checking.verdict import Options, Verdict
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.extensions.guards.chaos import with_chaos
from llfsm_verify.extensions.guards.reactions import KINDS
from llfsm_verify.extensions.guards.transparency import Transparent, transparency
from llfsm_verify.language.types import scalar_text
from llfsm_verify.limits import Budget, Limits
from llfsm_verify.verification.verify import verify
from tests.extensions.guards.helpers import draft_of, guarded, lines_of, proved
from tests.extensions.guards.test_random_guards import NOT_GUARDABLE, SLOW, drawn, violated
from tests.quick import each, many, spread

DRIVING = """\
name: driving
cycle_ms: 100
whiteboard:
  pedal: {type: 0..9, role: input}
  speed: {type: 0..9, role: output}
  parking: {type: 0..9}
machines:
  driver:
    inline:
      machine: Driver
      states:
        - {name: WAITS, on_entry: speed = 0;, transitions: [{when: after_ms(250), to: DRIVES}]}
        - {name: DRIVES, internal: speed = pedal;, transitions: [{when: pedal == 9, to: WAITS}]}
  parker:
    inline: {machine: Parker, states: [{name: PARKS, internal: "parking = 1 - parking;", stays: true}]}
    suspended: true
schedule: [driver, parker]
"""
POOL = DRIVING.replace("    suspended: true\n", "").replace("[driver, parker]", "[driver]\npool: [parker]")
SLOWLY = "slow: G speed < 6"
TEXTS = {"suspend": DRIVING, "resume": DRIVING, "restart": DRIVING, "load": POOL, "unload": DRIVING}
MACHINES = {"suspend": "driver", "resume": "parker", "restart": "driver", "load": "parker", "unload": "driver"}


def reacting(kind, until=None, text=None):
    """A guard with a reaction, beside a fallback: what the parker writes, where the reaction starts it."""
    machine = MACHINES[kind]
    fallback = {"speed": "parking" if machine == "parker" else "0"}
    return guarded(
        TEXTS[kind] if text is None else text, [SLOWLY], fallback, until=until, reactions=[f"{kind} {machine}"]
    )


def held(made, *texts):
    return [
        p.verdict is Verdict.HOLDS for p in verify(made.arrangement, lines_of(*texts), Options(), "auto").properties
    ]


def test_the_switch_commands_and_takes_it_back():
    reactions = ["suspend driver", "resume parker"]
    made, _ = guarded(DRIVING, [SLOWLY], {"speed": "parking"}, until="after_ms(500)", reactions=reactions)
    assert made.files["switch.machine.yaml"] == (
        "# The requested value goes to `speed`; when `alarm` is set, the fallback goes there.\n"
        "# When `alarm` is set: suspend `driver` and resume `parker`.\n"
        "machine: Switch\n"
        "variables:\n"
        "  driver_suspended: {type: bool}\n"
        "  parker_resumed: {type: bool}\n"
        "states:\n"
        "  - name: REQUESTED\n"
        "    internal: |\n"
        "      speed = speed_requested;\n"
        "    on_exit: |\n"
        "      speed = parking;\n"
        "      driver_suspended = is_running(driver);\n"
        "      suspend(driver);\n"
        "      parker_resumed = is_suspended(parker);\n"
        "      resume(parker);\n"
        "    transitions: [{when: alarm, to: INSTEAD}]\n"
        "  - name: INSTEAD\n"
        "    internal: |\n"
        "      speed = parking;\n"
        "    on_exit: |\n"
        "      speed = parking;\n"
        "      alarm = false;\n"
        "      unload(monitor); load(monitor);\n"
        "      if (parker_resumed) suspend(parker);\n"
        "      if (driver_suspended) resume(driver);\n"
        '    transitions: [{when: "after_ms(500)", to: REQUESTED}]\n'
    )
    access = made.arrangement.access
    assert {name for name, level in access.machines.items() if level} == {"monitor", "switch", "parker"}
    assert {name for name, level in access.write.items() if level} == {"speed", "alarm", "parking"}
    assert {name for name, level in access.command.items() if level} == {"driver", "parker"}


def test_rights_are_left_where_others_use_them():
    planner = (
        'planner: {inline: {machine: P, states: [{name: S, internal: "resume(driver); parking = 1;", stays: true}]}}'
    )
    text = DRIVING.replace("machines:\n", f"machines:\n  {planner}\n").replace("[driver,", "[planner, driver,")
    reactions = ["suspend driver", "resume parker"]
    made, _ = guarded(text, [SLOWLY], {"speed": "parking"}, reactions=reactions)
    assert made.names.rights.commanded == ("parker",)
    assert made.names.rights.substitutes == ()
    operated, _ = reacting("suspend", text=DRIVING + "operators: {resume: [driver]}\n")
    assert operated.names.rights.commanded == ()


EFFECTS = {
    "suspend": ("G (alarm -> X driver.suspended)", "G (switch@REQUESTED && X switch@REQUESTED -> X !driver.suspended)"),
    "resume": ("G (alarm -> X !parker.suspended)", "G (switch@REQUESTED && X switch@REQUESTED -> X parker.suspended)"),
    "restart": (
        "G (switch@REQUESTED -> X (switch@INSTEAD -> X driver@WAITS))",
        "G (switch@REQUESTED -> driver.loaded)",
    ),
    "load": ("G (alarm -> parker.loaded)", "G (switch@REQUESTED -> !parker.loaded)"),
    "unload": ("G (alarm -> !driver.loaded)", "G (switch@REQUESTED -> driver.loaded)"),
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_reactions_begin_with_the_alarm_and_end_with_it(kind):
    acts, ends = EFFECTS[kind]
    made, lines = reacting(kind, until="after_ms(300)")
    assert held(made, SLOWLY, f"acts: {acts}", f"ends: {ends}", "never: G !alarm") == [True, True, True, False]
    assert proved(made, lines).exit_code == 0
    assert isinstance(transparency(made.original, made.arrangement, made.names, Budget(Limits())), Transparent)
    for_good, lines = reacting(kind)
    assert held(for_good, f"acts: {acts}", "stays: G (switch@INSTEAD -> G switch@INSTEAD)") == [True, True]
    assert proved(for_good, lines).exit_code == 0
    same = transparency(for_good.original, for_good.arrangement, for_good.names, Budget(Limits()))
    assert isinstance(same, Transparent)


@pytest.mark.slow
def test_what_was_so_before_stays_so():
    """The parker is suspended at first, so the switch does not resume it."""
    made, _ = guarded(DRIVING, [SLOWLY], {"speed": "0"}, until="after_ms(300)", reactions=["suspend parker"])
    assert held(made, "always: G parker.suspended") == [True]


@pytest.mark.slow
def test_a_substitute_that_others_overwrite_is_no_proof():
    text = DRIVING.replace("internal: speed = pedal;", 'internal: "speed = pedal; parking = 0;"')
    made, lines = reacting("resume", text=text)
    proof = proved(made, lines)
    assert proof.exit_code == 1
    assert proof.reasons == ("`slow` is violated although `alarm` is set: the fallback does not keep it",)


HEATING = """\
name: heating
cycle_ms: 100
whiteboard:
  warm: {type: 0..20, role: input}
  on: {type: bool, role: output}
environment:
  inline:
    machine: Room
    variables: {t: {type: 0..20}}
    states:
      - name: S
        internal: "0..2 more = choose(0..2); t = on ? min(t + more, 20) : max(t - 1, 0); warm = t;"
        stays: true
machines:
  heater: {inline: {machine: H, states: [{name: S, internal: on = true;, stays: true}]}}
  cooler: {inline: {machine: C, states: [{name: S, internal: on = false;, stays: true}]}}
schedule: [heater]
pool: [cooler]
"""
MONITOR = """\
machine: Monitor
parameters: {alarm: {whiteboard: bool}}
states:
  - {name: SEES, internal: "alarm = warm > LIMIT || alarm && warm > 3;", stays: true}
"""


@pytest.mark.slow
@pytest.mark.parametrize(("limit", "code"), [(10, 0), (14, 1)])
def test_a_monitor_of_ones_own_reacts_without_a_fallback(limit, code):
    made, lines = guarded(
        HEATING,
        ["cool: G env.t < 15"],
        {},
        ("heater",),
        ("monitor.machine.yaml", MONITOR.replace("LIMIT", str(limit))),
        reactions=["unload heater", "load cooler"],
    )
    proof = proved(made, lines)
    assert proof.exit_code == code
    assert all("the reaction does not keep it, or the alarm came too late" in reason for reason in proof.reasons)
    again = "again: G (switch@INSTEAD -> X switch@INSTEAD)"
    ended = "ended: G (switch@REQUESTED -> heater.loaded && !cooler.loaded)"
    assert held(made, again, ended) == [False, True]


LOADED_AGAIN = """\
name: again
cycle_ms: 100
observe: cycle
whiteboard: {lamp: {type: bool, role: output}}
machines:
  boss: {inline: {machine: B, states: [{name: S, internal: unload(worker);, stays: true}]}}
  worker: {inline: {machine: W, states: [{name: S, internal: lamp = false;, stays: true}]}, on_fault: unload}
  helper: {inline: {machine: H, states: [{name: S, stays: true}]}, on_fault: unload}
schedule: [boss, helper, worker]
access: {levels: [low, high], machines: {boss: high, worker: high}, write: {lamp: high}, command: {worker: low}}
"""


@pytest.mark.slow
@pytest.mark.parametrize(("command", "verdict"), [("low", Verdict.VIOLATED), ("high", Verdict.HOLDS)])
def test_chaos_loads_again_what_others_unload(command, verdict):
    """The boss unloads the worker before each of its turns, and the helper may load it."""
    draft = draft_of(LOADED_AGAIN.replace("worker: low", f"worker: {command}"))
    chaos = resolve(with_chaos(draft, resolve(draft), ("worker", "helper"), {"lamp"}))
    assert verify(chaos, lines_of("dark: G !lamp"), Options(), "explicit").properties[0].verdict is verdict


@pytest.mark.parametrize(
    ("reactions", "code", "said"),
    [
        (["suspend drivr"], "E439", "there is no machine `drivr` to suspend"),
        (["suspend switch"], "E438", "a guard does not suspend its own parts"),
        (["load env"], "E438", "takes no commands"),
        (["suspend heater", "unload heater"], "E438", "two reactions, suspend and unload"),
        (["unload inner"], "E438", "is inside a state of another machine"),
    ],
)
def test_what_is_no_reaction_is_said_at_its_place(reactions, code, said):
    inner = "inner: {inline: {machine: I, states: [{name: S, stays: true}]}}"
    text = HEATING.replace("machines:\n", f"machines:\n  {inner}\n")
    text = text.replace("[heater]\npool: [cooler]", "[heater, inner, cooler]")
    text = text.replace("internal: on = true;, stays: true", "internal: on = true;, stays: true, runs: [inner]")
    with pytest.raises(DiagnosticError) as caught:
        guarded(text, ["p: G !on"], {"on": "false"}, ("heater",), reactions=reactions)
    (found,) = caught.value.diagnostics
    assert found.code == code and said in found.message
    assert found.span.text == reactions[-1].split()[1]


@pytest.mark.parametrize("kind", ["suspend", "restart", "unload"])
def test_what_the_policy_trusts_most_is_not_stopped(kind):
    trusted = DRIVING + "access: {levels: [low, high], machines: {parker: high}, write: {parking: high}}\n"
    with pytest.raises(DiagnosticError) as caught:
        guarded(trusted, [SLOWLY], {"speed": "parking"}, reactions=[f"{kind} parker"])
    assert [d.code for d in caught.value.diagnostics] == ["E438"]
    assert "has the highest clearance" in caught.value.diagnostics[0].message
    made, _ = guarded(trusted, [SLOWLY], {"speed": "parking"}, reactions=["resume parker"])
    assert made.names.rights.substitutes == ()
    assert made.arrangement.access.levels == ("low", "high", "guard")


TALLY = Counter()
SHOWN = {
    "suspend": "G (alarm -> X {0}.suspended)",
    "resume": "G (alarm -> X !{0}.suspended)",
    "restart": "G (alarm -> X !{0}.suspended)",
    "load": "G (alarm -> {0}.loaded)",
    "unload": "G (alarm -> !{0}.loaded)",
}


def agrees(data, seed):
    """Chaos allows what is explored, which is what runs show."""
    text, output = drawn(data)
    before = resolve(draft_of(text))
    kind, machine = data.draw(st.sampled_from(list(KINDS))), data.draw(st.sampled_from(before.machines)).name
    alike = [
        w.variable.name
        for w in before.whiteboard
        if w.role != "input" and w.variable.type == output.type and w.variable is not output
    ]
    start = scalar_text(output.init, output.type)
    fallback = data.draw(st.sampled_from([start, *alike]))
    until = data.draw(st.sampled_from([None, "true"]))
    try:
        made, lines = guarded(
            text,
            [f"p: G {output.name} == {start}"],
            {output.name: fallback},
            until=until,
            reactions=[f"{kind} {machine}"],
        )
    except DiagnosticError as error:
        if {d.code for d in error.diagnostics} <= NOT_GUARDABLE:
            reject()
        raise
    asked = lines_of(f"p: G {output.name} == {start}", f"acts: {SHOWN[kind].format(machine)}")
    limits = Limits(3_000, max_steps=100_000)
    proof = proved(made, lines, "explicit", limits)
    explored = verify(made.arrangement, asked, Options(limits), "explicit")
    if proof.result is not None and proof.result.properties[0].verdict is Verdict.HOLDS:
        TALLY["proved"] += 1
        assert explored.properties[0].verdict is not Verdict.VIOLATED
    for line, found in zip(asked.goals, explored.properties, strict=True):
        TALLY[f"{line.name} {found.verdict.value}"] += 1
        try:
            if found.verdict is Verdict.HOLDS:
                assert not violated(made.arrangement, lines_of(f"p: {line.text}"), seed)
        except BrokenProgramError:
            reject()
    if machine in made.names.rights.commanded and kind == "unload":
        assert explored.properties[1].verdict is not Verdict.VIOLATED


@pytest.mark.long
def test_runs_show_what_is_explored_and_proved():
    TALLY.clear()
    amount = settings(max_examples=many(200), suppress_health_check=SLOW)
    kinds = ["proved", "p holds", "p violated", "acts holds", "acts violated"]
    spread(agrees, amount, st.data(), st.integers(1, 1000), until=each(TALLY, kinds))

"""Guarded arrangements: their texts, and what is proved of them."""

import re
import time
from itertools import pairwise
from pathlib import Path

import pytest

from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.arrangement.resolve.arrangement import resolve
from llfsm_verify.checking.verdict import Options, Verdict
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.extensions.guards.chaos import with_chaos
from llfsm_verify.extensions.guards.guardable import guardable
from llfsm_verify.extensions.guards.transform import read_files
from llfsm_verify.language.trees import of_kind
from llfsm_verify.language.typed import Read
from llfsm_verify.limits import Limits
from llfsm_verify.logic.bounds import Clock
from llfsm_verify.verification.verify import verify
from tests.extensions.guards.helpers import draft_of, guarded, lines_of, proved, text_of

LIMITER = """\
name: limiter
cycle_ms: 100
whiteboard:
  pedal: {type: 0..9, role: input} # how far it is down
  speed: {type: 0..9, role: output}
  level:
    type: 0..9
    init: 3
    role: output
    safe: 0
machines:
  # Two of one kind.
  driver: {file: driver.machine.yaml, parameters: {out: speed, speed: speed}}
  idle:
    inline:
      machine: Idle
      states:
        - name: LOW
          on_entry: |
            level = speed; // not the speed of `fast`
            0..9 fast = speed;
            level = fast;
          transitions:
            - {when: speed > 5, to: HIGH}
        - name: HIGH
          on_entry: level++;
          transitions: [{when: level >= 9, to: LOW}]
schedule:
  - driver # first
  - idle
"""
DRIVER = """\
# It drives.
machine: Driver
parameters:
  out: {whiteboard: 0..9}
  speed: {whiteboard: 0..9} # called like the variable
states:
  - name: DRIVE
    internal: out = pedal + 0 * speed; // speed
    stays: true
"""


@pytest.fixture
def limiter(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("limiter.yaml").write_text(LIMITER)
    Path("driver.machine.yaml").write_text(DRIVER)
    return Path("limiter.yaml")


def test_names_change_where_they_mean_the_output_and_all_else_stays(limiter):
    made, _ = guarded(limiter, ["slow: G speed < 6", "few: G level < 8"], {"speed": "min(speed, 5)", "level": "0"})
    assert list(made.files) == [
        "limiter.yaml",
        "monitor.machine.yaml",
        "monitor_2.machine.yaml",
        "switch.machine.yaml",
        "driver.machine.yaml",
    ]
    assert made.files["driver.machine.yaml"] == DRIVER.replace("  speed:", "  speed_requested:").replace(
        "0 * speed;", "0 * speed_requested;"
    )
    expected = (
        LIMITER.replace(
            "{out: speed, speed: speed}}", "{out: speed_requested, speed_requested: speed_requested}, on_fault: unload}"
        )
        .replace("level = speed; // not", "level_requested = speed_requested; // not")
        .replace("fast = speed;\n            level =", "fast = speed_requested;\n            level_requested =")
        .replace("when: speed", "when: speed_requested")
        .replace("level++", "level_requested++")
        .replace("when: level", "when: level_requested")
    )
    kept = [line for line in made.files["limiter.yaml"].split("\n") if line in expected.split("\n")]
    assert kept == expected.split("\n")
    added = [line for line in made.files["limiter.yaml"].split("\n") if line not in expected.split("\n")]
    assert [re.sub(r", parameters.*", "", line.strip()) for line in added] == [
        "speed_requested: {type: 0..9, init: 0}",
        "level_requested: {type: 0..9, init: 3}",
        "alarm: {type: bool, init: false}",
        "on_fault: unload",
        "monitor: {file: monitor.machine.yaml",
        "monitor_2: {file: monitor_2.machine.yaml",
        "switch: {file: switch.machine.yaml}",
        "- monitor",
        "- monitor_2",
        "- switch",
        "observe: cycle",
        "access:",
        "levels: [behaviour, guard]",
        "machines: {monitor: guard, monitor_2: guard, switch: guard}",
        "write: {speed: guard, level: guard, alarm: guard}",
    ]


@pytest.mark.parametrize(
    ("file", "second"),
    [
        ("driver.machine.yaml", "driver_2.machine.yaml"),
        ("driver.yaml", "driver_2.yaml"),
        ("driver.v1.yaml", "driver.v1_2.yaml"),
    ],
)
def test_a_second_file_of_one_name_has_a_number_before_its_ending(limiter, file, second):
    for folder, text in (("a", DRIVER), ("b", DRIVER.replace("speed", "level"))):
        Path(folder).mkdir()
        Path(folder, file).write_text(text)
    other = f"other: {{file: b/{file}, parameters: {{out: level, level: level}}}}"
    text = LIMITER.replace("driver.machine.yaml", f"a/{file}").replace("  idle:\n", f"  {other}\n  idle:\n")
    limiter.write_text(text.replace("  - idle", "  - other\n  - idle"))
    made, _ = guarded(limiter, ["slow: G speed < 6"], {"speed": "min(speed, 5)"})
    assert list(made.files)[-2:] == [file, second]
    assert f"other: {{file: {second}" in made.files["limiter.yaml"]


def test_empty_mappings_get_all_that_is_added(limiter):
    text = LIMITER + "access:\n  levels: [low, high]\n  machines: {}\n  write: {}\n"
    made, _ = guarded(text, ["slow: G speed < 6", "few: G level < 8"], {"speed": "5", "level": "0"})
    access = made.arrangement.access
    assert set(access.machines.values()) == {2} and set(access.write) >= {"speed", "level", "alarm"}


def test_only_the_switch_knows_the_output(limiter):
    made, _ = guarded(limiter, ["slow: G speed < 6"], {"speed": "min(speed, 5)"})
    knowing = {
        machine.name
        for machine in made.arrangement.machines
        for read in of_kind(machine.states, Read)
        if read.variable.name == "speed"
    }
    assert knowing == {"switch"}


def test_whoever_suspends_all_does_not_suspend_the_guard(limiter):
    alone = LIMITER.replace("level++;", "level++; suspend_all();").replace("  - driver # first\n", "")
    alone = re.sub("  driver: .*\n", "", alone)
    made, _ = guarded(alone, ["few: G level < 8"], {"level": "0"})
    assert made.arrangement.access.refuses
    made, _ = guarded(LIMITER, ["few: G level < 8"], {"level": "0"})
    assert not made.arrangement.access.refuses


@pytest.mark.slow
def test_a_guard_is_proved_and_a_fallback_that_is_unsafe_is_told(limiter):
    made, lines = guarded(limiter, ["slow: G speed < 6"], {"speed": "min(speed, 5)"})
    proof = proved(made, lines)
    assert (proof.exit_code, proof.machines) == (0, ("driver", "idle"))
    made, lines = guarded(limiter, ["slow: G speed < 6"], {"speed": "min(speed, 6)"})
    proof = proved(made, lines)
    assert proof.exit_code == 1
    assert proof.reasons == ("`slow` is violated although `alarm` is set: the fallback does not keep it",)


@pytest.mark.slow
def test_chaos_for_a_machine_of_one_state_that_others_look_at():
    """It stays in its state, and does there in each turn what it likes."""
    state = {"name": "ON", "internal": "lamp = true;", "stays": True}
    watching = {"name": "S", "internal": "seen = m@ON;", "stays": True}
    machines = {
        "m": {"inline": {"machine": "M", "states": [state]}},
        "n": {"inline": {"machine": "N", "states": [watching]}},
    }
    whiteboard = {name: {"type": "bool", "role": "output"} for name in ("lamp", "seen")}
    draft = draft_of(text_of({"whiteboard": whiteboard, "machines": machines, "schedule": ["m", "n"]}))
    chaos = resolve(with_chaos(draft, resolve(draft), ("m",), {"lamp"}, commands=False))
    found = verify(chaos, lines_of("on: G m@ON", "off: G F !lamp", "lit: G F lamp"), Options(), "explicit")
    assert [p.verdict for p in found.properties] == [Verdict.HOLDS, Verdict.VIOLATED, Verdict.VIOLATED]


@pytest.mark.slow
def test_a_fallback_that_faults_is_no_proof(limiter):
    made, lines = guarded(limiter, ["slow: G speed < 6"], {"speed": "speed - 9"})
    proof = proved(made, lines)
    assert proof.exit_code == 1
    assert proof.result.faults.verdict is Verdict.VIOLATED
    reasons = [re.sub(r", .*?\)", ", …)", reason) for reason in proof.reasons]
    assert reasons == [
        "`idle` ends the run in a fault (F001, …) while `alarm` is set: correct `idle`, or guard it as well",
        "`switch` ends the run in a fault (F001, …) while `alarm` is set: correct the fallback",
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("world", "keep", "fallback", "said"),
    [
        ("x = x + speed;", "speed < 9", "0", "{model} leaves the range of `x` (F011, …) {any}: clamp it there"),
        ("x = min(x + speed, 9);", "speed < 9", "0", None),
        ("if (speed == 1) x = x + 5;", "speed != 1", "1", "{model} leaves the range of `x` (F011, …) {alarm}: clamp"),
        ("x = 9 / (9 - speed);", "speed < 10", "0", "{model} ends the run in a fault (F012, …) {any}: correct the"),
    ],
)
def test_a_fault_names_whose_it_is_and_whether_the_guard_had_taken_over(world, keep, fallback, said):
    """One of the surroundings is not blamed on the fallback."""
    driver = {"machine": "D", "states": [{"name": "S", "internal": "speed = 2;", "stays": True}]}
    model = {
        "machine": "W",
        "variables": {"x": {"type": "0..9"}},
        "states": [{"name": "S", "internal": f"see = 1; {world}"}],
    }
    board = {"speed": {"type": "0..9", "role": "output"}, "see": {"type": "0..1", "role": "input"}}
    document = {
        "cycle_ms": 100, "whiteboard": board, "environment": {"inline": model},
        "machines": {"driver": {"inline": driver}}, "schedule": ["driver"],
    }  # fmt: skip
    made, lines = guarded(text_of(document), [f"p: G {keep}"], {"speed": fallback}, guard_only=("driver",))
    found = [re.sub(r", .*?\)", ", …)", reason) for reason in proved(made, lines).reasons if "(F0" in reason]
    words = {"model": "the model of the surroundings", "any": "when the guarded machines do anything"}
    wanted = None if said is None else said.format(**words, alarm="while `alarm` is set")
    assert len(found) == (wanted is not None) and all(reason.startswith(str(wanted)) for reason in found), found


@pytest.mark.slow
def test_a_monitor_before_what_it_guards_is_too_slow(limiter):
    made, lines = guarded(limiter, ["slow: G speed < 6"], {"speed": "0"})
    first, *others = made.files
    text = made.files[first].replace(
        "  - driver # first\n  - idle\n  - monitor\n", "  - monitor\n  - driver\n  - idle\n"
    )
    draft = read_files({first: text, **{name: made.files[name] for name in others}}, Path("guarded"))
    arrangement = resolve(draft)
    chaos = resolve(with_chaos(draft, arrangement, made.names.guarded, {"speed"}))
    result = verify(chaos, lines, Options())
    assert [p.verdict for p in result.properties] == [Verdict.VIOLATED]


@pytest.mark.slow
def test_requests_count_again_after_a_time(limiter):
    made, lines = guarded(limiter, ["slow: G speed < 6"], {"speed": "0"}, until="after_ms(200)")
    assert proved(made, lines).exit_code == 0
    at_once, lines = guarded(limiter, ["slow: G speed < 6"], {"speed": "0"}, until="pedal < 3")
    assert proved(at_once, lines).exit_code == 0
    again = lines_of("again: G (alarm -> X X X alarm)")
    assert verify(made.arrangement, again, Options(), "explicit").properties[0].verdict is Verdict.VIOLATED
    made, lines = guarded(limiter, ["slow: G speed < 6"], {"speed": "0"})
    for_good = lines_of("for_good: G (alarm -> G alarm)")
    assert verify(made.arrangement, for_good, Options(), "explicit").properties[0].verdict is Verdict.HOLDS


@pytest.mark.slow
def test_a_guarded_arrangement_is_guarded_again(limiter, tmp_path):
    made, _ = guarded(limiter, ["slow: G speed < 6"], {"speed": "min(speed, 5)"})
    for name, text in made.files.items():
        (tmp_path / "once" / name).parent.mkdir(exist_ok=True)
        (tmp_path / "once" / name).write_text(text)
    twice, lines = guarded(tmp_path / "once" / "limiter.yaml", ["slower: G speed < 3"], {"speed": "2"})
    assert twice.names.guarded == ("switch",)
    assert twice.names.requests == {"speed": "speed_requested_2"}
    assert twice.arrangement.access.levels == ("behaviour", "guard", "guard_2")
    assert proved(twice, lines).exit_code == 0
    both = lines_of("slow: G speed < 6", "slower: G speed < 3")
    assert proved(twice, both).exit_code == 0


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("G speed < 6", None),
        ("G (pedal > 3 -> X speed < 6)", None),
        ("forbid p: [speed > 3] [speed < 2]", None),
        ("G (speed > 3 -> F[<=300ms] speed < 3)", None),
        ("G (speed > 3 -> O speed < 3)", None),
        ("G (speed > 3 -> F[>=300ms] speed < 3)", "not a safety property"),
        ("G (O speed > 3 -> F speed < 3)", "not a safety property"),
        ("G F speed < 6", "not a safety property"),
        ("G pedal < 6", "speaks of no output"),
        ("G (driver@DRIVE -> speed < 6)", "asks for the state of a machine"),
        ("G (driver.ran -> speed < 6)", "asks for a step"),
        ("G (sampled(pedal) < 3 -> speed < 6)", "asks what machines have sampled"),
        ("G (changed(speed) -> speed < 6)", "asks for the letter before"),
    ],
)
def test_what_cannot_be_guarded_is_said(limiter, text, reason):
    arrangement = resolve(draft_of(limiter))
    (line,) = lines_of(text if text.startswith("forbid") else f"p: {text}").goals
    found = guardable(line, arrangement, Clock(arrangement.cycle_ms))
    if reason is None:
        assert found.refusal is None
        assert found.outputs == ("speed",)
    else:
        assert reason in found.refusal.reason


def test_what_does_not_fit_is_said(limiter):
    def code(*arguments, **more):
        with pytest.raises(DiagnosticError) as caught:
            guarded(*arguments, **more)
        return {d.code for d in caught.value.diagnostics}

    assert code(limiter, ["G speed < 6"], {"sped": "0"}) == {"E439"}
    assert code(limiter, ["G speed < 6"], {"speed": "0"}, guard_only=("nobody",)) == {"E439"}
    pool = LIMITER.replace("  - idle\n", "pool: [idle]\n")
    assert code(pool, ["G level < 6"], {"level": "0"}) == {"E438"}
    two = LIMITER.replace("schedule:\n  - driver # first\n  - idle\n", "processes: {a: [driver], b: [idle]}\n")
    assert code(two, ["G level < 6"], {"level": "0"}) == {"E438"}
    alias = LIMITER.replace("speed: {type: 0..9", "speed: {type: &t 0..9").replace("    type: 0..9", "    type: *t")
    assert code(alias, ["G level < 6"], {"level": "0"}) == {"E438"}
    policy = LIMITER + "operators: {policy: [bob]}\naccess: {levels: [low], machines: {}, users: {bob: low}}\n"
    assert code(policy, ["G level < 6"], {"level": "0"}) == {"E438"}


@pytest.mark.parametrize(("written", "said"), [("speed", "does not write it"), ("level", "which has no class")])
def test_what_a_monitor_of_ones_own_must_not_write_is_said_at_its_place(limiter, written, said):
    own = f"machine: M\nstates: [{{name: S, internal: 'alarm = true; {written} = 1;', stays: true}}]\n"
    with pytest.raises(DiagnosticError) as caught:
        guarded(limiter, ["G speed < 6"], {"speed": "0"}, own=("own.machine.yaml", own))
    (found,) = caught.value.diagnostics
    assert (found.code, found.span.source.name, found.span.text) == ("E438", "own.machine.yaml", f"{written} = 1")
    assert said in found.message


KOMODO = Path("models/komodo_region")
REGION = "region: G (env.x >= -1.0 && env.x <= 1.0)"


def figure_2a(behaviour):
    """The stroll alone: it writes the speed itself."""
    text = (KOMODO / "stroll.yaml").read_text()
    text = text[: text.index("  monitor:")] + "schedule: [stroll]\n"
    text = text.replace("  wish: {type: Speed}\n  inhibit: {type: bool}\n", "")
    for name in ("world", "stroll"):
        text = text.replace(f"file: {name}.machine.yaml", f"file: {behaviour / name}.machine.yaml")
    return text


@pytest.fixture
def stroll(tmp_path):
    """The model's files with `speed` for `wish`, and the alarm for what inhibits."""
    for name in ("world", "stroll", "monitor"):
        text = (KOMODO / f"{name}.machine.yaml").read_text()
        (tmp_path / f"{name}.machine.yaml").write_text(
            text.replace("wish", "speed")
            .replace("inhibit", "alarm")
            .replace("edge", "0.83")
            .replace("parameters: {0.83: {constant: Metres}}\n", "")
        )
    return figure_2a(tmp_path), (tmp_path / "monitor.machine.yaml").read_text()


@pytest.mark.slow
def test_the_stroll_of_the_paper_is_kept_in_its_region_by_a_monitor_of_ones_own(stroll):
    text, monitor = stroll
    unguarded = verify(load_arrangement_text(text), lines_of(REGION), Options(), "explicit")
    assert unguarded.properties[0].verdict is Verdict.VIOLATED
    made, lines = guarded(text, [REGION], {"speed": "0.0"}, own=("monitor.machine.yaml", monitor))
    assert "speed_requested > 0 && position > 0.83" in made.files["monitor.machine.yaml"]
    assert proved(made, lines).exit_code == 0
    late = monitor.replace("0.83", "0.88")
    made, lines = guarded(text, [REGION], {"speed": "0.0"}, own=("monitor.machine.yaml", late))
    proof = proved(made, lines)
    assert proof.exit_code == 1
    assert "the alarm came too late" in proof.reasons[0]


FAULTY = sorted(Path("models/microwave").glob("faulty_*.yaml"))


@pytest.mark.slow
@pytest.mark.parametrize("path", FAULTY, ids=lambda path: path.stem)
def test_every_faulty_microwave_keeps_what_its_guard_prohibits(path):
    closed = "closed: G (door_open -> !motor)"
    made, lines = guarded(path, [closed], {"motor": "false"})
    assert proved(made, lines).exit_code == 0
    actual = verify(made.arrangement, lines, Options(), "explicit")
    assert [p.verdict for p in actual.properties] == [Verdict.HOLDS]


@pytest.mark.parametrize(
    "text", ["G (speed > 3 -> F[<=300ms] speed < 3)", "G (speed > 3 -> O (speed > 1 && speed < 4))"]
)
def test_bounds_in_time_and_the_past_are_kept(limiter, text):
    assert proved(*guarded(limiter, [text], {"speed": "2"})).exit_code == 0


@pytest.mark.slow
def test_the_time_limit_is_one_for_all_of_a_proof(limiter, monkeypatch):
    made, lines = guarded(limiter, ["p: G (speed < 6)"], {"speed": "speed"})
    given = []

    def slow(arrangement, properties, options, engine):
        given.append(options.limits.timeout)
        time.sleep(0.02)
        return verify(arrangement, properties, options, engine)

    monkeypatch.setattr("llfsm_verify.extensions.guards.proof.verify", slow)
    proved(made, lines, limits=Limits(timeout=60.0))
    assert len(given) > 1 and given[0] <= 60
    assert all(later <= before - 0.02 for before, later in pairwise(given)), given

"""`llfsm run`, `llfsm replay` of recordings and `llfsm check-recording`."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from llfsm_verify.runtime.recording.file import HEAD, MAGIC, PAGE, Recording
from tests.cli.running import FAULTY, LIGHTS, llfsm
from tests.processes import ended
from tests.runtime.recording.forging import begin_of, entries_of, sealed

PROPERTIES = "properties/traffic_lights.ltl"
ENDING = """\
name: ending
cycle_ms: 10
whiteboard: {n: {type: 0..5}}
machines:
  m:
    inline:
      machine: M
      states:
        - {name: A, internal: "n = n + 1;", transitions: [{when: "n == 3", to: B}]}
        - {name: B}
schedule: [m]
"""


@pytest.fixture
def ending(tmp_path: Path) -> str:
    """An arrangement that ends after some cycles."""
    path = tmp_path / "ending.yaml"
    path.write_text(ENDING)
    return str(path)


@pytest.mark.slow
def test_a_quiet_run_says_only_how_it_ended(ending: str, tmp_path: Path) -> None:
    for option in ("-q", "--quiet"):
        done = llfsm("run", ending, "--rate", "0", option, "-p", "small: G n < 6", "--record", str(tmp_path / option))
        assert (done.returncode, done.stderr, done.stdout.count("\n")) == (0, "", 1)
        assert done.stdout.startswith("5 cycles") and done.stdout.endswith("the arrangement has ended\n"), done.stdout


@pytest.mark.slow
def test_a_simulation_is_recorded_replayed_and_checked(tmp_path: Path) -> None:
    recording = str(tmp_path / "r")
    extent = ("--simulate", "--for", "120s", "--rate", "0", "--seed", "1")
    done = llfsm("run", LIGHTS, *extent, "--record", recording)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("120 cycles (360 ringlets), 120 s of logical time, in ")
    assert "recorded: " in done.stdout and "(122 frames)" in done.stdout
    done = llfsm("replay", recording)
    assert (done.returncode, done.stdout) == (0, f"{recording}: 122 frames, the same bit for bit, and then stopped\n")
    done = llfsm("check-recording", recording, PROPERTIES)
    assert done.returncode == 4 and "violated" not in done.stdout
    assert "because the recording ended before a verdict\n" in done.stdout
    done = llfsm("check-recording", recording, "-p", "G F ns@GREEN", "--allow-undecided", PROPERTIES)
    assert done.returncode == 0 and "because no finite part of a run decides it\n" in done.stdout
    Path(recording).write_bytes(Path(recording).read_bytes()[:-1])
    done = llfsm("check-recording", recording, PROPERTIES, "--allow-undecided")
    assert done.returncode == 4 and "because the recording ended before a verdict: the end of the file" in done.stdout


@pytest.mark.slow
def test_the_inputs_of_a_trace_violate_at_its_step(tmp_path: Path) -> None:
    text = "both: G !(ns@GREEN && ew@GREEN)"
    done = llfsm("verify", FAULTY, "-p", text, "-q", "--save-traces", str(tmp_path))
    assert done.returncode == 1
    recording = str(tmp_path / "r")
    trace = str(tmp_path / "both.trace.yaml")
    steps = sum(
        line.lstrip().startswith("- {machine") or "machine:" in line for line in Path(trace).read_text().split("\n")
    )
    done = llfsm("run", FAULTY, "--inputs", trace, "--rate", "0", "--record", recording)
    assert done.returncode == 0, done.stderr
    done = llfsm("replay", recording)
    assert done.returncode == 0, done.stdout
    done = llfsm("check-recording", recording, "-p", text)
    assert done.returncode == 1 and steps >= 65
    assert done.stdout == (f"violated  both  {text.partition(': ')[2]}\n                at step 65, in frame 23\n")


@pytest.mark.slow
def test_of_an_arrangement_that_ended_everything_is_decided(ending: str, tmp_path: Path) -> None:
    recording = str(tmp_path / "r")
    done = llfsm("run", ending, "--rate", "0", "--record", recording)
    assert done.returncode == 0 and done.stdout.split("\n")[0].endswith(": the arrangement has ended")
    lines = ("rises: F n == 3", "always: G n <= 3", "again: G F n == 2", "stays: F G n == 3", "never: G n != 3")
    options = [word for line in lines for word in ("-p", line)]
    done = llfsm("check-recording", recording, *options)
    assert done.returncode == 1
    found = {line.split()[1]: line.split()[0] for line in done.stdout.split("\n") if line[:1].strip()}
    assert found == {
        "rises": "satisfied", "always": "satisfied", "again": "violated", "stays": "satisfied", "never": "violated",
    }  # fmt: skip


@pytest.mark.slow
def test_formulas_without_names_are_told_apart(ending: str, tmp_path: Path) -> None:
    """As where they are verified."""
    recording = str(tmp_path / "r")
    assert llfsm("run", ending, "--rate", "0", "--record", recording).returncode == 0
    done = llfsm("check-recording", recording, "-p", "F n == 3", "-p", "G n < 3")
    assert done.returncode == 1 and [line.split()[:2] for line in done.stdout.split("\n") if line[:1].strip()] == [
        ["satisfied", "L1"], ["violated", "L2"]
    ]  # fmt: skip
    done = llfsm("check-recording", recording, "--syntax", "spin", "-p", "[] (n <= 3)")
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_a_fault_ends_a_run(tmp_path: Path) -> None:
    path, recording = tmp_path / "fault.yaml", str(tmp_path / "r")
    path.write_text(ENDING.replace("n == 3", "n == 9"))
    done = llfsm("run", str(path), "--rate", "0", "--record", recording)
    assert done.returncode == 1 and "fault[F001]: " in done.stdout and "5 ringlets" in done.stdout
    done = llfsm("replay", recording)
    assert done.returncode == 0 and done.stdout.endswith("and then fault\n")
    done = llfsm("check-recording", recording, "-p", "a: F n == 4", "-p", "b: F G n == 5")
    assert done.returncode == 4 and done.stdout.startswith("satisfied")


@pytest.mark.slow
def test_the_texts_in_a_recording_are_those_that_ran(ending: str, tmp_path: Path) -> None:
    """The file may change, or be gone."""
    recording = str(tmp_path / "r")
    assert llfsm("run", ending, "--rate", "0", "--record", recording).returncode == 0
    Path(ending).write_text(ENDING.replace("n == 3", "n == 2"))
    assert llfsm("replay", recording).returncode == 0
    done = llfsm("replay", recording, "--arrangement", ending)
    assert done.returncode == 1 and ": differs: frame " in done.stdout


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (("run", LIGHTS, "--set", "car"), 2),
        (("run", LIGHTS, "--set", "bus=1"), 2),
        (("run", LIGHTS, "--seed", "1"), 2),
        (("run", LIGHTS, "--for", "1 week"), 2),
        (("run", LIGHTS, "--for", "0s"), 2),
        (("run", LIGHTS, "--rate", "1e400"), 2),
        (("run", LIGHTS, "--rate", "0.000001"), 2),
        (("run", LIGHTS, "--priority", "100"), 2),
        (("check-recording", LIGHTS, "--from", "csv"), 2),
    ],
)
def test_wrong_usage(arguments: tuple[str, ...], code: int) -> None:
    done = llfsm(*arguments)
    assert done.returncode == code and done.stderr.startswith("error: ")


@pytest.mark.slow
def test_what_cannot_run(ending: str, tmp_path: Path) -> None:
    done = llfsm("run", "models/komodo_region/arrangement.yaml", "--for", "1s", "--rate", "0")
    assert done.returncode == 3 and "error[E483]" in done.stderr and "(`model: true`)" in done.stderr
    untimed = tmp_path / "untimed.yaml"
    untimed.write_text(ENDING.replace("cycle_ms: 10", "timing: untimed"))
    done = llfsm("run", str(untimed), "--rate", "0")
    assert done.returncode == 3 and "error[E483]" in done.stderr and "--cycle-ms" in done.stderr
    assert llfsm("run", str(untimed), "--rate", "0", "--cycle-ms", "5").returncode == 0
    done = llfsm("run", ending, "--rate", "0", "--cycle-ms", "5")
    assert done.returncode == 3 and "10 ms, not 5 ms" in done.stderr


def test_the_trace_of_several_processes_is_not_repeated(ending: str, tmp_path: Path) -> None:
    text = ENDING.replace("schedule: [m]", "processes: {p: [m], q: [k]}")
    machine = text[text.index("  m:") : text.index("processes")]
    Path(ending).write_text(text.replace(machine, machine + machine.replace("  m:", "  k:")))
    done = llfsm("verify", ending, "-p", "p: G n < 2", "-q", "--save-traces", str(tmp_path))
    assert done.returncode == 1, done.stderr
    done = llfsm("run", ending, "--inputs", str(tmp_path / "p.trace.yaml"))
    assert done.returncode == 3 and "error[E484]" in done.stderr


@pytest.mark.slow
def test_files_that_are_no_recordings(ending: str, tmp_path: Path) -> None:
    recording = tmp_path / "r"
    assert llfsm("run", ending, "--rate", "0", "--record", str(recording)).returncode == 0
    done = llfsm("run", ending, "--rate", "0", "--record", str(recording))
    assert done.returncode == 3 and "error[E480]" in done.stderr and "there already" in done.stderr
    done = llfsm("check-recording", ending, "-p", "F n == 1")
    assert done.returncode == 3 and "error[E481]" in done.stderr
    later = tmp_path / "later"
    later.write_bytes(b"llfsm-verify recording 3\n")
    done = llfsm("check-recording", str(later), "-p", "F n == 1")
    assert done.returncode == 3 and "of another version" in done.stderr
    for header in (
        {"words": 0}, {"words": 30}, {"words": 30, "arrangement": "a.yaml", "files": {"../../../etc/x": "name: x"}},
        {"words": 30, "arrangement": "a.yaml", "files": {"/etc/x": "name: x"}},
        {"words": 30, "cycle_ms": "1/0", "arrangement": "a.yaml", "files": {}},
    ):  # fmt: skip
        later.write_bytes(sealed((MAGIC + json.dumps(header).encode()).ljust(PAGE - 1) + b"\n", []))
        done = llfsm("replay", str(later))
        assert done.returncode == 3 and "error[E" in done.stderr, (header, done)
    data = recording.read_bytes()
    head = data[: begin_of(data) - HEAD].replace(b"n == 3", b"n == 4")
    later.write_bytes(sealed(head, entries_of(recording)))
    done = llfsm("replay", str(later))
    assert done.returncode == 3 and "error[E482]" in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("snapshot", ["ringlet", "none", "cycle"])
def test_an_input_that_nobody_reads_is_recorded(snapshot: str, ending: str, tmp_path: Path) -> None:
    text = ENDING.replace("n: {type: 0..5}", "n: {type: 0..5}, x: {type: bool, role: input}")
    Path(ending).write_text(text + f"profile: {{base: llfsm, snapshot: {snapshot}}}\n")
    recording = str(tmp_path / "r")
    assert llfsm("run", ending, "--rate", "0", "--record", recording, "--set", "x=true").returncode == 0
    assert llfsm("check-recording", recording, "-p", "G !x").returncode == 1


@pytest.mark.slow
def test_an_input_that_never_changes(ending: str, tmp_path: Path) -> None:
    text = ENDING.replace("n: {type: 0..5}", "n: {type: 0..5}, k: {type: 1..4, role: input, changes: never}")
    Path(ending).write_text(text.replace("n == 3", "n == k"))
    recording = str(tmp_path / "r")
    assert llfsm("run", ending, "--rate", "0", "--record", recording, "--set", "k=4").returncode == 0
    assert llfsm("replay", recording).returncode == 0
    assert llfsm("check-recording", recording, "-p", "F n == 4 && G k == 4").returncode == 0
    done = llfsm("run", ending, "--rate", "0", "--set", "k=9")
    assert done.returncode == 2 and "`9` is not a number from 1 to 4" in done.stderr


LARGE = """\
name: large
cycle_ms: 10
whiteboard: {x: {type: uint64, role: input}, s: {type: int64, role: input}, y: {type: uint64}, big: {type: bool}}
machines:
  m:
    inline:
      machine: M
      states:
        - {name: S, internal: "y = x; big = x > 9223372036854775808;", transitions: [{when: "false", to: S}]}
schedule: [m]
"""


@pytest.mark.slow
def test_numbers_of_64_bits(tmp_path: Path) -> None:
    path, recording = tmp_path / "large.yaml", str(tmp_path / "r")
    path.write_text(LARGE)
    done = llfsm("run", str(path), "--rate", "0", "--for", "50ms", "--record", recording, "--set", f"x={(1 << 64) - 1}")
    assert done.returncode == 0, done.stderr
    assert llfsm("replay", recording).returncode == 0
    done = llfsm(
        "check-recording", recording, "-p", "a: F big", "-p", "b: F x > 18446744073709551614", "-p", "c: F y < 5"
    )
    assert done.stdout.split().count("satisfied") == 3 and done.returncode == 0, done.stdout
    Path(recording).unlink()
    done = llfsm("run", str(path), "--rate", "0", "--for", "90ms", "--simulate", "--seed", "3", "--record", recording)
    assert done.returncode == 0 and llfsm("replay", recording).returncode == 0
    assert llfsm("check-recording", recording, "-p", "F big", "-p", "neg: F s < 0").returncode == 0
    done = llfsm(
        "verify",
        str(path),
        "--engine",
        "bmc",
        "-p",
        "p: G !(x == 18446744073709551615 && y == x)",
        "-q",
        "--save-traces",
        str(tmp_path),
    )
    assert done.returncode == 1, done.stderr
    Path(recording).unlink()
    trace = str(tmp_path / "p.trace.yaml")
    assert llfsm("run", str(path), "--rate", "0", "--inputs", trace, "--record", recording).returncode == 0
    assert llfsm("replay", recording).returncode == 0
    done = llfsm("check-recording", recording, "-p", "G !(x == 18446744073709551615 && y == x)")
    assert done.returncode == 1, done.stdout


BEFORE = """\
name: before
cycle_ms: 10
whiteboard: {bad: {type: bool}, n: {type: 0..1}}
machines:
  a:
    inline:
      machine: A
      states:
        - {name: S, internal: "bad = true;", transitions: [{when: "false", to: S}]}
  b:
    inline:
      machine: B
      states:
        - {name: S, internal: "if (bad) n = n + 2;", transitions: [{when: "false", to: S}]}
schedule: [a, b]
"""


@pytest.mark.slow
def test_what_comes_before_a_fault_in_its_cycle_counts(tmp_path: Path) -> None:
    path, recording = tmp_path / "before.yaml", str(tmp_path / "r")
    path.write_text(BEFORE)
    done = llfsm("run", str(path), "--rate", "0", "--record", recording)
    assert done.returncode == 1 and "1 ringlet)" in done.stdout and "fault[F001]" in done.stdout
    assert llfsm("replay", recording).returncode == 0
    assert llfsm("verify", str(path), "-q", "-p", "G !bad").returncode == 1
    done = llfsm("check-recording", recording, "-p", "G !bad")
    assert done.returncode == 1 and "at step 1, in frame 2" in done.stdout


@pytest.mark.slow
def test_what_speaks_of_inputs_is_open_after_the_end(ending: str, tmp_path: Path) -> None:
    Path(ending).write_text(ENDING.replace("n: {type: 0..5}", "n: {type: 0..5}, x: {type: bool, role: input}"))
    recording = str(tmp_path / "r")
    assert llfsm("run", ending, "--rate", "0", "--record", recording).returncode == 0
    done = llfsm("check-recording", recording, "-p", "a: G !x", "-p", "b: F n == 3", "-p", "c: F G n == 3")
    assert done.returncode == 4 and "because inputs may change after the end" in done.stdout
    assert done.stdout.split().count("satisfied") == 2


@pytest.mark.slow
def test_a_recording_that_was_cut_is_damaged(ending: str, tmp_path: Path) -> None:
    recording = tmp_path / "r"
    assert llfsm("run", ending, "--rate", "0", "--record", str(recording)).returncode == 0
    data = recording.read_bytes()
    begin = begin_of(data) - HEAD
    for end in (begin, begin + 8, begin + HEAD, len(data) - 1):
        recording.write_bytes(data[:end])
        done = llfsm("replay", str(recording))
        assert done.returncode == 3 and "damaged" in done.stdout + done.stderr, end


@pytest.mark.slow
def test_another_arrangement_than_the_recorded_one(ending: str, tmp_path: Path) -> None:
    recording = str(tmp_path / "r")
    assert llfsm("run", ending, "--rate", "0", "--record", recording).returncode == 0
    Path(ending).write_text(ENDING.replace("n: {type: 0..5}", "n: {type: 0..5}, k: {type: 0..7}"))
    done = llfsm("check-recording", recording, "-p", "G n < 9", "--arrangement", ending)
    assert done.returncode == 3 and "error[E482]" in done.stderr
    done = llfsm("replay", recording, "--arrangement", ending)
    assert done.returncode == 1 and "differs" in done.stdout


@pytest.mark.slow
def test_a_run_of_several_processes_takes_the_time_it_is_given(tmp_path: Path) -> None:
    """Also when one of them has ended."""
    path = tmp_path / "two.yaml"
    text = BEFORE.replace("schedule: [a, b]", "processes: {p: [a], q: [b]}").replace("n = n + 2", "n = 1")
    machine = text[text.index("  a:") : text.index("  b:")]
    path.write_text(text.replace(machine, "  a: {inline: {machine: A, states: [{name: S}]}}\n"))
    done = llfsm("run", str(path), "--rate", "0", "--for", "300ms")
    assert done.returncode == 0 and done.stdout.startswith("30 cycles "), done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("ends", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_signal_ends_a_run(ends: signal.Signals, tmp_path: Path) -> None:
    """After the cycle under way; after `kill -9` the process of the loop notices, and ends the run."""
    recording = tmp_path / "r"
    command = [sys.executable, "-m", "llfsm_verify", "run", LIGHTS, "--simulate", "--seed", "2", "--rate", "1000"]
    process = subprocess.Popen([*command, "--record", str(recording)], stdout=subprocess.PIPE, text=True)
    try:
        while not recording.exists() or frames(recording) < 20:
            assert process.poll() is None
            time.sleep(0.02)
        process.send_signal(ends)
        said, _ = ended(process)
    finally:
        if process.poll() is None:
            process.kill()
            process.wait()
    done = llfsm("replay", str(recording))
    assert done.returncode == 0, done.stdout
    if ends == signal.SIGKILL:
        assert process.returncode == -signal.SIGKILL and done.stdout.endswith("and then died\n")
    else:
        assert process.returncode == 0 and "stopped" in said and done.stdout.endswith("and then stopped\n")


def frames(path: Path) -> int:
    """How many can be read now."""
    try:
        with Recording(path) as recording:
            return sum(1 for _ in recording)
    except Exception:  # noqa: BLE001 - its header is not written yet
        return 0

"""Monitors in the loop against properties decided on the recording, ringlet by ringlet."""

from __future__ import annotations

from collections import Counter
from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.runtime.deciding.recordings import check
from llfsm_verify.runtime.live.plan import plan
from llfsm_verify.runtime.live.run import Run
from llfsm_verify.runtime.recording.file import Recorder, Recording
from llfsm_verify.runtime.recording.origin import header_of
from llfsm_verify.testing.arrangements import Document, arrangements
from tests.cli.running import FAULTY, LIGHTS, llfsm
from tests.quick import each, examples, many, spread

KINDS = ("violated", "satisfied", "undecided")


def agree(folder: Path, count: int) -> None:
    tally: Counter[str] = Counter()

    def compare(document: Document, seed: int) -> None:
        given = build_arrangement(document)
        places = [f"{m.name}@{s.name}" for m in given.machines for s in m.states]
        pick = [places[(seed >> 3 * i) % len(places)] for i in range(4)]
        text = f"a: G !{pick[0]}\nb: F {pick[1]}\nc: {pick[2]} W {pick[3]}\nd: G ({pick[1]} -> X X {pick[2]})\n"
        sources = [Source("p", text)]
        how = plan(given, simulated=True, cycle_ms=given.cycle_ms or Fraction(10), properties=parse_properties(sources))
        loop = how.loop(how.code(), period=0, seed=seed, rounds=30)
        path = folder / "r"
        path.unlink(missing_ok=True)
        header = header_of((), how.arrangement, simulated=True, seed=seed, free=how.free, properties=sources)
        run = Run(loop, Recorder(path, header, loop))
        run.start()
        assert run.wait()
        verdicts = {name: (verdict, frame or None) for name, verdict, frame in run.report.monitored}
        with Recording(path) as recording:
            found = {d.line.name: d for d in check(how.arrangement, parse_properties(sources), recording)}
        for name, (verdict, frame) in verdicts.items():
            tally[verdict] += 1
            if found[name].step is not None or verdict != "undecided":
                assert (found[name].verdict, found[name].frame) == (verdict, frame), name

    amount = settings(max_examples=count, deadline=None, suppress_health_check=list(HealthCheck))
    spread(compare, amount, arrangements(), st.integers(1, 1 << 40), size=10, until=each(tally, KINDS))


@pytest.mark.slow
def test_verdicts_are_those_of_the_recording(tmp_path: Path) -> None:
    agree(tmp_path, examples(10))


@pytest.mark.long
def test_verdicts_are_those_of_many_recordings(tmp_path: Path) -> None:
    agree(tmp_path, many(300))


@pytest.mark.slow
@pytest.mark.parametrize("together", ["separate", "together"])
def test_a_violation_ends_the_run_where_it_is_asked_to(together: str, tmp_path: Path) -> None:
    recording = str(tmp_path / "r")
    options = ("--simulate", "--seed", "3", "--rate", "0", "--for", "300s", "--processes", together)
    both = ("-p", "both: G !(ns@GREEN && ew@GREEN)", "-p", "once: F ns@AMBER", "-p", "again: G F ns@GREEN")
    done = llfsm("run", FAULTY, *options, *both, "--record", recording, "--on-violation", "stop")
    assert done.returncode == 1 and "stopped, because a property was violated" in done.stdout
    assert "violated: both (in frame 23)" in done.stdout and "satisfied: once (in frame" in done.stdout
    assert "`again` is not monitored: no finite part of a run decides it" in done.stderr
    assert "frames, the same bit for bit, and then violated" in llfsm("replay", recording).stdout
    assert "at step 65, in frame 23" in llfsm("check-recording", recording, *both).stdout
    done = llfsm("run", LIGHTS, *options, *both)
    assert done.returncode == 0 and "undecided: both\n" in done.stdout


@pytest.mark.slow
def test_the_first_letter_may_end_a_run(tmp_path: Path) -> None:
    recording = str(tmp_path / "r")
    options = ("--simulate", "--seed", "3", "--rate", "0", "--for", "300s", "--record", recording)
    done = llfsm("run", LIGHTS, *options, "-p", "never: G !ns@RED", "--on-violation", "stop")
    assert done.returncode == 1 and done.stdout.startswith("0 cycles (0 ringlets)")
    assert "violated: never (in frame 1)" in done.stdout
    assert "2 frames, the same bit for bit, and then violated" in llfsm("replay", recording).stdout


@pytest.mark.slow
def test_runs_that_break_an_assumption_do_not_count(tmp_path: Path) -> None:
    """No run that satisfies the assumption satisfies the property, so it is violated whatever happens."""
    recording = str(tmp_path / "r")
    lines = ("-p", "assume never: G !ns@GREEN", "-p", "once: F ns@GREEN")
    done = llfsm(
        "run", LIGHTS, "--simulate", "--seed", "3", "--rate", "0", "--for", "9s", *lines, "--record", recording
    )
    assert done.returncode == 1 and "violated: once (in frame 1)" in done.stdout
    assert "before the first step" in llfsm("check-recording", recording, *lines).stdout


@pytest.mark.slow
def test_what_is_decided_in_a_cycle_that_fails_has_its_frame(tmp_path: Path) -> None:
    texts = {
        "a.yaml": "name: failing\ncycle_ms: 10\nmachines: {a: {file: a.machine.yaml}, b: {file: b.machine.yaml}}\n"
        "schedule: [a, b]\nobserve: ringlet\n",
        "a.machine.yaml": "machine: A\ninitial: S\nstates:\n"
        "  - {name: S, transitions: [{when: 'true', to: T}]}\n  - {name: T}\n",
        "b.machine.yaml": "machine: B\nvariables: {n: {type: '0..3', init: 3}}\ninitial: S\n"
        "states: [{name: S, on_entry: n = n + 1;}]\n",
    }
    for name, text in texts.items():
        (tmp_path / name).write_text(text)
    done = llfsm("run", str(tmp_path / "a.yaml"), "--rate", "0", "-p", "moved: F a@T")
    assert done.returncode == 1 and "satisfied: moved (in frame 2)" in done.stdout, done.stderr


@pytest.mark.slow
def test_a_recording_whose_properties_are_damaged(tmp_path: Path) -> None:
    recording = tmp_path / "r"
    given = ("-p", "G !(ns@GREEN && ew@GREEN)", "-p", "once: F ns@AMBER")
    assert llfsm("run", LIGHTS, "--rate", "0", "--for", "9s", *given, "--record", str(recording)).returncode == 0
    assert "the same bit for bit" in llfsm("replay", str(recording)).stdout
    data = recording.read_bytes()
    for old, new in (
        (b"F ns@AMBER", b"F ns@AMBRE"), (b"F ns@AMBER", b"F ( ns@AMB"), (b'"syntax": "llfsm"', b'"syntax": "llfsx"'),
        (b'"<command line>", [', b'12345678901234.5, ['),
    ):  # fmt: skip
        assert data.count(old) == 1 and len(old) == len(new)
        recording.write_bytes(data.replace(old, new))
        for command in ("replay", "check-recording"):
            more = () if command == "replay" else ("-p", "G true")
            done = llfsm(command, str(recording), *more)
            assert done.returncode == 3 and "error[E481]" in done.stderr, (new, done)

"""Recordings as saved traces: tests perform what has happened, and find what the recording says."""

from __future__ import annotations

from collections import Counter
from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.diagnostics import DiagnosticError, Source, Span
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.runtime.deciding.piece import piece_of
from llfsm_verify.runtime.deciding.recordings import check
from llfsm_verify.runtime.live.plan import plan
from llfsm_verify.runtime.live.run import Run
from llfsm_verify.runtime.recording import UNSAVED
from llfsm_verify.runtime.recording.file import Recorder, Recording
from llfsm_verify.runtime.recording.origin import header_of
from llfsm_verify.testing.arrangements import Document, arrangements
from llfsm_verify.verification.replay import Replayed, replay_file
from tests.cli.running import FAULTY, LIGHTS, llfsm
from tests.quick import each, examples, many, spread

KINDS = ("violated", "holds", "fault")
BOTH = "both: G !(ns@GREEN && ew@GREEN)"


class Pieces:
    """Random runs, and what becomes of their recordings."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / "r"
        self.trace = folder / "p.trace.yaml"
        self.tally: Counter[str] = Counter()

    def __call__(self, document: Document, seed: int) -> None:
        given = build_arrangement(document)
        places = [f"{m.name}@{s.name}" for m in given.machines for s in m.states]
        ran = self.recorded(given, seed)
        place = places[(seed >> 4) % len(places)]
        lines = parse_properties([Source("p", f"a: G !{place}" if seed % 3 else f"b: F {place}")])
        with Recording(self.path) as recording:
            (decided,) = check(ran, lines, recording)
            done = self.performed(given, ran, lines, recording, None)
            if done is None:
                return
            assert (done.found == "violated") == (decided.verdict == "violated")
            if decided.verdict != "violated" or not decided.step:
                return
            assert len(done.file.steps) == decided.step
            shorter = self.performed(given, ran, lines, recording, decided.step - 1)
        assert shorter is not None
        assert (shorter.found, len(shorter.file.steps)) == ("holds", decided.step - 1)

    def recorded(self, given: Arrangement, seed: int) -> Arrangement:
        how = plan(given, simulated=True, cycle_ms=given.cycle_ms or Fraction(10))
        loop = how.loop(how.code(), period=0, seed=seed, rounds=30)
        self.path.unlink(missing_ok=True)
        header = header_of((), how.arrangement, simulated=True, seed=seed, free=how.free)
        run = Run(loop, Recorder(self.path, header, loop))
        run.start()
        assert run.wait()
        if run.report.ending == "fault":
            with Recording(self.path) as recording:
                done = self.performed(given, how.arrangement, PropertySet(), recording, None)
            assert done is None or done.found == "violated"
            self.tally["fault"] += done is not None
        return how.arrangement

    def performed(
        self, given: Arrangement, ran: Arrangement, lines: PropertySet, recording: Recording, last: int | None
    ) -> Replayed | None:
        """What a test makes of the trace; None: an untimed arrangement has choices of its own, which no run makes."""

        def load(path: str, /, *, named_at: Span | None = None) -> Arrangement:
            return given

        try:
            piece = piece_of(recording, given, lines, self.trace.parent, last)
        except DiagnosticError as error:
            if error.diagnostics[0].code != UNSAVED or ran.timing == given.timing:
                raise
            self.tally["untimed"] += 1
            return None
        self.trace.write_text(piece.text)
        done = replay_file(str(self.trace), "a", load)
        assert done.found == done.file.expect
        self.tally[done.file.expect] += 1
        return done


def pieces(folder: Path, count: int) -> None:
    check = Pieces(folder)
    amount = settings(max_examples=count, deadline=None, suppress_health_check=list(HealthCheck))
    spread(check, amount, arrangements(), st.integers(1, 1 << 40), size=10, until=each(check.tally, KINDS[:2]))


@pytest.mark.slow
def test_random_recordings_fail_in_tests_where_they_failed(tmp_path: Path) -> None:
    pieces(tmp_path, examples(5))


@pytest.mark.long
def test_many_random_recordings_fail_in_tests_where_they_failed(tmp_path: Path) -> None:
    pieces(tmp_path, many(300))


@pytest.mark.slow
def test_a_recording_of_the_inputs_of_a_trace_becomes_this_trace(tmp_path: Path) -> None:
    found, made, recording = tmp_path / "both.trace.yaml", tmp_path / "made.trace.yaml", str(tmp_path / "r")
    llfsm("verify", FAULTY, "-p", BOTH, "--save-traces", str(tmp_path))
    llfsm("run", FAULTY, "--simulate", "--inputs", str(found), "--rate", "0", "--for", "40s", "--record", recording)
    convert = ("trace", recording, "--arrangement", FAULTY)
    done = llfsm(*convert, "-p", BOTH, "-o", str(made))
    assert done.returncode == 0 and "both is violated by 65 steps (expect: violated)" in done.stderr, done
    assert made.read_text() == found.read_text()
    done = llfsm(*convert, "-p", BOTH, "--to", "trace", "--steps", ":64")
    assert "both is not violated by 64 steps (expect: holds)" in done.stderr and "expect: holds" in done.stdout
    for options, code, said in (
        (("-p", BOTH, "--to", "trace", "--steps", "9:64"), 2, "a saved trace begins where the run begins: --steps :64"),
        (("-p", BOTH, "-p", "G ns@RED", "--to", "trace"), 2, "a saved trace has one property, besides assumptions"),
        (("-p", BOTH, "--to", "csv"), 2, "-p says what a saved trace shows: it is for --to trace"),
        (("--to", "trace"), 3, "no fault ends the recording, and no property says what it shows"),
        (("-p", BOTH, "--to", "trace", "--arrangement", LIGHTS), 3, "error[E482]"),
    ):
        done = llfsm(*convert, *options)
        assert done.returncode == code and said in done.stderr, (options, done)
    assert llfsm("trace", recording, "--to", "trace", "-p", BOTH).returncode == 2
    assert "is not a recording" in llfsm("trace", str(found), "--to", "trace", "--arrangement", FAULTY).stderr


ENDING = """
name: ending
cycle_ms: 10
whiteboard: {d: {type: 0..1, init: 1, role: input}, x: {type: 0..9, init: 3}}
machines:
  m: {inline: {machine: M, states: [{name: A, internal: x = 6 / d;, transitions: [{when: x > 3, to: B}]}, {name: B}]}}
schedule: [m]
"""


@pytest.mark.slow
def test_runs_that_end_and_runs_that_fail(tmp_path: Path) -> None:
    arrangement, made = tmp_path / "a.yaml", str(tmp_path / "made.trace.yaml")
    arrangement.write_text(ENDING)
    for d, line, said in (
        (1, "F x == 4", "L1 is violated by"), (1, "F x == 6", "L1 is not violated by"),
        (0, None, "a fault ends 1 step"),
    ):  # fmt: skip
        recording = str(tmp_path / f"r{d}{line}")
        llfsm("run", str(arrangement), "--rate", "0", "--for", "1s", "--set", f"d={d}", "--record", recording)
        asked = () if line is None else ("-p", line)
        done = llfsm("trace", recording, "-o", made, "--arrangement", str(arrangement), *asked)
        assert done.returncode == 0 and said in done.stderr, done
        assert llfsm("replay", made).returncode == 0

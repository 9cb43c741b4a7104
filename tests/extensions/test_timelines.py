"""Timelines, read back by readers that are not ours."""

from __future__ import annotations

import csv
import json
import signal as signals
from collections import Counter
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.program.program import Int
from llfsm_verify.report.timeline.formats import TIMELINES
from llfsm_verify.runtime.recording.replay import replay
from llfsm_verify.runtime.recording.timeline import NANOSECONDS, UNTIMED_CYCLE, Row, Signal, Timeline, recorded
from llfsm_verify.testing.arrangements import Document, arrangements
from llfsm_verify.values import text
from tests.cli.running import FAULTY, llfsm
from tests.quick import AtLeast, examples, spread
from tests.runtime.live import runs


def write(timeline: Timeline, name: str, path: Path) -> None:
    with path.open("wb") as file:
        TIMELINES.load(name)(timeline, file)


def read_csv(path: Path) -> list[list[str]]:
    with path.open(newline="", encoding="utf-8") as file:
        _, *rows = csv.reader(file)
    return [row[3:-1] for row in rows]


def strings(path: Path) -> dict[str, list[tuple[int, str]]]:
    """Changes of the signals whose values are words, which vcdvcd does not read."""
    names, found, time = {}, {}, 0
    for line in path.read_text(encoding="utf-8").splitlines():
        words = line.split()
        if line.startswith("$scope"):
            scope = words[2]
        elif line.startswith("$var string"):
            names[words[3]] = f"{scope}.{words[4]}"
        elif line.startswith("#"):
            time = int(line[1:])
        elif line.startswith("s"):
            found.setdefault(names[words[1]], []).append((time, words[0][1:]))
    return found


def read_vcd(path: Path, timeline: Timeline, rows: list[Row]) -> list[list[str]]:
    """The values at the time of each row."""
    before = signals.getsignal(signals.SIGPIPE)
    from vcdvcd import VCDVCD  # which lets a broken pipe end the process

    signals.signal(signals.SIGPIPE, before)

    found, worded = VCDVCD(str(path)), strings(path)
    length = UNTIMED_CYCLE if timeline.cycle_ms is None else int(timeline.cycle_ms * NANOSECONDS)
    times = [0]
    for row in rows[1:]:
        times.append(max(row.cycle * length, times[-1] + 1))
    columns = []
    for signal in timeline.signals:
        scope, _, name = signal.name.rpartition(".")
        full = f"{scope or 'arrangement'}.{name}"
        if signal.labels:
            changes = worded[full]
            columns.append([next(value for at, value in reversed(changes) if at <= time) for time in times])
            continue
        values = [
            found[next(key for key in found.signals if key == full or key.startswith(full + "["))][time]
            for time in times
        ]
        columns.append([number_text(signal, value) for value in values])
    return [list(row) for row in zip(*columns, strict=True)] if columns else [[] for _ in rows]


def number_text(signal: Signal, value: str) -> str:
    if signal.type.digits:
        return f"{Decimal(value):.{signal.type.digits}f}"
    if signal.type.boolean:
        return {"0": "false", "1": "true"}[value]
    number, low, high = int(value, 2), signal.type.low, signal.type.high
    if low < 0 and number > high:
        number -= 1 << 1 + max(high.bit_length(), (-low - 1).bit_length())
    return str(number)


def read_mcap(path: Path, timeline: Timeline) -> list[list[str]]:
    from mcap.reader import make_reader

    found = []
    with path.open("rb") as file:
        for _, _, message in make_reader(file).iter_messages():
            values = json.loads(message.data)
            row = []
            for signal in timeline.signals:
                value = values[signal.name]
                digits = signal.type.digits and not signal.labels
                row.append(f"{Decimal(str(value)):.{signal.type.digits}f}" if digits else text(value))
            found.append(row)
    return found


def read_itf(path: Path, timeline: Timeline) -> list[list[str]]:
    trace = json.loads(path.read_text(encoding="utf-8"))
    assert trace["#meta"]["format"] == "ITF" and trace["vars"] == [signal.name for signal in timeline.signals]
    assert [state["#meta"]["index"] for state in trace["states"]] == [*range(len(trace["states"]))]
    values = [[state[name] for name in trace["vars"]] for state in trace["states"]]
    return [[text(int(v["#bigint"]) if isinstance(v, dict) else v) for v in state] for state in values]


def test_the_loop_of_a_trace_for_apalache(tmp_path: Path) -> None:
    rows = [Row(step, step, (step, 1 << 60)) for step in range(5)]
    signals = (Signal("n", "variable", Int(0, 9), ()), Signal("wide", "variable", Int(0, 1 << 62), ()))
    write(Timeline("looping", signals, rows, Fraction(20), 3, begins=1), "itf", tmp_path / "itf")
    trace = json.loads((tmp_path / "itf").read_text())
    assert trace["loop"] == 3 and trace["states"][3]["#meta"] == {
        "index": 3, "step": 3, "cycle": 3, "time_ms": 40.0, "fired": [],
    }  # fmt: skip
    assert trace["states"][4]["n"] == 4 and trace["states"][4]["wide"] == {"#bigint": str(1 << 60)}


@pytest.mark.long
def test_others_read_what_is_written(tmp_path: Path) -> None:
    tally: Counter[str] = Counter()

    def check(document: Document, seed: int) -> None:
        given = build_arrangement(document)
        code = runs.code_of(given)
        _, turns = runs.recorded(code, tmp_path / "r", 12, seed)
        rows = list(recorded(given, code, replay(code, turns)).rows)
        wanted = [[text(value) for value in row.values] for row in rows]
        for name, read in (("csv", lambda path, _: read_csv(path)), ("mcap", read_mcap), ("itf", read_itf)):
            timeline = recorded(given, code, replay(code, turns))
            write(timeline, name, tmp_path / name)
            assert read(tmp_path / name, timeline) == wanted, name
        timeline = recorded(given, code, replay(code, turns))
        write(timeline, "vcd", tmp_path / "vcd")
        assert read_vcd(tmp_path / "vcd", timeline, rows) == wanted
        write(recorded(given, code, replay(code, turns)), "svg", tmp_path / "svg")
        drawn = "".join(ET.parse(tmp_path / "svg").getroot().itertext())
        assert all(signal.name in drawn for signal in timeline.signals)
        tally["rows"] += len(rows)
        tally["decimals"] += any(signal.type.digits for signal in timeline.signals)

    amount = settings(max_examples=examples(12), deadline=None, suppress_health_check=list(HealthCheck))
    spread(
        check,
        amount,
        arrangements(),
        st.integers(1, 1 << 40),
        size=6,
        until=AtLeast(tally, {"rows": 40, "decimals": 1}),
    )


@pytest.mark.slow
def test_a_trace_and_its_run_over_time(tmp_path: Path) -> None:
    """The same inputs, so the same values where cycles end."""
    llfsm("verify", FAULTY, "-p", "both: G !(ns@GREEN && ew@GREEN)", "--save-traces", str(tmp_path))
    saved = str(next(tmp_path.glob("*both*")))
    recording = str(tmp_path / "r")
    assert llfsm("run", FAULTY, "--inputs", saved, "--rate", "0", "--record", recording).returncode == 0
    of_trace = list(csv.DictReader(llfsm("trace", saved, "--to", "csv").stdout.splitlines()))
    of_run = list(csv.DictReader(llfsm("trace", recording, "--to", "csv").stdout.splitlines()))
    steps = {row["step"]: row for row in of_trace}
    assert len(of_run) > 10 and "GREEN" in of_trace[-1]["ns"] and any("->" in row["fired"] for row in of_trace)
    for row in of_run[:-2]:
        assert {**row, "fired": "", "time_ms": ""} == {**steps[row["step"]], "fired": "", "time_ms": ""}
    # A step has the time at which its cycle begins, a frame that at which it is over.
    assert (steps["6"]["time_ms"], of_run[2]["step"], of_run[2]["time_ms"]) == ("1000", "6", "2000")
    part = list(csv.DictReader(llfsm("trace", recording, "--to", "csv", "--steps", "7:15").stdout.splitlines()))
    assert [row["step"] for row in part] == ["6", "9", "12", "15"]


@pytest.mark.slow
def test_wrong_uses(tmp_path: Path) -> None:
    recording = str(tmp_path / "r")
    assert llfsm("run", FAULTY, "--rate", "0", "--for", "9s", "--record", recording).returncode == 0
    for options in ((), ("-o", "t.csv", "--to", "vcd"), ("--to", "mcap"), ("--to", "csv", "--steps", "5"),
                    ("--to", "csv", "--steps", "9:3"), ("--to", "png")):  # fmt: skip
        assert llfsm("trace", recording, *options).returncode == 2, options
    done = llfsm("trace", recording, "-o", str(tmp_path / "no" / "t.csv"))
    assert done.returncode == 3 and "error[E487]" in done.stderr
    assert llfsm("trace", str(tmp_path / "none"), "--to", "csv").returncode == 3
    data = Path(recording).read_bytes()
    Path(recording).write_bytes(data[:-1])
    done = llfsm("trace", recording, "--to", "csv")
    assert done.returncode == 3 and "damaged" in done.stderr and done.stdout.count("\n") > 5
    done = llfsm("trace", recording, "--to", "trace", "--arrangement", FAULTY, "-p", "a: G true")
    assert done.returncode == 3 and "damaged" in done.stderr and "expect: holds" in done.stdout


@pytest.mark.slow
def test_traces_of_a_check_as_timelines(tmp_path: Path) -> None:
    """The same as `llfsm trace` makes of the trace files, and no file of others is replaced."""
    both = ("-p", "both: G !(ns@GREEN && ew@GREEN)", "-p", "served: G F ew@GREEN")
    formats = ("csv", "vcd", "itf", "svg")
    options = [word for name in formats for word in ("--save-as", name)]
    for _ in range(2):
        assert llfsm("verify", FAULTY, *both, "-q", "--save-traces", str(tmp_path / "t"), *options).returncode == 1
    for name in ("both", "served"):
        for wanted in formats:
            made = tmp_path / f"made.{wanted}"
            arguments = (str(tmp_path / "t" / f"{name}.trace.yaml"), "--to", wanted, "-o", str(made))
            assert llfsm("trace", *arguments).returncode == 0
            saved = tmp_path / "t" / f"{name}{TIMELINES[wanted].suffixes[0]}"
            assert saved.read_bytes() == made.read_bytes(), saved
    assert llfsm("verify", FAULTY, *both, "--save-as", "csv").returncode == 2
    (tmp_path / "u").mkdir()
    (tmp_path / "u" / "served.csv").write_text("mine")
    done = llfsm("verify", FAULTY, *both, "-q", "--save-traces", str(tmp_path / "u"), "--save-as", "csv")
    assert done.returncode == 3 and "error[E405]" in done.stderr and not (tmp_path / "u" / "both.trace.yaml").exists()

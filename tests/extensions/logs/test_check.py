"""Logs of others: recordings written as logs have the verdicts of the recordings."""

from __future__ import annotations

import json
import re
from collections import Counter
from datetime import UTC, datetime
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from random import Random

import jsonschema
import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.loader import build_arrangement, load_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.problem import bind
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.extensions.logs.check import LogReading
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.report.schema import SCHEMAS
from llfsm_verify.report.timeline.formats import TIMELINES
from llfsm_verify.runtime.deciding.letters import SlotLetters
from llfsm_verify.runtime.deciding.logs import LOGS
from llfsm_verify.runtime.deciding.recordings import Decided, check
from llfsm_verify.runtime.live.frame import ENDING, ENDINGS
from llfsm_verify.runtime.live.plan import plan
from llfsm_verify.runtime.live.run import Run
from llfsm_verify.runtime.recording.file import Recorder, Recording
from llfsm_verify.runtime.recording.origin import code_of, free_of, header_of
from llfsm_verify.runtime.recording.replay import replay
from llfsm_verify.runtime.recording.timeline import recorded
from llfsm_verify.testing.arrangements import Document, arrangements
from tests.cli.running import llfsm
from tests.quick import each, examples, many, spread

KINDS = ("violated", "satisfied", "undecided")
PLANT = """\
name: plant
cycle_ms: 10
types: {Mode: [IDLE, BUSY]}
whiteboard:
  x: {type: bool, role: input}
  n: {type: 0..9}
  v: {type: {decimal: 0.1, range: -5.0..5.0}}
  mode: {type: Mode}
  a: {type: {array: 0..3, size: 2}}
machines:
  m: {inline: {machine: M, states: [{name: A, transitions: [{when: x, to: B}]}, {name: B}]}}
schedule: [m]
"""


def check_log(arrangement: Arrangement, properties: PropertySet, log: str, mapping: str, form: str) -> list[Decided]:
    return LogReading(arrangement, properties, mapping, log).check(form)


def agree(folder: Path, count: int, formats: tuple[str, ...]) -> None:
    tally: Counter[str] = Counter()

    def compare(document: Document, seed: int) -> None:
        if len(document.get("processes", ())) > 1 or re.search("load|pool|on_fault", repr(document)):
            return  # `observe: cycle` needs a single process, and no column says whether a machine is loaded
        given = build_arrangement({**document, "observe": "cycle"})
        places = [f"{m.name}@{s.name}" for m in given.machines for s in m.states]
        pick = [places[(seed >> 3 * i) % len(places)] for i in range(4)]
        text = f"a: G !{pick[0]}\nb: F {pick[1]}\nc: {pick[2]} W {pick[3]}\nd: G ({pick[1]} -> X X {pick[2]})\n"
        inputs = [w.variable.name for w in given.whiteboard if w.role == "input" and str(w.variable.type) == "bool"]
        if inputs:
            text += f"e: G ({pick[0]} -> X {inputs[0]})\nf: G !rose({inputs[0]})\n"
        text += f"g: G !fell({pick[0]})\nh: F changed({pick[1]})\n"
        properties = parse_properties([Source("p", text)])
        how = plan(given, simulated=True, cycle_ms=given.cycle_ms or Fraction(10))
        loop = how.loop(how.code(), period=0, seed=seed, rounds=20)
        path = folder / "r"
        path.unlink(missing_ok=True)
        run = Run(loop, Recorder(path, header_of((), how.arrangement, simulated=True, seed=seed, free=how.free), loop))
        run.start()
        assert run.wait()
        with Recording(path) as recording:
            expected = check(how.arrangement, properties, recording)
            code = code_of(recording, how.arrangement)
            for form in formats:
                turns = list(replay(code, recording, free_of(recording, code.program)))
                if ENDINGS[turns[-1].frame[ENDING]] != "ended":
                    turns.pop()  # the frame that says so is no letter
                log, mapping = folder / f"log.{form}", folder / "mapping.yaml"
                with log.open("wb") as file:
                    TIMELINES.load(form)(recorded(how.arrangement, code, turns), file)
                problem = bind(how.arrangement, PropertySet())
                slots = SlotLetters(problem, problem.program(keep_all_bits=True)).slots
                columns: dict[str, object] = {name: name for name in slots}
                mapping.write_text(json.dumps({"columns": columns}))
                found = check_log(how.arrangement, properties, str(log), str(mapping), form)
                for one, other in zip(expected, found, strict=True):
                    tally[other.verdict] += 1
                    if other.verdict == "undecided":  # an arrangement that has ended says more
                        assert one.verdict == "undecided" or one.step is None
                    else:
                        assert (one.verdict, one.frame) == (other.verdict, other.step), one.line.name

    amount = settings(max_examples=count, deadline=None, suppress_health_check=list(HealthCheck))
    spread(compare, amount, arrangements(), st.integers(1, 1 << 40), size=10, until=each(tally, KINDS))


@pytest.mark.slow
def test_verdicts_on_a_recording_as_csv_are_those_on_the_recording(tmp_path: Path) -> None:
    agree(tmp_path, examples(8), ("csv",))


@pytest.mark.long
def test_verdicts_on_recordings_as_logs_are_those_on_the_recordings(tmp_path: Path) -> None:
    agree(tmp_path, many(60), ("csv", "mcap"))


@pytest.fixture
def plant(tmp_path: Path) -> Path:
    (tmp_path / "plant.yaml").write_text(PLANT)
    return tmp_path


def decide(folder: Path, log: str, mapping: str, *lines: str, name: str = "log.csv") -> list[tuple[str, int | None]]:
    """Verdict and row of each line."""
    (folder / "mapping.yaml").write_text(mapping)
    (folder / name).write_text(log)
    properties = parse_properties([Source("p", "\n".join(lines))])
    arrangement = load_arrangement(str(folder / "plant.yaml"))
    found = check_log(
        arrangement, properties, str(folder / name), str(folder / "mapping.yaml"), LOGS.named_by(name) or ""
    )
    return [(d.verdict, d.step) for d in found]


LOG = "t,car,count,state,volts,mode\n0,open,1,Off,0.26,IDLE\n1,shut,2,On,-1,BUSY\n\n2,open,2,On,0.34,BUSY\n"
MAPPING = """\
columns:
  x: {column: car, values: {open: true, shut: false}}
  n: {column: count, scale: 2, offset: 1}
  m: {column: state, values: {Off: A, On: B}}
  v: {column: volts, round: nearest}
  mode: mode
time: t
"""


def test_cells_are_converted(plant: Path) -> None:
    lines = (
        "G (x || n == 5)",
        "G !(m@B && n == 5 && !x)",
        "F mode == BUSY",
        "G F x",
        "G v >= -1.0",
        "F (v == 0.3 && m@A)",
    )
    assert decide(plant, LOG, MAPPING, *lines) == [
        ("undecided", None), ("violated", 2), ("satisfied", 2),
        ("undecided", None), ("undecided", None), ("satisfied", 1),
    ]  # fmt: skip


def test_the_last_row_repeats_forever_where_the_mapping_says_so(plant: Path) -> None:
    lines = ("G F x", "F G m@A", "G (m@B -> X m@B)", "G (n == 3 -> F[<=10ms] m@B)")
    mapping = MAPPING.replace("time: t", "ended: true\ntime: {column: t, unit: ms}")
    assert decide(plant, LOG, mapping, *lines) == [
        ("satisfied", None), ("violated", None), ("satisfied", None), ("satisfied", None)
    ]  # fmt: skip
    # After the last row, at 2 ms, there is one every 10 ms.
    lines = ("F[<=11ms] G m@A", "F (m@A && F[5ms:12ms] m@B)", "G (!x -> F[8ms:10ms] m@B)", "G (!x -> F[11ms:11ms] m@B)")
    assert [verdict for verdict, _ in decide(plant, LOG, mapping, *lines)] == [
        "violated", "satisfied", "violated", "satisfied"
    ]  # fmt: skip
    (plant / "plant.yaml").write_text(PLANT.replace("cycle_ms: 10", "timing: untimed"))
    assert decide(plant, LOG, mapping, lines[0], "F x") == [("undecided", None), ("satisfied", 1)]


TIMED = "columns: {x: fire, mode: {column: alarm, values: {'1': BUSY, '0': IDLE}}}\ntime: t\n"
SOON = "G (x -> F[<=2s] mode == BUSY)"


def decided_at(folder: Path, times: str, mapping: str, *lines: str, fire: int = 1) -> list[tuple[object, ...]]:
    """The rows have these times; there is a fire in the row `fire`, from 0, and the alarm is on in the last row."""
    stamps = times.split()
    rows = [f"{t},{int(i == fire)},{int(i == len(stamps) - 1)}\n" for i, t in enumerate(stamps)]
    (folder / "log.csv").write_text("t,fire,alarm\n" + "".join(rows))
    (folder / "mapping.yaml").write_text(mapping)
    properties = parse_properties([Source("p", "\n".join(lines))])
    arrangement = load_arrangement(str(folder / "plant.yaml"))
    found = check_log(arrangement, properties, str(folder / "log.csv"), str(folder / "mapping.yaml"), "csv")
    return [(d.verdict, d.step, d.time, d.deadline) for d in found]


@pytest.mark.parametrize(
    ("times", "expected"),
    [
        ("0.0 1.0 11.0 12.0", ("violated", 3, "11.0", "3")),
        ("0.0 0.1 0.2 0.3 0.4 0.5 0.6", ("undecided", None, None, None)),
        ("0 1 3 3", ("undecided", None, None, None)),  # rows of one instant: the deadline is not over
        ("0 1 3 3.000000000000000000000000000001", ("violated", 4, "3.000000000000000000000000000001", "3")),
        ("-1.5 -1.25 0.75", ("undecided", None, None, None)),
        ("-1.5 -2.5e0", "line 3, column `t`: the time falls from -1.5 to -2.5e0"),
        ("0 1 3 2.9", "line 5, column `t`: the time falls from 3 to 2.9"),
        ("0 noon 2", "line 3, column `t`: `noon` is neither a number nor a date with a time"),
        ("2026-01-02T23:59:59Z 2026-01-02T23:59:59.5Z 2026-01-03T00:00:01.500001Z",
         ("violated", 3, "2026-01-03T00:00:01.500001Z", "2026-01-03T00:00:01.5+00:00")),
        ("2026-01-02T23:59:59Z 2026-01-02T23:59:59.5Z 2026-01-03T00:00:01.500000001Z",
         ("violated", 3, "2026-01-03T00:00:01.500000001Z", "2026-01-03T00:00:01.5+00:00")),
        ("9999-12-31T23:59:58Z 9999-12-31T23:59:59Z", ("undecided", None, None, None)),
        ("2026-01-02T23:59:59Z 2026-01-02T23:59:59.5", "is a date without a zone, and times before it are a date with"),
        ("2026-01-02T23:59:59Z 1767398400", "`1767398400` is a number, and times before it are a date with a zone"),
        ("2026-02-30T00:00:00 1", "`2026-02-30T00:00:00` is not a time"),
        ("5", ("undecided", None, None, None)),
    ],
)  # fmt: skip
def test_bounds_compare_the_times_of_rows(plant: Path, times: str, expected: object) -> None:
    if isinstance(expected, str):
        with pytest.raises(DiagnosticError) as error:
            decided_at(plant, times, TIMED, SOON)
        (found,) = error.value.diagnostics
        assert found.code == "E497" and expected in found.message and found.hint
    else:
        assert decided_at(plant, times, TIMED, SOON) == [expected]


def test_times_have_a_unit_and_none_may_be_missing(plant: Path) -> None:
    for unit, at in (("ms", "0 1000 3000 3001"), ("us", "0 1000000 3000000 3000001"), ("ns", "0 1000000000 4e9 4e9")):
        mapping = TIMED.replace("time: t", f"time: {{column: t, unit: {unit}}}")
        assert decided_at(plant, at, mapping, SOON)[0][:2] == ("violated", 4 if unit != "ns" else 3)
    with pytest.raises(DiagnosticError, match="`unit` cannot be `h`"):
        decided_at(plant, "0 1", TIMED.replace("time: t", "time: {column: t, unit: h}"), SOON)
    (plant / "log.csv").write_text("t,fire,alarm\n0,0,0\n,1,0\n")
    with pytest.raises(DiagnosticError, match="line 3, column `t`: the row has no time"):
        decide(plant, "t,fire,alarm\n0,0,0\n,1,0\n", TIMED, SOON)


def test_a_decimal_comma_in_a_time_is_told_its_point(plant: Path) -> None:
    with pytest.raises(DiagnosticError) as error:
        decide(plant, 't,fire,alarm\n"0,5",0,0\n', TIMED, SOON)
    assert [d.hint for d in error.value.diagnostics] == ["write `0.5`"]


def test_without_times_rows_are_cycles_and_bounds_need_their_length(plant: Path) -> None:
    untimed = TIMED.replace("time: t\n", "")
    assert decided_at(plant, "0 1 2", untimed, "G (x -> F[<=10ms] mode == BUSY)")[0][0] == "undecided"
    (found,) = decided_at(plant, "0 1 2 3", untimed, "G (x -> F[<=10ms] mode == BUSY)")
    assert found[:2] == ("violated", 3)
    for line, row in (
        ("G (x -> O[1:3] mode == BUSY)", 2),
        ("G (mode == BUSY -> O[0:1] x)", 4),
        ("G (mode == BUSY -> O[0:2] x)", None),
        ("G (mode == BUSY -> O[<=10ms] x)", 4),
        ("G (mode == BUSY -> O[<=20ms] x)", None),
        ("G (H[1:2] x -> x)", 1),
        ("G (H[10ms:20ms] !x -> x)", 1),
    ):
        assert decided_at(plant, "0 1 2 3", untimed, line)[0][:2] == ("violated" if row else "undecided", row), line
    (plant / "plant.yaml").write_text(PLANT.replace("cycle_ms: 10", "timing: untimed"))
    with pytest.raises(DiagnosticError) as error:
        decided_at(plant, "0 1 2", untimed, SOON)
    assert error.value.diagnostics[0].code == "E336"
    assert decided_at(plant, "0 1 11 12", TIMED, SOON) == [("violated", 3, "11", "3")]  # stamps need no cycle


def test_assumptions_may_have_bounds_in_time(plant: Path) -> None:
    lines = ("assume quiet: G[<=5s] !x", "alarm: G[<=9s] mode == IDLE")
    assert decided_at(plant, "0 6 7 8", TIMED, *lines)[0][:2] == ("violated", 4)
    assert decided_at(plant, "0 1 7 8", TIMED, *lines)[0][:2] == ("satisfied", 2)  # the assumption is broken before
    lines = (lines[0], "forbid hurry: [x] [true]")
    assert decided_at(plant, "0 6 7 8", TIMED, *lines)[0][0] == "undecided"
    (plant / "log.csv").write_text("t,fire,alarm\n0,0,0\n")
    arrangement, of_past = load_arrangement(str(plant / "plant.yaml")), [Source("p", "F O F[<=1s] x")]
    log, mapping = str(plant / "log.csv"), str(plant / "mapping.yaml")
    (found,) = check_log(arrangement, parse_properties(of_past), log, mapping, "csv")
    assert found.verdict == "undecided" and "a past operator that speaks of the future" in found.reason


ASKED = (
    "G (x -> F[<=2s] mode == BUSY)", "F[1s:3s] x", "G[<=4s] !(x && mode == BUSY)", "x U[<=5s] mode == BUSY",
    "mode == IDLE R[<=3s] x", "G (rose(x) -> F[<=1500ms] fell(x))", "F (x && X[2] F[<=500ms] mode == IDLE)",
    "G (changed(mode) -> O x)", "F O F[<=1s] x", "G[>=2s] (x -> Y !x || H x)", "F G[<=2s] x", "G F[<=20ms] x",
    "G (mode == BUSY -> O[<=2s] x)", "F (H[1s:3s] x && F[<=1s] mode == BUSY)", "G (x S[0:2] mode == BUSY || F[<=1s] x)",
    "F (x T[500ms:2s] mode == BUSY)", "G (x -> O[1:3] mode == BUSY)", "G H[>=2s] x", "F H[0:2] (x || mode == BUSY)",
)  # fmt: skip


@pytest.mark.parametrize("seed", range(12))
def test_verdicts_on_random_times_are_those_of_the_definition(plant: Path, seed: int) -> None:
    random = Random(seed)
    rows, now = [], Fraction(random.randrange(-3, 3))
    for _ in range(random.randrange(1, 12)):
        rows.append((now, random.random() < 0.4, random.random() < 0.4))
        now += random.choice([Fraction(0), Fraction(1, 2), Fraction(1), Fraction(9, 8), Fraction(4)])
    log = "t,fire,alarm\n" + "".join(f"{float(t)},{int(x)},{int(y)}\n" for t, x, y in rows)
    open_end = decide(plant, log, TIMED, *ASKED)
    ended = decide(plant, log, TIMED + "ended: true\n", *ASKED)
    word = [frozenset({*(["x"] if x else []), *(["busy"] if y else [])}) for _, x, y in rows]
    delays = [1000 * (b[0] - a[0]) for a, b in pairwise(rows)] + [Fraction(10)]
    for text, (early, row), (verdict, _) in zip(ASKED, open_end, ended, strict=True):
        plain = text.replace("mode == IDLE", "!busy").replace("mode == BUSY", "busy")
        plain = plain.replace("rose(x)", "(x && Y !x)").replace("fell(x)", "(!x && Y x)")
        plain = plain.replace("changed(mode)", "((busy && Y !busy) || (!busy && Y busy))")
        (line,) = parse_properties([Source("p", f"a: {plain}")]).properties
        assert line.formula is not None
        holds = evaluate(line.formula, word[:-1], word[-1:], delays)
        assert verdict == ("satisfied" if holds else "violated"), text
        assert early in ("undecided", verdict), text
        assert (early == "undecided") == (row is None)


def test_rows_tell_what_rose_fell_and_changed(plant: Path) -> None:
    log = "t,fire,alarm\n" + "".join(f"{t},{x},{y}\n" for t, x, y in [(0, 1, 0), (1, 1, 1), (2, 0, 1), (3, 1, 1)])
    lines = ("F rose(x)", "F fell(x)", "F changed(mode)", "F rose(x && mode == BUSY)", "F[<=2s] fell(x)")
    assert decide(plant, log, TIMED, *lines) == [("satisfied", row) for row in (4, 3, 2, 2, 3)]
    with pytest.raises(DiagnosticError, match="no column gives `n`"):
        decide(plant, log, TIMED, "F changed(n)")


def test_elements_of_arrays_have_columns_of_their_own(plant: Path) -> None:
    mapping = "columns: {'a[0]': p, 'a[1]': q}"
    assert decide(plant, "p,q\n1,2\n3,2\n", mapping, "G a[1] == 2", "G a[0] < 3") == [
        ("undecided", None),
        ("violated", 2),
    ]


WRONG = [
    (LOG, MAPPING, "G a[1] == 0", "E498", "no column gives `a[1]`"),
    (LOG, MAPPING, "F m.ran", "E498", "asks what happened in a step"),
    (LOG, MAPPING.replace("column: car", "column: bus"), "F x", "E496", "there is no column `bus`"),
    (LOG, MAPPING.replace("  x:", "  y:"), "F x", "E496", "there is no slot `y`"),
    (LOG, MAPPING.replace("Off: A", "Off: C"), "F x", "E496", "m: `C` is not one of A, B"),
    (LOG, MAPPING.replace("scale: 2", "scale: two"), "F x", "E496", "`scale` cannot be `two`"),
    (LOG, MAPPING + "topic: t\n", "F x", "E496", "a log of this format has no topics"),
    (LOG, MAPPING + "ended: perhaps\n", "F x", "E035", "`ended` cannot be `perhaps`"),
    (LOG, MAPPING.replace("round: nearest", "scale: 1"), "F x", "E497", "column `volts` (`v`): `0.26` is not a mult"),
    (LOG.replace("shut", "gone"), MAPPING, "F x", "E497", "line 3, column `car` (`x`): `gone` is not one of open"),
    (LOG.replace("shut", ""), MAPPING, "F x", "E497", "line 3, column `car` (`x`): the cell has no value"),
    (LOG.replace(",2,On,-1", ",5,On,-1"), MAPPING, "F x", "E497", "`5` is outside 0..9"),
    (LOG.replace("1,shut,2", "1,2"), MAPPING, "F x", "E497", "line 3 has 5 cells, and the first has 6"),
    (LOG.replace("t,car", "car,car"), MAPPING, "F x", "E497", "line 1: two columns are called `car`"),
    (LOG.partition("\n")[0] + "\n", MAPPING, "F x", "E497", "the log has no rows"),
    ("", MAPPING, "F x", "E497", "its first line names no columns"),
]  # fmt: skip


@pytest.mark.parametrize(("log", "mapping", "line", "code", "said"), WRONG)
def test_what_is_wrong_is_said(plant: Path, log: str, mapping: str, line: str, code: str, said: str) -> None:
    with pytest.raises(DiagnosticError) as error:
        decide(plant, log, mapping, line)
    (found,) = error.value.diagnostics
    assert found.code == code and said in found.message and found.hint


def test_mappings_are_described_by_a_schema(plant: Path) -> None:
    import yaml

    schema = SCHEMAS.load("mapping")("mapping")
    jsonschema.Draft202012Validator.check_schema(schema)
    jsonschema.validate(yaml.safe_load(MAPPING + "ended: true\ntopic: t\nformat: 1\n"), schema)
    jsonschema.validate(yaml.safe_load(MAPPING.replace("time: t", "time: {column: t, unit: ns}")), schema)
    for wrong in ("{}", "columns: {}", "columns: {x: {values: {}}}", "columns: {x: c}\nmore: 1"):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(yaml.safe_load(wrong), schema)


@pytest.mark.slow
def test_parquet_is_read_in_batches(plant: Path) -> None:
    import pyarrow as pa
    from pyarrow.parquet import write_table

    rows = 100_000
    table = pa.table({"count": [1] * (rows - 1) + [4], "ok": [True] * rows, "volts": [0.5] * rows})
    write_table(table, plant / "log.parquet")
    (plant / "mapping.yaml").write_text("columns: {n: count, x: ok, v: volts}")
    arrangement = load_arrangement(str(plant / "plant.yaml"))
    properties = parse_properties([Source("p", "G n < 4\nG (x && v == 0.5)")])
    found = check_log(arrangement, properties, str(plant / "log.parquet"), str(plant / "mapping.yaml"), "parquet")
    assert [(d.verdict, d.step) for d in found] == [("violated", rows), ("undecided", None)]


@pytest.mark.slow
def test_other_topics_have_their_last_message_beside_a_row(plant: Path) -> None:
    from mcap.writer import Writer

    with (plant / "log.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start()
        channels = {t: writer.register_channel(t, "json", 0) for t in ("/a", "/b")}
        for time, (topic, data) in enumerate([("/b", {"ok": True}), ("/a", {"p": {"n": 1}}), ("/b", {"ok": False}),
                                              ("/b", {"ok": True}), ("/a", {"p": {"n": 2}})]):  # fmt: skip
            writer.add_message(channels[topic], time, json.dumps(data).encode(), time)
        writer.finish()
    (plant / "mapping.yaml").write_text("columns: {n: p.n, x: '/b:ok'}\ntopic: /a\ntime: log_time\n")
    arrangement = load_arrangement(str(plant / "plant.yaml"))
    properties = parse_properties([Source("p", "G x\nF n == 2\nF[<=1ms] n == 2")])  # times in nanoseconds
    found = check_log(arrangement, properties, str(plant / "log.mcap"), str(plant / "mapping.yaml"), "mcap")
    assert [(d.verdict, d.step, d.time) for d in found] == [
        ("undecided", None, None), ("satisfied", 2, "4"), ("satisfied", 2, "4")
    ]  # fmt: skip


@pytest.mark.slow
def test_numbers_as_programs_write_them(plant: Path) -> None:
    (plant / "mapping.yaml").write_text("columns: {n: {column: n, round: nearest}}\n")
    (plant / "log.csv").write_text("n\n0.1e1\n1.00000000000000000000000000000000000001\n5.551115123125783e-17\n20E-1\n")
    arrangement, properties = load_arrangement(str(plant / "plant.yaml")), parse_properties([Source("p", "F n == 2")])
    (found,) = check_log(arrangement, properties, str(plant / "log.csv"), str(plant / "mapping.yaml"), "csv")
    assert (found.verdict, found.step) == ("satisfied", 4)


@pytest.mark.slow
def test_times_of_parquet_are_shown_and_pipes_are_read_once(plant: Path) -> None:
    import pyarrow as pa
    from pyarrow.parquet import write_table

    at = [datetime(2026, 1, 2, 3, 4, number, tzinfo=UTC) for number in range(3)]
    write_table(pa.table({"n": [1, 2, 3], "at": at}), plant / "log.parquet")
    (plant / "mapping.yaml").write_text("columns: {n: n}\ntime: at\n")
    arrangement, properties = load_arrangement(str(plant / "plant.yaml")), parse_properties([Source("p", "F n == 2")])
    (found,) = check_log(arrangement, properties, str(plant / "log.parquet"), str(plant / "mapping.yaml"), "parquet")
    assert found.step == 2 and found.time == "2026-01-02T03:04:01+00:00"
    (plant / "mapping.yaml").write_text("columns: {n: n}\nended: true\n")
    with pytest.raises(DiagnosticError, match="may be read twice"):
        check_log(arrangement, properties, "/dev/null", str(plant / "mapping.yaml"), "csv")


@pytest.mark.slow
def test_a_damaged_mcap_is_not_decided_on(plant: Path) -> None:
    from mcap.writer import CompressionType, Writer

    log = plant / "log.mcap"
    with log.open("wb") as file:
        writer = Writer(file, compression=CompressionType.NONE)
        writer.start()
        channel = writer.register_channel("/a", "json", 0)
        for time in range(5):
            writer.add_message(channel, time, json.dumps({"n": time}).encode(), time)
        writer.finish()
    (plant / "mapping.yaml").write_text("columns: {n: n}\n")
    arrangement, properties = load_arrangement(str(plant / "plant.yaml")), parse_properties([Source("p", "G n < 5")])
    whole = log.read_bytes()
    assert whole.count(b'{"n": 2}') == 1
    for damaged in (whole.replace(b'{"n": 2}', b'{"n": 4}'), whole[:200], b"n\n1\n", b""):
        log.write_bytes(damaged)
        with pytest.raises(DiagnosticError, match="the log cannot be read"):
            check_log(arrangement, properties, str(log), str(plant / "mapping.yaml"), "mcap")
    (plant / "log.parquet").write_bytes(b"PAR1 and no more")
    with pytest.raises(DiagnosticError, match="the log cannot be read"):
        check_log(arrangement, properties, str(plant / "log.parquet"), str(plant / "mapping.yaml"), "parquet")


@pytest.mark.slow
def test_the_command_line_decides_on_logs(plant: Path) -> None:
    (plant / "mapping.yaml").write_text(MAPPING)
    (plant / "log.csv").write_text(LOG)
    log, mapping, arrangement = str(plant / "log.csv"), str(plant / "mapping.yaml"), str(plant / "plant.yaml")
    done = llfsm(
        "check-recording", log, "--mapping", mapping, "--arrangement", arrangement, "-p", "a: G x", "-p", "b: F m@B"
    )
    assert (done.returncode, done.stdout) == (
        1,
        "violated   a  G x\n{0}satisfied  b  F m@B\n{0}".format("              at row 2, at time 1\n"),
    )  # fmt: skip
    for wrong in ((log, "--mapping", mapping), (log, "--from", "csv"), (mapping, "--mapping", mapping)):
        assert llfsm("check-recording", *wrong, "-p", "G x").returncode == 2

"""The suites for plugs besides engines: all that is registered passes, and what is wrong fails in a named case."""

from __future__ import annotations

import json
import os
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import pytest

from llfsm_verify.arrangement.formats import ARRANGEMENTS, WRITERS
from llfsm_verify.arrangement.formats.data import draft_data
from llfsm_verify.arrangement.formats.writing import Writer
from llfsm_verify.arrangement.formats.yaml_writer import to_yaml
from llfsm_verify.plug import DRAWINGS, LOGS, PORTS, REPORTS, TIMELINES, Entry, NoColumn, Row, Started, Unreadable
from llfsm_verify.report.formats import Reports
from llfsm_verify.testing.conformance import (
    Case,
    drawing_cases,
    log_cases,
    port_cases,
    reader_cases,
    report_cases,
    scheduler_cases,
    timeline_cases,
    writer_cases,
)
from llfsm_verify.testing.conformance.plugs import SAMPLES, subjects
from tests.extensions.crops.thesis import TRANSITION_FILE
from tests.extensions.ros.dds import free_domain
from tests.extensions.test_mqtt import Broker
from tests.outside import needs
from tests.runtime.ports.test_whiteboard import other

KINDS = tuple(name for name, made in vars(Reports)["__annotations__"].items() if "Registry" in made)
ROWS = [{"car": "true", "n": "3"}, {"car": "false"}, {"car": "true", "n": "-1"}]


def failures(cases: list[Case]) -> dict[str, str]:
    """What the failed cases found, by their names."""
    assert len({case.name for case in cases}) == len(cases)
    return {case.name: outcome.wrong for case in cases if not (outcome := case()).passed}


def planted(name: str, binary: bool = False) -> Entry:
    """The entry of something below."""
    return Entry(name, f"{__name__}:{name}", "planted", (".wrong",), binary=binary)


# -------------------------------------------------- ours pass


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "name"), [(kind, name) for kind in KINDS for name in getattr(REPORTS, kind)])
def test_reports(kind: str, name: str) -> None:
    assert failures(report_cases(name, kind)) == {}


@pytest.mark.slow
@pytest.mark.parametrize("name", TIMELINES)
def test_timelines(name: str) -> None:
    assert failures(timeline_cases(name)) == {}


@pytest.mark.slow
def test_schedulers() -> None:
    """Those of a cluster are looked at where there is one (tests/extensions/cluster)."""
    assert failures(scheduler_cases("processes", "processes")) == {}


@pytest.mark.slow
@pytest.mark.parametrize("name", DRAWINGS)
def test_drawings(name: str) -> None:
    assert failures(drawing_cases(name)) == {}


@pytest.mark.slow
@pytest.mark.parametrize("name", WRITERS)
def test_readers_and_writers(name: str) -> None:
    text = WRITERS.load(name).arrangement(next(iter(SAMPLES.values())))
    assert failures(reader_cases(name, text)) == {}
    assert failures(writer_cases(name, name)) == {}


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(set(ARRANGEMENTS) - set(WRITERS)))
def test_readers_of_what_we_do_not_write(name: str) -> None:
    assert failures(reader_cases(name, {"crops": TRANSITION_FILE}[name])) == {}


def csv_log(path: Path) -> None:
    path.write_text("n,car\n3,true\n,false\n-1,true\n")


def parquet_log(path: Path) -> None:
    import pyarrow as pa
    from pyarrow.parquet import write_table

    write_table(pa.table({"n": ["3", None, "-1"], "car": [True, False, True]}), path)


def mcap_log(path: Path) -> None:
    from mcap.writer import Writer

    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("any", "jsonschema", b"{}")
        channel = writer.register_channel("/robot", "json", schema)
        for number, message in enumerate(({"car": True, "n": 3}, {"car": False}, {"car": True, "n": -1})):
            writer.add_message(channel, number, json.dumps(message).encode(), number)
        writer.finish()


def rosbag_log(path: Path) -> None:
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg("bool car\nstring n", "robot/msg/Seen"))
    with Writer(path) as writer:
        connection = writer.add_connection("/robot", "robot/msg/Seen", typestore=store)
        for number, (car, n) in enumerate(((True, "3"), (False, ""), (True, "-1"))):
            message = store.types["robot/msg/Seen"](car, n)
            writer.write(connection, number, store.serialize_ros1(message, "robot/msg/Seen"))


MADE: dict[str, tuple[Callable[[Path], None], str | None]] = {
    "csv": (csv_log, None), "parquet": (parquet_log, None), "mcap": (mcap_log, "/robot"),
    "rosbag": (rosbag_log, "/robot"),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", LOGS)
def test_logs(name: str, tmp_path: Path) -> None:
    make, topic = MADE[name]
    path = tmp_path / f"log{LOGS[name].suffixes[0]}"
    make(path)
    assert failures(log_cases(name, path, ROWS, topic)) == {}


def said(values: object) -> dict[str, bool]:
    """What a port of the kind `callback` calls."""
    return {"go": values is not None}


@contextmanager
def settings_of(kind: str, folder: Path) -> Iterator[str]:
    """Settings with which a port of the kind can be opened."""
    with ExitStack() as left:
        if kind == "callback":
            yield f"{{call: '{__name__}:said'}}"
        elif kind == "stream":
            os.mkfifo(folder / "in")
            os.mkfifo(folder / "out")
            yield "{read: in, write: out, inputs: [go], outputs: [m]}"
        elif kind == "whiteboard":
            left.enter_context(other())
            yield "{whiteboard: other, inputs: [go]}"
        elif kind == "process":
            said = 'echo \'{"hello": 1, "values": {"go": true}}\'; cat > /dev/null'
            yield json.dumps({"run": ["sh", "-c", said], "patience": "1min", "restart": "false"})
        elif kind == "prolog":
            (folder / "a.pl").write_text("go_now.\n")
            yield "{file: a.pl, inputs: {go: go_now}, outputs: {m: m}, patience: 1min}"
        elif kind == "serial":
            master, slave = os.openpty()
            left.callback(os.close, master)
            left.callback(os.close, slave)
            tty.setraw(master)
            yield f"{{device: '{os.ttyname(slave)}', baud: 57600}}"
        elif kind == "ros2":
            domain = left.enter_context(free_domain())
            (folder / "msgs/std_msgs/msg").mkdir(parents=True)
            (folder / "msgs/std_msgs/msg/Bool.msg").write_text("bool data\n")
            fields = "inputs: {go: /x.data}, outputs: {on: /x.data}"
            yield f"{{topics: {{/x: std_msgs/msg/Bool}}, messages: [msgs], domain: {domain}, {fields}}}"
        else:
            assert kind == "mqtt"
            broker = Broker(folder)
            left.callback(broker.stop)
            yield f"{{host: 127.0.0.1, port: {broker.port}, qos: 1}}"


NEEDED = {"mqtt": "mosquitto", "ros2": "cyclonedds", "prolog": "swipl"}


@pytest.mark.slow
@pytest.mark.parametrize(  # `ros1` has a test of its own, beside its master
    "name",
    [pytest.param(name, marks=needs(NEEDED[name])) if name in NEEDED else name for name in PORTS if name != "ros1"],
)
def test_ports(name: str, tmp_path: Path) -> None:
    with settings_of(name, tmp_path) as settings:
        assert failures(port_cases(name, settings, tmp_path)) == {}


# -------------------------------------------------- what is wrong does not


def says_nothing(*_: object) -> str:
    return ""


def says_always_the_same(*_: object) -> str:
    return "done"


def says_the_time(*_: object) -> str:
    return str(time.perf_counter_ns())


def names_one(result: Any, *_: object) -> str:
    return f"{result.arrangement}"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("report", "kind", "wrong"),
    [
        (says_nothing, "result", "a report is empty"),
        (says_always_the_same, "query", "what is different is reported alike"),
        (says_the_time, "access", "the same is reported in two ways"),
        (names_one, "result", "what is different is reported alike"),
    ],
)
def test_a_report_that_is_wrong(report: Callable[..., str], kind: str, wrong: str) -> None:
    assert failures(report_cases(planted(report.__name__), kind)) == {"reports": wrong}


def test_subjects_of_reports_are_those_of_the_registry() -> None:
    assert all(len(subjects(kind)) > 1 for kind in KINDS if kind in ("access", "monitor"))
    with pytest.raises(KeyError):
        subjects("nothing")


def closes_its_file(timeline: Any, file: Any) -> None:
    file.write(timeline.title.encode())
    file.close()


def forgets_values(timeline: Any, file: Any) -> None:
    file.write("".join(f"{row.step}." for row in timeline.rows).encode())


def writes_latin(timeline: Any, file: Any) -> None:
    file.write(b"\xff" + repr(list(timeline.rows)).encode())


def needs_a_row(timeline: Any, file: Any) -> None:
    file.write(repr([next(iter(timeline.rows)), *timeline.rows]).encode())


@pytest.mark.parametrize(
    ("writer", "wrong"),
    [
        (closes_its_file, "it closes the file"), (forgets_values, "another value of a signal is not shown"),
        (writes_latin, "UnicodeDecodeError"), (needs_a_row, "StopIteration"),
    ],
)  # fmt: skip
def test_a_timeline_that_is_wrong(writer: Callable[..., None], wrong: str) -> None:
    found = failures(timeline_cases(planted(writer.__name__)))
    assert list(found) == ["writes"] and wrong in found["writes"]


def draws_titles(graph: Any) -> str:
    return str(graph.title)


def draws_its_place(graph: Any) -> str:
    return f"{graph.title} {time.perf_counter_ns()}"


def draws_nothing(graph: Any) -> None:
    return None


@pytest.mark.parametrize(
    ("drawing", "binary", "wrong"),
    [
        (draws_titles, True, "its entry says that it is not text"), (draws_nothing, False, "it gives a NoneType"),
        (draws_its_place, False, "the same graph is drawn in two ways"),
        (says_nothing, False, "of a graph nothing is drawn"), (says_always_the_same, False, "two graphs have one"),
    ],
)  # fmt: skip
def test_a_drawing_that_is_wrong(drawing: Callable[..., object], binary: bool, wrong: str) -> None:
    found = failures(drawing_cases(planted(drawing.__name__, binary)))
    assert list(found) == ["draws"] and found["draws"].startswith(wrong)


def reads_all(path: str, wanted: Any) -> Iterator[Row]:
    """Cells that nobody wanted, and none that is missing."""
    for number, line in enumerate(Path(path).read_text().splitlines()[1:], 1):
        yield Row(f"line {number}", dict(zip(("n", "car"), line.split(","), strict=True)))


def reads_well(path: str, wanted: Any) -> Iterator[Row]:
    lines = Path(path).read_bytes().decode("latin-1").splitlines() or [""]
    names = lines[0].split(",")
    for name in (*wanted.columns, *([wanted.topic] if wanted.topic else [])):
        if name not in names:
            raise NoColumn(name, names)
    for number, line in enumerate(lines[1:], 1):
        cells = line.split(",")
        if len(cells) != len(names):
            raise Unreadable("a line is too short")
        yield Row(
            f"line {number}", {name: cells[names.index(name)] for name in wanted.columns if cells[names.index(name)]}
        )


def reads_one_place(path: str, wanted: Any) -> Iterator[Row]:
    return (Row("here", row.cells) for row in reads_well(path, wanted))


def reads_what_is_not_there(path: str, wanted: Any) -> Iterator[Row]:
    return reads_well(path, wanted) if Path(path).exists() else iter(())


def crashes(path: str, wanted: Any) -> Iterator[Row]:
    if Path(path).exists():
        Path(path).read_text(encoding="utf-8")
    return reads_well(path, wanted)


@pytest.mark.parametrize(
    ("reader", "wrong"),
    [
        (reads_well, {}),
        (reads_all, {"rows": "the rows", "names": "a column or topic", "damaged": "Unicode"}),
        (reads_one_place, {"rows": "two rows have one place"}),
        (reads_what_is_not_there, {"damaged": "a log that is not there is no OSError"}),
        (crashes, {"damaged": "UnicodeDecodeError"}),
    ],
)
def test_a_reader_of_logs_that_is_wrong(reader: Any, wrong: dict[str, str], tmp_path: Path) -> None:
    csv_log(tmp_path / "log")
    found = failures(log_cases(planted(reader.__name__), tmp_path / "log", ROWS))
    assert list(found) == list(wrong) and all(found[case].startswith(wrong[case]) for case in wrong), found


def reads_no_text(given: Any) -> object:
    """A file, and nothing else."""
    return ARRANGEMENTS.load("yaml")(type(given)(given.path))


def reads_from_nowhere(given: Any) -> object:
    return draft_data({**next(iter(SAMPLES.values())), "name": str(given.path)})


def reads_no_draft(given: Any) -> object:
    return {"machines": Path(given.path).read_text()}


def ends_in_a_crash(given: Any) -> object:
    if given.text is not None:
        json.loads(given.text)
    return ARRANGEMENTS.load("yaml")(given)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("reader", "wrong"),
    [
        (reads_no_text, {"reads": "DiagnosticError", "broken": ""}),
        (reads_from_nowhere, {"reads": "the path of the draft", "missing": "a file that is not there"}),
        (reads_no_draft, {"reads": "it gives a dict", "missing": "FileNotFoundError", "broken": "FileNotFoundError"}),
        (ends_in_a_crash, {"reads": "JSONDecodeError", "broken": "JSONDecodeError"}),
    ],
)
def test_a_reader_of_arrangements_that_is_wrong(reader: Any, wrong: dict[str, str]) -> None:
    found = failures(reader_cases(planted(reader.__name__), to_yaml(next(iter(SAMPLES.values())))))
    assert all(found[case].startswith(wrong[case]) for case in found) and "reads" in found, found


def forgets_a_machine(document: Any) -> str:
    machines = dict(document["machines"])
    return to_yaml({**document, "machines": machines, "name": "other"})


def changes_it(document: Any) -> str:
    document["machines"]["more"] = {}
    return to_yaml(document)


FORGETS, SAYS, DRAWS = Writer(forgets_a_machine), Writer(says_nothing), Writer(draws_nothing)  # type: ignore[arg-type]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("writer", "wrong"),
    [("FORGETS", "it is read again as another"), ("SAYS", "DiagnosticError"), ("DRAWS", "it gives no")],
)
def test_a_writer_that_is_wrong(writer: str, wrong: str) -> None:
    found = failures(writer_cases(planted(writer), "yaml"))
    assert list(found) == list(SAMPLES) and all(each.startswith(wrong) for each in found.values()), found


class Planted:
    """A kind of port whose ports do nothing, but for what is wrong with it."""

    keys: tuple[str, ...] = ("speed",)
    required: tuple[str, ...] = ("speed",)

    def __init__(self, wrong: str) -> None:
        self.wrong = wrong
        if wrong == "keys":
            self.keys = ("speed", "inputs")
        elif wrong == "required":
            self.required = ("depth",)

    def settings(self, report: Any, found: Any, what: str, folder: str) -> Started | None:
        if self.wrong == "trusting":
            return Started(lambda _: PlantedPort(self.wrong), (str(int(found["speed"].text)),))
        scalar = report.scalar(found["speed"], "`speed`")
        if scalar is None or (not scalar.text.isdigit() and self.wrong != "silent"):
            if scalar is not None:
                report.error("E493", "`speed` is a number", scalar.span)
            return None
        if not scalar.text.isdigit():
            return None
        return Started(lambda _: PlantedPort(self.wrong))

    def field_problem(self, name: str, *, output: bool) -> str | None:
        return "" if self.wrong == "field" and not name else None


class PlantedPort:
    every_frame = False

    def __init__(self, wrong: str) -> None:
        self.wrong = wrong
        self.pipe = os.pipe()
        self.flushed: object = "yes" if wrong == "flushed" else True

    def waits(self) -> list[tuple[int, int]]:
        return [(self.pipe[0], 1)]

    def serve(self, ready: Any, now: float) -> None:
        if self.wrong == "waiting":
            os.read(self.pipe[0], 1)

    def send(self, values: Any) -> None:
        if self.wrong == "sending":
            raise BrokenPipeError("no one is there")

    def close(self) -> None:
        for end in self.pipe if self.wrong != "leaking" else self.pipe[:1]:
            os.close(end)


GOOD, KEYS, REQUIRED, TRUSTING, SILENT, FIELD, FLUSHED, WAITING, SENDING, LEAKING = map(
    Planted,
    ("", "keys", "required", "trusting", "silent", "field", "flushed", "waiting", "sending", "leaking"),
)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "wrong"),
    [
        ("GOOD", {}),
        ("KEYS", {"declares": "one of its keys is one that every port has"}),
        ("REQUIRED", {"declares": "it requires a key that it does not have"}),
        ("FIELD", {"declares": "why there can be no field is not said"}),
        ("TRUSTING", {"settings": "AttributeError"}),
        ("SILENT", {"settings": "it reports a mistake and starts, or does neither"}),
        ("FLUSHED", {"opens": "`flushed` is neither true nor false"}),
        ("WAITING", {"opens": "`serve` waits, and no call may"}),
        ("SENDING", {"opens": "BrokenPipeError"}),
        ("LEAKING", {"opens": "a port that is closed leaves a descriptor open"}),
    ],
)
def test_a_kind_of_port_that_is_wrong(kind: str, wrong: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("llfsm_verify.testing.conformance.ports.AT_ONCE", 0.5)
    found = failures(port_cases(planted(kind), "{speed: 3}"))
    assert list(found) == list(wrong) and all(found[case].startswith(wrong[case]) for case in wrong), found

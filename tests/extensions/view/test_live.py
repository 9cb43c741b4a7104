"""Live views: what a page is sent is what the run's recording has, whatever the run, the page and others do."""

from __future__ import annotations

import itertools
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from decimal import Decimal
from pathlib import Path
from typing import Any

import jsonschema
import pytest

import llfsm_verify as lv
from llfsm_verify import DiagnosticError
from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.extensions.view import live
from llfsm_verify.extensions.view.live import view_live
from llfsm_verify.runtime.live.frame import HEADER
from llfsm_verify.runtime.live.slots import slots_of
from llfsm_verify.runtime.recording.file import Recording
from llfsm_verify.runtime.recording.origin import arrangement_of, code_of
from llfsm_verify.runtime.recording.replay import performed
from tests.extensions.view.clients import SECONDS, Address, served, wait_until

LIFT = "models/lift/arrangement.yaml"
COUNTER = """\
name: counter
cycle_ms: 5
whiteboard:
  go: {type: bool, role: input}
  out: {type: 0..9, init: 0, role: output}
machines:
  count: {file: count.yaml}
  other: {file: other.yaml}
processes: {a: [count], b: [other]}
operators: {replace: [count]}
"""
MACHINE = "machine: M\nvariables: {n: {type: 0..9, init: 0}}\nstates:\n"
STATE = "  - {{name: {0}, on_exit: 'n = (n + {1}) % 10; out = n;', transitions: [{2}]}}\n"
UP = MACHINE + "".join(
    (
        STATE.format("UP", 1, "{to: TOP, when: n == 8}, {to: UP, when: n % 2 == 1}, {to: UP, when: 'true'}"),
        STATE.format("TOP", 1, "{to: UP, when: n >= 5}, {to: UP, when: 'true'}"),
    )
)
DOWN = MACHINE + STATE.format("DOWN", 9, "{to: LOW, when: 'true'}") + STATE.format("LOW", 1, "{to: DOWN, when: 'true'}")
OTHER = "machine: O\nstates:\n  - {name: A, transitions: [{to: B, when: go}]}\n  - {name: B, stays: true}\n"


@pytest.fixture(autouse=True)
def boards(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    monkeypatch.setenv("LLFSM_WHITEBOARDS", str(tmp_path / "boards"))
    monkeypatch.setattr(live, "AGAIN", 0.05)
    return tmp_path / "boards"


@pytest.fixture
def counter(tmp_path: Path) -> Path:
    for name, text in {"a": COUNTER, "count": UP, "down": DOWN, "other": OTHER}.items():
        (tmp_path / f"{name}.yaml").write_text(text)
    return tmp_path / "a.yaml"


@contextmanager
def viewed(name: str, path: str | None = None) -> Iterator[Address]:
    with served(lambda tell, ended: view_live(name, path, tell, ended=ended)) as address:
        yield address


class Page:
    """What a page has: its document, and all that it is sent."""

    def __init__(self, address: Address) -> None:
        html = address.ask("/").text
        self.document, endpoints = (
            json.loads(re.search(rf'id="view-{kind}">(.*?)</script>', html, re.DOTALL)[1])
            for kind in ("document", "endpoints")
        )
        (self.run,) = self.document["runs"]
        self.values = [dict(zip(one["at"], one["values"], strict=True)) for one in self.run["changes"]]
        self.updates: list[dict[str, Any]] = []
        self.over = threading.Event()
        self.closing = False
        self.names: list[str] = []
        """Of the events."""
        self._thread = threading.Thread(target=self._listen, args=(address, endpoints["events"]))
        self._thread.start()

    def _listen(self, address: Address, path: str) -> None:
        with suppress(ConnectionResetError), address.stream(path) as events:  # the server ends
            for kind, name, update in events:
                if kind == "document":
                    break
                self.names.append(name)
                self.take(update)
        self.over.set()

    def take(self, update: dict[str, Any]) -> None:
        """As the schema says it: rows go on."""
        for column in ("step", "cycle", "turn", "time_ms"):
            if self.run["rows"][column] is not None:
                self.run["rows"][column] += update["rows"][column]
        for known, change in zip(self.values, update["changes"], strict=True):
            known |= dict(zip(change["at"], change["values"], strict=True))
        self.run["fired"] += update["fired"]
        self.run["marks"] += update["marks"]
        self.updates.append(update)

    @property
    def ending(self) -> str | None:
        return self.updates[-1]["ending"] if self.updates else self.run["ending"]

    def rows(self) -> list[dict[str, Any]]:
        """All rows with all values."""
        rows = self.run["rows"]
        names = [signal["name"] for signal in self.document["signals"]]
        found, now = [], {}
        for number, step in enumerate(rows["step"]):
            now = {name: known.get(number, now.get(name)) for name, known in zip(names, self.values, strict=True)}
            times = rows["time_ms"] and rows["time_ms"][number]
            found.append({"step": step, "cycle": rows["cycle"][number], "time_ms": times, **now})
        return found

    def wait(self, holds: Callable[[], object]) -> None:
        wait_until(holds)

    def join(self) -> None:
        self._thread.join(SECONDS)
        assert not self._thread.is_alive()


def recorded(path: Path) -> list[dict[str, Any]]:
    """What the recording has in each frame, performed again: the second way."""
    with Recording(str(path)) as recording:
        arrangement = arrangement_of(recording, load_arrangement)
        code = code_of(recording, arrangement)
        found = []
        for turn in performed(recording, code):
            frame = turn.frame
            cycle = frame[HEADER["CYCLE"]] + (frame[HEADER["NUMBER"]] > 1)
            shown = {slot.name: slot.value(frame) for slot in slots_of(code)}
            values = {name: str(value) if isinstance(value, Decimal) else value for name, value in shown.items()}
            time_ms = float(cycle * arrangement.cycle_ms)
            found.append({"step": frame[HEADER["STEPS"]], "cycle": cycle, "time_ms": time_ms, **values})
        return found


def in_order(shown: list[dict[str, Any]], frames: list[dict[str, Any]]) -> list[int]:
    """The frames that are rows: each row is one of them, in their order."""
    places, at = [], 0
    for row in shown:
        while at < len(frames) and frames[at] != row:
            at += 1
        assert at < len(frames), f"no frame is {row}"
        places.append(at)
        at += 1
    return places


@pytest.mark.slow
def test_each_row_is_a_frame_of_the_recording(tmp_path):
    lift = lv.load(LIFT)
    options = {"simulate": True, "seed": 3, "rate": 100, "whiteboard": "lift", "record": tmp_path / "r", "cycles": 120}
    with ExitStack() as left:
        run = left.enter_context(lift.run("small: G !open", **options))
        address = left.enter_context(viewed("lift", LIFT))
        pages = [Page(address) for _ in range(3)]
        run.wait()
        for page in pages:
            page.wait(lambda page=page: page.ending)
    frames = recorded(tmp_path / "r")
    for page in pages:
        assert page.ending == "stopped"
        rows = page.rows()
        places = in_order(rows, frames)
        missed = sum(update["missed"] for update in page.updates)
        assert len(rows) + missed + places[0] == len(frames) == places[-1] + 1
        assert sum(update["skipped"] for update in page.updates) == 0
        marked = {mark["row"]: mark["text"] for mark in page.run["marks"] if mark["kind"] == "violation"}
        first = next(number for number, row in enumerate(rows) if row["verdict(small)"] == "violated")
        assert marked in ({first: "violated: small"}, {}) and (marked or first == 0)
        assert page.updates[-1]["verdicts"] == {"small": "violated"}
        assert len(page.names) == len(set(page.names))
        page.join()


@pytest.mark.slow
@pytest.mark.parametrize("rate", [1, 20])
def test_latenesses_are_those_that_the_run_reports(counter, rate):
    """Of two processes the first turn of a cycle counts; a view that has missed frames has counted fewer."""
    with lv.load(counter).run(whiteboard="counter", cycles=100 * rate, rate=rate) as run, viewed("counter") as address:
        page = Page(address)
        report = run.wait()
        page.wait(lambda: page.ending)
    seen, said = page.updates[-1]["lateness"], report.lateness
    missed = page.rows()[0]["step"] > 0 or any(update["missed"] for update in page.updates)
    counted = (sum(seen["counts"]), round(1000 * seen["worst_us"]), seen["overruns"])
    expected = (said.turns, said.worst, said.overruns)
    assert all(map(int.__le__, counted, expected)) if missed else counted == expected
    edges = [0, *seen["edges_us"], float("inf")]
    assert (
        next(edges[i + 1] for i, n in enumerate(seen["counts"]) if not sum(seen["counts"][i + 1 :])) * 1000
        >= counted[1]
    )
    marks = [mark for mark in page.run["marks"] if mark["kind"] == "overrun"]
    assert len(marks) <= said.overruns and (missed or len(marks) == said.overruns)


@pytest.mark.slow
def test_transitions_that_fired_are_told_by_the_run(counter):
    """Two transitions lead from each state to UP: states alone do not say which fired."""
    with ExitStack() as left:
        run = left.enter_context(lv.load(counter).run(whiteboard="counter", record=counter.parent / "r", cycles=60))
        address = left.enter_context(viewed("counter"))
        page = Page(address)
        run.wait()
        page.wait(lambda: page.ending)
    page.join()
    machine = page.document["machines"][0]
    assert (machine["name"], len(machine["transitions"])) == ("count", 5)
    rows = page.rows()
    fired = {row: transition for row, number, transition in page.run["fired"] if number == 0}
    expected = {}
    for number, (before, row) in enumerate(itertools.pairwise(rows), 1):
        if row["step"] != before["step"] + 1 or page.run["rows"]["turn"][number] != 0:
            continue  # frames were missed, or it was the turn of the other one
        value, state = before["count.n"], before["count"]
        expected[number] = (0 if value == 8 else 1 if value % 2 else 2) if state == "UP" else (3 if value >= 5 else 4)
    assert fired == expected
    assert {1, 2} <= set(fired.values()) <= {0, 1, 2, 3}


@pytest.mark.slow
def test_a_replaced_machine_gives_a_new_document(counter):
    with ExitStack() as left:
        run = left.enter_context(lv.load(counter).run(whiteboard="counter"))
        address = left.enter_context(viewed("counter", str(counter)))
        page = Page(address)
        page.wait(lambda: page.updates)
        assert page.document["notes"] == []
        run.replace("count", counter.parent / "down.yaml", unchecked=True)
        assert page.over.wait(SECONDS)
        page.join()
        assert page.ending == "another run goes on"
        later = Page(address)
        later.wait(later.rows)
        machines = {machine["name"]: machine for machine in later.document["machines"]}
        assert [state["name"] for state in machines["count"]["states"]][:2] == ["DOWN", "LOW"]
        assert (machines["count"]["transitions"], len(machines["other"]["transitions"])) == ([], 1)
        assert later.document["notes"] == ["`count` was replaced since the run began, so it is not drawn"]
        assert later.rows()[-1]["count"] in ("DOWN", "LOW")
        run.stop()
        later.wait(lambda: later.ending == "stopped")
    later.join()


@contextmanager
def started(*arguments: str) -> Iterator[subprocess.Popen[str]]:
    """`llfsm run` as a process of its own."""
    command = [sys.executable, "-m", "llfsm_verify", "run", *arguments, "-q"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        yield process
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        process.communicate(timeout=SECONDS)


def serves(name: str) -> bool:
    try:
        with lv.Whiteboard(name) as board:
            return board.latest > 0
    except lv.WhiteboardError:
        return False


@pytest.mark.slow
def test_a_run_is_killed_and_started_again(counter):
    command = (str(counter), "--whiteboard", "counter", "--processes", "together")
    with started(*command) as process:
        wait_until(lambda: serves("counter"))
        with viewed("counter") as address:
            page = Page(address)
            page.wait(page.rows)
            before = page.rows()[0]
            os.kill(process.pid, signal.SIGKILL)
            process.wait()
            page.wait(lambda: page.ending)
            assert page.ending == "a process died"
            assert page.rows()[0] == before
            assert Page(address).run["ending"] == "a process died", "who comes later sees it too"
            with started(*command):
                assert page.over.wait(SECONDS)
                again = Page(address)
                again.wait(lambda: len(again.rows()) > 2)
                assert again.ending is None
            again.wait(lambda: again.ending == "stopped")


@pytest.mark.slow
def test_a_page_goes_on_after_its_last_event(counter):
    """A connection that is lost is made again by the browser, which names the last event that it has got."""
    with lv.load(counter).run(whiteboard="counter"), viewed("counter") as address:
        page = Page(address)
        page.wait(lambda: len(page.updates) > 3)
        name = page.names[2]
        with address.stream("/events?after=1.0.0", f"Last-Event-ID: {name}") as events:
            kind, _, update = next(events)
        assert kind == "message"
        key, number, base, _ = name.split(".")
        page.wait(lambda: len(page.rows()) > int(number) - int(base) + len(update["rows"]["step"]))
        begin = int(number) - int(base)
        assert update["rows"]["step"] == page.run["rows"]["step"][begin : begin + len(update["rows"]["step"])]
        for wrong in ("", "x", f"{key}.9", f"{key}.99999999.0.0", "1.2.0.3", f"{key}.-1.0.0", f"{key}.1.2.0"):
            with address.stream(f"/events?after={wrong}") as events:
                assert next(events)[0] == "document"


@pytest.mark.slow
def test_old_rows_are_forgotten_and_counted(counter, monkeypatch):
    monkeypatch.setattr(live, "KEPT", 20)
    with lv.load(counter).run(whiteboard="counter", record=counter.parent / "r") as run, viewed("counter") as address:
        first = Page(address)
        name = ".".join(first.names[0].split(".")[:3]) + ".0" if first.names else None
        first.wait(lambda: len(first.rows()) > 100)
        name = first.names[0]
        late = Page(address)
        late.wait(lambda: len(late.updates) > 2)
        assert late.run["window"]["first"] > 0
        with address.stream("/events", f"Last-Event-ID: {name}") as events:
            _, later, update = next(events)
        assert update["skipped"] > 0
        _, number, base, _ = name.split(".")
        at = int(number) - int(base)
        assert all(change["at"][0] == at for change in update["changes"]), "the first row has all values"
        assert int(later.split(".")[2]) == int(base) + update["skipped"]
        run.stop()
        late.wait(lambda: late.ending)
    frames = recorded(counter.parent / "r")
    in_order(late.rows(), frames)
    in_order(first.rows(), frames)


def test_there_is_no_such_run(counter):
    with lv.load(counter).run(whiteboard="counter"):
        said = refused("conter")
        assert said.code == "E551"
        assert said.message == "there is no whiteboard and no file `conter`"
        assert said.hint == "did you mean `counter`? `llfsm whiteboard list` says what runs"
    assert refused("../none").message == "there is no whiteboard and no file `../none`"
    assert refused("..").message == "`..` is a folder: name a saved trace or a recording in it"


def refused(name: str, path: str | None = None) -> lv.Diagnostic:
    with pytest.raises(DiagnosticError) as caught:
        view_live(name, path, pytest.fail)
    (found,) = caught.value.diagnostics
    return found


def test_another_arrangement_is_refused(counter):
    with lv.load(counter).run(whiteboard="counter"):
        said = refused("counter", LIFT)
        assert said.code == "E552"
        assert said.message == f"`counter` runs another arrangement than {LIFT}: it has no machine `buttons`"
        (counter.parent / "count.yaml").write_text(DOWN)
        assert "its `count` has no state `DOWN`" in refused("counter", str(counter)).message
        (counter.parent / "count.yaml").write_text(UP + "# changed\n")
        assert "its text is another one, or was changed since" in refused("counter", str(counter)).message
        assert refused("counter", "nowhere.yaml").file == "nowhere.yaml"
        with viewed("counter") as address:
            (note,) = Page(address).document["notes"]
            assert note.startswith("machines are not drawn: `counter` runs another arrangement than ")


def test_servers_that_tell_less_are_viewed_too(counter, monkeypatch):
    """As they were before: no arrangement, and what fired is told by the states where only one way leads there."""
    monkeypatch.setattr(
        lv.Whiteboard, "told", property(lambda self: {"epoch": 7}, lambda self, told: None), raising=False
    )
    with lv.load(counter).run(whiteboard="counter"):
        with viewed("counter") as address:
            page = Page(address)
            page.wait(lambda: page.updates)
            (note,) = page.document["notes"]
            assert note.startswith("this run does not say which arrangement it is of")
            assert page.run["rows"]["time_ms"] is None
            assert [machine["svg"] for machine in page.document["machines"]] == [None, None]
        with viewed("counter", str(counter)) as address:
            page = Page(address)
            page.wait(lambda: len(page.rows()) > 60)
            assert {transition for _, _, transition in page.run["fired"]} == {0}


@pytest.mark.slow
def test_documents_and_updates_are_of_the_schema(counter):
    """The schema is published: a validator that is not ours has no objection."""
    schema = json.loads((Path(live.__file__).with_name("view.schema.json")).read_text())
    update = {"$defs": schema["$defs"], "$ref": "#/$defs/update"}
    for path, options in ((LIFT, {"simulate": True, "seed": 1, "rate": 100}), (str(counter), {})):
        with lv.load(path).run(whiteboard="schema", **options) as run, viewed("schema") as address:
            page = Page(address)
            jsonschema.validate(page.document, schema)
            page.wait(lambda page=page: len(page.updates) > 3)
            run.stop()
            page.wait(lambda page=page: page.ending)
            for sent in page.updates:
                jsonschema.validate(sent, update)


@pytest.mark.slow
def test_a_run_that_does_not_wait_is_sampled():
    """Millions of cycles a second: a page gets some of them, at most 30 times a second, and the others are counted."""
    began = time.monotonic()
    with lv.load(LIFT).run(simulate=True, seed=1, rate=0, whiteboard="fast") as run, viewed("fast") as address:
        page = Page(address)
        page.wait(lambda: len(page.updates) > 8)
        run.stop()
        report = run.wait()
        page.wait(lambda: page.ending)
    most = 2 + live.UPDATES * (time.monotonic() - began)
    assert len(page.updates) <= most
    steps = page.run["rows"]["step"]
    assert steps == sorted(steps) and steps[-1] == report.ringlets
    rows = sum(len(update["rows"]["step"]) for update in page.updates)
    assert rows <= most * live.FIT
    lost = sum(update["missed"] + update["skipped"] for update in page.updates)
    begin = len(steps) - rows
    assert rows + lost == report.frames - 1 - steps[begin - 1] // 2, "each frame is a row, or is counted"
    assert page.updates[-1]["lateness"] is None

"""Slots of another run as inputs: whole frames, runs that end and begin again, and two that read one another."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path

import pytest

from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.runtime.live.loop import Loop
from llfsm_verify.runtime.live.plan import starting_values
from llfsm_verify.runtime.whiteboard.client import Whiteboard, WhiteboardError
from llfsm_verify.runtime.whiteboard.permissions import Permissions
from llfsm_verify.runtime.whiteboard.server import Server
from llfsm_verify.runtime.whiteboard.shared import Shared
from tests.runtime.ports.bench import Bench, bench, declared, kinds

TEXT = """\
ports:
  other:
    kind: whiteboard
    whiteboard: other
    inputs: {level: level, mode: now, speed: drive}
    on_failure: safe
    safe: {level: -3, mode: HIGH, speed: 0.5}
"""


class Other:
    """Another run, of the same arrangement, with its whiteboard."""

    def __init__(self, loop: Loop, shared: Shared, name: str = "other") -> None:
        self.loop, self.shared = loop, shared
        self.server = Server(name, shared, Permissions(None))

    def turn(self) -> None:
        self.server.serve(0)
        self.loop.go(1)


@contextmanager
def other() -> Iterator[Other]:
    loop = Loop(kinds(), held=starting_values(kinds().program))
    with closing(Shared("other", loop)) as shared:
        made = Other(loop, shared)
        loop.begin(0)
        with closing(made.server):
            yield made


def both(made: Bench, there: Other) -> None:
    there.turn()
    made.turn()


@pytest.fixture(autouse=True)
def a_folder_of_whiteboards(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LLFSM_WHITEBOARDS", str(tmp_path / "boards"))


def test_inputs_come_from_frames_of_another_run(tmp_path: Path) -> None:
    with bench(*declared(TEXT, tmp_path)) as made:
        made.until(made.has("level", -3))
        (said,) = made.said
        assert said.startswith("port other: there is no whiteboard `other`, or its server has died: `level`, `mode`, ")
        with other() as there:
            there.shared.posts.post({"level": 4, "mode": "LOW", "speed": "-0.25", "go": True})
            made.now = 1.5
            while not (made.value("level") == 4 and str(made.value("speed")) == "-0.25"):
                both(made, there)
            assert made.value("mode") == "LOW"
            there.loop.end("stopped")
            made.until(made.has("level", -3))
        made.now = 3.0
        with other() as there:
            there.shared.posts.post({"level": 2})
            while made.value("level") != 2:
                both(made, there)
        made.until(made.has("level", -3))
        assert made.value("mode") == "HIGH" and made.ports.counts["other"].failures == 9


def test_a_run_without_the_slot_is_none(tmp_path: Path) -> None:
    text = TEXT.replace("level: level", "level: height").replace("on_failure: safe", "on_failure: stop")
    with bench(*declared(text, tmp_path)) as made, other() as there:
        while made.ports.failure is None:
            both(made, there)
        assert made.ports.failure == (
            "port other: the whiteboard `other` has no slot `height`: `level`, `mode`, `speed` failed"
        )


def test_values_that_do_not_fit_are_refused(tmp_path: Path) -> None:
    text = TEXT.replace("level: level", "level: large")
    with bench(*declared(text, tmp_path)) as made, other() as there:
        there.shared.posts.post({"large": 1 << 63, "go": True})
        there.turn()
        while not made.ports.counts["other"].refused:
            both(made, there)
        assert made.value("level") in (-1, 0) and made.ports.counts["other"].taken


def test_two_runs_read_one_another(tmp_path: Path) -> None:
    """Neither waits for the other's answer."""
    first = declared(TEXT.replace("level: level, ", "").replace("level: -3, ", ""), tmp_path)
    second = declared(TEXT.replace("whiteboard: other", "whiteboard: bench"), tmp_path)
    with bench(*first) as one, bench(*second) as two:
        servers = [Server(name, made.board, Permissions(None)) for name, made in (("bench", one), ("other", two))]
        one.now = two.now = 2.0
        one.board.posts.post({"level": 3, "go": True})
        while not (two.value("level") == 3 and one.value("mode") == "LOW" == two.value("mode")):
            for server, made in zip(servers, (one, two), strict=True):
                server.serve(0)
                made.turn()
        for server in servers:
            server.close()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (TEXT.replace("whiteboard: other", "whiteboard: a/b"), "is not a valid name of a whiteboard"),
        (TEXT.replace("    whiteboard: other\n", ""), "has no `whiteboard`"),
        (TEXT + "    outputs: [level]\n", "writes only to its own whiteboard"),
        (TEXT.replace("whiteboard: other", "whiteboard: [other]"), "`whiteboard`"),
    ],
)
def test_wrong_files(text: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(DiagnosticError) as wrong:
        declared(text, tmp_path)
    (diagnostic,) = wrong.value.diagnostics
    assert message in diagnostic.message


COPY = """\
name: copy
cycle_ms: 5
whiteboard:
  seen: {type: 0..1000, role: input, init: 0}
  n: {type: 0..1000, init: 0}
machines:
  m:
    inline:
      machine: M
      states: [{name: A, internal: "if (seen < 1000) n = seen + 1;", transitions: [{when: "false", to: A}]}]
schedule: [m]
"""


@pytest.mark.slow
def test_arrangements_count_together(tmp_path: Path) -> None:
    """Each writes one more than what it reads of the other."""
    (tmp_path / "copy.yaml").write_text(COPY)
    runs = []
    for me, you in (("a", "b"), ("b", "a")):
        ports = tmp_path / f"{me}.ports.yaml"
        ports.write_text(
            f"ports:\n  p: {{kind: whiteboard, whiteboard: {you}, inputs: {{seen: n}}, on_failure: stale}}\n"
        )
        given = ["run", str(tmp_path / "copy.yaml"), "--whiteboard", me, "--ports", str(ports)]
        given = [sys.executable, "-m", "llfsm_verify", *given]
        runs.append(subprocess.Popen(given, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True))
    try:
        while True:
            with suppress(WhiteboardError), Whiteboard("a") as board:
                if int(board.get("n")) > 20:
                    break
            time.sleep(0.01)
    finally:
        for run in runs:
            run.send_signal(signal.SIGTERM)
        told = [run.communicate()[0] for run in runs]
    assert [run.returncode for run in runs] == [0, 0]
    assert all("messages in" in text for text in told)

"""The table of signals and processes in docs/safety.md, cell by cell."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from signal import Signals
from typing import Literal

import pytest

from llfsm_verify.runtime.whiteboard.client import Whiteboard, WhiteboardError

PROJECT = Path(__file__).parents[3]
ARRANGEMENT = """\
name: motors
cycle_ms: 1
whiteboard:
  motor: {type: 0..100, init: 0, role: output, safe: 0}
machines:
  drive:
    inline:
      machine: Drive
      variables:
        n: {type: 0..1000000, init: 0}
      states:
        - {name: ON, on_entry: motor = 77;, internal: n = (n + 1) % 1000000;, stays: true}
schedule: [drive]
"""
PORTS = """\
ports:
  motor:
    kind: stream
    write: motor.pipe
    outputs: {motor: motor}
"""
Kind = Literal["command", "thread", "separate"]
ENDS = frozenset(
    {Signals.SIGINT, Signals.SIGTERM, Signals.SIGHUP, Signals.SIGQUIT, Signals.SIGALRM, Signals.SIGXCPU}
    | {Signals.SIGUSR1, Signals.SIGUSR2, Signals.SIGVTALRM, Signals.SIGPROF, Signals.SIGIO, Signals.SIGPWR}
    | {Signals.SIGSTKFLT}
)
KILLS = frozenset(
    {Signals.SIGKILL, Signals.SIGSEGV, Signals.SIGBUS, Signals.SIGFPE, Signals.SIGILL, Signals.SIGABRT}
    | {Signals.SIGTRAP, Signals.SIGSYS}
)
FAILS = frozenset({Signals.SIGTTIN, Signals.SIGTTOU, Signals.SIGPIPE, Signals.SIGXFSZ})
NOTHING = frozenset({Signals.SIGCONT, Signals.SIGCHLD, Signals.SIGWINCH, Signals.SIGURG})
NAMED = (*sorted(ENDS | KILLS | FAILS | NOTHING), Signals.SIGTSTP, Signals.SIGSTOP)
FEW = {Signals.SIGHUP, Signals.SIGQUIT, Signals.SIGKILL, Signals.SIGTSTP, Signals.SIGSTOP, Signals.SIGTTOU}
"""One of each row, at least, which `make test` tries."""


@dataclass
class Started:
    pid: int
    board: Whiteboard
    said: Path
    pipe: int
    ended: Callable[[], int]
    """Waits until the process has ended or is suspended; its status."""
    received: bytes = b""

    @property
    def child(self) -> int:
        """The process that it has forked: of the loop, or the one that outlives a run on a thread."""
        (child,) = Path(f"/proc/{self.pid}/task/{self.pid}/children").read_text().split()
        return int(child)

    def goes_on(self, frames: int = 5) -> bool:
        """Whether so many frames come, while the motor runs."""
        first = self.board.view().number
        wait(lambda: self.board.view().number >= first + frames)
        return self.board.view().ending == "running" and self.board.view().values["motor"] == 77

    def comes_to_rest(self) -> str:
        """Waits for the last frame, which has safe values; how the run ended."""
        wait(lambda: self.board.view().values["motor"] == 0)
        return self.board.view().ending

    def sent(self) -> list[int]:
        """What the port has sent so far."""
        with suppress(BlockingIOError):
            while more := os.read(self.pipe, 1 << 16):
                self.received += more
        return [json.loads(line)["motor"] for line in self.received.splitlines()]


def wait(done: Callable[[], bool]) -> None:
    while not done():
        time.sleep(0.002)


def state_of(pid: int) -> str:
    """One letter, of Linux."""
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]


@pytest.fixture(scope="module")
def starting() -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-m", "tests.runtime.live.signalled"]
    with subprocess.Popen(command, cwd=PROJECT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        yield process
        assert process.stdin is not None
        process.stdin.close()


@pytest.fixture
def start(
    starting: subprocess.Popen[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Callable[[Kind], Started]]:
    assert starting.stdin is not None and starting.stdout is not None
    stdin, stdout = starting.stdin, starting.stdout
    monkeypatch.setenv("LLFSM_WHITEBOARDS", str(tmp_path / "boards"))

    def ask(what: object) -> int:
        stdin.write(json.dumps(what) + "\n")
        stdin.flush()
        return int(stdout.readline())

    (tmp_path / "motors.yaml").write_text(ARRANGEMENT)
    (tmp_path / "ports.yaml").write_text(PORTS)
    os.mkfifo(tmp_path / "motor.pipe")
    pipe = os.open(tmp_path / "motor.pipe", os.O_RDONLY | os.O_NONBLOCK)
    found: dict[int, Started] = {}

    def ended() -> int:
        status = ask(None)
        if not os.WIFSTOPPED(status):
            found.popitem()
        return status

    def begin(kind: Kind) -> Started:
        given = [kind, str(tmp_path / "motors.yaml"), "motors", str(tmp_path / "ports.yaml"), str(tmp_path / "said")]
        pid = ask([*given, str(tmp_path / "boards")])
        board = None
        while board is None:
            assert state_of(pid) != "Z", (tmp_path / "said").read_text()
            try:
                board = Whiteboard("motors")
            except WhiteboardError:  # it is not served yet
                time.sleep(0.01)
        one = Started(pid, board, tmp_path / "said", pipe, ended)
        found[pid] = one
        wait(lambda: board.view().values["motor"] == 77)
        wait(lambda: 77 in one.sent() if kind == "command" else "begun" in one.said.read_text())
        return one

    try:
        yield begin
    finally:
        os.close(pipe)
        for pid in found:  # the test has failed
            os.kill(pid, signal.SIGKILL)
            ask(None)


def over(run: Started) -> tuple[str, int | str]:
    """How a run ended that shall be at rest: its last frame, and the exit code or signal of its process."""
    last_frame, status = run.comes_to_rest(), run.ended()
    run.board.close()
    ended = Signals(os.WTERMSIG(status)).name if os.WIFSIGNALED(status) else os.waitstatus_to_exitcode(status)
    return last_frame, ended


def each(*kinds: frozenset[Signals]) -> list[object]:
    """The signals of these kinds; those that `make test` leaves out are `long`."""
    found = sorted(frozenset().union(*kinds))
    return [pytest.param(s, id=s.name, marks=[] if s in FEW else pytest.mark.long) for s in found]


pytestmark = pytest.mark.slow


@pytest.mark.parametrize("number", each(ENDS))
def test_the_command_ends_the_run(number: Signals, start: Callable[[Kind], Started]) -> None:
    run = start("command")
    os.killpg(run.pid, number)  # as a terminal does; the loop leaves it to the supervisor
    assert over(run) == ("stopped", 0)
    assert run.sent()[-1] == 0
    quiet = number in (signal.SIGINT, signal.SIGTERM)
    assert run.said.read_text().splitlines()[0].endswith(": stopped" if quiet else f": stopped by {number.name}")


def test_the_command_ends_by_a_real_time_signal(start: Callable[[Kind], Started]) -> None:
    run = start("command")
    os.kill(run.pid, signal.SIGRTMIN + 2)
    assert over(run) == ("stopped", 0)
    assert run.said.read_text().splitlines()[0].endswith(f": stopped by signal {signal.SIGRTMIN + 2}")


def test_the_command_is_suspended_when_all_is_safe(start: Callable[[Kind], Started]) -> None:
    run = start("command")
    os.killpg(run.pid, signal.SIGTSTP)
    assert run.comes_to_rest() == "stopped"
    status = run.ended()
    assert os.WIFSTOPPED(status) and run.sent()[-1] == 0
    assert not Path(f"/proc/{run.pid}/task/{run.pid}/children").read_text()
    os.kill(run.pid, signal.SIGCONT)
    assert over(run) == ("stopped", 0)  # nothing began again


@pytest.mark.parametrize("number", each(KILLS))
def test_the_command_dies(number: Signals, start: Callable[[Kind], Started]) -> None:
    run = start("command")
    os.kill(run.pid, number)
    assert over(run) == ("died", number.name)
    assert run.sent()[-1] == 77  # as docs/ports.md says


@pytest.mark.parametrize("number", each(FAILS, NOTHING))
def test_the_command_does_nothing(number: Signals, start: Callable[[Kind], Started]) -> None:
    run = start("command")
    os.killpg(run.pid, number)
    assert run.goes_on()
    os.kill(run.pid, signal.SIGTERM)
    assert over(run) == ("stopped", 0)


def test_the_command_stands_still(start: Callable[[Kind], Started]) -> None:
    run = start("command")
    os.kill(run.pid, signal.SIGSTOP)
    assert os.WIFSTOPPED(run.ended()) and run.goes_on()
    os.kill(run.pid, signal.SIGCONT)
    os.kill(run.pid, signal.SIGTERM)
    assert over(run) == ("stopped", 0) and run.sent()[-1] == 0


@pytest.mark.parametrize("number", each(ENDS, FAILS, NOTHING, frozenset({Signals.SIGTSTP})))
def test_the_loop_does_nothing(number: Signals, start: Callable[[Kind], Started]) -> None:
    run = start("command")
    os.kill(run.child, number)
    assert run.goes_on()
    os.kill(run.pid, signal.SIGTERM)
    assert over(run) == ("stopped", 0)


@pytest.mark.parametrize("number", each(KILLS))
def test_the_loop_dies(number: Signals, start: Callable[[Kind], Started]) -> None:
    run = start("command")
    os.kill(run.child, number)
    assert over(run) == ("died", 1)
    assert run.sent()[-1] == 0


def test_the_loop_stands_still(start: Callable[[Kind], Started]) -> None:
    run = start("command")
    child = run.child
    os.kill(child, signal.SIGSTOP)
    wait(lambda: state_of(child) == "T")
    view = run.board.view()
    wait(lambda: run.board.view().age > view.age + 0.02)
    assert run.board.view().number == view.number and run.board.view().ending == "running"
    os.kill(child, signal.SIGCONT)
    assert run.goes_on()
    os.kill(run.pid, signal.SIGTERM)
    assert over(run) == ("stopped", 0)


@pytest.mark.parametrize("kind", ["thread", "separate"])
@pytest.mark.parametrize("number", each(KILLS, ENDS - {Signals.SIGINT}))
def test_a_program_dies(number: Signals, kind: Kind, start: Callable[[Kind], Started]) -> None:
    run = start(kind)
    os.kill(run.pid, number)
    assert over(run) == ("died", number.name)


@pytest.mark.parametrize("kind", ["thread", "separate"])
def test_a_program_is_interrupted(kind: Kind, start: Callable[[Kind], Started]) -> None:
    run = start(kind)
    os.killpg(run.pid, signal.SIGINT)
    assert over(run) == ("stopped", 70) and "KeyboardInterrupt" in run.said.read_text()


@pytest.mark.parametrize("kind", ["thread", "separate"])
@pytest.mark.parametrize(
    "number", each(frozenset({Signals.SIGTSTP, Signals.SIGSTOP, Signals.SIGTTIN, Signals.SIGTTOU}))
)
def test_a_program_is_suspended(number: Signals, kind: Kind, start: Callable[[Kind], Started]) -> None:
    run = start(kind)
    os.kill(run.pid, number)
    assert os.WIFSTOPPED(run.ended())
    if kind == "separate":
        assert run.goes_on()
    else:
        stood = run.board.view().number
        age = run.board.view().age
        wait(lambda: run.board.view().age > age + 0.02)
        assert run.board.view().number == stood
    os.kill(run.pid, signal.SIGCONT)
    assert run.goes_on()
    os.kill(run.pid, signal.SIGINT)
    assert over(run) == ("stopped", 70)


@pytest.mark.parametrize("kind", ["thread", "separate"])
@pytest.mark.parametrize("number", each(FAILS - {Signals.SIGTTIN, Signals.SIGTTOU}, NOTHING))
def test_a_program_does_nothing(number: Signals, kind: Kind, start: Callable[[Kind], Started]) -> None:
    run = start(kind)
    os.kill(run.pid, number)
    assert run.goes_on()
    os.kill(run.pid, signal.SIGINT)
    assert over(run) == ("stopped", 70)


def test_the_table_names_each_signal_once() -> None:
    page = (PROJECT / "docs" / "safety.md").read_text()
    table = page.partition("## Signals")[2].partition("\n## ")[0]
    named = re.findall(
        r"SIG[A-Z0-9]+", "\n".join(line.split("|")[1] for line in table.splitlines() if line[:3] == "| S")
    )
    assert sorted(named) == sorted(s.name for s in NAMED)
    real_time = range(signal.SIGRTMIN, signal.SIGRTMAX + 1)
    assert {*map(int, NAMED)} == {*map(int, signal.valid_signals())} - {*real_time}

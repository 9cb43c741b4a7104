"""Whiteboards between processes: what is read is whole, and nobody writes what is not theirs."""

from __future__ import annotations

import asyncio
import ctypes
import json
import mmap
import os
import pwd
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from decimal import Decimal
from pathlib import Path
from random import Random

import pytest

from llfsm_verify.arrangement.loader import build_arrangement, load_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.runtime.live import control, generations
from llfsm_verify.runtime.live.generations import segment_words
from llfsm_verify.runtime.live.loop import LiveCode, Loop
from llfsm_verify.runtime.live.plan import starting_values
from llfsm_verify.runtime.live.run import Run
from llfsm_verify.runtime.live.slots import slots_of
from llfsm_verify.runtime.whiteboard import audit, segment
from llfsm_verify.runtime.whiteboard import client as board_of_others
from llfsm_verify.runtime.whiteboard.audit import FIRST, AuditLog, verify
from llfsm_verify.runtime.whiteboard.client import PostRefused, Whiteboard, WhiteboardError
from llfsm_verify.runtime.whiteboard.permissions import CONNECTIONS, PIECE, Permissions, user_name
from llfsm_verify.runtime.whiteboard.places import MOST_REQUEST, NoPlace, names, socket_path
from llfsm_verify.runtime.whiteboard.segment import Attached, Lent, NoSegment, Segment
from llfsm_verify.runtime.whiteboard.server import MOST_REFUSALS, MOST_WAKES, NameTaken, Server
from llfsm_verify.runtime.whiteboard.shared import Shared
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.values import elements
from tests.cli.running import LIGHTS, llfsm
from tests.runtime.live.runs import code_of

KINDS = {
    "name": "kinds",
    "cycle_ms": 10,
    "types": {"Mode": ["LOW", "HIGH"]},
    "whiteboard": {
        "go": {"type": "bool", "role": "input"},
        "level": {"type": "-3..4", "role": "input", "init": -1},
        "large": {"type": "uint64", "role": "input", "init": 0},
        "far": {"type": "int64", "role": "input", "init": 0},
        "mode": {"type": "Mode", "role": "input", "init": "LOW"},
        "speed": {"type": {"decimal": 0.01, "range": "-1.0..1.0"}, "role": "input", "init": 0},
        "a": {"type": {"array": "0..9", "size": 2}, "init": [3, 4]},
        "kept": {"type": "uint64", "init": 0},
        "seen": {"type": "int64", "init": 0},
        "now": {"type": "Mode", "init": "LOW"},
        "drive": {"type": {"decimal": 0.01, "range": "-1.0..1.0"}, "init": 0},
        "n": {"type": "int", "init": 0},
    },
    "machines": {
        "m": {
            "inline": {
                "machine": "M",
                "states": [
                    {
                        "name": "S",
                        "internal": "if (go) { kept = large; seen = far; now = mode; drive = speed; n = -level; }",
                        "transitions": [{"when": "false", "to": "S"}],
                    }
                ],
            }
        }
    },
    "schedule": ["m"],
}


@pytest.fixture(autouse=True)
def boards(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of its own for the sockets; its name is short, as sockets want it."""
    folder = Path(f"/tmp/llfsm-test-{os.getpid()}-{threading.get_ident() & 0xFFFF}")
    monkeypatch.setenv("LLFSM_WHITEBOARDS", str(folder))
    monkeypatch.setattr(board_of_others, "SECONDS", None)  # however busy the machine is
    return folder


@pytest.fixture(autouse=True)
def tidy(boards: Path) -> Iterator[None]:
    yield
    for path in boards.glob("*") if boards.exists() else ():
        path.unlink()
    if boards.exists():
        boards.rmdir()


@pytest.fixture(autouse=True)
def refusals_are_counted_until_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(audit, "INTERVAL", 1e9)


@contextmanager
def served(
    arrangement: Arrangement,
    name: str = "board",
    period: int = 1_000_000,
    refused: list[str] | None = None,
    audit: AuditLog | None = None,
) -> Iterator[Loop]:
    """A run with a whiteboard, on threads of this process."""
    code = code_of(arrangement)
    loop = Loop(code, period=period, held=starting_values(code.program))
    shared, over = Shared(name, loop), threading.Event()
    said = [] if refused is None else refused
    server = Server(name, shared, Permissions.of(arrangement), refused=said.append, audit=audit)
    run = Run(loop)

    def serve() -> None:
        while not over.is_set():
            server.serve(0.01)

    thread = threading.Thread(target=serve)
    run.start()
    thread.start()
    try:
        yield loop
    finally:
        run.stop()
        assert run.wait()
        over.set()
        thread.join()
        server.note_left_out()
        server.close()
        shared.close()


def wait_for(board: Whiteboard, name: str, value: object) -> None:
    """Until the slot has this value; the time limit of the test ends it."""
    while board.get(name) != value:
        time.sleep(0.001)


@pytest.mark.slow
def test_values_of_all_types_go_in_and_come_out() -> None:
    with served(build_arrangement(KINDS)), Whiteboard("board") as board:
        first = board.view()
        assert first.ending == "running" and first.age >= 0
        assert first.values["a[1]"] == 4 and first.values["m"] == "S" and first.values["level"] == -1
        for large, far, mode, speed, level in (
            ((1 << 64) - 1, -(1 << 63), "HIGH", "-0.75", 4), (1 << 63, (1 << 63) - 1, "LOW", "1.00", -3),
            (5, -1, "HIGH", "0.01", 0),
        ):  # fmt: skip
            board.post(go=True, large=large, far=far, mode=mode, speed=speed, level=level)
            wait_for(board, "kept", large)
            view = board.view().values
            assert (view["seen"], view["now"], str(view["drive"]), view["n"]) == (far, mode, speed, -level)
            assert (view["large"], view["far"], view["level"]) == (large, far, level)


@pytest.mark.long
def test_what_slots_show_is_what_the_executor_has() -> None:
    for path in sorted(Path("models").glob("*/arrangement.yaml")):
        program = lower(load_arrangement(str(path)), keep_all_bits=True)
        code = LiveCode(program)
        loop = Loop(code)
        loop.begin(0)
        loop.go(7)
        values = NativeProgram(program).layout.decode(loop.record)
        known = {}
        for var in program.vars:
            if var.name in values and var.origin.kind not in ("control", "output"):
                known |= dict(elements(var, values[var.name]))
        states = {
            program.machines[s.machine].name: program.machines[s.machine].states[values[s.state]] for s in program.slots
        }
        found = {slot.name: slot.value(loop.frame) for slot in slots_of(code)}
        assert {name: found[name] for name in known} == known
        assert {name: found[name] for name in states} == states


@pytest.mark.slow
def test_a_writer_posts_in_memory_of_its_own() -> None:
    with served(build_arrangement(KINDS)), Whiteboard("board") as board, Whiteboard("board") as other:
        other.post(level=3)
        with board.writer("large", "far", "mode", "speed", "go") as writer:
            for large, far, mode, speed in (
                ((1 << 64) - 1, -(1 << 63), "HIGH", "-0.75"), (1 << 63, (1 << 63) - 1, "LOW", "1.00"),
                (5, -1, "HIGH", "0.01"),
            ):  # fmt: skip
                writer.post(go=True, large=large, far=far, mode=mode, speed=Decimal(speed))
                wait_for(board, "kept", large)
                view = board.view().values
                assert (view["seen"], view["now"], str(view["drive"]), view["n"]) == (far, mode, speed, -3)
            for values, why in (
                ({"level": 1}, "no input `level`"), ({"mode": "MIDDLE"}, "not one of LOW, HIGH"), ({"go": 2}, "go"),
                ({"large": -1}, "not a number"), ({"speed": 2}, "not"),
            ):  # fmt: skip
                with pytest.raises(PostRefused, match=why):
                    writer.post(**values)
            with pytest.raises(PostRefused, match="belongs to another process"):
                other.post(large=1)
            with pytest.raises(PostRefused, match="belongs to another process"):
                other.writer("speed", "level")
            with pytest.raises(PostRefused, match="no input `x`"):
                board.writer("x")
        board.close()
        while True:  # until the server has noticed
            try:
                other.post(level=-2)
                other.writer("far").close()
                break
            except PostRefused:
                time.sleep(0.001)
        wait_for(other, "n", 2)
        assert other.get("kept") == 5 and other.get("mode") == "HIGH"


@pytest.mark.slow
def test_a_writer_that_writes_nonsense_is_not_waited_for() -> None:
    """Whatever stands in memory that was lent: the loop goes on, and takes only values that fit."""
    with served(build_arrangement(KINDS)) as loop, Whiteboard("board") as board:
        writer = board.writer("level", "go")
        lent = writer._lent
        assert lent is not None
        random = Random(1)
        writer.post(level=2, go=True)
        wait_for(board, "n", -2)
        for number in range(200):
            if number % 2:
                place = random.randrange(segment_words(len(lent.next))) * 8
                ctypes.c_uint64.from_address(lent.address + place).value = random.getrandbits(64)
            else:
                lent.next[random.randrange(len(lent.next))] = random.randrange(-(1 << 63), 1 << 63)
                lent.publish()
            before = loop.number
            while loop.number < before + 2:
                time.sleep(0)
            assert -3 <= board.get("level") <= 4 and board.get("go") in (True, False)
        writer.close()
    with closing(Segment("lent", 2, lent=True)) as segment, pytest.raises(OSError, match="not permitted"):
        os.ftruncate(segment.descriptor, 8)


@pytest.mark.slow
def test_a_frame_that_never_comes_is_not_waited_for() -> None:
    """A writer that was lent memory says that there is a frame, and writes none: nobody who reads it waits."""
    code = LiveCode(lower(build_arrangement(KINDS), keep_all_bits=True))
    loop = Loop(code)
    with closing(Shared("board", loop)) as shared, closing(Shared("next", Loop(code))) as following:
        lent = shared.posts.lend(["level"])
        place = shared.posts.place("level")
        writer = Lent(lent.descriptor, lent.words)
        assert shared.posts.posted("level") is None
        writer.next[place], writer.next[place + 1] = 2, 1
        writer.publish()
        assert shared.posts.posted("level") == 2
        loop.begin(0)
        loop.go(1)  # reads it
        newest = 8 * generations.NEWEST
        for number in (2, 5, -1, 1 << 62):
            ctypes.c_int64.from_address(writer.address + newest).value = number
            assert lent.newest() is None
            assert shared.posts.posted("level") == 2  # as the loop has read it
            following.posts.adopt(shared.posts)
            assert following.posts.posted("level") == 2
        assert segment.code().word(lent.address, lent.words, place) in (0, 2)
        writer.close()


@pytest.mark.slow
def test_what_is_refused() -> None:
    with served(build_arrangement(KINDS)), Whiteboard("board") as board, Whiteboard("board") as other:
        for values, why in (
            ({"nothing": 1}, "there is no input `nothing`"), ({"a": 1}, "there is no input `a`"),
            ({"level": 5}, "not a number from -3 to 4"), ({"mode": "MIDDLE"}, "not one of LOW, HIGH"),
            ({"go": True, "level": 9}, "not a number"), ({"speed": "0.001"}, "not a multiple of 0.01"),
        ):  # fmt: skip
            with pytest.raises(PostRefused, match=why):
                board.post(**values)
        assert board.get("go") is False  # of a post that is refused, nothing is posted
        board.post(level=2)
        with pytest.raises(PostRefused, match="belongs to another process"):
            other.post(level=1)
        board.close()
        while True:  # until the server has noticed
            try:
                other.post(level=1)
                break
            except PostRefused:
                time.sleep(0.001)
        wait_for(other, "level", 1)
        with pytest.raises(KeyError, match="no slot `nothing`"):
            other.get("nothing")


@pytest.mark.slow
def test_requests_that_are_none() -> None:
    with served(load_arrangement(LIGHTS)):
        connection = socket.socket(socket.AF_UNIX)
        connection.connect(str(socket_path("board")))
        stream = connection.makefile("rwb")
        assert json.loads(stream.readline())["whiteboard"] == "board"
        for line in (
            b"",
            b"{",
            b"[" * 5000,
            b"[1]",
            b'{"post": 1}',
            b'{"post": {}, "x": 1}',
            b'{"post": {"car": []}}',
            b"\xff",
        ):
            stream.write(line + b"\n")
            stream.flush()
            assert "error" in json.loads(stream.readline())
        stream.write(b'{"post": {}}\n')
        stream.flush()
        assert json.loads(stream.readline()) == {"ok": True}
        with suppress(ConnectionError):  # a line without an end: the server has had enough
            connection.sendall(b"x" * (2 * MOST_REQUEST))
            while connection.recv(1):
                pass
        stream.close()
        connection.close()
        with Whiteboard("board") as board:
            assert board.view().ending == "running"


@pytest.mark.slow
def test_two_of_one_name() -> None:
    with served(load_arrangement(LIGHTS)):
        loop = Loop(code_of(load_arrangement(LIGHTS)))
        with closing(Shared("board", loop)) as shared, pytest.raises(NameTaken, match="in use"):
            Server("board", shared, Permissions())
        assert names() == ["board"]


OPERATED = {
    "name": "operated",
    "cycle_ms": 1,
    "whiteboard": {"mode": {"type": "0..3", "init": 0}, "ran": {"type": "0..1000", "init": 0}},
    "machines": {
        name: {
            "inline": {
                "machine": "M",
                "states": [
                    {"name": "S", "internal": "ran = (ran + 1) % 1000;", "transitions": [{"when": "false", "to": "S"}]},
                    {"name": "WAITS", "stays": True},
                ],
                "suspend": "WAITS",
            }
        }
        for name in "ab"
    },
    "schedule": ["a", "b"],
    "operators": {"suspend": ["a", "b"], "resume": ["a"], "write": ["mode"]},
}


@pytest.mark.slow
def test_operators_command_in_their_order() -> None:
    with served(build_arrangement(OPERATED)), Whiteboard("board") as board:
        assert board.machines == {"a": ("S", "WAITS"), "b": ("S", "WAITS")}
        frames = []
        for number in range(20):
            frames.append(board.command("suspend", "a"))
            assert board.state_of("a") == "WAITS"
            frames.append(board.command("resume", "a"))
            assert board.state_of("a") == "S"
            frames.append(board.command("write", "mode", number % 4))
            assert board.get("mode") == number % 4
        assert frames == sorted(set(frames))
        for given, why in (
            (("restart", "a"), "does not declare restart of `a`, only suspend.a., suspend.b., resume.a., write.mode."),
            (("resume", "b"), "does not declare"), (("write", "mode", 4), "not a number from 0 to 3"),
            (("write", "ran", 1), "does not declare"), (("suspend", "a", 1), "has no value"),
        ):  # fmt: skip
            with pytest.raises(PostRefused, match=why):
                board.command(*given)


@pytest.mark.slow
def test_operators_let_a_machine_enter_a_state() -> None:
    """From any state to any other, for those with the clearance, and everything else is refused."""
    operated = {**OPERATED, "operators": {"enter": ["a", "b"], "suspend": ["a"]}}
    refused: list[str] = []
    users = {"levels": ["low", "high"], "command": {"b": "high"}, "users": {"nobody": "high"}}
    with served(build_arrangement({**operated, "access": users}), refused=refused), Whiteboard("board") as board:
        frames = []
        for state in ("WAITS", "S", "S", "WAITS", "WAITS", "S"):
            frames.append(board.command("enter", "a", state))
            assert board.state_of("a") == state
        board.command("suspend", "a")
        board.command("enter", "a", "S")
        assert board.state_of("a") == "S" and board.state_of("b") == "S"
        assert frames == sorted(set(frames))
        for given, why in (
            (("enter", "a", "SS"), "a: `SS` is not one of S, WAITS$"), (("enter", "a"), "a: a value is a word"),
            (("enter", "b", "S"), r"\(low\) may not enter `b`: that needs `high`"), (("enter", "c", "S"), "declare"),
            (("state", "a", "S"), r"does not declare state of `a`, only enter\(a\), enter\(b\), suspend\(a\)"),
            (("suspend", "a", "S"), "suspend has no value"),
        ):  # fmt: skip
            with pytest.raises(PostRefused, match=why):
                board.command(*given)


class Raw:
    """A client that says what it likes."""

    def __init__(self, name: str = "board") -> None:
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.connect(str(socket_path(name)))
        self._lines = self.socket.makefile("rb")
        self.hear()

    def say(self, *requests: object) -> None:
        texts = [r if isinstance(r, bytes) else json.dumps(r).encode() for r in requests]
        self.socket.sendall(b"".join(text + b"\n" for text in texts))

    def hear(self) -> dict[str, object]:
        found = json.loads(self._lines.readline())
        assert isinstance(found, dict)
        return found

    def close(self) -> None:
        self._lines.close()
        self.socket.close()


@pytest.mark.slow
def test_commands_of_two_clients_are_all_taken() -> None:
    """Also where one of them gives its next command as soon as one was taken."""
    with served(build_arrangement(OPERATED)) as loop, closing(Raw()) as one, closing(Raw()) as other:
        for number in range(20):
            one.say({"command": ["suspend", "a"]}, {"command": ["resume", "a"]}, {"command": ["suspend", "b"]})
            other.say({"command": ["write", "mode", number % 4]})
            answers = [one.hear(), one.hear(), one.hear(), other.hear()]
            assert all(answer.get("ok") for answer in answers)
            assert len({answer["frame"] for answer in answers}) == 4
            with Whiteboard("board") as board:
                assert board.get("mode") == number % 4
        assert loop.number > 80


@pytest.mark.slow
def test_a_hostile_client_spoils_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    refused: list[str] = []
    monkeypatch.setattr(audit, "INTERVAL", 1e9)
    log = AuditLog(tmp_path / "log")
    with served(build_arrangement(OPERATED), refused=refused, audit=log), Whiteboard("board") as board:
        with closing(Raw()) as client:
            deep = b'{"command": ["write", "mode", ' + b"[" * 900 + b"]" * 900 + b"]}"
            long = '{"command": ["suspend", "' + "\u00e9" * 400_000 + '"]}'
            for request, why in (
                (deep, "a value is a word"), ({"command": ["write", "mode", {"x": 1}]}, "a value is a word"),
                ({"command": ["value", "mode"]}, "does not declare value"),
                (long.encode(), "does not declare"),
                ({"write": []}, "memory is lent for inputs"), ({"subscribe": "x"}, "requests are"),
            ):  # fmt: skip
                client.say(request)
                assert why in str(client.hear()["error"])
            for number in range(MOST_WAKES + 1):
                client.say({"subscribe": True})
                assert ("error" in client.hear()) == (number == MOST_WAKES)
        with closing(Raw()) as client:
            client.say(*[b""] * 5000)
            with suppress(ConnectionError, ValueError):
                while client.hear():
                    pass
        with closing(Raw()) as client:
            with suppress(ConnectionError):
                client.say(b"x" * (MOST_REQUEST + 2 * PIECE))
            assert f"more than {MOST_REQUEST:,} bytes" in str(client.hear()["error"])
        with ExitStack() as crowd:
            for _ in range(CONNECTIONS.own):
                client = crowd.enter_context(closing(socket.socket(socket.AF_UNIX)))
                client.connect(str(socket_path("board")))
                with suppress(ConnectionError):
                    client.recv(1)
            with pytest.raises(WhiteboardError, match=f"has {CONNECTIONS.own} connections already"):
                Whiteboard("board")
        board.command("suspend", "a")
        large = tmp_path / "large.yaml"
        large.write_text("x" * MOST_REQUEST)
        with pytest.raises(PostRefused, match="1,048,576 are the most"):
            board.replace("a", large)
    log.close()
    assert verify(tmp_path / "log").last == log.last
    assert len(refused) == FIRST + 1 and "more" in refused[-1]


@pytest.mark.slow
def test_users_have_clearances() -> None:
    account = pwd.getpwuid(os.getuid()).pw_name
    access = {
        "levels": ["low", "high"],
        "write": {"mode": "high"},
        "command": {"b": "high"},
        "users": {"somebody": "high"},
    }
    refused: list[str] = []
    with served(build_arrangement({**OPERATED, "access": access}), refused=refused), Whiteboard("board") as board:
        board.command("suspend", "a")
        for given in (("suspend", "b"), ("write", "mode", 1)):
            with pytest.raises(PostRefused, match=rf"user `{account}` \(low\) may not {given[0]} .*needs `high`"):
                board.command(*given)
    assert [line.split(": ", 1)[0] for line in refused] == [f"process {os.getpid()} of user {os.getuid()}"] * 2
    access["users"] = {account: "high"}
    with served(build_arrangement({**OPERATED, "access": access})), Whiteboard("board") as board:
        board.command("suspend", "b")
        board.command("write", "mode", 1)
        assert board.get("mode") == 1


@pytest.mark.slow
def test_a_subscriber_gets_every_frame_once() -> None:
    """As fast as it reads: what it does not get, it is told of."""
    with served(build_arrangement(OPERATED), period=100_000) as loop, Whiteboard("board") as board:
        with board.subscribe("ran") as updates:
            numbers, missed, last = [], 0, None
            for update in updates:
                numbers.append(update.number)
                missed += update.missed
                if last is not None and not update.missed:
                    assert update.values["ran"] == (last + 2) % 1000 and update.number == numbers[-2] + 1
                last = update.values["ran"]
                if len(numbers) == 300:
                    break
            assert numbers == sorted(set(numbers))
            assert numbers[-1] - numbers[0] == 299 + missed
            before = loop.number
            while loop.number < before + 200:
                time.sleep(0.001)
            found = updates.read()  # with what was read and not handed out when the loop above was left
            assert any(u.missed for u in found) and sum(u.missed + 1 for u in found) == found[-1].number - numbers[-1]
        with pytest.raises(KeyError, match="no slot `x`"):
            board.subscribe("x")


@pytest.mark.slow
def test_a_subscriber_waits_with_asyncio() -> None:
    async def follow(board: Whiteboard) -> list[object]:
        found: list[object] = []
        with board.subscribe("mode") as updates:
            async for update in updates:
                found.append(update.values["mode"])
                if len(found) == 3:
                    break
                await asyncio.to_thread(set_mode, len(found))
        return found

    def set_mode(value: int) -> None:
        with Whiteboard("board") as other:
            other.command("write", "mode", value)

    with served(build_arrangement(OPERATED)), Whiteboard("board") as board:
        assert asyncio.run(follow(board)) == [0, 1, 2]


@pytest.mark.slow
def test_a_subscription_ends_with_the_run() -> None:
    with served(build_arrangement(OPERATED)) as loop, Whiteboard("board") as board:
        with board.subscribe() as updates:
            first = next(iter(updates))
            assert set(first.values) == {"mode", "ran", "a", "b"}
            loop.stop()
            last = [first, *updates][-1]
        view = board.view()
        assert view.ending == "stopped" and view.number >= last.number and view.values == last.values


@pytest.mark.parametrize("name", ["", "a/b", ".hidden", "x" * 65, "a b"])
def test_names_that_are_none(name: str) -> None:
    with pytest.raises(NoPlace, match="not a valid name of a whiteboard"):
        socket_path(name)


def test_a_folder_of_others_is_not_trusted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LLFSM_WHITEBOARDS", str(tmp_path))
    tmp_path.chmod(0o777)
    with pytest.raises(NoPlace, match="its owner alone may write"):
        socket_path("board")


def test_the_kernel_refuses_others() -> None:
    """A descriptor of the segment lets nobody write, cut, or map for writing; nor by the name that /proc has for it."""
    segment = Segment("kernel", 6)
    segment.publish([1, 2, 3, 4, 5, 6])
    descriptor = os.dup(segment.descriptor)
    attached = Attached(descriptor)
    named = os.open(f"/proc/self/fd/{descriptor}", os.O_RDWR)
    attempts = (
        lambda: os.ftruncate(descriptor, 0), lambda: os.ftruncate(descriptor, 1 << 20),
        lambda: mmap.mmap(descriptor, 0), lambda: os.pwrite(descriptor, b"x", 600),
        lambda: os.pwrite(named, b"x", 600),
        lambda: os.truncate(f"/proc/self/fd/{descriptor}", 0),
    )  # fmt: skip
    for attempt in attempts:
        with pytest.raises(OSError, match="not permitted"):
            attempt()
    segment.publish([2, 3, 4, 5, 6, 7])
    assert attached.newest() == [2, 3, 4, 5, 6, 7]
    attached.close()
    segment.close()
    os.close(named)
    os.close(descriptor)


@pytest.mark.slow
def test_what_is_asked_is_logged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also what is refused, and who asks for too much is sent away."""
    document = {**KINDS, "operators": {"suspend": ["m"]}}
    monkeypatch.setattr(audit, "INTERVAL", 1e9)
    log = AuditLog(tmp_path / "log")
    with served(build_arrangement(document), audit=log):
        with Whiteboard("board") as board:
            board.post(go=True)
            board.post(go=False)
            frame = board.command("suspend", "m")
            with pytest.raises(PostRefused):
                board.command("unload", "m")
        with Whiteboard("board") as board:
            for _ in range(MOST_REFUSALS + 1):
                with pytest.raises(PostRefused):
                    board.post(nothing=1)
            with pytest.raises(WhiteboardError, match=r"gone|disconnected"):
                board.post(nothing=1)
        monkeypatch.setattr(log, "failure", "the disk is full")
        with Whiteboard("board") as board, pytest.raises(PostRefused, match="cannot be written: the disk is full"):
            board.command("suspend", "m")
        monkeypatch.setattr(log, "failure", None)
    log.close()
    assert verify(tmp_path / "log").last == log.last
    lines = [json.loads(line) for line in (tmp_path / "log").read_text().splitlines()]
    assert all(line["uid"] == os.getuid() and line["pid"] == os.getpid() for line in lines[:-1])
    told = [(line["what"], line.get("kind", line.get("inputs"))) for line in lines[:3]]
    assert told == [("posts", ["go"]), ("command", "suspend"), ("taken", "suspend")]
    assert lines[2]["frame"] == frame and "does not declare unload" in lines[3]["why"]
    more = {"user": user_name(os.getuid()), "more": MOST_REFUSALS + 4 - FIRST}
    assert len(lines) == 3 + FIRST + 1 and lines[-1] == {**lines[-1], "what": "refused", **more}


def test_what_is_closed_is_not_touched() -> None:
    """Machine code that goes to an address that is unmapped ends the process."""
    frames = Segment("closed", 2), Segment("lent", 2, lent=True)
    segment, lent = frames[0], Lent(frames[1].descriptor, 2)
    segment.publish([1, 5])
    attached = Attached(segment.descriptor)
    one = attached.reader(1)
    assert one() == 5
    for mapped in (segment, attached, lent):
        mapped.close()
    touching = (
        lambda: segment.publish([2, 6]), segment.newest, attached.newest, lambda: attached.frame(1),
        lambda: attached.latest, lambda: attached.reader(1), lent.publish,
    )  # fmt: skip
    for touch in touching:
        with pytest.raises(ValueError, match="the segment is closed"):
            touch()
    frames[1].close()


def test_a_segment_is_closed_once() -> None:
    segment = Segment("closed", 2)
    segment.close()
    other = os.memfd_create("other")
    assert other == segment.descriptor, "the number is another file's now"
    segment.close()
    os.fstat(other)
    os.close(other)


@pytest.mark.slow
def test_a_subscription_outlives_its_whiteboard() -> None:
    with served(load_arrangement(LIGHTS), "outlived"):
        board = Whiteboard("outlived")
        board.view()  # there is a frame
        with board.subscribe() as subscription:
            assert subscription.read()
            board.close()
            with pytest.raises(ValueError, match="the segment is closed"):
                subscription.read()


def test_what_is_no_segment(tmp_path: Path) -> None:
    descriptor = os.memfd_create("plain", os.MFD_ALLOW_SEALING)
    os.ftruncate(descriptor, 4096)
    with pytest.raises(NoSegment, match="may still change its size"):
        Attached(descriptor)
    with (tmp_path / "file").open("wb") as file, pytest.raises(NoSegment, match="not memory that can be sealed"):
        Attached(file.fileno())
    os.close(descriptor)


@pytest.mark.slow
def test_a_killed_server_is_noticed_and_its_last_frame_stays() -> None:
    command = [sys.executable, "-m", "llfsm_verify", "run", LIGHTS, "--rate", "100", "--whiteboard", "killed"]
    for _ in range(2):
        process = subprocess.Popen(command)
        try:
            board = None
            while board is None:
                assert process.poll() is None
                try:
                    board = Whiteboard("killed")
                    board.view()
                except WhiteboardError:
                    board = None
                    time.sleep(0.02)
            process.send_signal(signal.SIGKILL)
            process.wait()
            view = board.view()
            assert view.ending == "died" and view.number >= 1 and board.view().number == view.number
            with pytest.raises(WhiteboardError, match="gone"):
                board.post(car=True)
            board.close()
            with pytest.raises(WhiteboardError, match="there is no whiteboard"):
                Whiteboard("killed")
        finally:
            process.kill()
            process.wait()


def test_the_list_says_that_it_is_empty() -> None:
    done = llfsm("whiteboard", "list")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "no run has a whiteboard\n")


@pytest.mark.slow
def test_the_command(capsys: pytest.CaptureFixture[str]) -> None:
    with served(load_arrangement(LIGHTS), "lights") as loop:
        done = llfsm("whiteboard", "list")
        assert done.returncode == 0 and done.stdout.startswith("lights: frame ") and "running" in done.stdout
        assert llfsm("whiteboard", "post", "lights", "car=true").returncode == 0
        done = llfsm("whiteboard", "get", "lights", "car", "ns")
        assert done.returncode == 0 and [line.partition(" = ")[0] for line in done.stdout.split("\n")] == [
            "car",
            "ns",
            "",
        ]
        for arguments in (("get", "nothing"), ("get", "lights", "nothing"), ("post", "lights", "car=maybe")):
            done = llfsm("whiteboard", *arguments)
            assert done.returncode == 3 and "error[E486]" in done.stderr
        assert llfsm("whiteboard", "post", "lights", "car").returncode == 2
        threading.Timer(0.2, loop.stop).start()
        done = llfsm("whiteboard", "watch", "lights", "ns", "car")
        assert done.returncode == 0 and done.stdout.endswith("stopped\n") and "car = true" in done.stdout
    assert loop.control[control.STOP]
    done = llfsm("run", LIGHTS, "--whiteboard", "a/b")
    assert done.returncode == 3 and "error[E485]" in done.stderr

"""What one client of a whiteboard may do to others: it has its share, and its turn."""

from __future__ import annotations

import asyncio
import ctypes
import gc
import json
import os
import platform
import resource
import select
import signal
import socket
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager, suppress
from errno import EAGAIN, EMFILE, ENFILE, ENOMEM, ENOSPC
from functools import cache
from pathlib import Path

import pytest

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.arrangement.replacing import Change, Replacement
from llfsm_verify.jsonvalue import Json
from llfsm_verify.limits import Limits
from llfsm_verify.runtime.live import control
from llfsm_verify.runtime.live.loop import LiveCode, Loop
from llfsm_verify.runtime.live.plan import starting_values
from llfsm_verify.runtime.swapping import check_process
from llfsm_verify.runtime.swapping.check_process import Check, CheckAnswer
from llfsm_verify.runtime.whiteboard.audit import ENDED, FIRST, INTERVAL, AuditLog, Sparing, verify
from llfsm_verify.runtime.whiteboard.client import PostRefused, Whiteboard, WhiteboardError, called
from llfsm_verify.runtime.whiteboard.permissions import (
    COMMANDS,
    CONNECTIONS,
    OWN,
    PIECES,
    READS,
    SUBSCRIPTIONS,
    Client,
    Permissions,
    Share,
)
from llfsm_verify.runtime.whiteboard.places import NoPlace, names, socket_path
from llfsm_verify.runtime.whiteboard.posts import LENT, Refused
from llfsm_verify.runtime.whiteboard.server import CALLS, FEW, KEPT_BYTES, STRANGERS, NameTaken, Server
from llfsm_verify.runtime.whiteboard.shared import Shared, wake_path
from tests.runtime.live.runs import code_of
from tests.runtime.whiteboard.test_server import OPERATED, Raw, boards, served, tidy  # noqa: F401 - fixtures

BOARD = {**OPERATED["whiteboard"], "go": {"type": "bool", "role": "input", "init": False}}  # type: ignore[dict-item]
PLAIN = {**OPERATED, "whiteboard": BOARD}
ACCESS = {
    **PLAIN,
    "access": {
        "levels": ["low", "high"], "machines": {"a": "high", "b": "high"}, "write": {"mode": "high", "ran": "high"},
        "command": {"a": "high", "b": "high"},
        "users": {"root": "high", "daemon": "low", "bin": "low", "sys": "low", "games": "high"},
    },
}  # fmt: skip
DAEMON, BIN, SYS, GAMES, NOBODY = 1, 2, 3, 5, 65534
SETRESUID = {"x86_64": 117, "aarch64": 147}.get(platform.machine())
pytestmark = pytest.mark.slow
needs_root = pytest.mark.skipif(os.getuid() != 0 or SETRESUID is None, reason="only root can be another user")


@contextmanager
def as_user(uid: int) -> Iterator[None]:
    """This thread belongs to another user; the others, as that of the server, do not."""

    def become(*users: int) -> None:
        assert SETRESUID is not None
        assert ctypes.CDLL(None).syscall(SETRESUID, *users) == 0

    become(uid, uid, 0)
    try:
        yield
    finally:
        become(0, 0, 0)


@cache
def made(text: str) -> tuple[Arrangement, LiveCode]:
    arrangement = build_arrangement(json.loads(text))
    return arrangement, code_of(arrangement)


@contextmanager
def standing(document: dict[str, object], audit: AuditLog | None = None) -> Iterator[tuple[Server, Shared, list[str]]]:
    """A server that serves when the test says so, of a run that stands at its first frame."""
    arrangement, code = made(json.dumps(document))
    loop, said = Loop(code, held=starting_values(code.program)), list[str]()
    with closing(Shared("board", loop)) as shared:
        loop.begin(0)
        server = Server("board", shared, Permissions.of(arrangement), refused=said.append, audit=audit)
        with closing(server):
            yield server, shared, said


def connected() -> socket.socket:
    connection = socket.socket(socket.AF_UNIX)
    connection.settimeout(0)
    try:
        connection.connect(str(socket_path("board")))
    except OSError:
        connection.close()
        raise
    return connection


def heard(connection: socket.socket) -> list[dict[str, object]]:
    """The lines that are there."""
    data = b""
    try:
        while more := connection.recv(1 << 20):
            data += more
    except BlockingIOError:
        pass
    return [json.loads(line) for line in data.splitlines()]


def fill(connections: ExitStack, server: Server, uid: int, count: int) -> list[str]:
    """So many connections of a user; why they were refused, if they were."""
    found = []
    for _ in range(count):
        with as_user(uid):
            one = connections.enter_context(connected())
        server.serve(0)
        found += [str(line["error"]) for line in heard(one) if "error" in line]
    return found


def test_shares() -> None:
    def lacks(share: Share, uid: int, rank: int, *held: tuple[int, int]) -> str:
        with socket.socket(socket.AF_UNIX) as connection:
            return share.lacks(Client(connection, 1, uid, rank), held) or ""

    small = Share("things", 6, 2, 5)
    readers, commanding = [(DAEMON, READS), (DAEMON, READS), (BIN, READS), (BIN, READS)], (GAMES, COMMANDS)
    assert not lacks(small, DAEMON, READS, readers[0])
    assert "user `daemon` has 2 things already" in lacks(small, DAEMON, READS, *readers[:2])
    assert "users who may not command have 4 things" in lacks(small, SYS, READS, *readers)
    assert not lacks(small, GAMES, COMMANDS, *readers)
    assert "other users than root and that of the run have 5 things" in lacks(
        small, SYS, COMMANDS, *readers, commanding
    )
    assert not lacks(Share("things", 6, 2), SYS, COMMANDS, *readers, commanding)
    assert not lacks(small, 0, OWN, *readers, commanding, *[(0, OWN)] * 5)
    assert "user `root` has 6 things" in lacks(small, 0, OWN, *[(0, OWN)] * 6)
    assert PIECES.others == LENT - PIECES.each and CONNECTIONS.others is None


@needs_root
def test_each_user_has_a_share_of_the_connections() -> None:
    with standing(ACCESS) as (server, _, _), ExitStack() as connections:
        most = CONNECTIONS.each
        assert fill(connections, server, DAEMON, most + 1) == [
            f"user `daemon` has {most} connections already, which is the share of a user"
        ]
        assert fill(connections, server, BIN, most) == []
        together = f"users who may not command have {2 * most} connections already, which is their share"
        assert fill(connections, server, SYS, 1) == [together]
        assert len(fill(connections, server, GAMES, most + 1)) == 1
        assert fill(connections, server, 0, CONNECTIONS.own) == []


@needs_root
def test_each_user_has_a_share_of_subscriptions_and_memory() -> None:
    with standing(ACCESS) as (server, _, _), ExitStack() as connections:
        with as_user(DAEMON):
            clients = [connections.enter_context(connected()) for _ in range(CONNECTIONS.each)]
        answers = []
        for client in clients:
            server.serve(0)
            heard(client)
            for request in (b'{"subscribe": true}\n', b'{"subscribe": true}\n', b'{"write": ["go"]}\n'):
                client.sendall(request)
                server.serve(0)
                server.serve(0)
                answers += heard(client)
        assert sum("socket" in answer for answer in answers) == SUBSCRIPTIONS.each
        lent = 0
        for _ in range(LENT):
            clients.pop(0).close()
            server.serve(0)
            with as_user(DAEMON):
                client = connected()
            server.serve(0)
            heard(client)
            client.sendall(b'{"write": ["go"]}\n')
            server.serve(0)
            server.serve(0)
            lent += any("words" in answer for answer in heard(client))
            client.close()
            server.serve(0)
        assert lent + sum("words" in answer for answer in answers) == PIECES.each


def test_a_flood_has_a_few_requests_done_in_a_round() -> None:
    """Whoever else asks has its turn in the same round, and ports have theirs after it."""
    with standing(PLAIN) as (server, shared, _), connected() as flood, connected() as operator:
        server.serve(0)
        server.serve(0)
        assert heard(flood) and heard(operator)
        with suppress(BlockingIOError):
            while True:
                flood.send(b'{"post": {}}\n' * 1000)
        operator.send(b'{"command": ["suspend", "a"]}\n')
        server.serve(0)
        assert server.patience == 0
        rounds = done = 0
        while rounds < 100:
            shared.loop.go(1)
            server.serve(0)
            rounds += 1
            news = heard(flood)
            assert len(news) <= 2 * FEW
            done += len(news)
            if any("frame" in line for line in heard(operator)):
                break
        assert rounds <= 3 and done


@needs_root
def test_those_who_may_command_come_first() -> None:
    """However many others ask, the command is done in the next round; and others have a turn in each."""
    with standing(ACCESS) as (server, shared, _), ExitStack() as connections:
        with as_user(DAEMON):
            crowd = [connections.enter_context(connected()) for _ in range(CONNECTIONS.each)]
        operator = connections.enter_context(connected())
        server.serve(0)
        server.serve(0)
        for client in (*crowd, operator):
            assert heard(client)
        for client in crowd:
            client.send(b'{"post": {"go": tru}}\n' * 1000)
        server.serve(0)
        operator.send(b'{"command": ["suspend", "a"]}\n')
        server.serve(0)
        assert shared.posts._issued is not None
        before = [len(heard(client)) for client in crowd]
        for _ in range(4 * len(crowd)):
            server.serve(0)
        assert sum(before) >= 1 and all(heard(client) for client in crowd)


def test_many_calls_are_taken_at_once_but_not_all() -> None:
    with standing(PLAIN) as (server, _, _), ExitStack() as calls:
        callers = [calls.enter_context(connected()) for _ in range(CALLS + 1)]
        server.serve(0)
        assert [bool(heard(caller)) for caller in callers] == [True] * CALLS + [False]
        server.serve(0)
        assert f"has {CONNECTIONS.own} connections already" in str(heard(callers[-1])[0]["error"])


def test_who_finds_no_descriptor_is_told() -> None:
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    with standing(PLAIN) as (server, _, _), ExitStack() as calls:
        callers = [calls.enter_context(connected()) for _ in range(3)]
        most = max(int(name) for name in os.listdir("/proc/self/fd"))  # noqa: PTH208 - numbers
        with ExitStack() as filled:
            resource.setrlimit(resource.RLIMIT_NOFILE, (most + 1, before[1]))
            try:
                with suppress(OSError):
                    while True:
                        filled.callback(os.close, os.open(os.devnull, os.O_RDONLY))
                server.serve(0)
            finally:
                resource.setrlimit(resource.RLIMIT_NOFILE, before)
        assert "no descriptor left" in str(heard(callers[0])[0]["error"])
        server.serve(0)
        assert heard(callers[2])[0]["whiteboard"] == "board"


@needs_root
def test_refusals_do_not_fill_the_audit_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They are counted by user: of strangers, whoever they are, and of a client that first posts again and again."""
    log = AuditLog(tmp_path / "log")
    with standing(ACCESS, log) as (server, shared, said):
        for number in range(3 * FIRST):
            with as_user((NOBODY, GAMES + 1)[number % 2]):
                caller = connected()
            server.serve(0)
            assert heard(caller) == [{"error": "it may not read the whiteboard"}]
            caller.close()
            with as_user(DAEMON):
                caller = connected()
            server.serve(0)
            caller.send(b'{"post": {"go": true}}\n')
            server.serve(0)
            caller.close()
            server.serve(0)
        with connected() as operator:
            server.serve(0)
            monkeypatch.setattr(AuditLog, "room", KEPT_BYTES)
            operator.send(b'{"command": ["unload", "a"]}\n{"command": ["suspend", "a"]}\n')
            for _ in range(3):
                server.serve(0)
            shared.loop.go(1)
            server.serve(0)
            assert any("frame" in line for line in heard(operator))
        server.note_left_out()
    log.close()
    assert verify(log.path).last == log.last
    lines = [json.loads(line) for line in log.path.read_text().splitlines()]
    told = [(line["what"], line["user"], line["more"]) for line in lines if "more" in line]
    assert sorted(told) == [("posts", "daemon", 2 * FIRST), ("refused", "root", 1), ("refused", STRANGERS, 2 * FIRST)]
    assert len(lines) == 2 * FIRST + 2 + 3
    assert said[FIRST:] == [f"{STRANGERS}: {2 * FIRST} more", "root: 1 more"]


def say(server: Server, client: socket.socket, *requests: object) -> list[dict[str, object]]:
    """What is answered to these at once."""
    client.sendall(b"".join(json.dumps(request).encode() + b"\n" for request in requests))
    for _ in range(2):
        server.serve(0)
    return heard(client)


class Changeable:
    """A run that can go on with another machine, as far as its server is told."""

    def __init__(self, document: dict[str, object]) -> None:
        self.arrangement = made(json.dumps(document))[0]
        self.problem: Exception | None = None
        self.replaced: list[Json] = []
        self.asked = list[Callable[[int | str, Sequence[str]], None]]()

    def admit(self, change: Change) -> None:
        if isinstance(change, Replacement) and change.machine != "a":
            raise Refused("it cannot be replaced")

    def ask(self, change: Change, answer: Callable[[int | str, Sequence[str]], None], unchecked: bool) -> None:
        if self.problem is not None:
            raise self.problem
        self.asked.append(answer)


REPLACEABLE = {**PLAIN, "operators": {"suspend": ["a"], "write": ["mode"], "replace": ["a"]}}
REPLACE = {"replace": ["a", "a.yaml", "machine: A"], "unchecked": False}


def test_what_is_refused_for_its_value_does_not_fill_the_audit_log(tmp_path: Path) -> None:
    """Nothing is an entry of its own that will not be done, also not for those who may command."""
    log = AuditLog(tmp_path / "log")
    requests = (
        {"command": ["write", "mode", 1029]}, {"command": ["suspend", "a", 1]}, {"command": ["unload", "a"]},
        {"replace": ["b", "b.yaml", "machine: B"], "unchecked": True}, {"write": ["nothing"]}, REPLACE,
    )  # fmt: skip
    with standing(REPLACEABLE, log) as (server, _, _):
        changing = Changeable(REPLACEABLE)
        server.takes(changing)
        with connected() as first, ExitStack() as others:
            server.serve(0)
            assert len(heard(first)) == 1
            assert not say(server, first, REPLACE) and len(changing.asked) == 1
            for request in requests:
                client = others.enter_context(connected())
                server.serve(0)
                heard(client)
                for _ in range(FIRST):
                    (answer,) = say(server, client, request)
                    assert "error" in answer
            assert len(changing.asked) == 1
            changing.asked[0]("it is refused", ())
            client.send(json.dumps(REPLACE).encode() + b"\n")
            server.serve(0)
            server.serve(0)
            assert len(changing.asked) == 2
        server.note_left_out()
    log.close()
    lines = [json.loads(line) for line in log.path.read_text().splitlines()]
    told = [line["what"] for line in lines]
    assert told == ["replace", *["refused"] * FIRST, "replace", "refused"]
    assert lines[-1]["more"] == len(requests) * FIRST + 1 - FIRST


def test_what_is_logged_is_logged_before_it_is_done(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log = AuditLog(tmp_path / "log")
    with standing(REPLACEABLE, log) as (server, shared, _), connected() as client:
        changing = Changeable(REPLACEABLE)
        server.takes(changing)
        monkeypatch.setattr(log, "failure", "the disk is full")
        server.serve(0)
        heard(client)
        for request in ({"command": ["write", "mode", 1]}, {"write": ["go"]}, REPLACE):
            (answer,) = say(server, client, request)
            assert "the audit log cannot be written: the disk is full" in str(answer["error"])
        assert shared.posts._issued is None and not changing.asked
        assert shared.loop.control[control.WRITER_COUNT] == 1
    log.close()


def test_a_change_that_cannot_be_checked_is_refused() -> None:
    """Where the system has no descriptor, process or thread left: the run goes on."""
    with standing(REPLACEABLE) as (server, _, _), connected() as client:
        changing = Changeable(REPLACEABLE)
        server.takes(changing)
        server.serve(0)
        heard(client)
        problems = [OSError(number, os.strerror(number)) for number in (EMFILE, ENFILE, EAGAIN, ENOMEM)]
        for problem in (*problems, RuntimeError("can't start new thread")):
            changing.problem = problem
            (answer,) = say(server, client, REPLACE)
            assert answer["error"] == f"it cannot be checked: {getattr(problem, 'strerror', problem)}"
        changing.problem = None
        assert not say(server, client, REPLACE) and changing.asked


def test_a_check_without_a_process_leaves_no_descriptor(monkeypatch: pytest.MonkeyPatch) -> None:
    def fork() -> int:
        raise BlockingIOError(EAGAIN, os.strerror(EAGAIN))

    monkeypatch.setattr(check_process, "fork", fork)
    before = os.listdir("/proc/self/fd")  # noqa: PTH208 - numbers
    with pytest.raises(BlockingIOError):
        Check(lambda: CheckAnswer(None, "", ()), Limits())
    assert os.listdir("/proc/self/fd") == before  # noqa: PTH208 - numbers


def test_a_run_goes_on_whose_socket_was_removed(boards: Path) -> None:  # noqa: F811
    with standing(PLAIN) as (server, shared, said), connected() as client:
        server.takes(Changeable(PLAIN))
        server.serve(0)
        socket_path("board").unlink()
        boards.rmdir()
        server.follow(shared)
        assert len(said) == 1 and said[0].endswith("who may connect cannot be changed: No such file or directory")
        server.serve(0)
        assert heard(client)


def test_a_connection_that_cannot_be_waited_for_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """The system limits how many descriptors a user waits for."""
    with standing(PLAIN) as (server, _, _), connected() as client, monkeypatch.context() as limited:
        limited.setattr(server, "_epoll", Full(server._epoll))
        server.serve(0)
        assert heard(client) == [{"error": "there is no room for another connection: No space left on device"}]


class Full:
    """An epoll in which nothing more can be registered."""

    def __init__(self, epoll: select.epoll) -> None:
        self.poll = epoll.poll

    def register(self, *_: object) -> None:
        raise OSError(ENOSPC, os.strerror(ENOSPC))


def test_a_descriptor_is_kept_where_nobody_calls_any_more() -> None:
    with standing(PLAIN) as (server, _, _):
        server._turn_away()
        assert server._spare >= 0


def test_the_last_command_is_logged_before_the_run_ends(tmp_path: Path) -> None:
    log = AuditLog(tmp_path / "log")
    with standing(PLAIN, log) as (server, shared, _), connected() as operator:
        server.serve(0)
        operator.send(b'{"command": ["suspend", "a"]}\n')
        server.serve(0)
        shared.loop.go(1)
        server.note_left_out()
        log.note(ENDED, {})
    log.close()
    assert not verify(log.path).open
    assert [json.loads(line)["what"] for line in log.path.read_text().splitlines()] == ["command", "taken", ENDED]


def test_more_entries_than_a_few_are_counted() -> None:
    """While a user goes on with it, one line in an interval; after a quiet one, they are written again."""
    now = 0.0
    sparing = Sparing(lambda: now)
    assert [sparing.writes("refused", "a", room=True) for _ in range(FIRST + 3)] == [True] * FIRST + [False] * 3
    assert sparing.writes("refused", "b", room=True) and sparing.writes("posts", "a", room=True)
    assert not sparing.writes("refused", "c", room=False)
    assert not [*sparing.left_out()]
    now += INTERVAL
    assert [*sparing.left_out()] == [("refused", "a", 3), ("refused", "c", 1)]
    assert not any(sparing.writes("refused", "a", room=True) for _ in range(FIRST + 1))
    now += INTERVAL
    assert [*sparing.left_out()] == [("refused", "a", FIRST + 1)]
    now += INTERVAL
    assert not [*sparing.left_out()] and sparing.writes("refused", "a", room=True)
    assert not [*sparing.left_out(over=True)]


def test_a_socket_for_waking_is_the_servers() -> None:
    """No client names one, removes that of another, or has more descriptors on the way than one."""
    board = socket_path("board")
    stale, others = wake_path(board, 3), (board.with_name("board.x.wake"), wake_path(board.with_name("boar.d"), 3))
    for path in (stale, *others):
        path.touch()
    with standing(PLAIN) as (server, _, _), connected() as one, connected() as other:
        assert not stale.exists() and all(path.exists() for path in others)
        server.serve(0)
        server.serve(0)
        assert heard(one) and heard(other)

        def asked(client: socket.socket, request: object) -> dict[str, object]:
            client.send(json.dumps(request).encode() + b"\n")
            server.serve(0)
            server.serve(0)
            return heard(client)[0]

        assert asked(one, {"subscribe": True}) == {"ok": True, "socket": 0}
        path = wake_path(board, 0)
        assert path.is_socket() and path.stat().st_mode & 0o777 == 0o600
        for request in ({"subscribe": "0123456789abcdef"}, {"subscribe": 1}, {"unsubscribe": 0}):
            assert "error" in asked(other, request)
        other.close()
        server.serve(0)
        assert path.exists()
        one.send(b'{"subscribe": true}\n' * 3)
        for _ in range(3 + 1):
            server.serve(0)
        assert ["error" in line for line in heard(one)] == [False, True, True]
        assert asked(one, {"unsubscribe": 0}) == {"ok": True} and not path.exists()
    assert {*board.parent.iterdir()} == {*others}


def test_who_is_not_woken_looks_again() -> None:
    with served(build_arrangement(OPERATED)) as loop, Whiteboard("board") as board:
        with board.subscribe() as one, board.frames() as other, board.subscribe() as third:

            async def follow() -> None:
                seen = 0
                async for _ in third:
                    seen += 1
                    if seen == 3:
                        return

            for reader in (one, other, third):
                reader.read()
            for path in socket_path("board").parent.glob("*.wake"):
                path.unlink()
            for reader in (one, other):
                updates = iter(reader)
                assert [next(updates) and None for _ in range(100)]
            asyncio.run(follow())
        assert loop.control[control.WAKE_COUNT]


def test_leaving_asynchronous_frames_leaves_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    problems: list[object] = []

    async def leave(board: Whiteboard) -> None:
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(lambda _, context: problems.append(context))
        for _ in range(3):
            updates = board.subscribe("ran")
            number = updates.fileno()
            async for _ in updates:
                break
            updates.close()
            updates.close()
            assert not loop.remove_reader(number)
            assert not [update async for update in updates]
            gc.collect()
            await asyncio.sleep(0)
        closing = board.subscribe("ran")
        loop.call_later(0.01, closing.close)
        async for _ in closing:
            pass

    with served(build_arrangement(OPERATED)), Whiteboard("board") as board:
        asyncio.run(leave(board))
    gc.collect()
    assert not problems and "exception" not in capsys.readouterr().err


@needs_root
def test_another_account_reads_and_posts(monkeypatch: pytest.MonkeyPatch) -> None:
    with served(build_arrangement(ACCESS)):
        with as_user(DAEMON):
            with Whiteboard("board") as board:
                assert board.view().ending == "running"
                with board.subscribe("ran") as updates:
                    news = iter(updates)
                    assert next(news).number < next(news).number
                board.post(go=True)
                with pytest.raises(PostRefused, match=r"user `daemon` \(low\) may not suspend `a`"):
                    board.command("suspend", "a")
            with pytest.raises(NoPlace, match="not a folder of yours"):
                Server("mine", None, Permissions())  # type: ignore[arg-type]
            assert names() == ["board"]
        socket_path("board").parent.chmod(0o711)
        with as_user(DAEMON), pytest.raises(NoPlace, match="cannot be read: Permission denied"):
            names()
        with as_user(NOBODY), pytest.raises(WhiteboardError, match="does not let this process in: it may not read"):
            Whiteboard("board")
        with monkeypatch.context() as unnamed:
            (place := socket_path("board").with_name("llfsm")).mkdir()
            unnamed.delenv("LLFSM_WHITEBOARDS")
            unnamed.setenv("XDG_RUNTIME_DIR", str(place.parent))
            with as_user(DAEMON), pytest.raises(NoPlace, match="not a folder of yours"):
                Whiteboard("board")
            place.rmdir()
    with served(build_arrangement(PLAIN)), as_user(DAEMON), pytest.raises(WhiteboardError, match="no whiteboard"):
        Whiteboard("board")


@needs_root
def test_a_server_of_another_user_is_not_believed() -> None:
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(socket_path("board")))
        with as_user(DAEMON):
            server.listen()
        with pytest.raises(WhiteboardError, match="is served by user 1, and its folder is of user 0"):
            Whiteboard("board")


def test_a_path_that_is_too_long(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LLFSM_WHITEBOARDS", str(tmp_path / ("x" * 100)))
    with pytest.raises(NoPlace, match=r"would be \d+ bytes long, and 107 are the most; LLFSM_WHITEBOARDS names"):
        socket_path("board")


def test_a_folder_in_the_way() -> None:
    socket_path("board").mkdir()
    with pytest.raises(NameTaken, match=r"board\.whiteboard is in the way, and stays: Is a directory"), standing(PLAIN):
        pass
    socket_path("board").rmdir()


def test_what_nobody_asks_for_takes_no_descriptors() -> None:
    def taken(document: dict[str, object], *, served: bool) -> int:
        loop = Loop(made(json.dumps(document))[1])
        before = len(os.listdir("/proc/self/fd"))  # noqa: PTH208 - numbers
        with closing(Shared("board", loop, served=served)):
            return len(os.listdir("/proc/self/fd")) - before  # noqa: PTH208 - numbers

    assert [taken(PLAIN, served=True), taken(PLAIN, served=False), taken(OPERATED, served=True)] == [2 + LENT, 2, 2]


def test_a_signal_does_not_end_a_call() -> None:
    """Several come while the caller waits; it goes on with what is left of its time."""
    before, over, woken = signal.getsignal(signal.SIGUSR1), threading.Event(), 0
    main = threading.main_thread().ident
    assert main is not None

    def disturb() -> None:
        while not over.wait(0.001):
            signal.pthread_kill(main, signal.SIGUSR1)

    def handle(*_: object) -> None:
        nonlocal woken
        woken += 1
        if makes_room and woken > FEW:
            with suppress(BlockingIOError):
                server.accept()[0].close()

    with socket.socket(socket.AF_UNIX) as server, ExitStack() as calls:
        server.bind(str(socket_path("board")))
        server.listen(0)
        server.setblocking(False)
        with suppress(BlockingIOError):
            while True:
                calls.enter_context(connected())
        makes_room = False
        signal.signal(signal.SIGUSR1, handle)
        thread = threading.Thread(target=disturb)
        thread.start()
        try:
            with pytest.raises(WhiteboardError, match="too many processes call the whiteboard"):
                called("board", 0.02)
            woken, makes_room = 0, True
            called("board", None).close()
            assert woken > FEW
        finally:
            over.set()
            thread.join()
            signal.signal(signal.SIGUSR1, before)


def test_a_caller_waits_until_there_is_room() -> None:
    """The system keeps so many calls waiting; one more waits for the server, as long as it is told to."""
    with socket.socket(socket.AF_UNIX) as server, ExitStack() as calls:
        server.bind(str(socket_path("board")))
        server.listen(0)
        with suppress(BlockingIOError):
            while True:
                calls.enter_context(connected())
        for seconds in (0, 0.01):
            with pytest.raises(WhiteboardError, match="too many processes call the whiteboard"):
                called("board", seconds)
        found: list[str] = []

        def call() -> None:
            try:
                Whiteboard("board")
            except WhiteboardError as error:
                found.append(str(error))

        thread = threading.Thread(target=call)
        thread.start()
        server.settimeout(0.01)
        while thread.is_alive():
            calls.close()
            with suppress(TimeoutError):
                server.accept()[0].close()
        thread.join()
        assert len(found) == 1 and "gone" in found[0]

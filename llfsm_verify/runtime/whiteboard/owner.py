"""The owner of a whiteboard: hands out its segment over a socket, and takes what others post.

A client gets one line of JSON, which describes the slots, together with a descriptor of the segment. It may then
send requests, a line of JSON each, and gets a line back: ``{"post": {"car": true}}`` gives values to inputs. An input
belongs to the client that posts it first, until that client is gone.
"""

from __future__ import annotations

import ctypes
import errno
import json
import os
import selectors
import socket
import struct
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import asdict

from llfsm_verify.checking.values import ValueProblem, choice_value
from llfsm_verify.jsonvalue import Json
from llfsm_verify.program.program import Choice
from llfsm_verify.runtime.live import control
from llfsm_verify.runtime.live.loop import Loop
from llfsm_verify.runtime.whiteboard.generations import segment_words
from llfsm_verify.runtime.whiteboard.places import socket_path
from llfsm_verify.runtime.whiteboard.segment import Segment, code
from llfsm_verify.runtime.whiteboard.slots import slots_of

MOST_CLIENTS = 64
MOST_BYTES = 1 << 16
"""Of a request."""
_CREDENTIALS = struct.Struct("3i")
VERSION = 1


class Taken(Exception):
    """Another process owns a whiteboard of this name, or the socket cannot be made."""


class Refused(Exception):
    """A request that is not granted; the message says why."""


class Posts:
    """What others have posted: a frame for the loop, in this process."""

    def __init__(self, loop: Loop) -> None:
        program = loop.code.program
        self._inputs: dict[str, tuple[int, Choice]] = {}
        for choice in program.choices:
            if choice.input and choice.input not in self._inputs:
                self._inputs[choice.input] = 1 + 2 * len(self._inputs), choice
        words = 1 + 2 * len(self._inputs)
        self._words = words
        self._frame = (ctypes.c_int64 * words)()
        self._copy = (ctypes.c_int64 * words)()
        self._segment = (ctypes.c_int64 * segment_words(words))()
        copy = ctypes.addressof(self._copy)
        self._writers = (ctypes.c_int64 * 4)(ctypes.addressof(self._segment), copy, words, 0)
        rows = []
        for number, choice in enumerate(program.choices):
            if choice.input:
                word, _ = self._inputs[choice.input]
                kind = choice.type
                rows += [number, copy + 8 * word, kind.low, kind.high - kind.low, copy + 8 * (word + 1)]
        self._sources = (ctypes.c_int64 * max(1, len(rows)))(*rows)
        for place, value in (
            (control.WRITERS, ctypes.addressof(self._writers)), (control.WRITER_COUNT, 1),
            (control.SOURCES, ctypes.addressof(self._sources)), (control.SOURCE_COUNT, len(rows) // 5),
        ):  # fmt: skip
            loop.told[place] = value

    def post(self, values: Mapping[str, Json]) -> None:
        """Give values to inputs, all together. Refused: there is no such input or value."""
        numbers: dict[int, int] = {}
        for name, value in values.items():
            if name not in self._inputs:
                raise Refused(f"there is no input `{name[:60]}`, only {', '.join(self._inputs) or 'none at all'}")
            word, choice = self._inputs[name]
            try:
                numbers[word] = choice_value(choice, _text(value))
            except ValueProblem as problem:
                raise Refused(f"{name}: {problem}") from None
        for word, number in numbers.items():
            self._frame[word] = number
            self._frame[word + 1] += 1
        self._frame[0] += 1
        code().publish(self._segment, self._frame, self._words)


def _text(value: Json) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


class _Client:
    def __init__(self, connection: socket.socket, uid: int) -> None:
        self.connection = connection
        self.uid = uid
        self.received = b""
        self.answers = b""


class Owner:
    """Serves a whiteboard of this name for the frames of a loop, whenever `serve` is called.

    `refused` is told of each request that is not granted. Taken: the name is in use. NoPlace: see `places`.
    """

    def __init__(self, name: str, loop: Loop, *, refused: Callable[[str], None] = lambda _: None) -> None:
        self._path = socket_path(name)
        self._refused = refused
        self._segment = Segment(name, loop.code.frames.words, loop.told[control.PERIOD])
        self._posts = Posts(loop)
        loop.told[control.SEGMENT] = self._segment.address
        self._loop = loop
        slots: list[Json] = [
            {**asdict(slot), "labels": list(slot.labels)}
            for slot in slots_of(loop.code.program, loop.code.layout, loop.code.frames)
        ]
        told: dict[str, Json] = {
            "whiteboard": name, "version": VERSION, "epoch": self._segment.epoch, "pid": os.getpid(), "slots": slots,
        }  # fmt: skip
        self._greeting = json.dumps(told).encode() + b"\n"
        self._owners: dict[str, _Client] = {}
        self._clients: dict[int, _Client] = {}
        self._selector = selectors.DefaultSelector()
        self._listening = self._listen()
        self._selector.register(self._listening, selectors.EVENT_READ)

    def _listen(self) -> socket.socket:
        listening = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM | socket.SOCK_NONBLOCK)
        try:
            for attempt in range(2):
                try:
                    listening.bind(str(self._path))
                    break
                except OSError as error:
                    if error.errno != errno.EADDRINUSE or attempt or _answers(str(self._path)):
                        why = "it is in use" if error.errno == errno.EADDRINUSE else error.strerror
                        raise Taken(f"the whiteboard `{self._path.stem}` cannot be served: {why}") from None
                    self._path.unlink(missing_ok=True)  # of a process that was killed
            listening.listen()
        except BaseException:
            listening.close()
            self._segment.close()
            raise
        return listening

    def serve(self, seconds: float) -> None:
        """Answer clients for so long."""
        for key, events in self._selector.select(seconds):
            if key.fileobj is self._listening:
                self._accept()
            elif isinstance(key.data, _Client):
                self._talk(key.data, events)

    def _accept(self) -> None:
        with suppress(BlockingIOError, ConnectionError):
            connection, _ = self._listening.accept()
            connection.setblocking(False)
            credentials = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
            pid, uid, _ = _CREDENTIALS.unpack(credentials)
            if uid not in (os.getuid(), 0) or len(self._clients) >= MOST_CLIENTS:
                self._refused(f"process {pid} of user {uid} may not read the whiteboard")
                connection.close()
                return
            client = _Client(connection, uid)
            try:
                # The descriptor travels with the first byte; a description of many slots may take more than one piece.
                sent = socket.send_fds(connection, [self._greeting], [self._segment.descriptor])
            except OSError:
                connection.close()
                return
            client.answers = self._greeting[sent:]
            self._clients[connection.fileno()] = client
            self._selector.register(connection, selectors.EVENT_READ, client)
            self._await(client)

    def _talk(self, client: _Client, events: int) -> None:
        try:
            if events & selectors.EVENT_WRITE:
                client.answers = client.answers[client.connection.send(client.answers) :]
            if events & selectors.EVENT_READ:
                data = client.connection.recv(MOST_BYTES)
                if not data:
                    raise ConnectionResetError
                client.received += data
                while b"\n" in client.received:
                    line, _, client.received = client.received.partition(b"\n")
                    client.answers += json.dumps(self._answer(client, line)).encode() + b"\n"
                if len(client.received) > MOST_BYTES or len(client.answers) > MOST_BYTES + len(self._greeting):
                    raise ConnectionResetError
        except BlockingIOError:
            pass
        except OSError:
            self._forget(client)
            return
        self._await(client)

    def _await(self, client: _Client) -> None:
        wanted = selectors.EVENT_READ | (selectors.EVENT_WRITE if client.answers else 0)
        self._selector.modify(client.connection, wanted, client)

    def _forget(self, client: _Client) -> None:
        self._clients.pop(client.connection.fileno(), None)
        self._selector.unregister(client.connection)
        client.connection.close()
        self._owners = {name: owner for name, owner in self._owners.items() if owner is not client}

    def _answer(self, client: _Client, line: bytes) -> dict[str, Json]:
        try:
            try:
                request = json.loads(line)
            except (ValueError, RecursionError):
                raise Refused("this is no line of JSON") from None
            values = request.get("post") if isinstance(request, dict) and len(request) == 1 else None
            if not isinstance(values, dict):
                raise Refused('a request is `{"post": {INPUT: VALUE, …}}`')
            for name in values:
                if self._owners.get(name, client) is not client:
                    raise Refused(f"`{name[:60]}` belongs to another process that posts it")
            self._posts.post(values)
            self._owners |= dict.fromkeys(values, client)
        except Refused as refused:
            self._refused(f"user {client.uid}: {refused}")
            return {"error": str(refused)}
        return {"ok": True}

    def close(self) -> None:
        """Nobody is served any more; the loop must not run."""
        self._loop.told[control.SEGMENT] = 0
        for client in list(self._clients.values()):
            self._forget(client)
        self._selector.close()
        self._listening.close()
        with suppress(OSError):
            self._path.unlink()
        self._segment.close()


def _answers(path: str) -> bool:
    """Whether somebody listens there."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as attempt:
        try:
            attempt.connect(path)
        except OSError:
            return False
        return True

"""The owner of a whiteboard: hands out its segment over a socket, and takes what others post.

A client gets one line of JSON, which describes the slots, together with a descriptor of the segment. It may then
send requests, a line of JSON each, and gets a line back: ``{"post": {"car": true}}`` gives values to inputs. An input
belongs to the client that posts it first, until that client is gone. ``{"command": ["suspend", "ns"]}`` and
``{"command": ["write", "mode", 2]}`` are what operators do; the answer comes when the loop has taken the command.
``{"subscribe": "0123456789abcdef"}`` lets each frame be followed by a datagram to the socket of that name in the folder
of whiteboards, which the client has bound; ``unsubscribe`` ends that. ``{"write": ["car"]}`` is answered with a
descriptor of memory in which the client posts these inputs by itself from now on. ``{"replace": ["ns", "new.yaml",
"machine: …"], "unchecked": true}`` lets another machine take the place of one, and ``{"policy": ["new.yaml",
"levels: …"]}`` another policy that of the one in force; when it has, all clients are sent away.
"""

from __future__ import annotations

import errno
import json
import os
import selectors
import socket
import struct
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict
from hashlib import sha256
from typing import Protocol

from llfsm_verify.arrangement.model import POLICY, REPLACE, Arrangement
from llfsm_verify.arrangement.replacing import Change, NewPolicy, Replacement
from llfsm_verify.jsonvalue import Json
from llfsm_verify.runtime.audit import AuditLog
from llfsm_verify.runtime.whiteboard.permissions import Permissions, policy_digest, user_name
from llfsm_verify.runtime.whiteboard.places import MOST_REQUEST, NoPlace, folder, socket_path
from llfsm_verify.runtime.whiteboard.segment import Segment
from llfsm_verify.runtime.whiteboard.shared import Shared
from llfsm_verify.runtime.whiteboard.slots import slots_of
from llfsm_verify.runtime.whiteboard.waking import NAME, SUFFIX
from llfsm_verify.runtime.whiteboard.writers import Refused

MOST_CLIENTS = 64
MOST_REFUSALS = 100
"""Of a client, which would fill the audit log."""
MOST_NOTED = 300
"""Characters of a request that the audit log keeps."""
MOST_NAME = 255
"""Characters of the name of a file."""
PIECE = 1 << 16
"""Bytes of a request that are read at once."""
MOST_LENT, MOST_WAKES = 4, 16
"""Segments and sockets for waking of one client."""
PATIENCE, PROMPT = 0.05, 0.001
"""Seconds between two looks whether a command was taken: at most, at least."""
_CREDENTIALS = struct.Struct("3i")
VERSION = 2
REQUESTS = (
    '`{"post": {INPUT: VALUE, …}}`, `{"command": [WHAT, MACHINE]}`, `{"command": ["write", SLOT, VALUE]}`, '
    '`{"replace": [MACHINE, FILE, TEXT], "unchecked": true}`, `{"policy": [FILE, TEXT]}`, '
    '`{"write": [INPUT, …]}`, `{"subscribe": SOCKET}` and `{"unsubscribe": SOCKET}`'
)


class Changing(Protocol):
    """A run that can go on with another machine or policy."""

    @property
    def arrangement(self) -> Arrangement:
        """As it runs now."""

    def ask(self, change: Change, answer: Callable[[int | str, Sequence[str]], None], unchecked: bool) -> None:
        """Let it go on with this, and call back with the number of a frame, or with what is wrong, and with what else
        is to be said. Refused.
        """


class Taken(Exception):
    """Another process owns a whiteboard of this name, or the socket cannot be made."""


class _Client:
    def __init__(self, connection: socket.socket, pid: int, uid: int) -> None:
        self.connection = connection
        self.pid = pid
        self.uid = uid
        self.received = b""
        self.answers = b""
        self.refusals = 0
        self.commanding = False
        """Its command is not taken yet, so what it sends next waits."""
        self.lent: list[Segment] = []
        self.descriptors: list[int] = []
        """To be sent with the next answer."""
        self.wakes: dict[str, int] = {}
        """Its sockets for waking."""

    @property
    def who(self) -> str:
        return f"process {self.pid} of user {self.uid}"


class Owner:
    """Serves a whiteboard of this name for the frames of a loop, whenever `serve` is called.

    `refused` is told of each request that is not granted, and `audit` of these and of all that changes something, as
    far as it can be; `fed`: inputs that something else writes. Taken: the name is
    in use. NoPlace: see `places`.
    """

    def __init__(
        self,
        name: str,
        shared: Shared,
        permissions: Permissions,
        *,
        refused: Callable[[str], None] = lambda _: None,
        fed: frozenset[str] = frozenset(),
        audit: AuditLog | None = None,
    ) -> None:
        self._path = socket_path(name)
        self._shared = shared
        self._permissions = permissions
        self._say = refused
        self._audit = audit
        self._fed = fed
        self._name = name
        self._changing: Changing | None = None
        self._greeting = self._greet()
        self._owners: dict[str, _Client] = {}
        self._clients: dict[int, _Client] = {}
        self._selector = selectors.EpollSelector()
        self._listening = self._listen()
        self._selector.register(self._listening, selectors.EVENT_READ)

    def _greet(self) -> bytes:
        slots: list[Json] = [{**asdict(slot), "labels": list(slot.labels)} for slot in slots_of(self._shared.loop.code)]
        told: dict[str, Json] = {
            "whiteboard": self._name, "version": VERSION, "epoch": self._shared.segment.epoch, "pid": os.getpid(),
            "slots": slots,
        }  # fmt: skip
        return _line(told)

    def _refused(self, client: _Client, why: str, request: str = "") -> None:
        self._say(f"{client.who}: {why}")
        self._note("refused", client, request=request, why=why)

    def _note(self, what: str, client: _Client, **facts: Json) -> None:
        """Write what a client asked, and what came of it, to the audit log, if there is one."""
        if self._audit is not None:
            short = {name: _short(fact) for name, fact in facts.items()}
            self._audit.note(what, {"pid": client.pid, "uid": client.uid, "user": user_name(client.uid), **short})

    def _logged(self, what: str, client: _Client, **facts: Json) -> None:
        """Refused: this must be logged and cannot be."""
        self._note(what, client, **facts)
        if self._audit is not None and self._audit.failure is not None:
            raise Refused(f"the audit log cannot be written: {self._audit.failure}")

    def takes(self, changing: Changing) -> None:
        """Let operators change this run."""
        self._changing = changing

    def follow(self, shared: Shared) -> None:
        """Another run goes on: clients are sent away. Those that call again get its frames, if its policy allows it."""
        if self._changing is not None:
            self._permissions = Permissions.of(self._changing.arrangement)
            self._admit()
        for client in self._clients.values():
            client.received = b""  # it is not done any more
        self._shared.posts.forward()
        for client in list(self._clients.values()):
            if client.commanding:
                why = "the arrangement was changed before the command came: send it again"
                self._refused(client, why)
                client.answers += _line({"error": why})
            with suppress(OSError):
                client.connection.send(client.answers)
            self._forget(client)
        self._shared = shared
        self._greeting = self._greet()

    def fileno(self) -> int:
        """Readable when `serve` has something to do."""
        return self._selector.fileno()

    @property
    def patience(self) -> float:
        """After so many seconds `serve` should be called in any case."""
        period = self._shared.segment.period / 1e9
        commanding = any(client.commanding for client in self._clients.values())
        return min(PATIENCE, max(PROMPT, period / 2)) if commanding else PATIENCE

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
            self._admit()
            listening.listen()
        except BaseException:
            listening.close()
            raise
        return listening

    def _admit(self) -> None:
        """Let other users connect, or not."""
        self._path.chmod(0o666 if self._permissions.admits_others else 0o600)

    def serve(self, seconds: float) -> None:
        """Answer clients for so long."""
        self._shared.posts.forward()
        for key, events in self._selector.select(seconds):
            if key.fileobj is self._listening:
                self._accept()
            elif isinstance(key.data, _Client):
                self._talk(key.data, events)

    def _accept(self) -> None:
        try:
            connection, _ = self._listening.accept()
        except OSError as error:
            if error.errno in (errno.EMFILE, errno.ENFILE):
                time.sleep(PROMPT)  # no descriptor is left: who calls waits until there is one
            return
        with suppress(BlockingIOError, ConnectionError):
            connection.setblocking(False)
            credentials = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
            pid, uid, _ = _CREDENTIALS.unpack(credentials)
            client = _Client(connection, pid, uid)
            allowed = self._permissions.may_connect(uid)
            if not allowed or len(self._clients) >= MOST_CLIENTS:
                crowded = f"{MOST_CLIENTS} processes read the whiteboard already"
                self._refused(client, crowded if allowed else "it may not read the whiteboard")
                connection.close()
                return
            try:
                # The descriptor travels with the first byte; a description of many slots may take more than one piece.
                sent = socket.send_fds(connection, [self._greeting], [self._shared.segment.descriptor])
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
                if client.descriptors:  # they travel with the first byte
                    sent = socket.send_fds(client.connection, [client.answers], client.descriptors)
                    client.descriptors = []
                else:
                    sent = client.connection.send(client.answers)
                client.answers = client.answers[sent:]
            if events & selectors.EVENT_READ:
                data = client.connection.recv(PIECE)
                if not data:
                    raise ConnectionResetError
                client.received += data
                self._answer(client)
                if self._refuses_too_often(client):
                    raise ConnectionResetError
                if len(client.received) > MOST_REQUEST:
                    self._refused(client, f"more than {MOST_REQUEST:,} bytes of what it asks wait")
                    raise ConnectionResetError
                if len(client.answers) > MOST_REQUEST + len(self._greeting):
                    raise ConnectionResetError
        except BlockingIOError:
            pass
        except OSError:
            self._forget(client)
            return
        self._await(client)

    def _refuses_too_often(self, client: _Client) -> bool:
        if client.refusals <= MOST_REFUSALS:
            return False
        self._refused(client, f"it is disconnected after {MOST_REFUSALS} refusals")
        return True

    def _await(self, client: _Client) -> None:
        wanted = selectors.EVENT_READ | (selectors.EVENT_WRITE if client.answers else 0)
        self._selector.modify(client.connection, wanted, client)

    def _forget(self, client: _Client) -> None:
        self._clients.pop(client.connection.fileno(), None)
        self._selector.unregister(client.connection)
        client.connection.close()
        for segment in client.lent:
            self._shared.posts.give_back(segment)
        for name, row in client.wakes.items():
            self._shared.wakes.remove(row)
            with suppress(OSError, NoPlace):  # of a process that was killed
                (folder() / (name + SUFFIX)).unlink(missing_ok=True)
        self._owners = {name: owner for name, owner in self._owners.items() if owner is not client}

    def _answer(self, client: _Client) -> None:
        """Its requests, one after the other; a command keeps the later ones waiting until it is taken."""
        while b"\n" in client.received and not client.commanding and client.refusals <= MOST_REFUSALS:
            line, _, client.received = client.received.partition(b"\n")
            answer: dict[str, Json] | None
            try:
                answer = self._do(client, line)
            except Refused as refused:
                self._refused(client, str(refused), line.decode("utf-8", "replace"))
                client.refusals += 1
                answer = {"error": str(refused)}
            if answer is not None:
                client.answers += _line(answer)

    def _do(self, client: _Client, line: bytes) -> dict[str, Json] | None:
        """What one request is answered; None: later."""
        try:
            request = json.loads(line)
        except (ValueError, RecursionError):
            raise Refused("this is not a line of JSON") from None
        match request:
            case {"post": dict(values), **rest} if not rest:
                self._post(client, values)
            case {"command": [str(kind), str(target), *value], **rest} if not rest and len(value) < 2:
                if value and not isinstance(value[0], bool | int | float | str | None):
                    raise Refused("a value is a word, a number, true or false")
                self._command(client, kind, target, value[0] if value else None)
                return None
            case {"replace": [str(machine), str(name), str(text)], "unchecked": bool(unchecked), **rest} if not rest:
                self._change(client, Replacement(machine, name, text), unchecked=unchecked)
                return None
            case {"policy": [str(name), str(text)], **rest} if not rest:
                self._change(client, NewPolicy(name, text))
                return None
            case {"write": [*names], **rest} if not rest and all(isinstance(name, str) for name in names):
                return self._lend(client, [str(name) for name in names])
            case {"subscribe": str(name), **rest} if not rest:
                self._subscribe(client, name)
            case {"unsubscribe": str(name), **rest} if not rest and name in client.wakes:
                self._shared.wakes.remove(client.wakes.pop(name))
            case _:
                raise Refused(f"requests are {REQUESTS}")
        return {"ok": True}

    def _lend(self, client: _Client, names: Sequence[str]) -> dict[str, Json]:
        if not names or len(client.lent) >= MOST_LENT:
            raise Refused(f"memory is lent for inputs, {MOST_LENT} times to one process")
        for name in names:
            self._available(client, name)
        self._logged("lend", client, inputs=list(names))
        segment = self._shared.posts.lend(names)
        client.lent.append(segment)
        client.descriptors.append(segment.descriptor)
        self._owners |= dict.fromkeys(names, client)
        places: dict[str, Json] = {name: self._shared.posts.place(name) for name in names}
        return {"ok": True, "words": self._shared.posts.words, "places": places}

    def _available(self, client: _Client, name: str) -> None:
        if name in self._fed:
            raise Refused(f"`{name[:60]}` comes from a port")
        if self._owners.get(name, client) is not client:
            raise Refused(f"`{name[:60]}` belongs to another process that posts it")

    def _post(self, client: _Client, values: Mapping[str, Json]) -> None:
        for name in values:
            self._available(client, name)
        self._shared.posts.post(values)
        first: list[Json] = [name for name in values if name not in self._owners]
        if first:
            self._note("posts", client, inputs=first)
        self._owners |= dict.fromkeys(values, client)

    def _command(self, client: _Client, kind: str, target: str, value: Json) -> None:
        denial = self._permissions.denial(client.uid, kind, target)
        if denial is not None:
            raise Refused(denial)

        self._logged("command", client, kind=kind, target=target, value=value)

        def taken(frame: int) -> None:
            self._note("taken", client, kind=kind, target=target, frame=frame)
            self._answer_late(client, {"ok": True, "frame": frame})

        with _commanding(client):
            self._shared.posts.command(kind, target, value, taken=taken)

    def _change(self, client: _Client, change: Change, *, unchecked: bool = False) -> None:
        kind, facts, asked = POLICY, dict[str, Json](), f"policy {change.name}"
        if isinstance(change, Replacement):
            kind, facts, asked = REPLACE, {"machine": change.machine}, f"replace {change.machine} by {change.name}"
        denial = self._permissions.denial(client.uid, kind, str(facts.get("machine")))
        if denial is not None:
            raise Refused(denial)
        if len(change.name) > MOST_NAME or not change.name.isprintable():
            raise Refused(f"the name of a file has {MOST_NAME} characters at most, all of which can be printed")
        changing = self._changing
        if changing is None:
            raise Refused("this run keeps the machines and the policy that it has")

        def answered(outcome: int | str, notes: Sequence[str]) -> None:
            if isinstance(outcome, str):
                self._refused(client, outcome, asked)
                self._answer_late(client, {"error": "; ".join((outcome, *notes))})
            else:
                self._note("replaced", client, **facts, frame=outcome, policy=policy_digest(changing.arrangement))
                client.commanding = False
                client.answers += _line(
                    {"ok": True, "frame": outcome, "notes": list(notes)}
                )  # it is sent away, with what still waits

        digest = sha256(change.text.encode("utf-8", "surrogatepass")).hexdigest()
        self._logged(kind, client, **facts, file=change.name, sha256=digest, unchecked=unchecked)
        with _commanding(client):
            changing.ask(change, answered, unchecked)

    def _answer_late(self, client: _Client, answer: dict[str, Json]) -> None:
        """Answer its command, and then the requests that waited for that."""
        client.commanding = False
        if client.connection.fileno() >= 0:
            client.answers += _line(answer)
            self._answer(client)
            if self._refuses_too_often(client):
                self._forget(client)
            else:
                self._await(client)

    def _subscribe(self, client: _Client, name: str) -> None:
        if not NAME.match(name):
            raise Refused("a socket for waking has a name of 16 hexadecimal digits")
        if any(name in other.wakes for other in self._clients.values()):
            raise Refused("it subscribes already")
        if len(client.wakes) >= MOST_WAKES:
            raise Refused(f"a process subscribes {MOST_WAKES} times at most")
        try:
            client.wakes[name] = self._shared.wakes.add(folder() / (name + SUFFIX))
        except (ValueError, NoPlace) as problem:
            raise Refused(str(problem)) from None

    def close(self) -> None:
        """Nobody is served any more. Who commands still hears whether the command came before the end."""
        for client in self._clients.values():
            client.received = b""  # it is not done any more
        self._shared.posts.forward()
        for client in list(self._clients.values()):
            with suppress(OSError):
                client.connection.send(client.answers)
            self._forget(client)
        self._selector.close()
        self._listening.close()
        with suppress(OSError):
            self._path.unlink()


@contextmanager
def _commanding(client: _Client) -> Iterator[None]:
    """Its later requests wait from here on, unless this one is refused."""
    client.commanding = True
    try:
        yield
    except Refused:
        client.commanding = False
        raise


def _short(fact: Json) -> Json:
    """What the audit log keeps of a fact."""
    if isinstance(fact, str):
        return fact[:MOST_NOTED]
    return [_short(part) for part in fact[:MOST_NOTED]] if isinstance(fact, list) else fact


def _line(answer: Mapping[str, Json]) -> bytes:
    return json.dumps(answer).encode() + b"\n"


def _answers(path: str) -> bool:
    """Whether somebody listens there."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as attempt:
        try:
            attempt.connect(path)
        except OSError:
            return False
        return True

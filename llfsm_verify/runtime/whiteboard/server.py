"""The server of a whiteboard: hands out its segment over a socket, and takes what others post.

A client gets one line of JSON, which describes the slots, together with a descriptor of the segment. It may then
send requests, a line of JSON each, and gets a line back: ``{"post": {"car": true}}`` gives values to inputs. An input
belongs to the client that posts it first, until that client is gone. ``{"command": ["suspend", "ns"]}`` and
``{"command": ["write", "mode", 2]}`` are what operators do; the answer comes when the loop has taken the command.
``{"subscribe": true}`` is answered with the number and the descriptor of a socket that gets a datagram after each
frame; ``{"unsubscribe": 3}`` ends that. ``{"write": ["car"]}`` is answered with a descriptor of memory in which the
client posts these inputs by itself from now on; ``{"give_back": ["car"]}`` ends that, and they keep their values.
``{"replace": ["ns", "new.yaml",
"machine: …"], "unchecked": true}`` lets another machine take the place of one, and ``{"policy": ["new.yaml",
"levels: …"]}`` another policy that of the one in force; when it has, all clients are sent away.

A client that is not let in, or is sent away, is told ``{"error": "…"}`` first. Clients are served in turns: a few
requests of each in a round, those first who may command, and a round ends soon (`ROUND`), so that no client keeps
ports and others waiting. Of connections, and whatever else there is a limited number of, each user has a share
(`permissions.py`).
"""

from __future__ import annotations

import errno
import json
import os
import resource
import select
import socket
import stat
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict
from hashlib import sha256
from pathlib import Path
from typing import Protocol

from llfsm_verify.arrangement.granting import policy_digest
from llfsm_verify.arrangement.model import POLICY, REPLACE, Arrangement
from llfsm_verify.arrangement.replacing import Change, NewPolicy, Replacement
from llfsm_verify.jsonvalue import Json
from llfsm_verify.runtime.live import forks
from llfsm_verify.runtime.live.slots import slots_of
from llfsm_verify.runtime.whiteboard.audit import AuditLog, Sparing
from llfsm_verify.runtime.whiteboard.permissions import (
    CONNECTIONS,
    PIECE,
    PIECES,
    READS,
    SUBSCRIPTIONS,
    Client,
    Permissions,
    user_name,
)
from llfsm_verify.runtime.whiteboard.places import peer_of, socket_path
from llfsm_verify.runtime.whiteboard.posts import Refused
from llfsm_verify.runtime.whiteboard.shared import Shared, remove_old

KEEPS = "this run keeps the machines and the policy that it has"
MOST_REFUSALS = 100
"""Of a connection."""
MOST_NOTED = 300
"""Characters of a request that the audit log keeps."""
MOST_NAME = 255
"""Characters of the name of a file."""
MOST_LENT, MOST_WAKES = 4, 16
"""Segments and sockets for waking of one client."""
FEW, ROUND = 8, 0.001
"""Requests of a client in a round; seconds of a round, for those who may command and then for the others: after the
request that exceeds it, the round ends.
"""
CALLS, WAITING_CALLS = 64, 1024
"""New connections in a round, and those that the system keeps waiting."""
KEPT_DESCRIPTORS = 32
"""The last ones of the process are not for those who may not command."""
KEPT_BYTES = 1 << 20
"""Of the disk, which only commands may fill with their entries in the audit log."""
STRANGERS = "users who may not connect"
"""As the audit log counts their calls, all together."""
PATIENCE, PROMPT = 0.05, 0.001
"""Seconds between two looks whether a command was taken: at most, at least."""
VERSION = 3
REQUESTS = (
    '`{"post": {INPUT: VALUE, …}}`, `{"command": [WHAT, MACHINE]}`, `{"command": ["write", SLOT, VALUE]}`, '
    '`{"command": ["enter", MACHINE, STATE]}`, '
    '`{"replace": [MACHINE, FILE, TEXT], "unchecked": true}`, `{"policy": [FILE, TEXT]}`, '
    '`{"write": [INPUT, …]}`, `{"give_back": [INPUT, …]}`, `{"subscribe": true}` and `{"unsubscribe": NUMBER}`'
)


class Changing(Protocol):
    """A run that can go on with another machine or policy."""

    @property
    def arrangement(self) -> Arrangement:
        """As it runs now."""

    @property
    def replaced(self) -> list[Json]:
        """The machines of which others have taken the places."""

    def admit(self, change: Change) -> object:
        """Refused: it could not even be tried."""

    def ask(self, change: Change, answer: Callable[[int | str, Sequence[str]], None], unchecked: bool) -> None:
        """Let it go on with this, and call back with the number of a frame, or with what is wrong, and with what else
        is to be said. Refused.
        """


class NameTaken(Exception):
    """Another process serves a whiteboard of this name, or the socket cannot be made."""


class Server:
    """Serves a whiteboard of this name for the frames of a loop, whenever `serve` is called.

    `refused` is told of each request that is not granted, and `audit` of these and of all that changes something, as
    far as it can be; `fed`: inputs that something else writes; `of`: what runs at first. NameTaken: the name is in use.
    NoPlace: see `places`.
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
        of: Arrangement | None = None,
    ) -> None:
        self._path = socket_path(name, own=True)
        self._of = of
        self._shared = shared
        self._permissions = permissions
        self._say = refused
        self._audit = audit
        self._fed = fed
        self._name = name
        self._changing: Changing | None = None
        self._loading = False
        """A client's machine or policy is on its way into the run."""
        self._greeting = self._greet()
        self._owners: dict[str, Client] = {}
        self._clients: dict[int, Client] = {}
        self._asking: dict[Client, None] = {}
        """Those whose next request may be done, who has waited longest first."""
        self._lent: list[tuple[int, int]] = []
        """The user and the rank of who was lent memory in this run."""
        self._sparing = Sparing()
        self._listening = self._listen()
        self._epoll = select.epoll()
        self._epoll.register(self._listening, select.EPOLLIN)
        forks.keep(self)
        self._spare = os.open(os.devnull, os.O_RDONLY | os.O_CLOEXEC)
        """Given up to tell who calls that no descriptor is left."""

    def _greet(self) -> bytes:
        code, of, changing = self._shared.loop.code, self._of, self._changing
        machines = [code.program.machines[slot.machine].name for slot in code.program.slots]
        told: dict[str, Json] = {
            "whiteboard": self._name, "version": VERSION, "epoch": self._shared.segment.epoch, "pid": os.getpid(),
            "slots": [{**asdict(slot), "labels": list(slot.labels)} for slot in slots_of(code)],
            "fired": {name: word for word, name in enumerate(machines, code.frames.fired)},
            "replaced": [] if changing is None else changing.replaced,
        }  # fmt: skip
        if of is not None:
            path = str(Path(of.path).resolve())
            told |= {"arrangement": path, "digest": of.digest, "cycle_ms": str(of.cycle_ms)}
        return _line(told)

    def _refused(self, client: Client, why: str, request: str = "") -> None:
        if self._listed("refused", client):
            self._say(f"{client.who}: {why}")
            self._note("refused", client, request=request, why=why)

    def _listed(self, what: str, client: Client) -> bool:
        """Whether an entry that needs no right is written; else it is counted."""
        user = user_name(client.uid) if self._permissions.may_connect(client.uid) else STRANGERS
        return self._sparing.writes(what, user, room=self._audit is None or self._audit.room > KEPT_BYTES)

    def note_left_out(self, *, over: bool = True) -> None:
        """Write how many entries were left out, where their interval has ended; all, with the last command that was
        taken, if the run is `over`.
        """
        if over:
            self._shared.posts.forward()
        for what, user, count in self._sparing.left_out(over=over):
            if what == "refused":
                self._say(f"{user}: {count:,} more")
            if self._audit is not None:
                self._audit.note(what, {"user": user, "more": count})

    def _note(self, what: str, client: Client, **facts: Json) -> None:
        """Write what a client asked, and what came of it, to the audit log, if there is one."""
        if self._audit is not None:
            short = {name: _short(fact) for name, fact in facts.items()}
            self._audit.note(what, {"pid": client.pid, "uid": client.uid, "user": user_name(client.uid), **short})

    def _logged(self, what: str, client: Client, **facts: Json) -> None:
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
            try:
                self._admit()
            except OSError as error:  # its name or its folder is gone; who is connected is asked for permission anyway
                self._say(f"{self._path}: who may connect cannot be changed: {error.strerror}")
        self._send_all_away("the arrangement was changed before the command came: send it again")
        self._lent.clear()
        self._shared = shared
        self._greeting = self._greet()

    def fileno(self) -> int:
        """Readable when `serve` has something to do."""
        return self._epoll.fileno()

    @property
    def patience(self) -> float:
        """After so many seconds `serve` should be called in any case."""
        if self._asking:
            return 0
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
                        raise NameTaken(f"the whiteboard `{self._name}` cannot be served: {why}") from None
                    try:
                        self._path.unlink(missing_ok=True)  # of a process that was killed
                    except OSError as problem:
                        raise NameTaken(f"{self._path} is in the way, and stays: {problem.strerror}") from None
            remove_old(self._path)
            self._admit()
            listening.listen(WAITING_CALLS)
        except BaseException:
            listening.close()
            raise
        return listening

    def let_go(self) -> None:
        """See `forks.Kept`."""
        self._epoll.close()
        self._listening.close()
        for client in self._clients.values():
            client.connection.close()

    def _admit(self) -> None:
        """Let other users connect, or not."""
        others = self._permissions.admits_others
        if others:
            place = self._path.parent
            place.chmod(stat.S_IMODE(place.stat().st_mode) | 0o055)
        self._path.chmod(0o666 if others else 0o600)

    def serve(self, seconds: float) -> None:
        """Answer clients, for a round; wait at most so long for the first one."""
        self._shared.posts.forward()
        self.note_left_out(over=False)
        calls = False
        for descriptor, events in self._epoll.poll(0 if self._asking else seconds):
            if descriptor == self._listening.fileno():
                calls = True
            elif descriptor in self._clients:
                self._transfer(self._clients[descriptor], events)
        for reads in (False, True):
            until = time.monotonic() + ROUND
            for client in [client for client in self._asking if (client.rank == READS) is reads]:
                self._answer(client, until)
                if time.monotonic() > until:
                    break
        if calls:
            self._accept()

    def _accept(self) -> None:
        for _ in range(CALLS):
            try:
                connection, _ = self._listening.accept()
            except OSError as error:
                if error.errno in (errno.EMFILE, errno.ENFILE):
                    self._turn_away()
                return
            self._welcome(connection)

    def _turn_away(self) -> None:
        """No descriptor is left: who calls is told, where that does not take one either."""
        self._close_spare()
        try:
            connection, _ = self._listening.accept()
            _leave(connection, "the run has no descriptor left for another connection")
        except OSError:
            time.sleep(PROMPT)
        finally:
            with suppress(OSError):  # another process of the system, or a thread of this one, was faster
                self._spare = os.open(os.devnull, os.O_RDONLY | os.O_CLOEXEC)

    def _close_spare(self) -> None:
        if self._spare >= 0:
            os.close(self._spare)
            self._spare = -1

    def _welcome(self, connection: socket.socket) -> None:
        connection.setblocking(False)
        pid, uid = peer_of(connection)
        client = Client(connection, pid, uid, self._permissions.rank(uid))
        why = self._no_room(client)
        if why is not None:
            self._refused(client, why)
            _leave(connection, why)
            return
        try:
            self._epoll.register(connection, 0)
        except OSError as error:  # the system waits for no more descriptors of a user
            _leave(connection, f"there is no room for another connection: {error.strerror}")
            return
        try:
            # The descriptor travels with the first byte; a description of many slots may take more than one piece.
            sent = socket.send_fds(connection, [self._greeting], [self._shared.segment.descriptor])
        except OSError:
            connection.close()
            return
        client.answers += self._greeting[sent:]
        self._clients[connection.fileno()] = client
        self._await(client)

    def _no_room(self, client: Client) -> str | None:
        """Why a client is not let in."""
        if not self._permissions.may_connect(client.uid):
            return "it may not read the whiteboard"
        most, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
        if client.rank == READS and 0 <= most <= client.connection.fileno() + KEPT_DESCRIPTORS:
            return "the run keeps its last descriptors for those who may command"
        return CONNECTIONS.lacks(client, ((other.uid, other.rank) for other in self._clients.values()))

    def _transfer(self, client: Client, events: int) -> None:
        """Send what goes, and read what has come."""
        gone = bool(events & (select.EPOLLHUP | select.EPOLLERR))
        try:
            if gone:
                client.answers.clear()
            elif events & select.EPOLLOUT:
                client.send()
            if events & select.EPOLLIN:
                data = client.connection.recv(PIECE)
                if not data:
                    raise ConnectionResetError
                client.received += data
            elif gone and client not in self._asking:
                raise ConnectionResetError
        except BlockingIOError:
            pass
        except OSError:
            self._forget(client)
            return
        if not client.asks and len(client.received) > client.most:
            self._send_away(client, f"more than {client.most:,} bytes of what it asks wait")
        else:
            self._await(client)

    def _await(self, client: Client) -> None:
        """Wait for what the client, or its connection, is to do next. It is read when all it has asked is done."""
        wanted = (0 if client.asks else select.EPOLLIN) | (select.EPOLLOUT if client.answers else 0)
        if wanted != client.awaited:
            self._epoll.modify(client.connection, wanted)
            client.awaited = wanted
        if client.may_ask:
            self._asking.setdefault(client)
        else:
            self._asking.pop(client, None)

    def _send_away(self, client: Client, why: str) -> None:
        self._refused(client, why)
        client.answers += _line({"error": why})
        with suppress(OSError):
            client.send()
        self._forget(client)

    def _send_all_away(self, why: str) -> None:
        """What they have asked since their last command is not done. A client that commands hears whether the command
        came, or why not.
        """
        for client in self._clients.values():
            client.forget_requests()
        self._shared.posts.forward()
        for client in list(self._clients.values()):
            if client.commanding and why:
                self._send_away(client, why)
                continue
            with suppress(OSError):
                client.send()
            self._forget(client)

    def _forget(self, client: Client) -> None:
        self._clients.pop(client.connection.fileno(), None)
        self._asking.pop(client, None)
        self._epoll.unregister(client.connection)
        client.connection.close()
        client.close_handed()
        for segment in client.lent:
            self._shared.posts.give_back(segment)
        for number in client.wakes:
            self._shared.wakes.remove(self._path, number)
        self._owners = {name: owner for name, owner in self._owners.items() if owner is not client}

    def _answer(self, client: Client, until: float) -> None:
        """A few of its requests; a command keeps the later ones waiting until it is taken."""
        self._asking.pop(client, None)
        for _ in range(FEW):
            line = client.take()
            answer: dict[str, Json] | None
            try:
                answer = self._do(client, line)
            except Refused as refused:
                self._refused(client, str(refused), line[: 4 * MOST_NOTED].decode("utf-8", "replace"))
                client.refusals += 1
                answer = {"error": str(refused)}
            if answer is not None:
                client.answers += _line(answer)
            if client.refusals > MOST_REFUSALS:
                self._send_away(client, f"it is disconnected after {MOST_REFUSALS} refusals")
                return
            if not client.may_ask or time.monotonic() > until:
                break
        self._await(client)

    def _do(self, client: Client, line: bytes) -> dict[str, Json] | None:
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
            case {"give_back": [*names], **rest} if not rest:
                for segment in client.lent:
                    if any(self._shared.posts.is_lent(str(name), segment) for name in names):
                        self._shared.posts.give_back(segment)
            case {"subscribe": True, **rest} if not rest:
                return self._subscribe(client)
            case {"unsubscribe": int(number), **rest} if not rest and number in client.wakes:
                client.wakes.remove(number)
                self._shared.wakes.remove(self._path, number)
            case _:
                raise Refused(f"requests are {REQUESTS}")
        return {"ok": True}

    def _lend(self, client: Client, names: Sequence[str]) -> dict[str, Json]:
        if not names or len(client.lent) >= MOST_LENT:
            raise Refused(f"memory is lent for inputs, {MOST_LENT} times to one process")
        for name in names:
            self._available(client, name)
        self._may_hold(client, PIECES.lacks(client, self._lent))
        segment = self._shared.posts.lend(names, lambda: self._logged("lend", client, inputs=list(names)))
        client.lent.append(segment)
        self._lent.append((client.uid, client.rank))
        client.descriptors.append(segment.descriptor)
        self._owners |= dict.fromkeys(names, client)
        places: dict[str, Json] = {name: self._shared.posts.place(name) for name in names}
        return {"ok": True, "words": self._shared.posts.words, "places": places}

    def _may_hold(self, client: Client, lacks: str | None) -> None:
        """Refused: it gets no other descriptor, or not yet."""
        if lacks is not None:
            raise Refused(lacks)
        if not client.has_read_all:
            raise Refused("a descriptor is handed out after all answers before it were read")

    def _available(self, client: Client, name: str) -> None:
        if name in self._fed:
            raise Refused(f"`{name[:60]}` comes from a port")
        if self._owners.get(name, client) is not client:
            raise Refused(f"`{name[:60]}` belongs to another process that posts it")

    def _post(self, client: Client, values: Mapping[str, Json]) -> None:
        for name in values:
            self._available(client, name)
        self._shared.posts.post(values)
        first: list[Json] = [name for name in values if name not in self._owners]
        if first and self._listed("posts", client):
            self._note("posts", client, inputs=first)
        self._owners |= dict.fromkeys(values, client)

    def _command(self, client: Client, kind: str, target: str, value: Json) -> None:
        denial = self._permissions.denial(client.uid, kind, target)
        if denial is not None:
            raise Refused(denial)

        def granted() -> None:
            self._logged("command", client, kind=kind, target=target, value=value)

        def taken(frame: int) -> None:
            self._note("taken", client, kind=kind, target=target, frame=frame)
            self._answer_late(client, {"ok": True, "frame": frame})

        with _commanding(client):
            self._shared.posts.command(kind, target, value, taken=taken, granted=granted)

    def _change(self, client: Client, change: Change, *, unchecked: bool = False) -> None:
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
            raise Refused(self._permissions.undeclared(change) or KEEPS)
        if self._loading:
            raise Refused("another machine or policy is already being loaded into this run")
        changing.admit(change)

        def answered(outcome: int | str, notes: Sequence[str]) -> None:
            self._loading = False
            if isinstance(outcome, str):
                self._refused(client, outcome, asked)
                self._answer_late(client, {"error": "; ".join((outcome, *notes))})
            else:
                self._note("replaced", client, **facts, frame=outcome, policy=policy_digest(changing.arrangement))
                client.commanding = False  # it is sent away, with what still waits
                client.answers += _line({"ok": True, "frame": outcome, "notes": list(notes)})

        digest = sha256(change.text.encode("utf-8", "surrogatepass")).hexdigest()
        self._logged(kind, client, **facts, file=change.name, sha256=digest, unchecked=unchecked)
        with _commanding(client):
            try:
                changing.ask(change, answered, unchecked)
            except OSError as error:
                raise Refused(f"it cannot be checked: {error.strerror or error}") from None
            except RuntimeError as error:  # there is no room for another thread
                raise Refused(f"it cannot be checked: {error}") from None
            self._loading = True

    def _answer_late(self, client: Client, answer: dict[str, Json]) -> None:
        """Answer its command; the requests that waited for that have their turn."""
        client.commanding = False
        if client.connection.fileno() >= 0:
            client.answers += _line(answer)
            self._await(client)

    def _subscribe(self, client: Client) -> dict[str, Json]:
        if len(client.wakes) >= MOST_WAKES:
            raise Refused(f"a process subscribes {MOST_WAKES} times at most")
        held = [(other.uid, other.rank) for other in self._clients.values() for _ in other.wakes]
        self._may_hold(client, SUBSCRIPTIONS.lacks(client, held))
        try:
            number, woken = self._shared.wakes.add(self._path)
        except ValueError as problem:
            raise Refused(str(problem)) from None
        except OSError as error:
            raise Refused(f"there is no socket for waking: {error.strerror}") from None
        client.wakes.add(number)
        client.handed.append(woken)
        client.descriptors.append(woken.fileno())
        return {"ok": True, "socket": number}

    def close(self) -> None:
        """No one is served any more. A client that commands still hears whether the command came before the end."""
        self._send_all_away("")
        self._epoll.close()
        self._close_spare()
        with suppress(OSError):
            self._path.unlink()  # before another run may serve it
        self._listening.close()


@contextmanager
def _commanding(client: Client) -> Iterator[None]:
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


def _leave(connection: socket.socket, why: str) -> None:
    """Say why a client is not let in, and close the connection."""
    with suppress(OSError):
        connection.setblocking(False)
        connection.send(_line({"error": why}))
    connection.close()


def _line(answer: Mapping[str, Json]) -> bytes:
    return json.dumps(answer).encode() + b"\n"


def _answers(path: str) -> bool:
    """Whether a process listens there."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as attempt:
        try:
            attempt.connect(path)
        except OSError:
            return False
        return True

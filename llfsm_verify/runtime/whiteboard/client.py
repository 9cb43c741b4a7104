"""A whiteboard as others see it: the newest values, how old they are, and what they may post."""

from __future__ import annotations

import json
import math
import os
import select
import socket
import struct
import time
from collections.abc import Callable, Collection, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from llfsm_verify.files import Closing
from llfsm_verify.jsonvalue import Json
from llfsm_verify.program.program import Choice
from llfsm_verify.runtime.live.frame import COMMITTED, ENDING, ENDINGS, NUMBER
from llfsm_verify.runtime.live.slots import STATE, Slot
from llfsm_verify.runtime.whiteboard.places import MOST_REQUEST, NOBODY, location, peer_of
from llfsm_verify.runtime.whiteboard.segment import Attached, Lent, NoSegment
from llfsm_verify.runtime.whiteboard.subscription import Feed, Frames, Subscription
from llfsm_verify.values import Shown, ValueProblem, number_of, shown, text

SECONDS: float | None = 5.0
"""How long a server may take to answer."""
SHORTEST = 0.001
"""Seconds of waiting for a connection."""
MOMENT = 0.001
"""Seconds between two looks for a first frame."""
MOST_BYTES = 1 << 24
OFTEN = 100
"""Posts of the same inputs in a row, after which memory is asked for them."""


class WhiteboardError(Exception):
    """There is no such whiteboard, its server does not answer, or it refuses a post; the message says which."""


class PostRefused(WhiteboardError):
    """There is no such input or value, or the input belongs to another process."""


@dataclass(frozen=True, slots=True)
class View:
    """A whole frame of a whiteboard: all its values are of one moment."""

    values: Mapping[str, Shown]
    """By the names of slots: states of machines, variables, inputs."""
    number: int
    """Of the frame; one more for every cycle of a process."""
    age: float
    """Seconds since it was committed."""
    ending: str
    """``running``, or why there will be no other frame: one of `live.frame.ENDINGS`, or ``died``."""


class InputWriter(Closing):
    """Posts inputs in memory that the server of a whiteboard has lent; made by `Whiteboard.writer`.

    They belong to it while the whiteboard is connected.
    """

    def __init__(self, lent: Lent, inputs: Mapping[str, tuple[int, Choice]]) -> None:
        self._lent = lent
        self._inputs = inputs

    def post(self, **values: Shown) -> None:
        """Give values to inputs, all together, from the next cycle on. PostRefused: there is no such input or value."""
        for name in values:
            if name not in self._inputs:
                raise PostRefused(f"this writer has no input `{name}`, only {', '.join(self._inputs)}")
        numbers = [(self._inputs[name][0], self._number(name, value)) for name, value in values.items()]
        frame = self._lent.next
        for place, number in numbers:
            frame[place] = number
            frame[place + 1] = 1
        self._lent.publish()

    @property
    def inputs(self) -> frozenset[str]:
        """What it posts."""
        return frozenset(self._inputs)

    def posted(self) -> dict[str, Json]:
        """What it has posted last."""
        frame = self._lent.next
        return {
            name: value
            if isinstance(value := shown(choice.type, choice.labels, frame[place]), bool | int)
            else text(value)
            for name, (place, choice) in self._inputs.items()
            if frame[place + 1]
        }

    def _number(self, name: str, value: Shown) -> int:
        try:
            return number_of(self._inputs[name][1], value)
        except ValueProblem as problem:
            raise PostRefused(f"{name}: {problem}") from None

    def close(self) -> None:
        """Post no more."""
        self._lent.close()


class Replaced(NamedTuple):
    """A machine or a policy has taken the place of another one."""

    frame: int
    """The number of the frame from which on the arrangement has it."""
    notes: tuple[str, ...]
    """What its check has to say."""


class Whiteboard(Closing):
    """A whiteboard that a run of this name serves on this machine. WhiteboardError: no run does.

    `connection` is one that `called` has made; it is closed with the whiteboard, or where that is not made.
    """

    def __init__(self, name: str, connection: socket.socket | None = None) -> None:
        self.name = name
        self._readers: dict[str, Callable[[], Shown]] = {}
        self._writer: InputWriter | None = None
        """Of the inputs that this process posts often."""
        self._posted: Collection[str] = frozenset()
        self._often = 0.0
        """How many times in a row these were posted."""
        self._connection, self._received = connection or called(name, SECONDS), b""
        self._connection.settimeout(SECONDS)
        self.told: Mapping[str, Json] = {}
        """What its server says of the run: its slots, and where its arrangement is from, if it is a newer one."""
        try:
            self._slots, self._attached = self._greeted()
        except BaseException:
            self._connection.close()
            raise

    def _greeted(self) -> tuple[dict[str, Slot], Attached]:
        line, descriptors = self._line()
        try:
            told = json.loads(line)
            if isinstance(told, dict) and "error" in told:
                raise WhiteboardError(f"`{self.name}` does not let this process in: {told['error']}")
            if len(descriptors) != 1:
                raise WhiteboardError(f"`{self.name}` is not a whiteboard")
            slots = {s["name"]: Slot(**{**s, "labels": tuple(s["labels"])}) for s in told["slots"]}
            attached, self.told = Attached(descriptors[0]), told
            if any(slot.word >= attached.words for slot in slots.values()):
                raise NoSegment("its slots are not in its frames")
        except (ValueError, TypeError, KeyError, NoSegment) as error:
            raise WhiteboardError(f"`{self.name}` is not a whiteboard: {error}") from None
        finally:
            _close(descriptors)
        return slots, attached

    def _line(self) -> tuple[bytes, list[int]]:
        descriptors: list[int] = []
        while b"\n" not in self._received:
            try:
                data, more, _, _ = socket.recv_fds(self._connection, 1 << 16, 4)
            except OSError:
                data, more = b"", []
            descriptors += more
            self._received += data
            if not data or len(self._received) > MOST_BYTES:
                _close(descriptors)
                raise WhiteboardError(f"the server of `{self.name}` is gone, or does not answer")
        line, _, self._received = self._received.partition(b"\n")
        return line, descriptors

    @property
    def slots(self) -> tuple[Slot, ...]:
        """What is in its frames."""
        return tuple(self._slots.values())

    @property
    def period(self) -> float:
        """Seconds of a cycle; 0: it runs as fast as it goes."""
        return self._attached.period / 1e9

    @property
    def latest(self) -> int:
        """The number of the newest frame; 0: there is none yet."""
        return self._attached.latest

    def frame(self, number: int = 0) -> list[int] | None:
        """The frame of this number, from 1, or the newest one; None: there is none yet, or it has been overwritten."""
        return self._attached.frame(number) if number else self._attached.newest()

    def fileno(self) -> int:
        """A descriptor that is readable when the server is gone, for `select`."""
        return self._connection.fileno()

    @property
    def is_gone(self) -> bool:
        """Whether the server has closed the connection, or died."""
        try:
            readable, _, _ = select.select([self._connection], [], [], 0)
            return bool(readable) and self._connection.recv(1, socket.MSG_PEEK) == b""
        except OSError:
            return True

    def view(self) -> View:
        """The newest frame. WhiteboardError: no frame has been written, and none comes."""
        frame = self._newest()
        ending = ENDINGS[frame[ENDING]] if 0 <= frame[ENDING] < len(ENDINGS) else "died"
        if ending == "running" and self.is_gone:
            ending = "died"
        age = (time.monotonic_ns() - frame[COMMITTED]) / 1e9
        return View({name: slot.value(frame) for name, slot in self._slots.items()}, frame[NUMBER], age, ending)

    def get(self, name: str | None = None) -> Shown:
        """The newest value of a slot. KeyError: there is no such slot; TypeError: none is named; WhiteboardError."""
        if name is None:
            raise TypeError(f"name one of {', '.join(self._slots)}; `view().values` has the values of all of them")
        read = self._readers.get(name)
        if read is None:
            read = self._reader(name)
        return read()

    def _reader(self, name: str) -> Callable[[], Shown]:
        """A fast function that reads one slot."""
        self._known([name])
        self._newest()
        value, word = self._slots[name].reader(), self._attached.reader(self._slots[name].word)
        self._readers[name] = lambda: value(word())
        return self._readers[name]

    def _newest(self) -> list[int]:
        """The newest frame, after a moment of patience when the run has only just begun."""
        until = time.monotonic() + SECONDS if SECONDS is not None else math.inf
        while (frame := self._attached.newest()) is None:
            if time.monotonic() >= until or self.is_gone:
                raise WhiteboardError(f"nothing has been written to `{self.name}` yet")
            time.sleep(MOMENT)
        return frame

    def post(self, **values: Shown) -> None:
        """Give values to inputs, which then belong to this process while it is connected.

        The same inputs again and again are posted in memory that the server lends, if it does. PostRefused: nothing
        was posted; WhiteboardError: the server is gone.
        """
        before: dict[str, Json] = {}
        if self._writer is not None:
            if values.keys() <= self._writer.inputs:
                if self.is_gone:
                    raise WhiteboardError(f"the server of `{self.name}` is gone")
                self._writer.post(**values)
                return
            if values.keys() & self._writer.inputs:  # all values of a post come together
                before = self._writer.posted()
                self._ask({"give_back": [*sorted(self._writer.inputs)]})
                self._writer.close()
                self._writer, self._often = None, -math.inf
        sent: dict[str, Json] = {n: v if isinstance(v, bool | int | str) else str(v) for n, v in values.items()}
        self._ask({"post": {**before, **sent}})
        self._often = self._often + 1 if values.keys() == self._posted else min(self._often, 0)
        self._posted = values.keys()
        if self._often >= OFTEN and self._writer is None:
            self._often = -math.inf
            with suppress(WhiteboardError):  # it goes on as before
                self._writer = self.writer(*values)

    def writer(self, *inputs: str) -> InputWriter:
        """Memory in which this process posts these inputs from now on, without asking the server each time.

        PostRefused: there is no such input, it belongs to another process, or no memory is left to lend.
        """
        answer, descriptor = self._lent({"write": list(inputs)})
        try:
            match answer:
                case {"words": int(words), "places": dict(places)}:
                    slots = {name: (int(str(place)), self._slots[name].choice) for name, place in places.items()}
                    return InputWriter(Lent(descriptor, words), slots)
                case _:
                    raise self._unanswered()
        except (NoSegment, ValueError, KeyError) as error:
            raise WhiteboardError(f"the server of `{self.name}` lends nothing: {error}") from None
        finally:
            os.close(descriptor)

    def command(self, kind: str, target: str, value: Shown | None = None) -> int:
        """Let an operator's command come: ``suspend``, ``resume``, ``restart``, ``load``, ``load_suspended`` or
        ``unload`` a machine, let it ``enter`` a state, or ``write`` a value to a slot. Returns the number of the frame
        after the cycle at whose beginning it came.

        PostRefused: the arrangement's `operators` or `access` do not allow it; WhiteboardError: the server is gone.
        """
        given: list[Json] = [kind, target]
        if value is not None:
            given.append(value if isinstance(value, bool | int | str) else str(value))
        frame = self._ask({"command": given}, patient=True).get("frame")
        if not isinstance(frame, int):
            raise self._unanswered()
        return frame

    def send(self, request: dict[str, Json]) -> None:
        """Ask the server for something without waiting: `answers` has what comes back, in the order of what was asked.
        Until it has all of it, nothing else may be asked. PostRefused: it is too long; WhiteboardError: the server is
        gone.
        """
        line = json.dumps(request).encode() + b"\n"
        if len(line) > MOST_REQUEST:
            raise PostRefused(f"it would be a request of {len(line):,} bytes, and {MOST_REQUEST:,} are the most")
        try:
            self._connection.settimeout(SECONDS)
            self._connection.sendall(line)
        except OSError:
            raise WhiteboardError(f"the server of `{self.name}` is gone") from None

    def answers(self) -> list[dict[str, Json]]:
        """What has come back by now of what was sent; it does not wait."""
        self._connection.settimeout(0)
        with suppress(OSError):
            while (data := self._connection.recv(1 << 16)) and len(self._received) < MOST_BYTES:
                self._received += data
        *lines, self._received = self._received.split(b"\n")
        return [_answer(line) for line in lines]

    def replace(self, machine: str, path: str | Path, *, unchecked: bool = False) -> Replaced:
        """Let the machine in a file (YAML) take the place of one that runs, after it has been checked. Its variables
        are carried over by name and type. The run is then another one: close this, and make a new `Whiteboard`.

        PostRefused: the arrangement's `operators` or `access` do not allow it, the machine does not fit, or it is not
        proved that nothing goes wrong with it; OSError: the file cannot be read; WhiteboardError: the server is gone.
        """
        return self._change({"replace": [machine, Path(path).name, _text_in(path)], "unchecked": unchecked})

    def policy(self, path: str | Path) -> Replaced:
        """Let the policy in a file take the place of the one in force, after it has been checked. The run is then
        another one: close this, and make a new `Whiteboard`.

        PostRefused: `operators` does not allow it to this user, the policy is wrong or gives a machine a right that it
        had not, or it is not proved that nothing goes wrong with it; OSError: the file cannot be read;
        WhiteboardError: the server is gone.
        """
        return self._change({"policy": [Path(path).name, _text_in(path)]})

    def _change(self, request: dict[str, Json]) -> Replaced:
        match self._ask(request, patient=True):
            case {"frame": int(frame), "notes": [*notes]}:
                return Replaced(frame, tuple(map(str, notes)))
        raise self._unanswered()

    def subscribe(self, *slots: str) -> Subscription:
        """Frames one after the other, from the newest one on; only those in which one of the slots changed, if any are
        named. KeyError: there is no such slot; WhiteboardError: there are too many subscribers.
        """
        self._known(slots)
        return Subscription(self._feed(), {name: self._slots[name] for name in slots or self._slots})

    def frames(self) -> Frames:
        """All frames, one after the other, from the first one if it is still there, else from the newest one on.

        WhiteboardError: there are too many subscribers.
        """
        return Frames(self._feed())

    def _feed(self) -> Feed:
        answer, descriptor = self._lent({"subscribe": True})
        number = answer.get("socket")
        if not isinstance(number, int):
            os.close(descriptor)
            raise self._unanswered()

        def unsubscribe() -> None:
            with suppress(WhiteboardError):  # the server is gone
                self._ask({"unsubscribe": number})

        woken = socket.socket(fileno=descriptor)
        return Feed(self._attached, woken, self._connection, self.is_running, unsubscribe)

    def is_running(self) -> bool:
        """Whether another frame may come."""
        frame = self._attached.newest()
        return (frame is None or ENDINGS[frame[ENDING]] == "running") and not self.is_gone

    def state_of(self, machine: str) -> str:
        """The state in which a machine is. KeyError: there is no such machine."""
        if self._slots[machine].kind != STATE:
            raise KeyError(f"`{machine}` is not a machine")
        return str(self.get(machine))

    @property
    def machines(self) -> dict[str, tuple[str, ...]]:
        """The machines in the order of their turns, each with the names of its states."""
        return {slot.name: slot.labels for slot in self._slots.values() if slot.kind == STATE}

    def _known(self, names: Iterable[str]) -> None:
        for name in names:
            if name not in self._slots:
                raise KeyError(f"there is no slot `{name}` on `{self.name}`, only {', '.join(self._slots)}")

    def _ask(self, request: dict[str, Json], *, patient: bool = False) -> dict[str, Json]:
        """What the server answers. PostRefused: it refuses."""
        answer, descriptors = self._asked(request, patient=patient)
        _close(descriptors)
        return answer

    def _lent(self, request: dict[str, Json]) -> tuple[dict[str, Json], int]:
        """What the server answers, with a descriptor, which the caller closes."""
        answer, descriptors = self._asked(request)
        if len(descriptors) != 1:
            _close(descriptors)
            raise self._unanswered()
        return answer, descriptors[0]

    def _asked(self, request: dict[str, Json], *, patient: bool = False) -> tuple[dict[str, Json], list[int]]:
        self.send(request)
        if patient:
            self._connection.settimeout(None)
        line, descriptors = self._line()
        answer = _answer(line)
        if "error" in answer:
            _close(descriptors)
            raise PostRefused(str(answer["error"]))
        return answer, descriptors

    def _unanswered(self) -> WhiteboardError:
        return WhiteboardError(f"the server of `{self.name}` does not answer what was asked")

    def close(self) -> None:
        """Read no more, and give up inputs."""
        if self._writer is not None:
            self._writer.close()
        self._connection.close()
        self._attached.close()
        self._readers.clear()


def _close(descriptors: Iterable[int]) -> None:
    for descriptor in descriptors:
        os.close(descriptor)


def _answer(line: bytes) -> dict[str, Json]:
    """What a server says in one line."""
    try:
        answer = json.loads(line)
    except (ValueError, RecursionError):
        answer = None
    return answer if isinstance(answer, dict) else {"error": "the server's answer is not valid"}


def called(name: str, seconds: float | None = 0) -> socket.socket:
    """A connection to the server of a whiteboard, who may not have answered yet. Where too many call at once, it waits
    so long; None: without an end. WhiteboardError: no run serves it, or another user than the folder's serves it.
    """
    path, user = location(name)
    connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    until = None if seconds is None else time.monotonic() + seconds
    served_by = NOBODY
    try:
        connection.setblocking(seconds != 0)
        while served_by == NOBODY:  # a signal ends the waiting, and Python takes that for a connection
            if seconds != 0:  # Python's own limit does not hold for sockets of this kind
                left = 0.0 if until is None else max(until - time.monotonic(), SHORTEST)
                limit = struct.pack("ll", *divmod(int(1e6 * left), 1_000_000))
                connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, limit)
            connection.connect(str(path))
            _, served_by = peer_of(connection)
            if served_by == NOBODY and until is not None and time.monotonic() >= until:
                raise BlockingIOError
        if served_by != user:
            raise WhiteboardError(f"`{name}` is served by user {served_by}, and its folder is of user {user}")
    except BlockingIOError:
        connection.close()
        raise WhiteboardError(f"too many processes call the whiteboard `{name}` at once") from None
    except OSError:
        connection.close()
        raise WhiteboardError(f"there is no whiteboard `{name}`, or its server has died") from None
    except BaseException:
        connection.close()
        raise
    return connection


def _text_in(path: str | Path) -> str:
    """The text of a file, as much of it as is too long. OSError, UnicodeDecodeError."""
    with open(path, encoding="utf-8") as file:
        return file.read(MOST_REQUEST)

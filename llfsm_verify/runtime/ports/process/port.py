"""A port that is a program: it is started, spoken to, started again and ended, and never waited for during a run."""

from __future__ import annotations

import json
import select
import signal
import socket
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

from llfsm_verify.jsonvalue import Json
from llfsm_verify.runtime.ports.line_port import MOST_BYTES, LineReader, Malformed, decode, shown_json
from llfsm_verify.runtime.ports.port import AskingPort, Link, Started, Unopened
from llfsm_verify.runtime.ports.process.child import Child
from llfsm_verify.values import Shown

VERSION = 1
RESTART, LONGEST_RESTART = 0.5, 30.0
"""Seconds until a program that has failed is started again, at first and at most; a program that ran for the latter
begins with the former."""
MOST_WAITING = 1000
"""Lines that wait until the program reads them. The newest values wait apart, and are one line."""
LEAVING, STOPPING = 1.0, 0.5
"""Seconds that it has after its last line, and after SIGTERM."""
LAST_READS = 16
"""Of what a program has said that has ended."""


@dataclass(frozen=True, slots=True)
class ProcessSettings:
    """The program of a port, and what it is told."""

    run: tuple[str, ...]
    """The words of its command line."""
    folder: str
    """Where it is started."""
    told: Mapping[str, Json] = field(default_factory=dict)
    """What the first line says to it beside fields and requests, under `told`."""
    patience: float = 10.0
    """Seconds in which it must say hello."""
    restart: bool = True
    hint: str = "correct `run`, or what the program writes"
    """What to do where it does not start."""
    environment: Mapping[str, str] = field(default_factory=dict)
    """Variables that it has besides those of the run."""
    paces: bool = False
    """Whether it begins the cycles of the run (`clock: external`)."""

    @property
    def started(self) -> Started:
        """What a kind gives."""

        def start(link: Link) -> ProcessPort:
            return ProcessPort(link, self)

        return Started(start, paces=self.paces)


class _Failed(Exception):
    """What the program does is the end of it; the message says why."""


class ProcessPort(AskingPort):
    """Speaks the protocol of this folder. Unopened: there is no such program, or it does not say hello in time."""

    every_frame = False

    def __init__(self, link: Link, of: ProcessSettings, clock: Callable[[], float] = time.monotonic) -> None:
        self._link, self._of, self._clock = link, of, clock
        self._child: Child | None = None
        self._lines, self._greeted = LineReader(), False
        self._begun = b""
        """What is left of a line of which something is written."""
        self._waiting: deque[bytes] = deque()
        self._newest: bytes | None = None
        self._last: bytes | None = None
        """The values that it was told last, which one that is started again is told first."""
        self._deaf: float | None = None
        """When it has closed the socket; it has mostly ended then, which is heard a moment later."""
        self._since = self._next = 0.0
        self._pause = RESTART
        self._leaving: float | None = None
        """When it was told the end."""
        self._stopped = False
        try:
            self._start()
            while not self._greeted:
                self._await()
        except (_Failed, OSError) as problem:
            raise Unopened(f"`{' '.join(of.run)[:80]}`: {_why(problem)}", of.hint) from None
        finally:
            if not self._greeted:
                self.close()

    def _start(self) -> None:
        """OSError: there is no such program."""
        self._since = self._clock()
        self._lines, self._greeted, self._begun, self._deaf = LineReader(), False, b"", None
        self._waiting = deque([json.dumps(self._link.hello(self._of.told)).encode() + b"\n"])
        self._child = Child(self._of.run, self._of.folder, self._of.environment)

    def _await(self) -> None:
        """Move what can be moved until it has said hello. _Failed."""
        assert self._child is not None
        left = self._since + self._of.patience - self._clock()
        poll = select.poll()
        for descriptor, events in self.waits():
            poll.register(descriptor, events)
        limit = left if self._deaf is None else STOPPING
        self._serve(self._child, dict(poll.poll(max(0.0, 1000 * limit))))
        self._look(self._clock())

    def waits(self) -> Iterator[tuple[int, int]]:
        """See `Port`."""
        if self._child is not None:
            yield self._child.ends, select.POLLIN
            writes = bool(self._begun or self._waiting or (self._newest is not None and self._greeted))
            if self._deaf is None:
                yield self._child.socket.fileno(), select.POLLIN | (select.POLLOUT if writes else 0)

    def serve(self, ready: Mapping[int, int], now: float) -> None:
        """See `Port`."""
        now = self._clock()
        try:
            if self._child is not None:
                self._serve(self._child, ready)
                self._look(now)
            elif self._leaving is None and self._of.restart and now >= self._next:
                self._start()
        except (_Failed, OSError) as problem:
            self._fail(_why(problem))

    def _serve(self, child: Child, ready: Mapping[int, int]) -> None:
        events, ended = ready.get(child.socket.fileno(), 0), child.ends in ready
        if ended:
            for _ in range(LAST_READS):
                if not self._read(child):
                    break
            raise _Failed(self._end())
        if events & ~select.POLLOUT and not self._read(child):
            self._deaf = self._clock()
        if events & select.POLLOUT:
            self._write(child)

    def _look(self, now: float) -> None:
        """What has taken too long."""
        assert self._child is not None
        if self._leaving is None:
            if not self._greeted and now >= self._since + self._of.patience:
                raise _Failed(f"it has not said hello within {self._of.patience:g} s")
            if self._deaf is not None and now >= self._deaf + STOPPING:
                raise _Failed("it has closed its standard input or output")
        elif now >= self._leaving + LEAVING + STOPPING:
            self._end()
        elif now >= self._leaving + LEAVING and not self._stopped:
            self._stopped = True
            self._child.signal(signal.SIGTERM)

    def _read(self, child: Child) -> bool:
        """Whether there may be more."""
        data = child.read()
        for line in self._lines.lines(data or b""):
            self._message(line)
        if data == b"" and self._lines.restart() and self._leaving is None:
            self._link.malformed("a line has no end")
        return data is None or bool(data)

    def _message(self, line: bytes | None) -> None:
        try:
            if line is None:
                raise Malformed(f"a line is longer than {MOST_BYTES:,} bytes")
            if not line.strip():
                return
            said = decode(line, constants=True)
            if self._greeted:
                self._take(said)
                return
            values = _mapping(said, "values")
        except Malformed as problem:
            if not self._greeted:
                raise _Failed(f"it says no hello: {problem}") from None
            self._link.malformed(str(problem))
            return
        version = said.get("hello")
        if version is None:
            reason = said.get("say")
            raise _Failed(reason[:400] if isinstance(reason, str) else f"it says no hello: {_keys(said)}")
        if version != VERSION or version is True:
            other = str(version)[:20] if isinstance(version, int | str) else "?"
            raise _Failed(f"it speaks version {other} of the protocol, and this is version {VERSION}")
        self._greeted = True
        if self._newest is None and self._link.repeats:
            self._newest = self._last
        if values:
            self._link.take(values)

    def _take(self, said: Mapping[str, Json]) -> None:
        """Malformed."""
        if "cycle" in said:
            self._link.cycle(_number(said, "cycle"), _mapping(said, "values"))
        elif "values" in said and not {"of", "answer"} & said.keys():
            self._link.take(_mapping(said, "values"))
        elif "of" in said or "answer" in said:
            end = "answer" in said
            number, state = _number(said, "answer" if end else "of"), said.get("state", "DONE" if end else None)
            if not isinstance(state, str):
                raise Malformed("`state` is not a text")
            self._link.report(number, state, _mapping(said, "values"), end=end)
        elif isinstance(names := said.get("lost"), list):
            self._link.lost(str(said.get("why", "it says so"))[:200], fields=[str(name) for name in names] or None)
        elif isinstance(text := said.get("say"), str):
            self._link.say(text[:1000])
        else:
            raise Malformed(f"a line is not a message: {_keys(said)}")

    def _fail(self, why: str) -> None:
        """It has failed with all its inputs, and may be started again."""
        self._end()
        now = self._clock()
        pause = RESTART if now >= self._since + LONGEST_RESTART else self._pause
        self._next, self._pause = now + pause, min(2 * pause, LONGEST_RESTART)
        self._link.fail_requests(why)
        if self._newest is not None and not self._of.restart:
            self._link.unsent(why)
            self._newest = None
        if self._leaving is None:
            self._link.lost(why, forever=not self._of.restart)

    def _end(self) -> str:
        child, self._child = self._child, None
        self._waiting.clear()
        self._begun = b""
        return "" if child is None else child.end()

    def send(self, values: Mapping[str, Shown]) -> None:
        """See `Port`."""
        gone = self._child is None and not self._of.restart
        if self._newest is not None or gone:
            self._link.unsent("it has failed" if self._child is None else "it is not read as fast as it changes")
        told = f'"time": {self._clock()}, "cycle": {self._link.latest}'
        self._newest = None if gone else _written(f'"values": {shown_json(values)}, {told}')

    def ask(self, number: int, name: str, values: Mapping[str, Shown]) -> None:
        """See `AskingPort`."""
        if self._child is None or not self._greeted:
            self._link.fail_requests("it does not run")
            return
        self._tell(_written(f'"request": {number}, "name": {json.dumps(name)}, "values": {shown_json(values)}'))

    def cancel(self, number: int) -> None:
        """See `AskingPort`."""
        self._tell(_written(f'"cancel": {number}'))

    def safe(self, values: Mapping[str, Shown]) -> None:
        """See `AskingPort`."""
        self._tell(_written(f'"safe": {shown_json(values)}'))

    def end(self, ending: str) -> None:
        """See `AskingPort`."""
        self._leaving = self._clock()
        self._tell(_written(f'"end": {json.dumps(ending)}'))

    def _tell(self, line: bytes) -> None:
        if self._child is None:
            return
        if self._newest is not None and self._greeted:  # what was so before it comes before it
            self._waiting.append(self._newest)
            self._last, self._newest = self._newest, None
        self._waiting.append(line)
        if len(self._waiting) > MOST_WAITING:
            self._fail(f"it has left {MOST_WAITING:,} lines unread")

    def _write(self, child: Child) -> None:
        if not self._begun and self._waiting:
            self._begun = self._waiting.popleft()
        elif not self._begun and self._newest is not None and self._greeted:
            self._begun = self._last = self._newest
            self._newest = None
        try:
            self._begun = self._begun[child.write(self._begun) :]
        except OSError:
            self._deaf = self._deaf or self._clock()
            return
        if not self._begun:
            self._link.sent()
            if self._leaving is not None and not self._waiting:
                child.socket.shutdown(socket.SHUT_WR)

    @property
    def flushed(self) -> bool:
        """See `Port`."""
        if self._leaving is not None:
            return self._child is None
        return not self._begun and not self._waiting and self._newest is None

    def close(self) -> None:
        """See `Port`."""
        self._end()


def _keys(said: Mapping[str, Json]) -> str:
    """What a line has, in words."""
    return f"it has {', '.join(f'`{key}`' for key in said)[:80] or 'nothing'}"


def _why(problem: Exception) -> str:
    return (isinstance(problem, OSError) and problem.strerror) or str(problem)


def _written(parts: str) -> bytes:
    return f"{{{parts}}}\n".encode()


def _mapping(said: Mapping[str, Json], key: str) -> Mapping[str, Json]:
    found = said.get(key, {})
    if not isinstance(found, dict):
        raise Malformed(f"`{key}` is not a mapping")
    return found


def _number(said: Mapping[str, Json], key: str) -> int:
    found = said.get(key)
    if type(found) is not int:
        raise Malformed(f"`{key}` is not a whole number")
    return found

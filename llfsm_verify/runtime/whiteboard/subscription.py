"""PUSH: the frames of a whiteboard one after the other, for a reader that is woken by each."""

from __future__ import annotations

import asyncio
import select
import socket
from abc import abstractmethod
from collections import deque
from collections.abc import AsyncIterator, Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Generic, TypeVar

from llfsm_verify.files import Closing
from llfsm_verify.runtime.live.frame import NUMBER
from llfsm_verify.runtime.live.generations import GENERATIONS
from llfsm_verify.runtime.live.slots import Slot
from llfsm_verify.runtime.whiteboard.segment import Attached
from llfsm_verify.values import Shown

T = TypeVar("T")
BEHIND = 2
"""A reader that was too slow goes on with the newest half of the frames that are kept."""
CYCLES, SHORTEST, LONGEST = 4, 0.02, 1.0
"""A reader that is not woken looks after so many cycles; seconds of that, at least and at most."""
MOST_WAKES = 64
"""Datagrams that are read at once; there may always be another one."""


@dataclass(frozen=True, slots=True)
class Update:
    """A frame in which something changed that was subscribed to."""

    number: int
    """Of the frame."""
    values: Mapping[str, Shown]
    """All that is subscribed to, of one moment."""
    missed: int
    """Frames that were overwritten before they could be read, since the last update: something may have changed in
    them and back again."""


@dataclass(frozen=True, slots=True)
class Feed:
    """Where a reader has frames from."""

    attached: Attached
    woken: socket.socket
    """The server has made it, and sends a datagram there after each frame."""
    server: socket.socket
    """Its other end is closed when the server is gone."""
    running: Callable[[], bool]
    """Whether another frame may come."""
    over: Callable[[], None]
    """To be called when the socket is not needed any more."""


def most_missed(every: int, kept: int = GENERATIONS) -> int:
    """How many frames a reader may miss at once that reads each within so many cycles, when so many frames are kept.

    When it looks, the newest frame is at most `every` after the last one that it read. The frame after that one is
    being overwritten once the newest one is `kept` after the last one.
    """
    return 0 if every < kept else every - kept // BEHIND - 1


class _Reader(Closing, Generic[T]):
    """Reads frame after frame, each once, in order, and makes something of them.

    `fileno` is readable when there may be a new frame or the run has ended, for `selectors` and `asyncio`; no thread is
    started. A reader that waits for it looks again after `patience` seconds.
    """

    def __init__(self, feed: Feed) -> None:
        self._attached = feed.attached
        self._feed = feed
        self._last = 0
        self._pending: deque[T] = deque()
        """Read, and not handed out yet."""
        self.patience = min(LONGEST, max(SHORTEST, CYCLES * feed.attached.period / 1e9))
        """Seconds after which to look in any case: a datagram may be lost."""
        self._unwatch: Callable[[], None] = lambda: None
        feed.woken.setblocking(False)
        self._both = select.epoll()
        self._both.register(feed.woken, select.EPOLLIN)
        self._both.register(feed.server, select.EPOLLIN | select.EPOLLRDHUP)

    def _first(self) -> list[int] | None:
        """The frame to begin with."""
        return self._attached.newest()

    @abstractmethod
    def _take(self, frame: list[int], lost: int) -> None:
        """A frame, and how many before it were overwritten before they could be read."""

    def fileno(self) -> int:
        """A descriptor to wait on."""
        return self._both.fileno()

    def read(self) -> list[T]:
        """What is new; it does not wait. The first one is how things stand."""
        self._fetch()
        found = list(self._pending)
        self._pending.clear()
        return found

    def _fetch(self) -> None:
        with suppress(BlockingIOError):
            for _ in range(MOST_WAKES):
                self._feed.woken.recv(16)
        while self._last < (newest := self._attached.latest):
            frame = self._attached.frame(self._last + 1) if self._last else self._first()
            if frame is None:  # overwritten: go on with the oldest one that is not about to be
                oldest = max(self._last + 1, newest - GENERATIONS // BEHIND)
                while (frame := self._attached.frame(oldest)) is None:
                    oldest = max(oldest + 1, self._attached.latest - GENERATIONS // BEHIND)
            lost = frame[NUMBER] - self._last - 1 if self._last else 0
            self._last = frame[NUMBER]
            self._take(frame, lost)

    def __iter__(self) -> Iterator[T]:
        """What comes, as it comes, until the run has ended."""
        while not self._both.closed:
            running = self._feed.running()
            self._fetch()
            while self._pending:  # who leaves the iterator finds the others later
                yield self._pending.popleft()
            if not running:
                return
            if not self._both.closed:
                self._both.poll(self.patience)

    async def __aiter__(self) -> AsyncIterator[T]:
        if self._both.closed:
            return
        loop = asyncio.get_running_loop()
        woken = asyncio.Event()
        descriptor = self.fileno()
        loop.add_reader(descriptor, woken.set)

        def unwatch() -> None:
            if not loop.is_closed():
                loop.remove_reader(descriptor)

        self._unwatch = unwatch
        try:
            while not self._both.closed:
                running = self._feed.running()
                self._fetch()
                while self._pending:
                    yield self._pending.popleft()
                if not running:
                    return
                timer = loop.call_later(self.patience, woken.set)
                await woken.wait()
                timer.cancel()
                woken.clear()
        finally:
            if not self._both.closed:  # else the number may be another file's by now
                unwatch()

    def close(self) -> None:
        """Nothing more is read, and iterators end."""
        if not self._both.closed:
            self._unwatch()
            self._both.close()
            self._feed.woken.close()
            self._feed.over()


class Subscription(_Reader[Update]):
    """Reads frame after frame, each once, in order; where the writer went round before it was read, it says so.

    Iterated over, or awaited, it gives updates until the run has ended. `fileno` is readable when there may be a new
    frame or the run has ended, for `selectors` and `asyncio`; who waits for it looks again after `patience` seconds. No
    thread is started. Made by `Whiteboard.subscribe`.
    """

    def __init__(self, feed: Feed, of: Mapping[str, Slot]) -> None:
        super().__init__(feed)
        self._slots = of
        self.missed = 0
        """Frames that were missed since the last update."""
        self._values: dict[str, Shown] | None = None

    def _take(self, frame: list[int], lost: int) -> None:
        self.missed += lost
        values = {name: slot.value(frame) for name, slot in self._slots.items()}
        if values != self._values:
            self._values = values
            self._pending.append(Update(frame[NUMBER], values, self.missed))
            self.missed = 0


class Frames(_Reader[list[int]]):
    """Frames as they are, from the first one if it is still there, until the run has ended."""

    def _first(self) -> list[int] | None:
        return self._attached.frame(1) or self._attached.newest()

    def _take(self, frame: list[int], lost: int) -> None:
        del lost  # frames have numbers
        self._pending.append(frame)

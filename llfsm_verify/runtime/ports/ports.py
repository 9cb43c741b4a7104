"""All ports of a run, served on one thread, beside the thread or process in which the arrangement runs."""

from __future__ import annotations

import select
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.jsonvalue import Json
from llfsm_verify.runtime.live.frame import NUMBER
from llfsm_verify.runtime.live.pace import Pace
from llfsm_verify.runtime.live.slots import Slot
from llfsm_verify.runtime.ports import UNOPENED
from llfsm_verify.runtime.ports.port import Port, PortSpec, Unopened
from llfsm_verify.runtime.whiteboard.posts import Posts, Refused
from llfsm_verify.values import Shown, choice_value, shown


@dataclass(slots=True)
class Counts:
    """What a port has done."""

    taken: int = 0
    """Messages that gave a value to an input."""
    refused: int = 0
    """Values that were not of the type of their input."""
    malformed: int = 0
    """Messages that could not be read, and those without a field of an input."""
    failures: int = 0
    """How often an input has failed."""
    sent: int = 0
    """Messages."""
    unsent: int = 0
    """Messages that were never sent, because newer ones took their places or the other side was gone."""


class RunLink:
    """The link of one port.

    An input fails when its port says that it is lost, or when it has had no message for the time-out; with a time-out,
    what may come back by itself has that long. It has failed until its next message. With `pace` it begins cycles.
    """

    def __init__(
        self,
        spec: PortSpec,
        posts: Posts,
        say: Callable[[str], None],
        clock: Callable[[], float],
        pace: Pace | None = None,
    ) -> None:
        self.spec = spec
        self.pace = pace
        self.name, self.fields = spec.name, frozenset(spec.inputs.values())
        self.counts = Counts()
        self.stop: str | None = None
        """Why the run shall end."""
        self.over = False
        """Whether the run has ended, so that nothing fails any more."""
        self._posts, self._say, self._clock = posts, say, clock
        now = clock()
        self._heard = dict.fromkeys(spec.inputs, now)
        self._ended = now
        """When the last cycle has ended that this port began."""
        self._failed: set[str] = set()
        self._said: set[str] = set()

    def follow(self, posts: Posts) -> None:
        """Post to another run from now on."""
        self._posts = posts

    def begin(self) -> None:
        """The run begins now: nothing could be heard before."""
        self._ended = self._clock()
        self._heard = dict.fromkeys(self.spec.inputs, self._ended)

    def cycle(self, number: int, values: Mapping[str, Json]) -> None:
        """See `Link`: the loop reads these values where it begins the cycle."""
        pace = self.pace
        if pace is None:
            self.malformed("a message begins a cycle, and the port has no `clock: external`")
        elif pace.under_way:
            self._misplaced(f"cycle {number:,} cannot begin before the frame of cycle {pace.next - 1:,} was sent")
        elif number != pace.next:
            self._misplaced(f"cycle {number:,} cannot begin where cycle {pace.next:,} is the next one")
        elif not pace.over:
            if values:
                self.take(values)
            pace.begin()

    def _misplaced(self, why: str) -> None:
        self.counts.malformed += 1
        self._once("misplaced", why)

    def cycle_ended(self) -> bool:
        """Whether the cycle that this port began has ended; it is said once."""
        if self.pace is None or not self.pace.ended():
            return False
        self._ended = self._clock()
        return True

    def take(self, values: Mapping[str, Json]) -> None:
        """See `Link`: values that fit are posted, all together."""
        given = {name: values[field] for name, field in self.spec.inputs.items() if field in values}
        if not given:
            self.malformed(f"a message has none of the fields {', '.join(sorted(self.fields))}")
            return
        good = {name: value for name, value in given.items() if self._fits(name, value)}
        if good:
            self._posts.post(good)
            self.counts.taken += 1
            self._heard |= dict.fromkeys(good, self._clock())
            self._failed -= good.keys()

    def _fits(self, name: str, value: Json) -> bool:
        try:
            self._posts.number(name, value)
        except Refused as refused:
            self.counts.refused += 1
            self._once("refused", f"a value is refused: {refused}")
            return False
        return True

    def malformed(self, why: str) -> None:
        """See `Link`."""
        self.counts.malformed += 1
        self._once(f"malformed {why}", why)

    def lost(self, why: str, *, forever: bool = False) -> None:
        """See `Link`."""
        if self.spec.inputs and (forever or self.spec.timeout is None):
            self._fail([name for name in self._heard if name not in self._failed], why)
        else:
            self._once("lost", why)

    def sent(self) -> None:
        """See `Link`."""
        self.counts.sent += 1

    def unsent(self, why: str) -> None:
        """See `Link`."""
        self.counts.unsent += 1
        self._once(f"unsent {why}", f"an output is not written: {why}")

    def look(self, now: float) -> None:
        """Whether an input, or the run, has waited for too long."""
        if self.pace is not None and not self.pace.under_way and now - self._ended >= WAITING and not self.over:
            self._once("waits", f"the run waits for cycle {self.pace.next:,}, which the port begins")
        limit = self.spec.timeout
        if limit is not None:
            late = [n for n, heard in self._heard.items() if n not in self._failed and now - heard >= limit]
            self._fail(late, f"no message for {limit:g} s")

    @property
    def due(self) -> float | None:
        """When `look` has to be called next, if nothing comes."""
        waiting = [heard for name, heard in self._heard.items() if name not in self._failed]
        return None if self.spec.timeout is None or not waiting else min(waiting) + self.spec.timeout

    def _fail(self, names: list[str], why: str) -> None:
        if not names or self.over:
            return
        self._failed |= set(names)
        self.counts.failures += len(names)
        told = f"{why}: " + ", ".join(f"`{name}`" for name in names)
        if self.spec.on_failure == "safe":
            self._posts.post({name: self.spec.safe[name] for name in names})
            self._once("safe", f"{told} {'gets its safe value' if len(names) == 1 else 'get their safe values'}")
        elif self.spec.on_failure == "stop":
            self.stop = self.stop or f"port {self.name}: {told} failed"
        else:
            self._once("stale", f"{told} {'keeps its last value' if len(names) == 1 else 'keep their last values'}")

    def _once(self, kind: str, what: str) -> None:
        """Say it the first time; the counts have the others."""
        if kind not in self._said:
            self._said.add(kind)
            self._say(f"port {self.name}: {what}")


WAITING = 5.0
"""Seconds without a cycle after which a port that begins them is reported."""
FINISHING = 1.0
"""Seconds in which the last messages must be sent."""
SHORTEST, LONGEST = 0.001, 0.02
"""Seconds between two looks at the newest frame, which are half a cycle within these bounds."""

T = TypeVar("T")
Newest = Callable[[], Sequence[int] | None]
"""Reads the newest frame; None: there is none yet."""


class Ports:
    """The ports of a run, open until `finish`.

    They post to `posts`, read frames by `newest`, and call `stop` when the run shall end; they know nothing else of it.
    `say` gets what happens, each kind of it once. With `pace`, one of them begins cycles. DiagnosticError (E495): one
    cannot be opened, and none is open.
    ModuleNotFoundError: a package is not installed.
    """

    def __init__(
        self,
        specs: Iterable[PortSpec],
        posts: Posts,
        newest: Newest,
        slots: Iterable[Slot],
        *,
        period: float = 0.0,
        stop: Callable[[], object] = lambda: None,
        say: Callable[[str], None] = lambda _: None,
        clock: Callable[[], float] = time.monotonic,
        pace: Pace | None = None,
    ) -> None:
        self._newest = newest
        self._slots = {slot.name: slot for slot in slots}
        self._clock = clock
        self._pause = LONGEST if pace is not None else min(max(period / 2, SHORTEST), LONGEST)
        self._frame = 1  # the first frame, before the first turn, has no values of inputs
        self._sent: dict[str, Mapping[str, Shown]] = {}
        self._open: list[tuple[RunLink, Port]] = []
        self._links: list[RunLink] = []
        self._stop, self._stopped = stop, False
        self._outer, self._inner = select.epoll(), select.epoll()
        self._outer.register(self._inner, select.EPOLLIN)
        if pace is not None:
            self._outer.register(pace.fileno(), select.EPOLLIN)
        self._ports: dict[int, Port] = {}
        """By the descriptors that are watched."""
        self._plain: dict[int, int] = {}
        """Those that no epoll can watch, with their events."""
        try:
            for spec in specs:
                link = RunLink(spec, posts, say, clock, pace if spec.paces else None)
                self._links.append(link)
                self._open.append((link, spec.start(link)))
        except Unopened as problem:
            self.close()
            message = f"port `{spec.name}` cannot be opened: {problem}"
            raise DiagnosticError(Diagnostic(UNOPENED, message, spec.span, hint=problem.hint)) from None
        except BaseException:
            self.close()
            raise
        for link in self._links:
            link.begin()
        self._watch()

    def follow(self, posts: Posts, newest: Newest, slots: Iterable[Slot]) -> None:
        """Post to another run and read its frames, which go on with the numbers of those before."""
        self._newest, self._slots = newest, {slot.name: slot for slot in slots}
        for link in self._links:
            link.follow(posts)

    @property
    def failure(self) -> str | None:
        """Why the run shall end: an input has failed whose port says ``stop``."""
        return next((link.stop for link in self._links if link.stop is not None), None)

    @property
    def counts(self) -> dict[str, Counts]:
        """What each port has done, by name."""
        return {link.name: link.counts for link in self._links}

    def fileno(self) -> int:
        """Readable when `serve` has something to do."""
        return self._outer.fileno()

    @property
    def patience(self) -> float:
        """After so many seconds `serve` should be called in any case: half a cycle, or when an input may fail."""
        now = self._clock()
        due = min((at - now for link in self._links if (at := link.due) is not None), default=self._pause)
        return max(0.0, min(due, SHORTEST if self._plain else self._pause))

    def serve(self, seconds: float) -> None:
        """Move messages as they come, for at most so long."""
        if self._outer.closed:
            return
        self._move(min(seconds, self.patience))
        self._look()
        over = any(link.pace is not None and link.pace.over for link in self._links)
        if (over or self.failure is not None) and not self._stopped:
            self._stopped = True
            self._stop()

    def _move(self, seconds: float) -> None:
        ready: dict[int, dict[int, int]] = {}
        for descriptor, events in (*self._inner.poll(0 if self._plain else seconds), *self._plain.items()):
            if descriptor in self._ports:
                ready.setdefault(id(self._ports[descriptor]), {})[descriptor] = events
        now = self._clock()
        for link, port in list(self._open):
            self._guard(link, port, partial(port.serve, ready.get(id(port), {}), now))
            link.look(now)
        self._watch()

    def _watch(self) -> None:
        """Wait for what the ports wait for from now on.

        They open and close descriptors as they like, and one that was duplicated before it was closed could never be
        taken out of an epoll again: so each wait has one of its own, inside the one that others see.
        """
        if not self._inner.closed:
            self._outer.unregister(self._inner)
            self._inner.close()
        self._inner = select.epoll()
        self._ports, self._plain = {}, {}
        for link, port in list(self._open):
            for descriptor, events in self._guard(link, port, partial(_waits, port)) or ():
                self._ports[descriptor] = port
                try:
                    self._inner.register(descriptor, events)
                except PermissionError:  # a regular file is always ready
                    self._plain[descriptor] = events
                except OSError:
                    self._plain[descriptor] = select.POLLNVAL
        self._outer.register(self._inner, select.EPOLLIN)

    def _guard(self, link: RunLink, port: Port, act: Callable[[], T]) -> T | None:
        """A port of another package that fails is closed; the others, and the run, go on."""
        try:
            return act()
        except Exception as error:  # noqa: BLE001 - see above
            self._open = [pair for pair in self._open if pair[1] is not port]
            with suppress(Exception):
                port.close()
            link.lost(f"the port has failed: {type(error).__name__}: {error}", forever=True)
            return None

    def _look(self, *, last: bool = False) -> None:
        """Send what the newest frame has changed; to a port that begins cycles, the frame at the end of each, and the
        last one."""
        ended = any(link.cycle_ended() for link in self._links)  # before the newest frame is read
        frame = self._newest()
        if frame is None:
            return
        new, self._frame = frame[NUMBER] > self._frame, max(frame[NUMBER], self._frame)
        for link, port in list(self._open):
            due, always = new, port.every_frame
            if link.pace is not None:
                due, always = ended or last, ended or link.pace.under_way
            if due and (link.spec.outputs or always):
                values = {field: self._slots[name].value(frame) for name, field in link.spec.outputs.items()}
                if always or values != self._sent.get(link.name):
                    self._send(link, port, values)

    def _send(self, link: RunLink, port: Port, values: Mapping[str, Shown]) -> None:
        self._sent[link.name] = values
        self._guard(link, port, partial(port.send, values))
        self._watch()  # it may have something to write now

    def finish(self, ending: str) -> None:
        """Send the last frame and, where the arrangement has not `ended` by itself, safe values; then close.

        `ending` is one of `live.frame.ENDINGS`. Where no turn was ever taken, nothing is sent. What is not
        read within FINISHING is not waited for, and counted.
        """
        if not self._open:
            return
        for link in self._links:
            link.over = True
        self._look(last=True)
        self._flush()
        if ending != "ended" and self._frame > 1:
            for link, port in list(self._open):
                safe = {
                    field: self._safe(link, name) for name, field in link.spec.outputs.items() if name in link.spec.safe
                }
                if safe:
                    self._send(link, port, {**self._sent.get(link.name, {}), **safe})
            self._flush()
        for link, port in self._open:
            if not port.flushed:
                link.unsent("the run has ended before it was read")
        self.close()

    def _safe(self, link: RunLink, name: str) -> Shown:
        choice = self._slots[name].choice
        return shown(choice.type, choice.labels, choice_value(choice, link.spec.safe[name]))

    def _flush(self) -> None:
        limit = time.monotonic() + FINISHING
        while time.monotonic() < limit and any(not port.flushed for _, port in self._open):
            self._move(SHORTEST * 10)

    def close(self) -> None:
        """Close all ports, without a word."""
        for _, port in self._open:
            with suppress(Exception):
                port.close()
        self._open = []
        self._inner.close()
        self._outer.close()


def _waits(port: Port) -> list[tuple[int, int]]:
    return list(port.waits())

"""All ports of a run, served on one thread, beside the thread or process in which the arrangement runs."""

from __future__ import annotations

import select
import time
from collections import deque
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from decimal import Decimal
from functools import partial
from math import ceil
from types import MappingProxyType
from typing import Any, TypeVar

from llfsm_verify.arrangement.requests import Request
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, without_controls
from llfsm_verify.jsonvalue import Json
from llfsm_verify.runtime.live.frame import CYCLE, NUMBER
from llfsm_verify.runtime.live.pace import Pace
from llfsm_verify.runtime.live.slots import Slot
from llfsm_verify.runtime.ports import UNOPENED
from llfsm_verify.runtime.ports.handshake import FAILURES, Handshake
from llfsm_verify.runtime.ports.line_port import inner
from llfsm_verify.runtime.ports.port import AskingPort, Link, Port, PortSpec, Unopened
from llfsm_verify.runtime.whiteboard.posts import Posts, Refused
from llfsm_verify.values import Shown, ValueProblem, choice_value, number_of, shown, text


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
    silent: set[str] = field(default_factory=set)
    """Inputs of which no message has come."""


class RunLink:
    """The link of one port.

    An input fails when its port says that it is lost, or when it has had no message for the time-out; with a time-out,
    what may come back by itself has that long. It has failed until its next message. With `pace` it begins cycles.

    Until it is told which run to `follow`, it keeps what has come.
    """

    def __init__(
        self, spec: PortSpec, slots: Mapping[str, Slot], cycle_ms: float, say: Callable[[str], None],
        clock: Callable[[], float],
    ) -> None:  # fmt: skip
        self.spec = spec
        self.pace: Pace | None = None
        self.name, self.fields = spec.name, frozenset(spec.inputs.values())
        self.counts = Counts()
        self.latest = 0
        self.repeats = spec.when is None
        self.stop: str | None = None
        """Why the run shall end."""
        self.over = False
        """Whether the run has ended, so that nothing fails any more."""
        self.port: Port | None = None
        self._slots, self._cycle_ms = slots, cycle_ms
        self._posts: Posts | None = None
        self._early: list[dict[str, Json]] = []
        """What has come before there is a run, by message where there are events in it."""
        self._parameters: dict[str, int] = {}
        self._first_cycle: tuple[int, Mapping[str, Json]] | None = None
        self._say, self._clock = say, clock
        self.paced = False
        """Whether a port begins the cycles, so that time-outs of inputs count logical time."""
        self._ended = clock()
        """When the last cycle has ended that this port began."""
        self._heard = dict.fromkeys((name for name in spec.inputs if name not in spec.never), self._ended)
        self.counts.silent.update(self._heard)
        self._failed: set[str] = set()
        self._said: set[str] = set()
        self._pulses: deque[tuple[str, Json]] = deque()
        """Events that no cycle has had."""
        self._theirs: dict[str, str] = {}
        for theirs, ours in spec.values.items():
            self._theirs.setdefault(ours, theirs)
        self.handshakes = [Handshake(_in_cycles(request, cycle_ms), self) for request in spec.requests]
        self._numbers = 0
        self._sends: dict[str, Shown] = {}
        """The fields of a request, if it is sent now."""
        self._unanswered: dict[int, Handshake] = {}
        self._forgotten = 0
        """Up to this number, answers that nothing waits for may still come."""

    def _time(self) -> float:
        """Seconds, as inputs count them."""
        return self.latest * self._cycle_ms / 1000 if self.paced else self._clock()

    def hello(self, told: Mapping[str, Json]) -> dict[str, Json]:
        """See `Link`."""

        def types(fields: Mapping[str, str]) -> dict[str, Json]:
            return {field: _type(self._slots[name]) for name, field in fields.items()}

        requests: dict[str, Json] = {
            r.name: {
                **r.told, "kind": r.kind, "timeout": r.timeout, "sends": types(r.sends), "answers": types(r.answers),
                "feedback": types(r.feedback),
            }
            for r in self.spec.requests
        }  # fmt: skip
        return {
            "hello": 1, "port": self.name, "cycle_ms": self._cycle_ms, "inputs": types(self.spec.inputs),
            "outputs": types(self.spec.outputs), "requests": requests, "told": dict(told),
            **({} if not self.spec.paces else {"cycle": 0 if self.pace is None else self.pace.next}),
        }  # fmt: skip

    def parameters(self) -> dict[str, int]:
        """The values of inputs that never change, from what has come by now. Unopened: some are missing or wrong."""
        for name in sorted(self.spec.never):
            said = [message.pop(name) for message in self._early if name in message]
            if not said:
                raise Unopened(f"its hello has no value for `{name}`", f"let it say `{self.spec.inputs[name]}` first")
            given = said[-1]
            number = self._parameter(name, given)
            if number is None:
                raise Unopened(
                    f"its hello gives `{name}` the value {_text(given)[:40]}", "let it say a value that fits"
                )
            self._parameters[name] = number
        return dict(self._parameters)

    def _parameter(self, name: str, given: Json) -> int | None:
        for value in (self.spec.values.get(_text(given)), given):
            with suppress(ValueProblem):
                if isinstance(value, bool | int | str):
                    return number_of(self._slots[name].choice, value)
        return None

    def follow(self, posts: Posts, slots: Mapping[str, Slot]) -> None:
        """Post to this run from now on; `slots`: where its frames have what."""
        first, self._posts, self._slots = self._posts is None, posts, slots
        for name, value in list(self._pulses):
            posts.pulse(name, value, self._pulsed)
        if first:
            posts.post(dict(self.spec.events))
            early, self._early = self._early, []
            for given in early:
                self._give(given)
            if self.spec.on_failure == "safe":  # what has failed already
                posts.post({name: self.spec.safe[name] for name in self._failed})
            if self._first_cycle is not None:
                self.cycle(*self._first_cycle)

    def begin(self) -> None:
        """The run begins now: nothing could be heard before."""
        self._ended = self._clock()
        self._heard = dict.fromkeys(self._heard, self._time())
        for handshake in self.handshakes:
            handshake.begin()

    def cycle(self, number: int, values: Mapping[str, Json]) -> None:
        """See `Link`: the loop reads these values where it begins the cycle."""
        pace = self.pace
        if not self.spec.paces:
            self.malformed("a message begins a cycle, and the port has no `clock: external`")
        elif (self._posts is None or pace is None) and number == 0 and self._first_cycle is None:
            self._first_cycle = number, values
        elif self._posts is None or pace is None:
            why = "where cycle 0 is the next one" if number else "twice"
            self._misplaced(f"cycle {number:,} cannot begin {why}")
        elif pace.under_way:
            self._misplaced(f"cycle {number:,} cannot begin before the frame of cycle {pace.next - 1:,} was sent")
        elif number != pace.next:
            self._misplaced(f"cycle {number:,} cannot begin where cycle {pace.next:,} is the next one")
        elif not pace.over:
            if values:
                self.take(values)
            self._posts.forward()  # the next event, if one waits
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
        given = _picked(self.spec.inputs, values)
        if not given:
            self.malformed(f"a message has none of the fields {', '.join(sorted(self.fields))}")
        elif self._posts is None and self._early and not given.keys() & self.spec.events.keys():
            self._early[-1] |= given
        elif self._posts is None and len(self._early) < MOST_EARLY:
            self._early.append(given)
        elif self._posts is None:
            self.counts.refused += len(given)
            self._once("events", f"an event is refused: {MOST_EARLY:,} wait for the first cycle already")
        else:
            never = given.keys() & self.spec.never
            if other := [n for n in sorted(never) if self._parameter(n, given[n]) != self._parameters.get(n)]:
                self.counts.refused += len(other)
                self._once("never", f"another value comes during the run for `{other[0]}`, which never changes")
            if given.keys() - never:
                self._give(given)

    def _give(self, given: Mapping[str, Json]) -> None:
        """Post what fits."""
        assert self._posts is not None
        good = self._fitting({name: value for name, value in given.items() if name not in self.spec.never})
        if good:
            self._posts.post({name: value for name, value in good.items() if name not in self.spec.events})
            self.counts.taken += 1
            self._heard |= dict.fromkeys(good, self._time())
            self.counts.silent -= good.keys()
            self._failed -= good.keys()
        for name in good.keys() & self.spec.events.keys():
            self._pulse(name, good[name])

    def _pulse(self, name: str, value: Json) -> None:
        assert self._posts is not None
        try:
            self._posts.pulse(name, value, self._pulsed)
        except Refused as refused:
            self.counts.refused += 1
            self._once("events", f"an event is refused: {refused}")
        else:
            self._pulses.append((name, value))

    def _pulsed(self, _: int) -> None:
        self._pulses.popleft()

    def _fitting(self, given: Mapping[str, Json]) -> dict[str, Json]:
        """Those values that fit their inputs, as they are called here."""
        good: dict[str, Json] = {}
        for name, value in given.items():
            try:
                good[name] = self._fit(name, value)
            except Refused as refused:
                self.counts.refused += 1
                self._once("refused", f"a value is refused: {refused}")
        return good

    def _fit(self, name: str, value: Json) -> Json:
        """A value of an input, as it is called here. Refused."""
        assert self._posts is not None
        ours = self.spec.values.get(_text(value), value)
        with suppress(Refused):
            self._posts.number(name, ours)
            return ours
        self._posts.number(name, value)
        return value

    # ------------------------------------------------------------ requests

    def see(self, frame: Sequence[int]) -> None:
        """A frame has come, the newest."""
        for handshake in self.handshakes:
            handshake.look(self.latest)
            request = handshake.request
            shown = self._slots[request.state].value(frame) == request.called(handshake.state)
            self._sends = {field: self.theirs(self._slots[name].value(frame)) for name, field in request.sends.items()}
            handshake.see(bool(self._slots[request.ask].value(frame)), shown=shown, now=self.latest)

    def theirs(self, value: Shown) -> Shown:
        """A value as the other side calls it."""
        return self._theirs.get(text(value), value) if self._theirs else value

    def show(self, request: Request, state: str, answers: Mapping[str, str], values: Mapping[str, Json]) -> None:
        """See `Asked`."""
        assert self._posts is not None
        self._posts.post({**self._fitting(_picked(answers, values)), request.state: request.called(state)})

    def number(self, handshake: Handshake) -> int:
        """See `Asked`."""
        if len(self._unanswered) >= MOST_UNANSWERED:
            old = next((number for number, of in self._unanswered.items() if of.number != number), 0)
            self._unanswered.pop(old, None)
            self._forgotten = max(self._forgotten, old)
        self._numbers += 1
        self._unanswered[self._numbers] = handshake
        return self._numbers

    def ask(self, request: Request, number: int) -> None:
        """See `Asked`."""
        if isinstance(self.port, AskingPort) and not self.over:
            self.port.ask(number, request.name, self._sends)

    def cancel(self, number: int) -> None:
        """See `Asked`."""
        if isinstance(self.port, AskingPort):
            self.port.cancel(number)

    def report(self, number: int, state: str, values: Mapping[str, Json], *, end: bool) -> None:
        """See `Link`. What comes late is thrown away."""
        handshake = self._unanswered.get(number)
        if handshake is None and not 0 < number <= self._forgotten:
            self.malformed(f"an answer has a number for which nothing waits: {number}")
        if handshake is None:
            return
        if end:
            del self._unanswered[number]
        if handshake.number == number:
            problem = self._unfit(handshake.request, state, values) if end else None
            if problem is not None:
                self.counts.refused += 1
                self._once(f"unfit {handshake.request.name}", problem)
                state, values = "" if state in COMPLETE else state, {}
            problem = handshake.report(state, values, self.latest, end=end)
            if problem is not None:
                self.malformed(problem)

    def _unfit(self, request: Request, state: str, values: Mapping[str, Json]) -> str | None:
        """Why an answer is not valid: a value does not fit its input, or is missing where the request is done."""
        given, why = _picked(request.answers, values), ""
        lacking = [field for name, field in request.answers.items() if name not in given]
        if lacking and state in COMPLETE:
            why = f"it has no `{lacking[0]}`"
        for name, value in given.items():
            try:
                self._fit(name, value)
            except Refused as refused:
                why = str(refused)
        instead = f", so it is {FAILURES[request.kind]}" if state in COMPLETE else ""
        return f"an answer does not fit the request `{request.name}`{instead}: {why}" if why else None

    def fail_requests(self, why: str) -> None:
        """See `Link`."""
        for number, handshake in list(self._unanswered.items()):
            if handshake.number == number:
                request = handshake.request
                self._once(f"failed {request.name}", f"{why}: the request `{request.name}` {FAILURES[request.kind]}")
            self.report(number, "", {}, end=True)

    # ------------------------------------------------------------ what goes wrong

    def say(self, what: str) -> None:
        """See `Link`."""
        if len(self._said) < MOST_SAID:
            self._once(f"say {what}", what)

    def malformed(self, why: str) -> None:
        """See `Link`."""
        self.counts.malformed += 1
        self._once(f"malformed {why.partition(':')[0]}", why)

    def lost(self, why: str, *, forever: bool = False, fields: Collection[str] | None = None) -> None:
        """See `Link`."""
        if forever and self.spec.paces and not self.over:
            self.stop = self.stop or f"port {self.name}: {_harmless(why)}, so no cycle can begin"
        of = [name for name in self._heard if fields is None or self.spec.inputs[name] in fields]
        if of and (forever or fields is not None or self.spec.timeout is None):
            self._fail([name for name in of if name not in self._failed], why)
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
            at = self._time()
            late = [n for n, heard in self._heard.items() if n not in self._failed and at - heard >= limit]
            self._fail(late, f"no message for {limit:g} s")
        if self._pulses and self._posts is not None:
            self._posts.forward()

    @property
    def due(self) -> float | None:
        """When `look` has to be called next, if nothing comes."""
        limit = None if self.paced else self.spec.timeout
        waiting = [] if limit is None else [at + limit for name, at in self._heard.items() if name not in self._failed]
        return min(waiting, default=None)

    def _fail(self, names: list[str], why: str) -> None:
        if not names or self.over:
            return
        self._failed |= set(names)
        self.counts.failures += len(names)
        told = f"{why}: " + ", ".join(f"`{name}`" for name in names)
        if self.spec.on_failure == "safe" and self._posts is not None:
            self._posts.post({name: self.spec.safe[name] for name in names})
            self._once("safe", f"{told} {'gets its safe value' if len(names) == 1 else 'get their safe values'}")
        elif self.spec.on_failure == "stop":
            self.stop = self.stop or f"port {self.name}: {_harmless(told)} failed"
        else:
            self._once("stale", f"{told} {'keeps its last value' if len(names) == 1 else 'keep their last values'}")

    def _once(self, kind: str, what: str) -> None:
        """Say it the first time; the counts have the others."""
        if kind not in self._said:
            self._said.add(kind)
            self._say(f"port {self.name}: {_harmless(what)}")


def _harmless(what: str) -> str:
    """A text with words of the other side, which may be anything."""
    return without_controls(what.encode(errors="replace").decode())[:MOST_TOLD]


WAITING = 5.0
"""Seconds without a cycle after which a port that begins them is reported."""


def _in_cycles(request: Request, cycle_ms: float) -> Request:
    """With its time-out in cycles, as its plant counts it: at any `--rate`, and also with a clock outside."""
    limit = request.timeout
    return request if limit is None else replace(request, timeout=ceil(round(1000 * limit / cycle_ms, 6)))


def _picked(fields: Mapping[str, str], values: Mapping[str, Json]) -> dict[str, Json]:
    """By name what a message has in the field of it: under the field itself, or where its dots lead."""
    found: dict[str, Json] = {}
    for name, path in fields.items():
        part: Any = values
        with suppress(LookupError, TypeError, ValueError):
            for step in [path] if path in values or not inner(path) else path.split("."):
                part = part[int(step) if isinstance(part, list) and step.isdecimal() else step]
            found[name] = part
    return found


def _text(value: Json | Shown) -> str:
    return text(value) if isinstance(value, bool | int | str | Decimal) else f"({type(value).__name__})"


def _type(slot: Slot) -> Json:
    return {
        "low": slot.low, "high": slot.high, "boolean": slot.boolean, "digits": slot.digits, "labels": [*slot.labels],
    }  # fmt: skip


COMPLETE = ("DONE", "SUCCEEDED")
"""Ends that come with all answers."""
MOST_UNANSWERED = 1000
"""Requests of a port whose answers, which are not wanted any more, may still come."""
MOST_EARLY = 1000
"""Messages with events that wait for the first cycle."""
MOST_SAID, MOST_TOLD = 100, 1000
"""Different texts that the other side may say, and characters of one."""
FINISHING, LEAVING = 1.0, 2.0
"""Seconds in which the last messages must be sent, and programs must have ended."""
SHORTEST, LONGEST = 0.001, 0.02
"""Seconds between two looks at the newest frame, which are half a cycle within these bounds."""

T = TypeVar("T")
Newest = Callable[[], Sequence[int] | None]
"""Reads the newest frame; None: there is none yet."""


def opened(
    spec: PortSpec, slots: Mapping[str, Slot], cycle_ms: float, say: Callable[[str], None] = lambda _: None,
    clock: Callable[[], float] = time.monotonic,
) -> RunLink:  # fmt: skip
    """An open port, before there is a run that it could serve. DiagnosticError (E495): it cannot be opened."""
    link = RunLink(spec, slots, cycle_ms, say, clock)
    try:
        link.port = spec.start(link)
        return link
    except Unopened as problem:
        raise unopened(spec, problem) from None


def unopened(spec: PortSpec, problem: Unopened) -> DiagnosticError:
    """E495."""
    message = f"port `{spec.name}` cannot be opened: {problem}"
    return DiagnosticError(Diagnostic(UNOPENED, message, spec.span, hint=problem.hint))


def _one_cycle(spec: PortSpec, posts: Posts) -> None:
    """DiagnosticError (E495): the events of a port would not have one cycle each."""
    if not posts.has_pulses:
        hint = "leave out `events`, or let one process of the arrangement run all its machines"
        raise unopened(spec, Unopened("several processes take turns, so that an event has no single cycle", hint))


class Ports:
    """The ports of a run, open until `finish`.

    They post to `posts`, read frames by `newest`, and call `stop` when the run shall end; they know nothing else of it.
    `say` gets what happens, each kind of it once; `early` has those that are open already, and the others are opened.
    With `pace`, one of them begins cycles. DiagnosticError (E495): one cannot be opened, and none is open.
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
        cycle_ms: float | None = None,
        early: Mapping[str, RunLink] = MappingProxyType({}),
    ) -> None:
        self._newest = newest
        self._slots = {slot.name: slot for slot in slots}
        self._clock = clock
        self._pause = LONGEST if pace is not None else min(max(period / 2, SHORTEST), LONGEST)
        self._frame = 1  # the first frame, before the first turn, has no values of inputs
        self._sent: dict[str, Mapping[str, Shown]] = {}
        self._keys: dict[str, Mapping[str, Shown]] = {}
        """What `when` was, by port."""
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
        ms = 1000 * period if cycle_ms is None else cycle_ms
        self._open = [(link, port) for link in early.values() if (port := link.port) is not None]
        try:
            for spec in specs:
                link = early.get(spec.name) or opened(spec, self._slots, ms, say, clock)
                self._links.append(link)
                if spec.name not in early and link.port is not None:
                    self._open.append((link, link.port))
                if spec.events:
                    _one_cycle(spec, posts)
                link.pace, link.paced = pace if spec.paces else None, pace is not None
                link.follow(posts, self._slots)
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
            link.follow(posts, self._slots)

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
            with suppress(Exception):
                port.close()
            why = f"the port has failed: {type(error).__name__}: {error}"
            link.port = closed = _Closed(link, why)
            self._open = [(of, closed if one is port else one) for of, one in self._open]
            link.lost(why, forever=True)
            link.fail_requests(why)
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
            spec, due, always = link.spec, new, port.every_frame
            if link.pace is not None:
                due, always = ended or last, ended or link.pace.under_way
            if due:
                link.latest = frame[CYCLE]
            if due and (spec.outputs or always):
                values = {field: link.theirs(self._slots[name].value(frame)) for name, field in spec.outputs.items()}
                if spec.when is not None and link.pace is None:
                    key = {"": self._slots[spec.when].value(frame)}
                    changed = key != self._keys.setdefault(link.name, key)
                    self._keys[link.name] = key
                else:
                    changed = always or values != self._sent.get(link.name)
                if changed:
                    self._send(link, port, values)
                self._sent[link.name] = values
            if due and link.handshakes:
                self._guard(link, port, partial(link.see, frame))
                self._watch()  # it may ask for something now

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
        for link, port in list(self._open):
            for handshake in link.handshakes:
                self._guard(link, port, handshake.withdraw)
        self._watch()
        self._flush()
        if ending != "ended" and self._frame > 1:
            for link, port in list(self._open):
                safe = {
                    field: self._safe(link, name) for name, field in link.spec.outputs.items() if name in link.spec.safe
                }
                if safe and isinstance(port, AskingPort):
                    self._guard(link, port, partial(port.safe, safe))
                elif safe:
                    self._send(link, port, {**self._sent.get(link.name, {}), **safe})
            self._watch()
            self._flush()
        for link, port in list(self._open):
            if isinstance(port, AskingPort):
                self._guard(link, port, partial(port.end, ending))
        self._watch()
        self._flush(LEAVING)
        for link, port in self._open:
            if not port.flushed:
                link.unsent("the run has ended before it was read")
        self.close()

    def _safe(self, link: RunLink, name: str) -> Shown:
        choice = self._slots[name].choice
        return link.theirs(shown(choice.type, choice.labels, choice_value(choice, link.spec.safe[name])))

    def _flush(self, seconds: float | None = None) -> None:
        limit = time.monotonic() + (FINISHING if seconds is None else seconds)
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


class _Closed(AskingPort):
    """In the place of a port that has failed: nothing comes, and no request is answered."""

    every_frame = False

    def __init__(self, link: Link, why: str) -> None:
        self._link, self._why = link, why

    def send(self, values: Mapping[str, Shown]) -> None:  # noqa: ARG002 - nobody hears it
        """See `Port`."""
        self._link.unsent("it has failed")

    def ask(self, number: int, name: str, values: Mapping[str, Shown]) -> None:  # noqa: ARG002 - nobody hears it
        """See `AskingPort`."""
        self._link.fail_requests(self._why)

    def cancel(self, number: int) -> None:
        """See `AskingPort`."""

    def safe(self, values: Mapping[str, Shown]) -> None:
        """See `AskingPort`."""

    def end(self, ending: str) -> None:
        """See `AskingPort`."""


def _waits(port: Port) -> list[tuple[int, int]]:
    return list(port.waits())

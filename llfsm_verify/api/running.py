"""A run of an arrangement, in real time or as fast as possible, from its start to its report."""

from __future__ import annotations

import asyncio
import os
import random
import select
import threading
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import Future
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Self

from llfsm_verify.api.traces import Value
from llfsm_verify.arrangement.draft import Draft
from llfsm_verify.arrangement.formats import Given, read_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.arrangement.replacing import Change, NewPolicy, Replacement
from llfsm_verify.diagnostics import counted
from llfsm_verify.jsonvalue import Json
from llfsm_verify.runtime.launch import Launch, declared_ports, following, launched, opened_early, serving, with_ports
from llfsm_verify.runtime.live.pace import Pace
from llfsm_verify.runtime.live.run import RunReport
from llfsm_verify.runtime.live.slots import slots_of
from llfsm_verify.runtime.ports.port import PortSpec
from llfsm_verify.runtime.swapping.settings import RunSettings
from llfsm_verify.runtime.whiteboard.client import Replaced, WhiteboardError
from llfsm_verify.runtime.whiteboard.places import NoPlace
from llfsm_verify.runtime.whiteboard.server import NameTaken
from llfsm_verify.runtime.whiteboard.shared import Shared
from llfsm_verify.values import text

PATIENCE = 0.02
"""Seconds between two looks whether there is something to do, at most."""
SHORTLY = 0.001
"""Seconds between two looks whether it has begun."""


class LiveRun:
    """What `Model.run` gives: an arrangement that runs. It is a context manager, whose end stops it, and awaitable.

    It is stopped when Python ends. It belongs to the process that made it: in a child which that process forks,
    leaving the context does nothing, and all else raises RuntimeError. `wrapped` is private.
    """

    def __init__(self, ready: Launch, left: ExitStack, said: list[str]) -> None:
        self._pid = os.getpid()
        self.unmonitored: Mapping[str, str] = ready.plan.unmonitored
        """Properties that no finite part of a run decides, and why."""
        self._left = left
        self.said: Sequence[str] = said
        """What went wrong at ports, each kind of it once."""
        self._thread = threading.Thread(target=self._serve, name="llfsm-serve", daemon=True)
        self._lock = threading.RLock()
        """Of all that others see, which another run may take over."""
        self._ended = threading.Event()
        self._awaiting: list[Callable[[], object]] = []
        """To be called when it has ended, by the thread that serves."""
        try:
            try:
                self._launched = self._left.enter_context(launched(ready))
            except (NameTaken, NoPlace) as problem:
                raise WhiteboardError(str(problem)) from None
            self.wrapped, self._shared = self._launched.run, self._launched.shared
            self._ports = self._left.enter_context(serving(ready, self._launched, said.append))
            self._begin()
        except BaseException:
            if self._thread.ident is None:
                self._left.close()
            else:
                self.stop()  # nothing else can
            raise

    def __repr__(self) -> str:
        if not self._is_own:
            return f"<LiveRun of process {self._pid}>"
        if self._report is None:
            return f"<LiveRun: {'ended by an error' if self._ended.is_set() else 'it runs'}>"
        return f"<LiveRun: {self._report.ending} after {counted(self._report.cycles, 'cycle')}>"

    def _begin(self) -> None:
        self._slots = {slot.name: slot for slot in slots_of(self._shared.loop.code)}
        self._report: RunReport | None = None
        self._last: dict[str, Value] | None = None
        self._changing: Future[tuple[int | str, Sequence[str]]] | None = None
        self._failure: BaseException | None = None
        _end_with_program()
        _running.add(self)
        try:
            self._thread.start()
        except BaseException:
            if self._thread.ident is None:
                _running.discard(self)
            raise

    @property
    def _is_own(self) -> bool:
        """Whether it belongs to this process, and not to the one that forked it."""
        return os.getpid() == self._pid

    def _own(self) -> None:
        """RuntimeError: it does not belong to this process."""
        if not self._is_own:
            raise RuntimeError(f"the run belongs to process {self._pid}, of which this one is a child")

    def _serve(self) -> None:
        served = [*([] if self._ports is None else [self._ports]), *self._launched.attendants]
        poll = select.poll()
        for one in (self.wrapped, *served):
            poll.register(one.fileno(), select.POLLIN)
        try:
            self._launched.start(self._follow, *([] if self._ports is None else [following(self._ports)]))
            while True:
                with self._lock:
                    if self.wrapped.wait(0):
                        break
                    self._shared.posts.forward()
                    for one in served:
                        one.serve(0)
                poll.poll(1000 * min([PATIENCE, *(one.patience for one in served)]))
            self._report = self.wrapped.report
            if self._ports is not None:
                self._ports.finish(self._report.ending)
        except BaseException as error:  # noqa: BLE001 - raised where the caller waits
            self._failure = error
        finally:
            with self._lock:
                try:
                    self._last = self._now()
                    self._left.close()
                except BaseException as error:  # noqa: BLE001 - raised where the caller waits
                    self._failure = self._failure or error
                self._ended.set()
                _running.discard(self)
                if self._changing is not None and not self._changing.done():
                    self._changing.set_result(("the run has ended", ()))
                for tell in self._awaiting:
                    tell()

    def _follow(self, shared: Shared) -> None:
        """Another run goes on with this one."""
        self._shared = shared
        self._slots = {slot.name: slot for slot in slots_of(shared.loop.code)}

    @contextmanager
    def _going_on(self) -> Iterator[None]:
        """Where something is asked of the run. ValueError: it has ended; RuntimeError: see `_own`."""
        self._own()
        with self._lock:
            if self._ended.is_set():
                raise ValueError("the run has ended")
            yield

    def _now(self) -> dict[str, Value]:
        frame = self._shared.segment.newest()
        return {} if frame is None else {name: slot.value(frame) for name, slot in self._slots.items()}

    def values(self) -> dict[str, Value]:
        """The newest frame: states of machines, variables, inputs and verdicts, all of one moment. It waits for the
        first one; none (``{}``) where the run has ended before it.
        """
        self._own()
        while not (found := self._values()) and not self._ended.wait(SHORTLY):
            pass  # it has not begun
        return found or self._values()

    def _values(self) -> dict[str, Value]:
        with self._lock:
            return self._last if self._last is not None else self._now()

    def post(self, **values: Value) -> None:
        """Give values to inputs, all together, from the next cycle on. ValueError: there is no such input or value, or
        the run has ended."""
        with self._going_on():
            self._shared.posts.post({name: _json(value) for name, value in values.items()})

    def command(self, kind: str, target: str, value: Value | None = None) -> None:
        """Let an operator's command come at the beginning of a cycle; see `Whiteboard.command`.

        ValueError: the arrangement's `operators` do not declare it, or the run has ended.
        """
        with self._going_on():
            self._shared.posts.command(kind, target, None if value is None else _json(value), taken=lambda _: None)

    def replace(self, machine: str, path: str | Path, *, unchecked: bool = False) -> Replaced:
        """Let the machine in a file (YAML) take the place of one, after it has been checked; see `Whiteboard.replace`.
        This run goes on with it.

        ValueError: the arrangement's `operators` do not allow it or it is not from files, the machine does not fit, it
        is not proved that nothing goes wrong with it, or the run has ended; OSError: the file cannot be read.
        """
        text = Path(path).read_text(encoding="utf-8")
        return self._change(Replacement(machine, Path(path).name, text), unchecked=unchecked)

    def policy(self, path: str | Path) -> Replaced:
        """Let the policy in a file take the place of the one in force, after it has been checked; see
        `Whiteboard.policy`. This run goes on with it. Errors as for `replace`.
        """
        return self._change(NewPolicy(Path(path).name, Path(path).read_text(encoding="utf-8")))

    def _change(self, change: Change, *, unchecked: bool = False) -> Replaced:
        answered: Future[tuple[int | str, Sequence[str]]] = Future()
        self.values()  # it has begun
        with self._going_on():
            self._launched.ask(change, lambda outcome, notes: answered.set_result((outcome, notes)), unchecked)
            self._changing = answered
        outcome, notes = answered.result()
        if isinstance(outcome, str):
            raise ValueError("; ".join((outcome, *notes)))
        return Replaced(outcome, tuple(notes))

    def stop(self) -> None:
        """Let it end after the cycle under way."""
        self._own()
        with self._lock:
            if not self._ended.is_set():
                self.wrapped.stop()

    def wait(self, seconds: float | None = None) -> RunReport:
        """Wait until it has ended, at most so long; how it went. TimeoutError: it goes on."""
        self._own()
        if not self._ended.wait(seconds):
            raise TimeoutError("the run goes on")
        self._thread.join()
        if self._failure is not None:
            raise self._failure
        assert self._report is not None
        return self._report

    def __await__(self) -> Generator[object, None, RunReport]:
        return self._awaited().__await__()

    async def _awaited(self) -> RunReport:
        """Wait without a thread, which would keep Python from ending."""
        self._own()
        loop = asyncio.get_running_loop()
        ended = asyncio.Event()

        def tell() -> None:
            with suppress(RuntimeError):  # the event loop is closed, and no one waits any more
                loop.call_soon_threadsafe(ended.set)

        with self._lock:
            if self._ended.is_set():
                ended.set()
            else:
                self._awaiting.append(tell)
        await ended.wait()
        return self.wait()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._is_own:
            self.stop()
            self.wait()


_running: set[LiveRun] = set()
"""Runs that have not ended, also those of the process of which this one is a child."""


def _end_all() -> None:
    """Python ends: stop what still runs, and wait until outputs have their safe values."""
    runs = [run for run in list(_running) if run._is_own]
    for run in runs:
        run.stop()
    for run in runs:
        with suppress(Exception):  # of the run, which no one has waited for
            run.wait()


@cache
def _end_with_program() -> None:
    """Call `_end_all` when the main thread ends, before Python waits for other threads, which may wait for the run.

    These functions are called in the reverse order, and that of `concurrent.futures.thread` waits for its threads.
    """
    import concurrent.futures.thread  # noqa: F401

    threading._register_atexit(_end_all)  # type: ignore[attr-defined]


def _json(value: Value) -> Json:
    return value if isinstance(value, bool | int | str) else text(value)


def start(
    given: Arrangement, settings: RunSettings, cycles: int | None, ports: str | Path | Sequence[PortSpec] = ()
) -> LiveRun:
    """`Model.run`, its options checked one by one. ValueError: some do not go together."""
    if (settings.hold is not None or settings.draw) and not settings.simulated:
        raise ValueError("`hold` and `draw` say how `simulate` draws inputs")
    if settings.record is not None and any(line.file is not None for line in settings.properties):
        raise ValueError("a recording keeps the texts of properties, and automata are in files of their own")
    draft = _draft_of(given, settings)
    seed = None
    if settings.simulated:
        seed = random.SystemRandom().randrange(1 << 32) if settings.seed is None else settings.seed
    settings = replace(settings, seed=seed, sources=() if draft is None else draft.sources, digest=given.digest)
    how = settings.plan(given)
    code, rounds, said = how.code(), -1 if cycles is None else cycles, list[str]()
    specs = declared_ports(str(ports), given, code) if isinstance(ports, str | Path) else tuple(ports)
    settings = with_ports(settings, specs)
    twice = sorted(settings.fed & settings.held.keys())
    if twice:
        raise ValueError(f"`{twice[0]}` is held by `inputs`, and a port feeds it")
    if any(spec.paces for spec in specs):
        _refuse_real_time(settings)
        settings, rounds = replace(settings, rate=Fraction(0), pace=Pace(rounds)), 0
    with ExitStack() as left:
        early = left.enter_context(opened_early(specs, how, code, said.append))
        loop = settings.first(how, code, rounds=rounds, free=early.free)
        return LiveRun(Launch(draft, settings, how, loop, specs, early), left.pop_all(), said)


def _refuse_real_time(settings: RunSettings) -> None:
    """ValueError: an option does not go with cycles that a port begins."""
    if settings.rate not in (0, 1) or settings.strict:
        raise ValueError("`rate` and overruns are about real time, and a port begins each cycle")


def _draft_of(given: Arrangement, settings: RunSettings) -> Draft | None:
    """What was read of the arrangement, for a recording or for replacements; None where neither needs it, and for
    replacements where it is not from a file, or not as it stands there now."""
    recorded = settings.record is not None
    if not (recorded or given.replaceable or given.policy_users):
        return None
    draft = read_arrangement(Given(given.path)) if Path(given.path).is_file() else None
    if draft is not None and draft.digest == given.digest:
        return draft
    if recorded:
        raise ValueError("a recording keeps the texts of its arrangement, which must come from files")
    return None

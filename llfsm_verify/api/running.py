"""A run of an arrangement, in real time or as fast as it goes, from its start to its report."""

from __future__ import annotations

import asyncio
import random
import threading
from collections.abc import Callable, Generator, Mapping
from contextlib import ExitStack, closing
from fractions import Fraction
from pathlib import Path
from typing import Literal, Self

from llfsm_verify.api.properties import Properties, property_sources
from llfsm_verify.api.traces import Value
from llfsm_verify.arrangement.formats import Given, read_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.goals.kinds import CHECKED
from llfsm_verify.diagnostics import Source
from llfsm_verify.jsonvalue import Json
from llfsm_verify.kripke.values import text
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.runtime.live.plan import Plan
from llfsm_verify.runtime.live.run import Run, RunReport
from llfsm_verify.runtime.live.supervised import Supervised
from llfsm_verify.runtime.loading.making import Making
from llfsm_verify.runtime.whiteboard.board import WhiteboardError
from llfsm_verify.runtime.whiteboard.owner import Owner, Taken
from llfsm_verify.runtime.whiteboard.permissions import Permissions
from llfsm_verify.runtime.whiteboard.places import NoPlace
from llfsm_verify.runtime.whiteboard.shared import Shared
from llfsm_verify.runtime.whiteboard.slots import slots_of

Processes = Literal["thread", "separate", "together"]
Started = tuple[Run | Supervised, Shared, Owner | None]
PATIENCE = 0.02
"""Seconds between two looks whether it has ended."""


class LiveRun:
    """What `Model.run` gives: an arrangement that runs. It is a context manager, whose end stops it, and awaitable.

    `wrapped` is private.
    """

    def __init__(self, how: Plan, started: Callable[[ExitStack], Started]) -> None:
        self.unmonitored: Mapping[str, str] = how.unmonitored
        """Properties that no finite part of a run decides, and why."""
        self._left = ExitStack()
        try:
            self.wrapped, self._shared, self._owner = started(self._left)
        except BaseException:
            self._left.close()
            raise
        self._slots = {slot.name: slot for slot in slots_of(self._shared.loop.code)}
        self._report: RunReport | None = None
        self._last: dict[str, Value] | None = None
        self._reading = threading.Lock()
        self._failure: BaseException | None = None
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._serve, name="llfsm-serve", daemon=True)
        self.wrapped.start()
        self._thread.start()

    def _serve(self) -> None:
        try:
            while not self.wrapped.wait(0 if self._owner is not None else PATIENCE):
                self._shared.posts.forward()
                if self._owner is not None:
                    self._owner.serve(PATIENCE)
            self._report = self.wrapped.report
        except BaseException as error:  # noqa: BLE001 - raised where somebody waits
            self._failure = error
        finally:
            with self._reading:
                self._last = self._now()
            self._left.close()
            self._ended.set()

    def _now(self) -> dict[str, Value]:
        frame = self._shared.segment.newest()
        return {} if frame is None else {name: slot.value(frame) for name, slot in self._slots.items()}

    def values(self) -> dict[str, Value]:
        """The newest frame: states of machines, variables, inputs and verdicts, all of one moment."""
        with self._reading:
            return self._last if self._last is not None else self._now()

    def post(self, **values: Value) -> None:
        """Give values to inputs, all together, from the next cycle on. ValueError: there is no such input or value."""
        self._shared.posts.post({name: _json(value) for name, value in values.items()})

    def command(self, kind: str, target: str, value: Value | None = None) -> None:
        """Let an operator's command come at the beginning of a cycle; see `Whiteboard.command`.

        ValueError: the arrangement's `operators` do not declare it.
        """
        self._shared.posts.command(kind, target, None if value is None else _json(value), taken=lambda _: None)

    def stop(self) -> None:
        """Let it end after the cycle under way."""
        if not self._ended.is_set():
            self.wrapped.stop()

    def wait(self, seconds: float | None = None) -> RunReport:
        """Wait until it has ended, at most so long; how it went. TimeoutError: it goes on."""
        if not self._ended.wait(seconds):
            raise TimeoutError("the run goes on")
        self._thread.join()
        if self._failure is not None:
            raise self._failure
        assert self._report is not None
        return self._report

    def __await__(self) -> Generator[object, None, RunReport]:
        return asyncio.to_thread(self.wait).__await__()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()
        self.wait()


def _json(value: Value) -> Json:
    return value if isinstance(value, bool | int | str) else text(value)


def start(
    given: Arrangement,
    properties: Properties,
    syntax: str,
    *,
    inputs: Mapping[str, str],
    simulate: bool,
    seed: int | None,
    cycles: int | None,
    cycle_ms: Fraction | None,
    rate: Fraction,
    whiteboard: str | None,
    record: str | Path | None,
    priority: int | None,
    stop_on: tuple[str, ...],
    processes: Processes,
) -> LiveRun:
    """`Model.run`, its options checked."""
    sources = property_sources(properties)
    lines = parse_properties(sources, syntax, CHECKED)
    seed = random.SystemRandom().randrange(1 << 32) if simulate and seed is None else seed
    texts: tuple[Source, ...] = ()
    if record is not None:
        if any(line.file is not None for line in lines):
            raise ValueError("a recording keeps the texts of properties, and automata are in files of their own")
        draft = read_arrangement(Given(given.path)) if Path(given.path).is_file() else None
        if draft is None or draft.digest != given.digest:
            raise ValueError("a recording keeps the texts of its arrangement, which must come from files")
        texts = draft.sources
    making = Making(
        simulated=simulate, cycle_ms=cycle_ms, held=inputs, properties=lines, property_texts=sources, syntax=syntax,
        rate=rate, seed=seed if simulate else None, strict="overrun" in stop_on, heeds="violation" in stop_on,
        record=record, sources=texts, digest=given.digest,
    )  # fmt: skip
    how = making.plan(given)
    loop = making.first(how, how.code(), rounds=-1 if cycles is None else cycles)

    def started(left: ExitStack) -> Started:
        shared = left.enter_context(closing(Shared(whiteboard or "run", loop)))
        owner = None
        if whiteboard is not None:
            try:
                owner = left.enter_context(closing(Owner(whiteboard, shared, Permissions(how.arrangement.access))))
            except (Taken, NoPlace) as problem:
                raise WhiteboardError(str(problem)) from None
        recorder = making.recorder(how.arrangement, loop, ())
        if processes == "thread":
            return Run(loop, recorder, priority=priority), shared, owner
        run = Supervised(loop, shared, recorder, priority=priority, together=processes == "together")
        return left.enter_context(run), shared, owner

    return LiveRun(how, started)

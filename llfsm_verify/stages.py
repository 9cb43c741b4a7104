"""Where the time of a process goes, by stages that are named where the work is done.

Nothing is measured until `record` is called: a stage then costs two readings of the clocks. Stages may lie within each
other, and the time of an inner one does not count for the outer one. One process, one thread.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ContextDecorator, contextmanager, nullcontext
from dataclasses import dataclass, field
from types import TracebackType
from typing import Final, Literal, Self

OTHER: Final = "the rest"
"""What no stage has named."""


@dataclass(slots=True)
class Recording:
    """Seconds of processor time and of wall time by the names of stages, in the order in which these began first."""

    spent: dict[str, tuple[float, float]] = field(default_factory=dict)
    parts: dict[str, tuple[float, float]] = field(default_factory=dict)
    """The same by parts of the work, each of which has all stages."""
    _stack: list[str] = field(default_factory=lambda: [OTHER])
    _since: tuple[float, float] = field(default_factory=lambda: (time.process_time(), time.perf_counter()))

    def now(self) -> None:
        """Count the time since the last reading for the stage that is under way."""
        cpu, wall = time.process_time(), time.perf_counter()
        before = self.spent.get(self._stack[-1], (0.0, 0.0))
        self.spent[self._stack[-1]] = before[0] + cpu - self._since[0], before[1] + wall - self._since[1]
        self._since = cpu, wall

    def begin(self, name: str) -> None:
        """The stage `name` is under way."""
        self.now()
        self._stack.append(name)
        self.spent.setdefault(name, (0.0, 0.0))

    def end(self) -> None:
        """The stage that began last is over."""
        self.now()
        self._stack.pop()

    @contextmanager
    def part(self, name: str) -> Iterator[None]:
        """Count what is done within as a part of the work."""
        cpu, wall = time.process_time(), time.perf_counter()
        try:
            yield
        finally:
            self.parts[name] = time.process_time() - cpu, time.perf_counter() - wall


_recording: Recording | None = None


def record() -> Recording:
    """Measure the stages from now on."""
    global _recording  # noqa: PLW0603 - one for the process
    _recording = Recording()
    return _recording


def part(name: str) -> AbstractContextManager[None]:
    """Within is a part of the work that has all stages, if anything is measured."""
    return nullcontext() if _recording is None else _recording.part(name)


_listener: Callable[[str, bool], None] | None = None


@contextmanager
def following(call: Callable[[str, bool], None]) -> Iterator[None]:
    """Within, `call` is told of each stage that begins (true) or ends (false), and no one else is."""
    global _listener  # noqa: PLW0603 - one for the process
    outer, _listener = _listener, call
    try:
        yield
    finally:
        _listener = outer


class stage(ContextDecorator):  # noqa: N801 - used as a function is
    """A stage of the work: ``with stage("lowering"): …``, or ``@stage("lowering")`` before a whole function."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __enter__(self) -> Self:
        self._recording = _recording
        if self._recording is not None:
            self._recording.begin(self._name)
        if _listener is not None:
            _listener(self._name, True)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> Literal[False]:
        if _listener is not None:
            _listener(self._name, False)
        if self._recording is not None:
            self._recording.end()
        return False

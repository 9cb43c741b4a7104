"""Limits of a piece of work (time, memory, configurations), and the budget in force, which deep code asks by `tick`.

A budget is put in force with ``with budget:`` by whoever begins a piece of work, and everything below asks it by
`tick()`: translations, emptiness checks and evaluations have no parameter for it. It is a context variable, so that
budgets nest, and threads that copy the context of their starter have the same one. Where none is in force, nothing is
limited.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar, Token
from copy import copy
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, Self

DEFAULT_SHARE = 0.8
"""Without --memory a check may use this share of the machine's memory."""
TICKS = 4096
"""Calls of `tick` for each real check."""
DEFAULT_STEPS = 20
"""Ringlets of a simulated run where the user does not say how far it goes."""
MOST_JOBS = 256
"""Threads or processes at once, at most: more than there are processors only wait for each other."""
LOOKS = 64
"""Calls of `tick` for each look at the clock, since some work between two calls takes long."""


class LimitReached(Exception):
    """A limit has been reached; the message says which, in a sentence."""


Counted = Literal["configurations", "steps", "work"]


def reached(most: int, what: Counted) -> str:
    """What is said when there are more than so many; `work`: units of Z3's, on classes of inputs."""
    return f"the limit of {most:,} {'units of work on classes of inputs' if what == 'work' else what} was reached"


@dataclass(frozen=True, slots=True)
class Limits:
    """None: no limit. `memory` is of the whole process, in bytes; `timeout` in seconds."""

    max_states: int | None = None
    memory: int | None = None
    timeout: float | None = None
    whole: float | None = None
    """The limit that users know, of which `timeout` is what is left."""
    max_steps: int | None = None
    """Steps of an exploration, each choice of values counted."""
    max_work: int | None = None
    """Units of Z3's work on the classes of the inputs of one program."""

    def within(self, seconds: float | None) -> Limits:
        """The same with so much of the time (None: as they are)."""
        if seconds is None:
            return self
        return replace(self, timeout=seconds, whole=self.timeout if self.whole is None else self.whole)


class Budget:
    """What a piece of work may use, counted from the creation of the budget."""

    def __init__(self, limits: Limits, pulse: Callable[[], None] | None = None) -> None:
        """`pulse` is called now and then in long work."""
        self._limits = limits
        self._pulse = pulse
        self._started = time.monotonic()
        self._ticks = 0
        self._granted = 0.0
        self._memory = limits.memory if limits.memory is not None else default_memory()
        self._tokens: list[tuple[Token[Callable[[], None]], Token[Budget | None]]] = []

    @property
    def seconds(self) -> float:
        """Since its creation."""
        return time.monotonic() - self._started

    @property
    def max_states(self) -> int | None:
        return self._limits.max_states

    @property
    def max_steps(self) -> int | None:
        return self._limits.max_steps

    @property
    def max_work(self) -> int | None:
        return self._limits.max_work

    @property
    def has_end(self) -> bool:
        """There is a time limit."""
        return self._limits.timeout is not None

    @property
    def left(self) -> float | None:
        """Seconds that are left of the time limit, if there is one."""
        return None if self._limits.timeout is None else max(self._limits.timeout - self.seconds, 0.0)

    def grant(self, seconds: float) -> None:
        """Allow work until so many seconds after the time limit, whenever it is granted."""
        self._granted = seconds

    def check(self, more: int = 0) -> None:
        """Raises LimitReached when the time or the memory is used up, or would be with `more` bytes."""
        self.check_time()
        if memory_in_use() + more > self._memory:
            raise LimitReached(f"the memory limit of {self._memory / 2**20:,.0f} MiB was reached")

    def check_time(self) -> None:
        """Raises LimitReached when the time is used up, with what was granted beyond the limit."""
        limit = self._limits.timeout
        if limit is not None and self.seconds > limit + self._granted:
            whole = limit if self._limits.whole is None else self._limits.whole
            raise LimitReached(f"the time limit of {whole:g} s was reached")

    @property
    def is_late(self) -> bool:
        """The time limit was reached; perhaps more was granted."""
        return self._limits.timeout is not None and self.seconds > self._limits.timeout

    def tick(self) -> None:
        """`check`, cheap enough to be called in inner loops."""
        self._ticks += 1
        if self._ticks % TICKS == 0:
            self.check()
            if self._pulse is not None:
                self._pulse()
        elif self._ticks % LOOKS == 0:
            self.check_time()

    def narrowed(self, max_states: int, max_steps: int) -> Budget:
        """The same budget for a part of the work, which explores no more than this."""
        part = copy(self)
        part._limits = replace(self._limits, max_states=max_states, max_steps=max_steps)
        part._tokens = []
        return part

    def __enter__(self) -> Self:
        """Put it in force: `tick()` asks it."""
        self._tokens.append((_TICK.set(self.tick), _BUDGET.set(self)))
        return self

    def __exit__(self, *_: object) -> None:
        ticks, budget = self._tokens.pop()
        _TICK.reset(ticks)
        _BUDGET.reset(budget)


def _nothing() -> None:
    """What is asked where no budget is in force."""


_TICK: ContextVar[Callable[[], None]] = ContextVar("tick", default=_nothing)
"""What `tick` calls."""
_BUDGET: ContextVar[Budget | None] = ContextVar("budget", default=None)


def budget_in_force() -> Budget | None:
    """That of the innermost `with`; None where no `with` has one, or the work is unlimited."""
    return _BUDGET.get()


def tick() -> None:
    """A small piece of work is done. Raises LimitReached when the budget in force is used up; without one, nothing."""
    _TICK.get()()


def check_time() -> None:
    """LimitReached when the time of the budget in force is used up: before work whose first tick comes late."""
    budget = _BUDGET.get()
    if budget is not None:
        budget.check_time()


@contextmanager
def ticking(call: Callable[[], None]) -> Iterator[None]:
    """Within, `tick` also calls `call`, which may raise to stop the work."""
    outer = _TICK.get()

    def both() -> None:
        call()
        outer()

    token = _TICK.set(both)
    try:
        yield
    finally:
        _TICK.reset(token)


@contextmanager
def unlimited() -> Iterator[None]:
    """Within, no budget is in force: for short work whose result is wanted in any case."""
    tokens = _TICK.set(_nothing), _BUDGET.set(None)
    try:
        yield
    finally:
        _TICK.reset(tokens[0])
        _BUDGET.reset(tokens[1])


def endless_budget() -> Budget:
    """For work that may take whatever it needs."""
    return Budget(Limits(memory=sys.maxsize))


def parse_size(text: str) -> int:
    """Bytes: a number with its unit, K, M, G or T (powers of 1024), or B for bytes themselves. ValueError."""
    units = {"K": 1 << 10, "M": 1 << 20, "G": 1 << 30, "T": 1 << 40}
    number = text.upper().removesuffix("IB").removesuffix("B")
    unit = number[-1:] if number[-1:] in units else ""
    try:
        value = float(number.removesuffix(unit))
    except ValueError:
        value = 0.0
    if not 0 < value < 1e15:
        raise ValueError(f"{text[:40]!r} is not a size such as 500M or 2G")
    if not unit and not text.upper().endswith("B"):
        written = text.strip()[:40]
        wanted = f"write {written}M (MiB), {written}G (GiB) or {written}B (bytes)"
        raise ValueError(f"{text[:40]!r} has no unit: {wanted}")
    return int(value * units.get(unit, 1))


def default_memory() -> int:
    """Bytes that a check may use unless its limits say otherwise."""
    return int(DEFAULT_SHARE * _physical_memory())


def processors(groups: Path = Path("/sys/fs/cgroup"), own: Path = Path("/proc/self/cgroup")) -> int:
    """Those that this process may use, MOST_JOBS at most: by its affinity, and on Linux by the quotas of its control
    groups (cgroup v2), rounded up."""
    found = len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1
    found = min(found, MOST_JOBS)
    try:
        name = next(line[3:] for line in own.read_text("utf-8").splitlines() if line.startswith("0::"))
    except (OSError, StopIteration):
        return found
    group = groups / name.lstrip("/")
    for each in (group, *group.parents[: len(group.parts) - len(groups.parts)]):
        with suppress(OSError, ValueError):  # there is no such file, or "max": no limit
            quota, period = map(int, (each / "cpu.max").read_text("ascii").split())
            found = min(found, max(-(-quota // period), 1))
    return found


def memory_in_use() -> int:
    """Resident memory of this process in bytes (its peak where the system tells no more)."""
    try:
        with open("/proc/self/statm", "rb") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:
        import resource

        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        return peak if sys.platform == "darwin" else peak * 1024


def _physical_memory() -> int:
    """The machine's memory in bytes, or the container's where it has less."""
    physical = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    try:
        with open("/sys/fs/cgroup/memory.max", encoding="ascii") as file:
            return min(physical, int(file.read()))
    except (OSError, ValueError):
        return physical

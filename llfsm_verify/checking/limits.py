"""Limits of a check: time, memory and configurations, asked for often and cheaply."""

from __future__ import annotations

import os
import time
from collections.abc import Callable

from llfsm_verify.checking.verdict import Limits
from llfsm_verify.kripke.explore import LimitReached

DEFAULT_SHARE = 0.8
"""Without --memory a check may use this share of the machine's memory."""


TICKS = 4096
"""Calls of `tick` for each real check."""
LOOKS = 64
"""Calls of `tick` for each look at the clock, since some work between two calls takes long."""


class Budget:
    """The limits of one check, counted from its creation."""

    def __init__(self, limits: Limits, pulse: Callable[[], None] | None = None) -> None:
        """`pulse` is called now and then in long work."""
        self._limits = limits
        self._pulse = pulse
        self._started = time.monotonic()
        self._ticks = 0
        self._granted = 0.0
        self._memory = limits.memory if limits.memory is not None else default_memory()

    @property
    def seconds(self) -> float:
        return time.monotonic() - self._started

    @property
    def max_states(self) -> int | None:
        return self._limits.max_states

    @property
    def max_steps(self) -> int | None:
        return self._limits.max_steps

    @property
    def left(self) -> float | None:
        """Seconds that are left of the time limit, if there is one."""
        return None if self._limits.timeout is None else max(self._limits.timeout - self.seconds, 0.0)

    def grant(self, seconds: float) -> None:
        """Allow `seconds` from now, even beyond the time limit."""
        self._granted = time.monotonic() + seconds

    def check(self, more: int = 0) -> None:
        """Raises LimitReached when the time or the memory is used up, or would be with `more` bytes."""
        if self._is_late and time.monotonic() > self._granted:
            whole = self._limits.timeout if self._limits.whole is None else self._limits.whole
            raise LimitReached(f"the time limit of {whole:g} s was reached")
        if memory_in_use() + more > self._memory:
            raise LimitReached(f"the memory limit of {self._memory / 2**20:,.0f} MiB was reached")

    @property
    def _is_late(self) -> bool:
        return self._limits.timeout is not None and self.seconds > self._limits.timeout

    def tick(self) -> None:
        """`check`, cheap enough to be called in inner loops."""
        self._ticks += 1
        if self._ticks % TICKS == 0:
            self.check()
            if self._pulse is not None:
                self._pulse()
        elif self._ticks % LOOKS == 0 and self._is_late:
            self.check()


def default_memory() -> int:
    """Bytes that a check may use unless its limits say otherwise."""
    return int(DEFAULT_SHARE * _physical_memory())


def memory_in_use() -> int:
    """Resident memory of this process in bytes (its peak where the system tells no more)."""
    try:
        with open("/proc/self/statm", "rb") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:
        import resource
        import sys

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

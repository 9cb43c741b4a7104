"""Verdicts on standard error as they fall, in a check that takes a while: the report comes when all are there."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Iterable
from types import TracebackType
from typing import Self

from llfsm_verify.checking.verdict import FAULTS, EarlyVerdict, Verdict
from llfsm_verify.interrupts import deferring

PATIENCE = 3.0
"""Seconds of processor time before the first verdict is said: a short check only reports. Not seconds of the clock, so
that the same check says the same on a busy machine."""
LOOK = 0.25
"""Seconds between two looks at them."""


class EarlyVerdicts:
    """Says each verdict once: what is known when the patience ends at that moment, the rest when it falls."""

    def __init__(self, names: Iterable[str], title: str = "") -> None:
        """`names`: of the properties; `title`: what is checked, where that is one of several."""
        self._open = {*names, FAULTS}
        self._title = title and f"{title}: "
        self._waiting: list[str] = []
        self._late = PATIENCE <= 0
        self._sound = False
        """No run ends in a fault."""
        self._ended = threading.Event()
        self._lock = threading.Lock()
        self._began, self._used = time.monotonic(), _processor_time()
        self._clock = threading.Thread(target=self._watch, daemon=True)

    @deferring
    def __enter__(self) -> Self:
        self._clock.start()
        return self

    @deferring
    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended.set()
        self._clock.join()

    @deferring
    def add(self, known: EarlyVerdict) -> None:
        """A verdict has fallen."""
        with self._lock:
            if known.name not in self._open:
                return
            self._open.remove(known.name)
            left = f"{len(self._open)} more to decide" if self._open else "all are decided"
            after = f"{self._title}after {time.monotonic() - self._began:.0f} s"
            faultless = known.verdict is Verdict.HOLDS and known.name != FAULTS and not self._sound
            word = "holds on fault-free runs" if faultless else known.verdict.value
            self._waiting.append(f"{after}: {word:<8}  {known.name} (by {known.engine}; {left})")
            self._sound = self._sound or (known.name == FAULTS and known.verdict is Verdict.HOLDS)
            if self._late:
                self._say()

    def _watch(self) -> None:
        signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())
        while not self._ended.wait(LOOK):
            if _processor_time() - self._used >= PATIENCE:
                with self._lock:
                    self._late = True
                    self._say()
                return

    def _say(self) -> None:
        waiting, self._waiting = self._waiting, []
        for line in waiting:
            print(line, file=sys.stderr, flush=True)


def _processor_time() -> float:
    """Seconds of this process and of those of its children that have ended."""
    return sum(os.times()[:4])

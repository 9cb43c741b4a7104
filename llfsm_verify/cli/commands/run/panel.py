"""The panel of `llfsm run --panel`: the run as it goes, in a terminal."""

from __future__ import annotations

import select
import shutil
import sys
import time
from collections.abc import Mapping
from typing import TextIO, cast

from llfsm_verify.cli.io.standard_error import Unhurried
from llfsm_verify.report.panel import Snapshot, panel
from llfsm_verify.runtime.launch import Launch
from llfsm_verify.runtime.live.frame import CYCLE, ENDING, ENDINGS, NUMBER, STEPS
from llfsm_verify.runtime.live.run import lateness
from llfsm_verify.runtime.live.slots import STATE, VERDICT, slots_of
from llfsm_verify.runtime.whiteboard.shared import Shared
from llfsm_verify.values import Shown

INTERVAL = 0.1
"""Seconds between two pictures."""


class Pictures:
    """Shows the newest frame ten times a second, beside the loop, which knows nothing of it."""

    patience = INTERVAL

    def __init__(self, shared: Shared, ready: Launch) -> None:
        from rich.console import Console
        from rich.live import Live

        self._shared, self._name, self._cycle = shared, ready.plan.arrangement.name, ready.plan.cycle
        self._slots = slots_of(shared.loop.code)
        self._nothing = select.epoll()
        self._drawn = 0.0
        self._before: Mapping[str, Shown] = {}
        self._rate = (0.0, 0, 0.0)
        """When ringlets were counted last, how many there were, and how many in a second before."""
        self._terminal = Unhurried(sys.stdout)
        self._live = Live(console=Console(file=cast(TextIO, self._terminal)), auto_refresh=False)
        self._live.start()

    def follow(self, shared: Shared) -> None:
        """Show another run from now on."""
        self._shared, self._slots = shared, slots_of(shared.loop.code)

    def fileno(self) -> int:
        """Never readable: no one asks for a picture."""
        return self._nothing.fileno()

    def serve(self, seconds: float) -> None:  # noqa: ARG002 - there is nothing to wait for
        """Draw, if it is time to."""
        if time.monotonic() - self._drawn >= INTERVAL:
            self._terminal.flush()
            if not self._terminal.waits:  # else no one can see it now
                self.draw()

    def draw(self) -> None:
        """Draw the newest frame."""
        frame = self._shared.segment.newest()
        if frame is None:
            return
        self._drawn = now = time.monotonic()
        since, counted, rate = self._rate
        if now - since >= 1.0:
            rate = (frame[STEPS] - counted) / (now - since) if since else 0.0
            self._rate = (now, frame[STEPS], rate)
        values = {slot.name: slot.value(frame) for slot in self._slots}
        of = {kind: {s.name: values[s.name] for s in self._slots if s.kind == kind} for kind in (STATE, VERDICT)}
        others = {s.name: values[s.name] for s in self._slots if s.kind not in of}
        verdicts = {name.removeprefix("verdict(").removesuffix(")"): value for name, value in of[VERDICT].items()}
        moment = Snapshot(
            self._name, frame[NUMBER], ENDINGS[frame[ENDING]], float(frame[CYCLE] * self._cycle / 1000), frame[STEPS],
            rate, of[STATE], others, verdicts, lateness(self._shared.loop),
        )  # fmt: skip
        self._live.update(panel(moment, self._before, shutil.get_terminal_size().lines), refresh=True)
        self._before = values

    def close(self) -> None:
        """The last picture stays."""
        self.draw()
        self._live.stop()
        self._terminal.close()
        self._nothing.close()

"""The panel of `llfsm run --panel`, the run as it goes: states of machines, values of slots, how late cycles begin."""

from __future__ import annotations

import select
import shutil
import sys
import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, TextIO, cast

from llfsm_verify.plug import (
    ENDING_WORDS,
    FRAME_CYCLE,
    FRAME_ENDING,
    FRAME_ENDINGS,
    FRAME_NUMBER,
    FRAME_STEPS,
    STATE_SLOT,
    VERDICT_SLOT,
    Lateness,
    Launch,
    SharedFrames,
    Shown,
    Unhurried,
    duration_text,
    lateness,
    slots_of,
    text,
)  # fmt: skip

if TYPE_CHECKING:
    from rich.console import RenderableType

INTERVAL = 0.1
"""Seconds between two pictures."""
FEWEST = 3
"""Lines of a table, at least."""
AROUND = 7
"""Lines of a panel beside those at its top and those of a table."""
MOST_VIOLATED = 8
"""Names of violated properties."""


@dataclass(frozen=True, slots=True)
class Snapshot:
    """What a panel shows."""

    name: str
    number: int
    """Of the frame."""
    ending: str
    logical: float
    """Seconds of logical time."""
    ringlets: int
    rate: float
    """Ringlets in a second, as last measured."""
    states: Mapping[str, Shown]
    """Of each machine."""
    values: Mapping[str, Shown]
    """Of all other slots."""
    verdicts: Mapping[str, Shown]
    """Of monitors."""
    lateness: Lateness | None


def panel(now: Snapshot, before: Mapping[str, Shown], height: int) -> RenderableType:
    """The panel, of at most so many lines where that is possible; what is not as it was `before` stands out."""
    from rich.console import Group
    from rich.panel import Panel
    from rich.table import Table
    from rich.text import Text

    state = "runs" if now.ending == "running" else ENDING_WORDS.get(now.ending, now.ending)
    lines = [
        Text(f"frame {now.number:,}   {now.logical:.3f} s of logical time   {now.ringlets:,} ringlets"),
        Text(f"{now.rate:,.0f} ringlets a second"),
    ]
    late = now.lateness
    if late is not None and late.turns:
        told = ", ".join(f"{percent:g} % within {duration_text(value)}" for percent, value in late.percentiles)
        style = "bold red" if late.overruns else ""
        lines.append(
            Text(f"lateness: {told}, worst {duration_text(late.worst)}, overruns {late.overruns:,}", style=style)
        )
    violated = [name for name, verdict in now.verdicts.items() if verdict == "violated"]
    if now.verdicts:
        counts = Counter(str(verdict) for verdict in now.verdicts.values())
        lines.append(Text("properties: " + ", ".join(f"{number:,} {verdict}" for verdict, number in counts.items())))
    lines += [Text(f"violated: {name}", style="bold red") for name in violated[:MOST_VIOLATED]]
    room = max(FEWEST, height - AROUND - len(lines))
    tables = Table.grid(padding=(0, 4))
    tables.add_row(*(_table(*one, before, room) for one in (("machine", now.states), ("slot", now.values)) if one[1]))
    return Panel(Group(*lines, Text(), tables), title=f"{now.name}: {state}", title_align="left", expand=False)


def _table(title: str, values: Mapping[str, Shown], before: Mapping[str, Shown], room: int) -> RenderableType:
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, pad_edge=False, show_edge=False)
    table.add_column(title, style="dim")
    table.add_column("state" if title == "machine" else "value", min_width=8)
    for name in list(values)[:room]:
        changed = name in before and before[name] != values[name]
        table.add_row(Text(name), Text(text(values[name]), style="bold reverse" if changed else ""))
    left = len(values) - room
    if left > 0:
        table.add_row(Text(f"… {left:,} more"), Text())
    return table


class Pictures:
    """Shows the newest frame ten times a second, beside the loop, which knows nothing of it."""

    patience = INTERVAL

    def __init__(self, shared: SharedFrames, ready: Launch) -> None:
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

    def follow(self, shared: SharedFrames) -> None:
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
            rate = (frame[FRAME_STEPS] - counted) / (now - since) if since else 0.0
            self._rate = (now, frame[FRAME_STEPS], rate)
        values = {slot.name: slot.value(frame) for slot in self._slots}
        of = {
            kind: {s.name: values[s.name] for s in self._slots if s.kind == kind} for kind in (STATE_SLOT, VERDICT_SLOT)
        }
        others = {s.name: values[s.name] for s in self._slots if s.kind not in of}
        verdicts = {name.removeprefix("verdict(").removesuffix(")"): value for name, value in of[VERDICT_SLOT].items()}
        logical = float(frame[FRAME_CYCLE] * self._cycle / 1000)
        moment = Snapshot(
            self._name, frame[FRAME_NUMBER], FRAME_ENDINGS[frame[FRAME_ENDING]], logical, frame[FRAME_STEPS],
            rate, of[STATE_SLOT], others, verdicts, lateness(self._shared.loop),
        )  # fmt: skip
        self._live.update(panel(moment, self._before, shutil.get_terminal_size().lines), refresh=True)
        self._before = values

    def close(self) -> None:
        """The last picture stays."""
        self.draw()
        self._live.stop()
        self._terminal.close()
        self._nothing.close()

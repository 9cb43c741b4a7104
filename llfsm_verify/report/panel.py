"""A run at one moment, as a panel for a terminal: states of machines, values of slots, how late its cycles begin."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from llfsm_verify.report.running import ENDINGS, duration
from llfsm_verify.runtime.live.run import Lateness
from llfsm_verify.values import Shown, text

if TYPE_CHECKING:
    from rich.console import RenderableType

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

    state = "runs" if now.ending == "running" else ENDINGS.get(now.ending, now.ending)
    lines = [
        Text(f"frame {now.number:,}   {now.logical:.3f} s of logical time   {now.ringlets:,} ringlets"),
        Text(f"{now.rate:,.0f} ringlets a second"),
    ]
    late = now.lateness
    if late is not None and late.turns:
        told = ", ".join(f"{percent:g} % within {duration(value)}" for percent, value in late.percentiles)
        style = "bold red" if late.overruns else ""
        lines.append(Text(f"lateness: {told}, worst {duration(late.worst)}, overruns {late.overruns:,}", style=style))
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

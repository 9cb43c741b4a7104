"""What goes from the plan of a sweep to those who check, and comes back: a task and its outcome, as texts and numbers.

Both can be pickled. A task has all texts that its check reads, so that who performs it needs no shared disk.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Literal, Protocol

from llfsm_verify.plug import Json, RowState

ValueKind = Literal["constant", "parameter", "initial"]
State = RowState


@dataclass(frozen=True, slots=True)
class Task:
    """One check."""

    key: str
    """SHA-256 (hex) of everything that decides the outcome."""
    files: tuple[tuple[str, str], ...]
    """The texts of all files that are read, by their paths below one folder (no `..` in them, `/` between names)."""
    arrangement: str
    """The path of the arrangement among them."""
    properties: tuple[str, ...]
    """The paths of the property files among them."""
    values: tuple[tuple[ValueKind, str, Json], ...]
    """Kind, name and value: see `values.with_values`."""
    options: tuple[tuple[str, Json], ...]
    """Keywords of `Model.check`, `engine` and `syntax` among them, without `timeout` and `memory`."""
    timeout: float | None
    """Seconds."""
    memory: int | None
    """Bytes."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of a task."""

    state: State
    """`timeout`, `memory`: one of the limits of the task was reached, and `result` says what was decided before, if
    anything was. `failed`: `message` says what is wrong with its texts. `killed`: its process died."""
    result: Json | None
    """The check as `llfsm verify --format json` writes it."""
    message: str = ""
    seconds: float = 0.0
    memory: int = 0
    """The most bytes that its process had while it ran."""
    traces: tuple[tuple[str, str], ...] = ()
    """The texts of trace files by their names (without `.trace.yaml`)."""


class Scheduler(Protocol):
    """Who lets tasks be performed."""

    def run(self, tasks: Iterable[Task], ended: Callable[[Task, Outcome], None]) -> None:
        """Perform all tasks, and tell `ended` of each as it ends, in this thread. KeyboardInterrupt passes."""

    def close(self) -> None:
        """Give back what it holds; after this it runs nothing."""

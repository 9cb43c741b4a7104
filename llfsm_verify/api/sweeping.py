"""Sweeps from Python: a row for each combination, and the registry that names who makes them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Literal, Protocol

from llfsm_verify.jsonvalue import Json
from llfsm_verify.registry import Registry

if TYPE_CHECKING:
    import pandas as pd

RowState = Literal["done", "timeout", "memory", "failed", "killed"]


@dataclass(frozen=True, slots=True)
class SweepRow:
    """What came of one combination of a sweep."""

    key: str
    """SHA-256 (hex) of everything that decides it."""
    values: Mapping[str, Json]
    """By the names of columns, ``arrangement`` among them."""
    state: RowState
    """``done``; or what ended it: ``timeout`` and ``memory`` are its limits, ``failed`` says that its files are wrong,
    ``killed`` that its process ended."""
    exit_code: int
    """As of `llfsm verify`."""
    verdicts: Mapping[str, str] = field(default_factory=dict)
    """``holds``, ``violated`` or ``unknown`` by property, and of ``faults``."""
    reasons: Mapping[str, str] = field(default_factory=dict)
    """Why what is unknown is, by property."""
    faults: tuple[str, ...] = ()
    """The codes of faults that a run can end in."""
    states: int = 0
    """Configurations found."""
    traces: Mapping[str, str] = field(default_factory=dict)
    """The files of traces by property, as seen from the file of results; none without such a file."""
    message: str = ""
    """What is wrong, where it failed or was killed."""
    seconds: float = 0.0
    memory: int = 0
    """The most bytes that its process had; 0: not known."""

    @property
    def verdict(self) -> str:
        """In a word: ``holds``, ``violated``, ``unknown``, ``fails`` (a pass that a strict check refuses), or state."""
        if self.exit_code == 1:
            return "violated" if "violated" in self.verdicts.values() else "fails"
        return self.state if self.state != "done" else "unknown" if self.exit_code else "holds"


class SweepRows(Protocol):
    """The rows of a sweep, in the order of its combinations. ``print(rows)`` shows the table."""

    @property
    def rows(self) -> tuple[SweepRow, ...]:
        """All that are known: some are missing where Ctrl-C ended the sweep."""

    @property
    def exit_code(self) -> int:
        """The most important one of all rows; 130 where Ctrl-C ended the sweep."""

    def __len__(self) -> int: ...
    def __iter__(self) -> Iterator[SweepRow]: ...
    def __getitem__(self, index: int, /) -> SweepRow: ...
    def csv(self) -> str:
        """A line a row, after one with the names of columns."""

    def to_json(self) -> str:
        """What `llfsm sweep --format json` prints."""

    def frame(self) -> pd.DataFrame:
        """A data frame. ModuleNotFoundError: pandas is not installed."""


SWEEPS: Registry[Callable[..., SweepRows]] = Registry("way to sweep", (), "llfsm_verify.sweeps")


def sweep(
    given: str | Path | Mapping[str, object],
    *,
    jobs: int | None = None,
    scheduler: str | None = None,
    results: str | Path | None = None,
    timeout: float | None = None,
    memory: int | str | None = None,
) -> SweepRows:
    """Check every combination that a sweep file, or a mapping of its shape, describes: a row each.

    `jobs` processes (None: as many as processors) check, or the workers of a `scheduler` (``"tcp://HOST:PORT"``). Rows
    in the file of `results` are not checked again; new ones are added, with traces beside it. `timeout` and `memory`
    are of each check, in place of the file's. Raises `DiagnosticError` for a wrong sweep before anything starts, and
    where the scheduler is lost (known rows are in `results` then), ValueError where there is no such scheduler.
    """
    return SWEEPS.load("sweep")(given, jobs=jobs, scheduler=scheduler, results=results, timeout=timeout, memory=memory)

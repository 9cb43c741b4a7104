"""Sweeps from Python: what there is to ask of their rows, and the registry that names who makes them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from llfsm_verify.jsonvalue import Json
from llfsm_verify.registry import Registry

if TYPE_CHECKING:
    import pandas as pd


class SweepRow(Protocol):
    """What came of one combination of a sweep."""

    @property
    def values(self) -> Mapping[str, Json]:
        """Its values by name, `arrangement` among them."""

    @property
    def verdict(self) -> str:
        """``holds``, ``violated``, ``unknown``; or what ended it: ``timeout``, ``memory``, ``failed``, ``killed``."""

    @property
    def verdicts(self) -> Mapping[str, str]:
        """The verdict of each property, and of ``faults``."""

    @property
    def reasons(self) -> Mapping[str, str]:
        """Why what is unknown is, by property."""

    @property
    def traces(self) -> Mapping[str, str]:
        """The files of traces by property, relative to the file of results; none where there is no such file."""

    @property
    def message(self) -> str:
        """What is wrong, where the check failed."""

    @property
    def exit_code(self) -> int:
        """As of `llfsm verify`."""

    @property
    def states(self) -> int:
        """Configurations found."""

    @property
    def seconds(self) -> float:
        """How long the check took."""

    @property
    def memory(self) -> int:
        """The most bytes that its process had."""


class SweepRows(Protocol):
    """The rows of a sweep, in the order of its combinations. ``print(rows)`` shows the table."""

    @property
    def rows(self) -> tuple[SweepRow, ...]:
        """All that are known."""

    @property
    def numbers(self) -> tuple[int, ...]:
        """Which combinations they are of, from 1; some are missing where Ctrl-C ended the sweep."""

    @property
    def exit_code(self) -> int:
        """The most important one of all rows; 130 where Ctrl-C ended the sweep."""

    def __len__(self) -> int: ...
    def __iter__(self) -> Iterator[SweepRow]: ...
    def __getitem__(self, index: int, /) -> SweepRow: ...
    def text(self, width: int = 120) -> str:
        """The table for people."""

    def csv(self) -> str:
        """A line a row."""

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

    `jobs` processes (None: as many as processors) perform the checks, or the workers of a `scheduler`
    (``"tcp://HOST:PORT"``). Rows that the file of `results` has are not checked again, and new ones are added to it,
    with traces beside it. `timeout` and `memory` are of each check, in place of those of the file.

    Raises `DiagnosticError` for a wrong sweep before anything starts, and where the scheduler is lost; what was known
    then is in `results`. Unregistered (ValueError): there is no such scheduler.
    """
    return SWEEPS.load("sweep")(given, jobs=jobs, scheduler=scheduler, results=results, timeout=timeout, memory=memory)

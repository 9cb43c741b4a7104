"""A sweep from its file to its rows: planned, performed by a scheduler, kept as it goes on."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, overload

from llfsm_verify import Diagnostic, DiagnosticError, LimitOptions
from llfsm_verify import SweepRow as Row
from llfsm_verify.extensions.sweep.plan import Combination, Plan, plan
from llfsm_verify.extensions.sweep.reading import read_sweep
from llfsm_verify.extensions.sweep.rows import ResultsFile, row_of
from llfsm_verify.extensions.sweep.scheduling import is_elsewhere, opened
from llfsm_verify.extensions.sweep.table import csv_table, json_table, properties_of, summary, text_table
from llfsm_verify.extensions.sweep.task import Outcome, Task
from llfsm_verify.plug import checked_options, parse_size

if TYPE_CHECKING:
    from pandas import DataFrame

ORDER = (70, 130, 5, 3, 1, 4, 0)
"""Exit codes, the most important one first."""
INTERRUPTED, BAD_INPUT = 130, 3


class Rows(Sequence[Row]):
    """The rows of a sweep in the order of its combinations; some may be missing where it was interrupted."""

    def __init__(self, found: Mapping[int, Row], plan: Plan, stopped: BaseException | None = None) -> None:
        self.numbers = tuple(sorted(found))
        """Which combinations the rows are of, from 1."""
        self.rows = tuple(found[number] for number in self.numbers)
        self.combinations = len(plan.combinations)
        self.warnings = plan.warnings
        self.stopped = stopped
        """What ended the sweep before its end: KeyboardInterrupt, SystemExit of a signal, or that its scheduler could
        not go on."""

    @overload
    def __getitem__(self, index: int) -> Row: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Row]: ...
    def __getitem__(self, index: int | slice) -> Row | Sequence[Row]:
        return self.rows[index]

    def __len__(self) -> int:
        return len(self.rows)

    def __repr__(self) -> str:
        return f"<Rows {summary(self.rows, self.combinations)}>"

    def __str__(self) -> str:
        """The table for people."""
        return self.text()

    @property
    def exit_code(self) -> int:
        """The most important one of all rows; 130 where it was interrupted, that of a signal that ended it, 3 where
        its scheduler was lost."""
        if isinstance(self.stopped, SystemExit):
            return int(self.stopped.code or 0)
        ended = {KeyboardInterrupt: INTERRUPTED, DiagnosticError: BAD_INPUT}.get(type(self.stopped), 0)
        codes = {ended, *(row.exit_code for row in self.rows)}
        return next((code for code in ORDER if code in codes), max(codes))

    def text(self, width: int = 120) -> str:
        """The table for people: what differs in columns, the rest above, reasons and the count of verdicts below."""
        table = text_table(self.rows, self.numbers, width) + "\n" if self.rows else ""
        return f"{table}{summary(self.rows, self.combinations)}\n"

    def csv(self) -> str:
        """A line a row, after one with the names of columns."""
        return csv_table(self.rows, self.numbers)

    def to_json(self) -> str:
        """One object, as `llfsm sweep --format json` prints it."""
        return json_table(self.rows, self.numbers, self.combinations, self.exit_code)

    def frame(self) -> DataFrame:
        """A data frame of pandas: a column for each value and for each property. ModuleNotFoundError: pandas is not
        installed."""
        try:
            from pandas import DataFrame
        except ModuleNotFoundError as error:
            if error.name != "pandas":
                raise
            message = "frame needs pandas, which is not installed: pip install 'llfsm-verify[pandas]'"
            raise ModuleNotFoundError(message, name="pandas") from None
        asked = properties_of(self.rows)
        return DataFrame(
            {
                **row.values, "state": row.state, "verdict": row.verdict,
                **{name: row.verdicts.get(name) for name in asked}, "states": row.states, "seconds": row.seconds,
                "memory": row.memory, "message": row.message,
            }
            for row in self.rows
        )  # fmt: skip


def rows_of(
    given: str | Path | Mapping[str, object],
    *,
    jobs: int | None,
    scheduler: str | None,
    results: str | Path | None,
    timeout: float | None,
    memory: int | str | None,
) -> Rows:
    """What `llfsm_verify.sweep` gives, and raises."""
    if jobs is not None and (isinstance(jobs, bool) or not isinstance(jobs, int) or jobs < 1):
        raise ValueError(f"`jobs` is a whole number from 1, not {jobs!r}")
    if not isinstance(scheduler, str | None):
        raise ValueError(f"`scheduler` is an address such as 'tcp://localhost:8786', not {scheduler!r}")
    if jobs is not None and is_elsewhere(scheduler):
        raise ValueError(
            "`jobs` is for processes of this machine, and a scheduler has its own workers: leave out `jobs`"
        )
    if not isinstance(given, str | Path | Mapping):
        raise TypeError(f"a sweep is the path of a file or a mapping of its shape, not {given!r:.80}")
    limits = {"timeout": timeout, "memory": memory}
    checked_options("sweep", limits, LimitOptions)
    size = parse_size(memory) if isinstance(memory, str) else memory
    rows = sweep(given, jobs=jobs, scheduler=scheduler, results=results, timeout=timeout, memory=size)
    if isinstance(rows.stopped, DiagnosticError | SystemExit):
        raise rows.stopped
    return rows


def sweep(
    given: str | Path | Mapping[str, object],
    *,
    jobs: int | None = None,
    scheduler: str | None = None,
    results: str | Path | None = None,
    timeout: float | None = None,
    memory: int | None = None,
    began: Callable[[Plan, int, Iterable[Diagnostic]], None] | None = None,
    ended: Callable[[Row], None] | None = None,
) -> Rows:
    """All rows of a sweep: see `llfsm_verify.sweep`. `stopped` of them says what ended it early, if anything did.

    `began` is told the plan, how many rows are known from `results`, and warnings; `ended` each row as it is there.
    """
    read = read_sweep(given)
    read = replace(read, timeout=read.timeout if timeout is None else timeout, memory=memory or read.memory)
    planned = plan(read)
    kept = None if results is None else ResultsFile(Path(results), planned)
    by_key = {each.task.key: each for each in planned.combinations}
    found: dict[int, Row] = {}
    for key, row in ({} if kept is None else kept.known).items():
        found[by_key[key].number] = replace(row, values=by_key[key].values)
    if began is not None:
        began(planned, len(found), (*planned.warnings, *(() if kept is None else kept.warnings)))

    def take(task: Task, outcome: Outcome) -> None:
        combination = by_key[task.key]
        row = row_of(combination, outcome, {}) if kept is None else kept.save(combination, outcome)
        found[combination.number] = row
        if ended is not None:
            ended(row)

    left = [each for each in planned.combinations if each.number not in found]
    try:
        rows = Rows(found, planned, _perform(left, take, scheduler, jobs))
        if kept is not None:
            kept.write(rows.rows)
    finally:
        if kept is not None:
            kept.close()
    return rows


def _perform(
    left: Sequence[Combination], take: Callable[[Task, Outcome], None], scheduler: str | None, jobs: int | None
) -> BaseException | None:
    """Let tasks be performed; what ended that early. Raises what `opened` raises."""
    if not left:
        return None
    performing = opened(scheduler, jobs)
    try:
        performing.run((each.task for each in left), take)
    except (KeyboardInterrupt, SystemExit, DiagnosticError) as stopped:
        return stopped
    finally:
        performing.close()
    return None

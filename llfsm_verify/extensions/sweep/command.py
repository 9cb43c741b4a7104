"""`llfsm sweep`: every combination of a file checked, a row each."""

from __future__ import annotations

import time
from argparse import Namespace
from collections.abc import Iterable
from pathlib import Path
from shlex import quote

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify import SweepRow as Row
from llfsm_verify.extensions.sweep.plan import Plan
from llfsm_verify.extensions.sweep.scheduling import is_elsewhere
from llfsm_verify.extensions.sweep.sweeping import Rows, sweep
from llfsm_verify.plug import (
    CommandParser,
    Output,
    StatusLine,
    Unregistered,
    UsageError,
    ending_raises,
    limit_arguments,
    positive_number,
    tell,
    without_controls,
    wrong_usage,
)

FORMATS = ("text", "json", "csv")
RESULTS = ".results.jsonl"


def arguments(parser: CommandParser) -> None:
    """Add the arguments of `llfsm sweep`."""
    parser.about(
        "Check every combination of arrangements, values and property files that a file describes: a row each.",
        "llfsm sweep SWEEP.yaml --jobs 4\nllfsm sweep SWEEP.yaml --scheduler tcp://localhost:8786 --format csv",
        "exit codes: 0 everything holds, 1 violated or a fault, 2 wrong usage, 3 files wrong, 4 unknown, "
        "130 interrupted; of several rows the most important one: 3, 1, 4, 0",
    )
    add = parser.add_argument
    add("sweep", metavar="SWEEP", help="the file that says what is combined (`llfsm schema sweep`)")
    add("--jobs", metavar="N", type=positive_number, help="so many processes (default: as many as processors)")
    add("--scheduler", metavar="URL", help="let the workers of a scheduler check, such as tcp://HOST:8786 of Dask")
    add("--results", metavar="FILE", help="keep rows there, and go on from those that are there; traces are beside it "
        f"(default: SWEEP{RESULTS}, beside the file)")  # fmt: skip
    add("--format", choices=FORMATS, default=FORMATS[0], help="how to report (default: %(default)s)")
    limit_arguments(parser, "end a check")


def run(options: Namespace) -> int:
    """Sweep and report; the exit code, 3 also where the scheduler was lost. DiagnosticError: wrong files."""
    given = Path(options.sweep)
    results = Path(options.results) if options.results else given.parent / f"{given.stem}{RESULTS}"
    if options.jobs and is_elsewhere(options.scheduler):
        raise UsageError(
            "--jobs is for processes of this machine, and a scheduler has its own workers: leave out --jobs"
        )
    with ending_raises(), StatusLine() as line, wrong_usage(Unregistered, "--scheduler: "):
        watched = _Watched(line, results)
        rows = sweep(
            options.sweep, jobs=options.jobs, scheduler=options.scheduler, results=results, timeout=options.timeout,
            memory=options.memory, began=watched.began, ended=watched.ended,
        )  # fmt: skip
    output = Output()
    output.plain({"text": lambda: rows.text(output.width), "json": rows.to_json, "csv": rows.csv}[options.format]())
    _say_where(rows, results, options.sweep)
    if isinstance(rows.stopped, DiagnosticError):
        tell(*rows.stopped.diagnostics)
    return rows.exit_code


def _say_where(rows: Rows, results: Path, file: str) -> None:
    traces = any(row.traces for row in rows)
    tell(without_controls(f"rows saved: {results}" + (", with traces beside it" if traces else "")))
    if rows.stopped is not None:
        again = f"llfsm sweep {quote(file)} --results {quote(str(results))}"
        tell(without_controls(f"ended after {len(rows):,} of {rows.combinations:,} rows; to go on: {again}"))


class _Watched:
    """How far a sweep is, on a terminal."""

    def __init__(self, line: StatusLine, results: Path) -> None:
        self._line = line
        self._results = results
        self._known = self._wanted = self._done = 0
        self._started = time.monotonic()

    def began(self, plan: Plan, known: int, warnings: Iterable[Diagnostic]) -> None:
        """The plan is made, and so many rows are known."""
        tell(*warnings)
        self._known, self._wanted = known, len(plan.combinations)
        if known:
            tell(without_controls(f"{known:,} of {self._wanted:,} rows were in {self._results} already"))
        self._started = time.monotonic()

    def ended(self, row: Row) -> None:  # noqa: ARG002 - only that there is one more
        """One more row."""
        self._done += 1
        self._line.show(self.text)

    def text(self) -> str:
        """Rows so far, their rate and what is left."""
        rate = self._done / max(time.monotonic() - self._started, 1e-3)
        left = self._wanted - self._known - self._done
        return f"{self._known + self._done:,} of {self._wanted:,} rows, {rate:,.1f}/s, about {left / rate:,.0f} s to go"

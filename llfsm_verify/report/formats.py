"""The formats of reports, by the names that ``--format`` knows them by."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

from llfsm_verify.registry import Registry
from llfsm_verify.report.entry import Failed, ReportEntry

if TYPE_CHECKING:
    from rich.console import RenderableType

    from llfsm_verify.analysis.coverage.result import Coverage
    from llfsm_verify.analysis.lint.finding import LintResult
    from llfsm_verify.arrangement.model import Arrangement
    from llfsm_verify.checking.verdict import Result
    from llfsm_verify.report.knowledge import Answer
    from llfsm_verify.report.monitor import Monitors
    from llfsm_verify.runtime.stepping.random_run import Simulated
    from llfsm_verify.verification.query import QueryResult


GROUPS = "llfsm_verify.reports"
"""Of entry points: with the kind of the report after a full stop, such as `llfsm_verify.reports.result`."""


@dataclass(frozen=True, slots=True)
class Style:
    """What of a report is wanted; formats for programs say everything."""

    quiet: bool = False
    """Verdicts only, and what was asked for beside them."""
    fold: bool = True
    """Long stretches of a trace without an event are one row."""
    whole: float | None = None
    """Seconds of the whole command so far."""
    traces: bool = False
    """Of lint: the tables of runs."""
    suppressed: bool = False
    """Of lint: also what files accept."""
    width: int = 80
    """Of a terminal, in cells."""


Written = str | Iterable["RenderableType"]
"""Text for programs, without a final newline, or what a terminal shows."""


@dataclass(frozen=True, slots=True)
class Reports:
    """All reports, by what they are about and then by format. What a report gets depends on what it is about."""

    result: Registry[Callable[[Result, Arrangement, Style], Written]]
    """Of `llfsm verify`."""
    lint: Registry[Callable[[LintResult, Arrangement, Style], Written]]
    coverage: Registry[Callable[[Coverage, Arrangement, Style], Written]]
    query: Registry[Callable[[QueryResult, Arrangement, Style], Written]]
    access: Registry[Callable[[Arrangement, str], str]]
    """Of `llfsm access`; the second is the digest of the policy."""
    simulation: Registry[Callable[[Simulated, Style], Written]]
    """Of `llfsm simulate`. What is for a terminal is made while the run is."""
    knowledge: Registry[Callable[[Answer], Written]]
    """Of `llfsm knowledge`, whatever was asked."""
    monitor: Registry[Callable[[Monitors, Callable[[str], None]], str]]
    """Of `llfsm monitor`, with the final newline; the second takes what is said beside. All but `text` are asked about
    one property."""

    def failed(self, name: str | None) -> Failed | None:
        """What says that the files are wrong in the format `name`, whatever the command is."""
        for each in fields(self):
            entry = getattr(self, each.name).get(name)
            if isinstance(entry, ReportEntry) and entry.failure is not None:
                return entry.failed()
        return None


def _formats(kind: str, *entries: ReportEntry) -> Registry[Any]:
    return Registry("report format", entries, f"{GROUPS}.{kind}")


REPORTS = Reports(
    result=_formats(
        "result",
        ReportEntry("text", "llfsm_verify.report.text:report", "for people", (".txt",)),
        ReportEntry(
            "json", "llfsm_verify.report.json:report", "one object, schema `result`", (".json",),
            failure="llfsm_verify.report.json:failure_json",
        ),
    ),
    lint=_formats(
        "lint",
        ReportEntry("text", "llfsm_verify.report.lint:report", "for people"),
        ReportEntry("json", "llfsm_verify.report.lint:report_json", "one object, schema `lint`"),
    ),
    coverage=_formats(
        "coverage",
        ReportEntry("text", "llfsm_verify.report.coverage:report", "for people"),
        ReportEntry("json", "llfsm_verify.report.coverage:report_json", "one object, schema `coverage`"),
    ),
    query=_formats(
        "query",
        ReportEntry("text", "llfsm_verify.report.query:report", "for people"),
        ReportEntry("json", "llfsm_verify.report.query:report_json", "one object, schema `query`"),
    ),
    access=_formats(
        "access",
        ReportEntry("text", "llfsm_verify.report.access:access_text", "for people"),
        ReportEntry("json", "llfsm_verify.report.access:report_json", "one object"),
    ),
    simulation=_formats(
        "simulation",
        ReportEntry("table", "llfsm_verify.report.runtable:report", "for people"),
        ReportEntry("json", "llfsm_verify.report.simulation:report_json", "schema `simulation`"),
    ),
    knowledge=_formats(
        "knowledge",
        ReportEntry("text", "llfsm_verify.report.knowledge:report", "for people"),
        ReportEntry("json", "llfsm_verify.report.knowledge:report_json", "one object, schema `knowledge`"),
    ),
    monitor=_formats(
        "monitor",
        ReportEntry("text", "llfsm_verify.report.monitor:report", "a sentence or two"),
        ReportEntry("machine", "llfsm_verify.report.monitor:report_machine", "a machine file"),
        ReportEntry("table", "llfsm_verify.report.monitor:report_table", "a JSON table"),
        ReportEntry("dot", "llfsm_verify.report.monitor:report_dot", "a drawing"),
    ),
)  # fmt: skip

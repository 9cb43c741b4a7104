"""The formats of reports, by the names that ``--format`` knows them by."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from llfsm_verify.registry import Entry, Registry

if TYPE_CHECKING:
    from rich.console import RenderableType

    from llfsm_verify.analysis.lint.finding import LintResult
    from llfsm_verify.arrangement.model import Arrangement
    from llfsm_verify.checking.verdict import Result
    from llfsm_verify.verification.query import QueryResult


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


Written = str | Iterable["RenderableType"]
"""Text for programs, without a final newline, or what a terminal shows."""

RESULTS: Registry[Callable[[Result, Arrangement, Style], Written]] = Registry(
    "report format",
    [
        Entry("text", "llfsm_verify.report.text:report", "for people"),
        Entry("json", "llfsm_verify.report.json:report", "one object, schema `result`"),
        Entry("junit", "llfsm_verify.report.junit:report", "JUnit XML, for continuous integration"),
        Entry("sarif", "llfsm_verify.report.sarif.results:report", "SARIF 2.1.0, for code hosts"),
    ],
)
"""Of `llfsm verify`."""

LINT: Registry[Callable[[LintResult, Arrangement, Style], Written]] = Registry(
    "report format",
    [
        Entry("text", "llfsm_verify.report.lint.text:report", "for people"),
        Entry("json", "llfsm_verify.report.lint.json:report", "one object, schema `lint`"),
        Entry("sarif", "llfsm_verify.report.lint.json:report_sarif", "SARIF 2.1.0, for code hosts"),
    ],
)
"""Of `llfsm lint`."""

QUERIES: Registry[Callable[[QueryResult, Arrangement, Style], Written]] = Registry(
    "report format",
    [
        Entry("text", "llfsm_verify.report.query:report", "for people"),
        Entry("json", "llfsm_verify.report.query:report_json", "one object, schema `query`"),
    ],
)
"""Of `llfsm query`."""

"""Findings of lint: as text for a terminal or a pipe, and as JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import TYPE_CHECKING

from rich.text import Text

from llfsm_verify.analysis.lint.finding import Finding, LintResult, Proof, Witness
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.diagnostics import Diagnostic, counted
from llfsm_verify.fileformat import FORMAT
from llfsm_verify.jsonvalue import Json
from llfsm_verify.report.formats import Style
from llfsm_verify.report.json import inputs_object, span_object, trace_object
from llfsm_verify.report.text import run_text
from llfsm_verify.report.wording import input_text

if TYPE_CHECKING:
    from rich.console import RenderableType

STYLES = {"warning": "yellow", "note": "cyan", "accepted": "dim"}
MOST_OPEN = 20
"""Open questions that are listed."""


def lint_text(result: LintResult, *, traces: bool = False, suppressed: bool = False) -> Iterator[RenderableType]:
    """What `llfsm lint --format text` prints. `traces`: with tables of runs; `suppressed`: and what files accept."""
    shown = result.findings if suppressed else result.shown
    for finding in shown:
        yield from _finding(finding, result)
        if traces and finding.witness is not None and finding.witness.trace is not None:
            yield from run_text(finding.witness.trace)
        yield Text()
    for question in result.open[:MOST_OPEN]:
        yield Text(f"{question.span}: unknown[{question.code}]: {question.message}", "yellow")
        if question.hint is not None:
            yield Text(f"  hint: {question.hint}")
    if len(result.open) > MOST_OPEN:
        yield Text(f"and {len(result.open) - MOST_OPEN} more like this (--format json has all)")
    if result.open:
        yield Text()
    yield Text(_summary(result))
    if result.left_out:
        yield Text(f"counted without what nothing depends on: {', '.join(result.left_out)}")
    yield from (Text(input_text(note)) for note in result.inputs)


def proof_text(finding: Finding, result: LintResult) -> str:
    """How a finding is known, in a clause; empty where the text alone tells it."""
    by: dict[Proof, str] = {
        "local": "proved: no turn does otherwise, from any values inside the declared ranges",
        "reachable": f"proved: no run does otherwise ({counted(result.configurations, 'configuration')})",
        "run": "",
        "ranges": "for some values inside the declared ranges; not known to be reachable",
        "text": "",
    }
    return by[finding.proof]


def witness_text(witness: Witness) -> str:
    """The values that show a finding, in a clause."""
    before = ", ".join(f"{name} = {value}" for name, value in witness.variables)
    sampled = ", ".join(f"{name} = {value}" for name, value in witness.inputs)
    words = []
    if witness.trace is not None:
        count = len(witness.trace.steps)
        words.append(f"in a run of {counted(count, 'step')}" if count else "from the start")
    if before:
        words.append(f"{'before the last' if witness.trace is not None else 'before the turn'}: {before}")
    if sampled:
        words.append(f"sampled: {sampled}")
    return "; ".join(words)


def explain(finding: Finding, result: LintResult) -> Diagnostic:
    """A finding as a diagnostic that also says how it is known."""
    notes = [*finding.notes]
    if len(finding.machines) > 1 and finding.proof != "text":
        notes.append(f"in {', '.join(f'`{m}`' for m in finding.machines)}")
    notes += filter(None, (proof_text(finding, result), witness_text(finding.witness) if finding.witness else ""))
    if finding.suppressed is not None:
        notes.append(f"accepted: {finding.suppressed}")
    return Diagnostic(finding.code, finding.message, finding.span, tuple(notes), finding.hint)


def _finding(finding: Finding, result: LintResult) -> Iterator[Text]:
    kind = finding.level if finding.suppressed is None else "accepted"
    first, *rest = explain(finding, result).render(kind).splitlines()
    yield Text(first, STYLES[kind])
    yield from map(Text, rest)


def _summary(result: LintResult) -> str:
    counts = {level: sum(f.level == level for f in result.shown) for level in ("warning", "note")}
    parts = [counted(n, level) for level, n in counts.items()]
    accepted = len(result.findings) - len(result.shown)
    parts += [f"{accepted} accepted"] if accepted else []
    parts += [f"{len(result.open)} unknown"] if result.open else []
    extent = "single turns only"
    if result.explored:
        extent = f"{counted(result.configurations, 'configuration')}, " + (
            "complete" if result.complete else "not complete"
        )
        if result.reason is not None:
            extent += f": {result.reason}"
    return f"{', '.join(parts)}; {extent}, {result.seconds:.2f} s"


def report(result: LintResult, _: Arrangement, style: Style) -> Iterator[RenderableType]:
    """The report for people, as `report.formats` knows it."""
    return lint_text(result, traces=style.traces, suppressed=style.suppressed)


def report_json(result: LintResult, *_: object) -> str:
    """The whole result as one JSON object (schema `lint`), indented, without a final newline."""
    return json.dumps(lint_object(result), indent=2, ensure_ascii=False)


def lint_object(result: LintResult) -> dict[str, Json]:
    """The result as plain dictionaries and lists."""
    return {
        "format": FORMAT,
        "arrangement": result.arrangement,
        "path": result.path,
        "findings": [_finding_object(f) for f in result.findings],
        "unknown": [
            {"code": q.code, "message": q.message, "span": span_object(q.span), "hint": q.hint} for q in result.open
        ],
        "explored": result.explored,
        "complete": result.complete,
        "reason": result.reason,
        "states": result.configurations,
        "left_out": list(result.left_out),
        "inputs": inputs_object(result.inputs),
        "seconds": round(result.seconds, 6),
        "exit_code": result.exit_code,
    }


def _finding_object(finding: Finding) -> Json:
    return {
        "code": finding.code,
        "level": finding.level,
        "message": finding.message,
        "span": span_object(finding.span),
        "machines": list(finding.machines),
        "proof": finding.proof,
        "notes": list(finding.notes),
        "hint": finding.hint,
        "witness": None if finding.witness is None else _witness(finding.witness),
        "silenced": finding.suppressed,
    }


def _witness(witness: Witness) -> Json:
    return {
        "reachable": witness.trace is not None,
        "variables": dict(witness.variables),
        "inputs": dict(witness.inputs),
        "trace": None if witness.trace is None else trace_object(witness.trace),
    }

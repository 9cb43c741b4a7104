"""Findings of lint as JSON and SARIF."""

from __future__ import annotations

import json

from llfsm_verify.analysis.lint.finding import Finding, LintResult, Witness
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.diagnostics import Diagnostic
from llfsm_verify.fileformat import FORMAT
from llfsm_verify.jsonvalue import Json
from llfsm_verify.report.json import inputs_object, span_object, trace_object
from llfsm_verify.report.lint.text import explain
from llfsm_verify.report.sarif.flows import with_flows
from llfsm_verify.report.sarif.results import diagnostic_result, notification, sarif_log


def report(result: LintResult, *_: object) -> str:
    """The whole result as one JSON object (schema `lint`), indented, without a final newline."""
    return json.dumps(lint_object(result), indent=2, ensure_ascii=False)


def lint_object(result: LintResult) -> dict[str, Json]:
    """The result as plain dictionaries and lists."""
    return {
        "format": FORMAT,
        "arrangement": result.arrangement,
        "path": result.path,
        "findings": [_finding(f) for f in result.findings],
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


def _finding(finding: Finding) -> Json:
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


def report_sarif(result: LintResult, arrangement: Arrangement, *_: object) -> str:
    """A SARIF 2.1.0 log with one run: a result for each finding and each warning of the files.

    The run of a finding is its code flow, what a file accepts is suppressed, and what is unknown is of the kind `open`.
    """
    results: list[Json] = []
    rules: list[str] = []
    notes: list[Json] = []
    for finding in result.findings:
        value = diagnostic_result(explain(finding, result))
        value["level"] = finding.level
        if finding.suppressed is not None:
            value["suppressions"] = [{"kind": "inSource", "justification": finding.suppressed}]
        trace = None if finding.witness is None else finding.witness.trace
        # A run of no step is no flow.
        results.append(with_flows(value, (trace,), arrangement) if trace is not None and trace.steps else value)
        rules.append(finding.code)
    for question in result.open:
        value = diagnostic_result(Diagnostic(question.code, question.message, question.span, hint=question.hint))
        results.append({**value, "kind": "open", "level": "none"})
        rules.append(question.code)
        notes.append(notification(f"unknown: {question.message}"))
    for warning in arrangement.warnings:
        results.append(diagnostic_result(warning))
        rules.append(warning.code)
    return sarif_log(results, rules, notes, exit_code=result.exit_code, successful=True)

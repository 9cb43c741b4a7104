"""Findings of lint as SARIF."""

from __future__ import annotations

from llfsm_verify import Diagnostic
from llfsm_verify.extensions.servers.flows import with_flows
from llfsm_verify.extensions.servers.sarif import diagnostic_result, notification, sarif_log
from llfsm_verify.plug import Arrangement, Json, LintResult, lint_diagnostic


def report(result: LintResult, arrangement: Arrangement, *_: object) -> str:
    """A SARIF 2.1.0 log with one run: a result for each finding and each warning of the files.

    The run of a finding is its code flow, what a file accepts is suppressed, and what is unknown is of the kind `open`.
    """
    results: list[Json] = []
    rules: list[str] = []
    notes: list[Json] = []
    for finding in result.findings:
        value = diagnostic_result(lint_diagnostic(finding, result))
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

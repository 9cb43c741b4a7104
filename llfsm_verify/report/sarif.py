"""Results as SARIF 2.1.0 (OASIS standard, 2020), which code hosts show beside the lines that they are about."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Sequence
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from urllib.parse import quote

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.trace import Trace, TraceStep
from llfsm_verify.checking.verdict import FaultFinding, PropertyResult, Result, Verdict
from llfsm_verify.diagnostics import Diagnostic, Span
from llfsm_verify.report.codes import all_codes
from llfsm_verify.report.json import Json
from llfsm_verify.report.tracetable import Row, initial_text, loop_text, rows
from llfsm_verify.report.wording import fault_text, under_assumptions

SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
ROOT = "%SRCROOT%"
MAX_STEPS = 5_000
"""Steps of a trace that are shown; code hosts refuse results with many more."""

VIOLATED, UNKNOWN = "violated", "unknown"
RULES = {VIOLATED: "PropertyViolated", UNKNOWN: "VerdictUnknown"}
SHORT = {
    VIOLATED: "A run of the arrangement violates a property.",
    UNKNOWN: "A property was neither found to hold nor violated.",
}
HELP = {
    VIOLATED: "The code flow is a run that the executor took, step by step, to where the property can no longer hold, "
    "or round a loop for ever. Mend the machine, or the property if it asks for too much. `llfsm-verify --save-traces "
    "DIR` saves the run, and `llfsm replay` runs it again.",
    UNKNOWN: "The search ended before it was complete. Raise the limit that the reason names (--max-states, "
    "--memory, --timeout), or make the arrangement smaller.",
}


def result_sarif(result: Result, arrangement: Arrangement) -> str:
    """A log with one run: a result for each property violated or unknown, each fault, and each warning.

    A violation stands at the property's line, a fault at the line of the machine that raises it; its run is a code flow
    through the lines of transitions and states. Places are relative to the folder that we are in.
    """
    results: list[Json] = []
    rules: list[str] = []
    notes: list[Json] = []
    for item in result.properties:
        if item.verdict is not Verdict.HOLDS:
            results.append(_property(result, arrangement, item))
            rules.append(VIOLATED if item.verdict is Verdict.VIOLATED else UNKNOWN)
        if item.verdict is Verdict.UNKNOWN:
            notes.append(_notification(f"{item.name} is unknown: {item.reason}"))
    for finding in result.faults.findings:
        results.append(_fault(arrangement, finding))
        rules.append(finding.site.code)
    if result.faults.verdict is Verdict.UNKNOWN:
        notes.append(_notification(f"whether a run ends in a fault is unknown: {fault_text(result)}"))
    for warning in arrangement.warnings:
        results.append(_diagnostic(warning))
        rules.append(warning.code)
    return _log(results, rules, notes, exit_code=result.exit_code, successful=not result.interrupted)


def failure_sarif(diagnostics: Sequence[Diagnostic], exit_code: int) -> str:
    """The same for wrong input: a result for each diagnostic, at its place."""
    results: list[Json] = [_diagnostic(d) for d in diagnostics]
    return _log(results, [d.code for d in diagnostics], [], exit_code=exit_code, successful=False)


# ---------------------------------------------------------------- the log around the results


def _log(results: list[Json], used: list[str], notes: list[Json], *, exit_code: int, successful: bool) -> str:
    rules = sorted(set(used))
    for result, rule in zip(results, used, strict=True):
        assert isinstance(result, dict)
        result["ruleIndex"] = rules.index(rule)
    driver: dict[str, Json] = {"name": "llfsm-verify", "rules": [_rule(rule) for rule in rules]}
    try:
        driver["semanticVersion"] = version("llfsm-verify")
    except PackageNotFoundError:
        pass  # a source tree that nobody has installed has no version
    invocation: dict[str, Json] = {
        "executionSuccessful": successful,
        "exitCode": exit_code,
        "toolExecutionNotifications": notes,
    }
    run: dict[str, Json] = {
        "tool": {"driver": driver},
        "columnKind": "unicodeCodePoints",
        "originalUriBaseIds": {ROOT: {"description": {"text": "The folder in which llfsm-verify was called."}}},
        "invocations": [invocation],
        "results": results,
    }
    return json.dumps({"$schema": SCHEMA, "version": "2.1.0", "runs": [run]}, indent=2, ensure_ascii=False)


def _rule(rule: str) -> Json:
    """What is known of a rule: ours about verdicts, or the code of a diagnostic or fault."""
    if rule in RULES:
        name, short, text = RULES[rule], SHORT[rule], HELP[rule]
    else:
        name, short = rule, all_codes()[rule]
        text = f"{short} The message says what to write instead; docs/diagnostics.md lists all codes."
    level = "warning" if rule.startswith("W") else "error"
    return {
        "id": rule,
        "name": name,
        "shortDescription": {"text": short},
        "fullDescription": {"text": text},
        "help": {"text": text},
        "defaultConfiguration": {"level": level},
    }


def _notification(text: str) -> Json:
    return {"level": "warning", "message": {"text": text}}


# ---------------------------------------------------------------- results


def _property(result: Result, arrangement: Arrangement, item: PropertyResult) -> dict[str, Json]:
    violated = item.verdict is Verdict.VIOLATED
    assuming = f" ({under_assumptions(result)})" if violated and result.assumptions else ""
    sentences = [f"{item.name} is {item.verdict.value}{assuming}: {item.text}"]
    sentences += [_sentence(loop_text(item.trace))] if item.trace is not None else []
    sentences += [_sentence(text) for text in ((item.reason,) if item.reason else ()) + item.notes]
    value: dict[str, Json] = {
        "ruleId": VIOLATED if violated else UNKNOWN,
        # What was not decided is no failure by the standard, and then has no level.
        "kind": "fail" if violated else "open",
        "level": "error" if violated else "none",
        "message": {"text": "\n".join(sentences)},
        "locations": [_location(item.span, arrangement, name=f"{arrangement.name}.{item.name}")],
        "partialFingerprints": _fingerprint(
            _uri(arrangement.path) or arrangement.name, item.kind, item.name, item.text
        ),
    }
    return _with_flow(value, item.trace, arrangement)


def _fault(arrangement: Arrangement, finding: FaultFinding) -> dict[str, Json]:
    site = finding.site
    line = "" if site.span is None else " ".join(site.span.source.line(site.span.line).split())
    value: dict[str, Json] = {
        "ruleId": site.code,
        "kind": "fail",
        "level": "error",
        "message": {"text": f"A run ends in a fault: {site.message}\n{_sentence(loop_text(finding.trace))}"},
        "locations": [_location(site.span, arrangement, name=f"{arrangement.name}.faults")],
        "partialFingerprints": _fingerprint(
            _uri(arrangement.path) or arrangement.name, site.code, _uri(_name(site.span)) or "", site.message, line
        ),
    }
    return _with_flow(value, finding.trace, arrangement)


def _diagnostic(diagnostic: Diagnostic) -> dict[str, Json]:
    parts = [diagnostic.message, *diagnostic.notes, *([f"Hint: {diagnostic.hint}"] if diagnostic.hint else [])]
    name = _name(diagnostic.span) or diagnostic.file or ""
    uri = _uri(name)
    value: dict[str, Json] = {
        "ruleId": diagnostic.code,
        "level": "error" if diagnostic.is_error else "warning",
        "message": {"text": "\n".join(parts)},
        "partialFingerprints": _fingerprint(uri or name, diagnostic.code, diagnostic.message),
    }
    if uri is not None:
        physical: dict[str, Json] = {"artifactLocation": {"uri": uri, **_base(uri)}}
        if diagnostic.span is not None:
            physical["region"] = _region(diagnostic.span)
        value["locations"] = [{"physicalLocation": physical}]
    return value


def _fingerprint(*parts: str) -> dict[str, Json]:
    """The same as long as all parts are, wherever the lines have moved."""
    return {"llfsm/v1": sha256("\0".join(parts).encode()).hexdigest()[:32]}


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."


# ---------------------------------------------------------------- places


def _location(span: Span | None, arrangement: Arrangement, *, name: str = "", text: str = "") -> dict[str, Json]:
    """A place in a file. What was written on the command line is shown at the start of the arrangement."""
    uri = _uri(_name(span))
    if uri is None:
        uri, span = _uri(arrangement.path), arrangement.span
    location: dict[str, Json] = {}
    if uri is not None:
        assert span is not None
        location["physicalLocation"] = {"artifactLocation": {"uri": uri, **_base(uri)}, "region": _region(span)}
    if name:
        location["logicalLocations"] = [{"fullyQualifiedName": name, "name": name.rsplit(".", 1)[1]}]
    if text:
        location["message"] = {"text": text}
    return location


def _name(span: Span | None) -> str:
    return "" if span is None else span.source.name


def _uri(name: str) -> str | None:
    """Relative to the folder that we are in; absolute outside of it; None for what is no file."""
    if not name or name.startswith("<"):
        return None
    path = Path(os.path.relpath(name))
    return Path(name).absolute().as_uri() if path.parts[:1] == ("..",) else quote(path.as_posix())


def _base(uri: str) -> dict[str, Json]:
    return {} if ":" in uri else {"uriBaseId": ROOT}


def _region(span: Span) -> dict[str, Json]:
    end_line, end_column = span.end_position
    return {"startLine": span.line, "startColumn": span.column, "endLine": end_line, "endColumn": end_column}


# ---------------------------------------------------------------- runs


def _with_flow(value: dict[str, Json], trace: Trace | None, arrangement: Arrangement) -> dict[str, Json]:
    """With the run as a code flow: its start and the steps in which something happens."""
    if trace is None:
        return value
    steps: list[Json] = []
    for row in rows(trace):
        if row.folded:
            continue
        number = int(row.step)
        span = arrangement.span if number == 0 else _step_span(trace.steps[number - 1], arrangement)
        text = f"Initially {initial_text(trace)}" if number == 0 else _step_text(row)
        steps.append(
            {
                "location": _location(span, arrangement, text=text),
                "executionOrder": number,
                "importance": "essential" if row.fired or row.changes else "important",
            }
        )
    if len(steps) > MAX_STEPS:
        message = value["message"]
        assert isinstance(message, dict)
        message["text"] = f"{message['text']}\nThe code flow leaves out steps in the middle: it has {len(steps):,}."
        steps = steps[: MAX_STEPS // 2] + steps[-MAX_STEPS // 2 :]
    return value | {"codeFlows": [{"threadFlows": [{"locations": steps}]}]}


def _step_text(row: Row) -> str:
    """The cells of a row in a sentence."""
    where = f"{row.machine} in {row.state}" if row.state else row.machine
    repeats = {"first": "the steps from here on repeat for ever", "only": "this step repeats for ever"}
    cells: Iterable[str] = (row.fired, row.inputs, row.changes, row.atoms, repeats.get(row.mark, ""))
    return f"step {row.step}: {'; '.join(filter(None, (where, *cells)))}"


def _step_span(step: TraceStep, arrangement: Arrangement) -> Span | None:
    """The transition that fired, else the state in which the ringlet was spent."""
    if step.machine is None:
        return None
    machine = arrangement.machine(step.machine)
    for state in machine.states:
        if state.name == step.state:
            for transition in state.transitions:
                target = machine.states[transition.target].name
                if step.fired == f"{state.name} -> {target} when {transition.text}":
                    return transition.span
            return state.span
    return machine.span  # the implicit suspend state stands nowhere

"""Results as JUnit XML, the shape that continuous integration servers read."""

from __future__ import annotations

import xml.etree.ElementTree as ET

from llfsm_verify import Verdict
from llfsm_verify.plug import (
    CLAIMED,
    PropertyResult,
    Result,
    Trace,
    asked_text,
    fault_text,
    initial_text,
    is_contradicted,
    sentences,
    summary_text,
    trace_rows,
    vacuity_texts,
    verdict_text,
)


def report(result: Result, *_: object) -> str:
    """One `testsuite` with a `testcase` a property and one named `faults`.

    A violated property or a fault is a `failure` with its trace as text, an unknown verdict an `error`; with
    ``--strict`` a pass that is empty or rests on a checkpoint is also a `failure`, and one that was not looked at an
    `error`. The time of the whole
    search stands at the suite; the cases share one search, so theirs is 0.
    """
    verdicts = [item.verdict for item in result.properties] + [result.faults.verdict]
    claimed = sum(map(result.is_claimed, verdicts))
    empty, unseen = (
        sum(judge(item) and not result.is_claimed(item.verdict) for item in result.properties)
        for judge in (result.is_empty, result.is_unseen)
    )
    counts = {
        "tests": str(len(verdicts)),
        "failures": str(verdicts.count(Verdict.VIOLATED) + claimed + empty),
        "errors": str(verdicts.count(Verdict.UNKNOWN) + unseen),
        "time": f"{result.seconds:.3f}",
    }
    root = ET.Element("testsuites", {"name": "llfsm-verify", **counts})
    suite = ET.SubElement(root, "testsuite", {"name": _clean(result.arrangement), **counts, "skipped": "0"})
    for item in result.properties:
        _property_case(_case(suite, result, item.name), result, item)
    case = _case(suite, result, "faults")
    messages = [f"{f.site.span or result.path}: {f.site.code}: {f.site.message}" for f in result.faults.findings]
    message = "; ".join([fault_text(result), *messages])
    traces = [finding.trace for finding in result.faults.findings]
    _outcome(case, result.faults.verdict, message, result.faults.reason, traces)
    if result.is_claimed(result.faults.verdict):
        _claimed(case, "faults", [CLAIMED])
    ET.SubElement(suite, "system-out").text = _clean(summary_text(result))
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode")


def _property_case(case: ET.Element, result: Result, item: PropertyResult) -> None:
    """What was found of a property."""
    words = f"{verdict_text(result, item)}: {asked_text(item.kind, item.text)}"
    sentences = vacuity_texts(result, item)
    traces = [] if item.trace is None else [item.trace, *item.more]
    reason = "\n".join(filter(None, [item.reason, *sentences])) if is_contradicted(item) else item.reason
    _outcome(case, item.verdict, f"{item.name}: {words}", reason, traces)
    if result.is_claimed(item.verdict):
        _claimed(case, item.name, sentences)
    elif result.is_empty(item):
        attributes = {"type": "vacuous", "message": _clean(f"{item.name}: {sentences[0]}")}
        escape = result.escape_of(item)
        runs = [] if escape is None else ["", _trace(escape)]
        ET.SubElement(case, "failure", attributes).text = _clean("\n".join([*sentences, *runs]))
    elif result.is_unseen(item):
        attributes = {"type": "unknown", "message": _clean(f"{item.name}: {sentences[-1]}")}
        ET.SubElement(case, "error", attributes).text = _clean("\n".join(sentences))
    if item.verdict is Verdict.HOLDS:
        ET.SubElement(case, "system-out").text = _clean("\n".join([words, *sentences]))


def _case(suite: ET.Element, result: Result, name: str) -> ET.Element:
    return ET.SubElement(suite, "testcase", {"classname": _clean(result.arrangement), "name": name, "time": "0"})


def _claimed(case: ET.Element, name: str, sentences: list[str]) -> None:
    attributes = {"type": "resumed", "message": _clean(f"{name}: {CLAIMED}")}
    ET.SubElement(case, "failure", attributes).text = _clean("\n".join(sentences))


def _outcome(case: ET.Element, verdict: Verdict, message: str, reason: str | None, traces: list[Trace]) -> None:
    if verdict is Verdict.HOLDS:
        return
    kind, name = ("failure", "violated") if verdict is Verdict.VIOLATED else ("error", "unknown")
    element = ET.SubElement(case, kind, {"type": name, "message": _clean(message)})
    element.text = _clean("\n\n".join([*([reason] if reason else []), *map(_trace, traces)]))


def _trace(trace: Trace) -> str:
    lines = [
        " | ".join(
            cell for cell in (row.step, row.machine, row.state, row.fired, row.inputs, row.changes, row.atoms) if cell
        )
        for row in trace_rows(trace)
    ]
    return "\n".join([f"initially {initial_text(trace)}", *lines, *sentences(trace)])


def _clean(text: str) -> str:
    """XML 1.0 has no place for most control characters, not even escaped."""
    return "".join(
        c if c in "\t\n" or (c >= " " and c not in "\ufffe\uffff") else "\N{REPLACEMENT CHARACTER}" for c in text
    )

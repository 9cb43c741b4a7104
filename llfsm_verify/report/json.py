"""Results as JSON, in the shape that `schema/result.schema.json` publishes."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from decimal import Decimal
from typing import TYPE_CHECKING

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.trace import Cause, Event, Sampled, Trace, TraceStep
from llfsm_verify.checking.verdict import Attempt, FaultFinding, PropertyResult, Result
from llfsm_verify.diagnostics import Diagnostic, Span
from llfsm_verify.fileformat import FORMAT
from llfsm_verify.jsonvalue import Json
from llfsm_verify.kripke.labels.sizes import InputNote
from llfsm_verify.report.cycles import moments
from llfsm_verify.report.formats import Style
from llfsm_verify.report.wording import verdict_text
from llfsm_verify.values import read_back

if TYPE_CHECKING:
    from llfsm_verify.checking.verdict import Proof


def result_json(result: Result) -> str:
    """The whole result as one JSON object, indented, without a final newline."""
    return json.dumps(result_object(result), indent=2, ensure_ascii=False)


def result_object(result: Result) -> dict[str, Json]:
    """The result as plain dictionaries and lists."""
    return {
        "format": FORMAT,
        "arrangement": result.arrangement,
        "path": result.path,
        "engine": result.engine,
        "complete": result.complete,
        "interrupted": result.interrupted,
        "states": result.exploration.states,
        "transitions": result.exploration.transitions,
        "stored": result.exploration.stored,
        "counted": result.exploration.counted,
        "depth": result.exploration.depth,
        "longest": result.exploration.longest,
        "attempts": [attempt_object(attempt) for attempt in result.attempts],
        "resumed_from": result.exploration.resumed_from,
        "left_out": list(result.exploration.left_out),
        "inputs": inputs_object(result.exploration.inputs),
        "seconds": round(result.seconds, 6),
        "assumptions": list(result.assumptions),
        "escape": None if result.escape is None else trace_object(result.escape),
        "properties": [_property(result, item) for item in result.properties],
        "strict": result.strict,
        "notes": list(result.notes),
        "warnings": [diagnostic_object(warning) for warning in result.warnings],
        "faults": {
            "verdict": result.faults.verdict.value,
            "reason": result.faults.reason,
            "list": [_finding(finding) for finding in result.faults.findings],
            "proofs": [proof_object(proof) for proof in result.faults.proofs],
        },
        "exit_code": result.exit_code,
    }


def attempt_object(attempt: Attempt) -> dict[str, Json]:
    """What one of several engines did."""
    return {
        "engine": attempt.engine,
        "seconds": round(attempt.seconds, 6),
        "decided": list(attempt.decided),
        "reasons": list(attempt.reasons),
    }


def failure_json(diagnostics: Iterable[Diagnostic], exit_code: int) -> str:
    """What stands in place of a result when the files are wrong: everything that is, as one JSON object."""
    errors: Json = [diagnostic_object(d) for d in diagnostics]
    value: Json = {"format": FORMAT, "error": {"diagnostics": errors}, "exit_code": exit_code}
    return json.dumps(value, indent=2, ensure_ascii=False)


def diagnostic_object(diagnostic: Diagnostic) -> dict[str, Json]:
    """A diagnostic; line and column count from 1 and are null where a file as a whole is wrong."""
    span = diagnostic.span
    return {
        "code": diagnostic.code,
        "message": diagnostic.message,
        "file": diagnostic.file if span is None else span.file,
        "line": None if span is None else span.line,
        "column": None if span is None else span.column,
        "notes": list(diagnostic.notes),
        "hint": diagnostic.hint,
    }


def _property(result: Result, item: PropertyResult) -> Json:
    return {
        "name": item.name,
        "kind": item.kind.removesuffix(" initially"),
        "initially": item.kind == "forbid initially",
        "text": item.text,
        "span": span_object(item.span),
        "verdict": item.verdict.value,
        "words": verdict_text(result, item),
        "engine": item.engine,
        "reason": item.reason,
        "notes": list(item.notes),
        "trace": None if item.trace is None else trace_object(item.trace),
        "more": [trace_object(trace) for trace in item.more],
        "only": item.only,
        "witness": None if item.witness is None else trace_object(item.witness),
        "vacuity": _vacuity(result, item),
        "proofs": [proof_object(proof) for proof in item.proofs],
    }


def inputs_object(notes: Iterable[InputNote]) -> list[Json]:
    """What was made of wide inputs."""
    return [{"inputs": list(n.inputs), "values": n.values, "classes": n.classes, "reason": n.reason} for n in notes]


def proof_object(proof: Proof) -> dict[str, Json]:
    """A proof; `smt` is the invariant for solvers."""
    return {
        "shows": proof.shows,
        "bound": proof.bound,
        "unit": proof.unit,
        "invariant": list(proof.invariant),
        "legend": dict(proof.legend),
        "k": proof.k,
        "checked_by": list(proof.checked_by),
        "smt": proof.smt,
    }


def _vacuity(result: Result, item: PropertyResult) -> Json:
    vacuity = item.vacuity
    return {
        "looked": vacuity.looked,
        "reason": vacuity.reason,
        "findings": [
            {"kind": f.kind, "message": f.message, "subject": f.subject, "witness": f.witness} for f in vacuity.findings
        ],
        "never": list(vacuity.never),
        "always": list(vacuity.always),
        "accepted": vacuity.accepted,
        "fails": result.is_empty(item),
    }


def _finding(finding: FaultFinding) -> Json:
    site = finding.site
    return {
        "code": site.code,
        "message": site.message,
        "span": None if site.span is None else span_object(site.span),
        "trace": trace_object(finding.trace),
    }


def span_object(span: Span) -> dict[str, Json]:
    """A place: lines and columns count from 1, the end is just after the last character."""
    end_line, end_column = span.end_position
    return {
        "file": span.file,
        "line": span.line,
        "column": span.column,
        "end_line": end_line,
        "end_column": end_column,
    }


def trace_object(trace: Trace, before: Sequence[TraceStep] = ()) -> dict[str, Json]:
    """A trace: `loop` is the index in `steps` (from 0) at which the part that repeats begins, or null.

    `before`: the steps that led to its beginning; they count, and have taken time.
    """
    times, first = step_times(trace, before), len(before) + 1
    return {
        "initial": dict(trace.initial),
        "values": {name: _value(text) for name, text in trace.initial},
        "free": dict(trace.initial_free),
        "atoms": dict(trace.initial_atoms),
        "steps": [_step(step, first + i, times[i]) for i, step in enumerate(trace.steps)],
        "loop": trace.loop,
        "fault": None if trace.fault is None else {"code": trace.fault.code, "message": trace.fault.message},
        "causes": _causes(trace.initial_causes),
        "because": trace.because,
    }


def _causes(causes: Iterable[Cause]) -> Json:
    return [{"atom": c.atom, "value": c.value, "variables": dict(c.variables)} for c in causes]


def _choices(read: Iterable[Sampled]) -> Json:
    return [{"choice": s.choice, "input": s.input or None, "value": _number(s), "text": s.text} for s in read]


def step_times(trace: Trace, before: Sequence[TraceStep] = ()) -> list[int | float | None]:
    """The milliseconds of logical time at which the cycle of each step begins; None: untimed."""
    when = moments((*before, *trace.steps))[len(before) :]
    if trace.period is None:
        return [None for _ in when]
    times = (trace.period * (moment.cycle - 1) for moment in when)
    return [int(time) if time.denominator == 1 else float(time) for time in times]


def _value(text: str) -> bool | int | float | str:
    value = read_back(text)
    return float(value) if isinstance(value, Decimal) else value


def _number(read: Sampled) -> int | float:
    """A value as a number. That of `choose(2, 4, 8)` is kept as the place in the list, that of a decimal in steps, and
    its text is the number."""
    value = _value(read.text)
    return read.value if isinstance(value, (bool, str)) else value


def _step(step: TraceStep, number: int, time: float | None) -> Json:
    return {
        "step": number,
        "time_ms": time,
        "process": step.process,
        "machine": step.machine,
        "state": step.state,
        "fired": step.fired,
        "sampled": _choices(step.sampled),
        "world": _choices(step.world),
        "changes": [
            {"variable": c.variable, "before": c.before, "after": c.after, "value": _value(c.after)}
            for c in step.changes
        ],
        "cycle": step.cycle,
        "observed": step.observed,
        "atoms": dict(step.atoms),
        "causes": _causes(step.causes),
        "events": [_event(event) for event in step.events],
    }


def _event(event: Event) -> Json:
    site = event.site
    span = None if site.span is None else span_object(site.span)
    return {"kind": event.kind, "code": site.code, "message": site.message, "span": span}


def report(result: Result, _: Arrangement, __: Style) -> str:
    """The report for programs, as `report.formats` knows it."""
    return result_json(result)

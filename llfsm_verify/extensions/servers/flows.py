"""Runs in SARIF: code flows through the lines of transitions and states."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from urllib.parse import quote

from llfsm_verify import TraceStep
from llfsm_verify.plug import (
    CAUSE_MARK,
    Arrangement,
    Json,
    Span,
    Trace,
    TraceRow,
    initial_text,
    sentences,
    trace_rows,
)

ROOT = "%SRCROOT%"


def location(span: Span | None, arrangement: Arrangement, *, name: str = "", text: str = "") -> dict[str, Json]:
    """A place in a file. What was written on the command line is shown at the start of the arrangement."""
    uri = uri_of(name_of(span))
    if uri is None:
        uri, span = uri_of(arrangement.path), arrangement.span
    value: dict[str, Json] = {}
    if uri is not None:
        value["physicalLocation"] = physical_location(uri, span)
    if name:
        value["logicalLocations"] = [{"fullyQualifiedName": name, "name": name.rsplit(".", 1)[1]}]
    if text:
        value["message"] = {"text": text}
    return value


def physical_location(uri: str, span: Span | None) -> dict[str, Json]:
    """A region of a file, or the file."""
    value: dict[str, Json] = {"artifactLocation": {"uri": uri, **({} if ":" in uri else {"uriBaseId": ROOT})}}
    if span is not None:
        end_line, end_column = span.end_position
        value["region"] = {
            "startLine": span.line,
            "startColumn": span.column,
            "endLine": end_line,
            "endColumn": end_column,
        }
    return value


def name_of(span: Span | None) -> str:
    """The file that a span is in; empty: none."""
    return "" if span is None else span.source.name


def uri_of(name: str) -> str | None:
    """Relative to the folder that we are in; absolute outside of it; None for what is no file."""
    if not name or name.startswith("<"):
        return None
    path = Path(os.path.relpath(name))
    return Path(name).absolute().as_uri() if path.parts[:1] == ("..",) else quote(path.as_posix())


MAX_STEPS = 5_000
"""Steps of the runs of one result that are shown; code hosts refuse results with many more."""


def sentence(text: str) -> str:
    """A clause as a sentence."""
    return f"{text[0].upper()}{text[1:]}."


def ending(trace: Trace) -> list[str]:
    """How a run ends, and why that fails, in sentences."""
    return [sentence(text) for text in sentences(trace)]


def with_flows(value: dict[str, Json], traces: Sequence[Trace], arrangement: Arrangement) -> dict[str, Json]:
    """A result with each run as a code flow: its start and the steps in which something happens."""
    if not traces:
        return value
    most = max(2, MAX_STEPS // len(traces))  # a flow needs a step
    flows: list[Json] = []
    cut = False
    for number, trace in enumerate(traces, 1):
        steps: list[Json] = list(_steps(trace, arrangement))
        words = [f"Run {number} of {len(traces)}:"] if len(traces) > 1 else []
        words += ending(trace)
        if len(steps) > most:
            cut = True
            steps = steps[: most // 2] + steps[len(steps) - most // 2 :]
        flows.append({"message": {"text": " ".join(words)}, "threadFlows": [{"locations": steps}]})
    if cut:
        message = value["message"]
        assert isinstance(message, dict)
        value = {**value, "message": {"text": f"{message['text']}\nA code flow leaves out steps in the middle."}}
    return {**value, "codeFlows": flows}


def _steps(trace: Trace, arrangement: Arrangement) -> Iterator[Json]:
    for row in trace_rows(trace):
        caused = CAUSE_MARK in row.atoms
        if row.folded and not caused:
            continue
        # A folded row stands for the steps `6–30`, and is shown at the first.
        number = int(row.step.partition("–")[0])
        span = arrangement.span if number == 0 else _step_span(trace.steps[number - 1], arrangement)
        text = _step_text(row)
        if number == 0:
            text = f"Initially {'; '.join(filter(None, (initial_text(trace), row.atoms)))}"
        yield {
            "location": location(span, arrangement, text=text),
            "executionOrder": number,
            "importance": "essential" if row.fired or row.changes or caused else "important",
        }


def _step_text(row: TraceRow) -> str:
    """The cells of a row in a sentence."""
    where = f"{row.machine} in {row.state}" if row.state else row.machine
    repeats = {"first": "the steps from here on repeat forever", "only": "this step repeats forever"}
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

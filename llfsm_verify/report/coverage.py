"""Coverage as text and as JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from rich.text import Text

from llfsm_verify.analysis.coverage.goals import Goal, Kind
from llfsm_verify.analysis.coverage.result import STATUSES, Coverage, Judged, Status
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.diagnostics import counted
from llfsm_verify.fileformat import FORMAT
from llfsm_verify.jsonvalue import Json
from llfsm_verify.report.formats import Style
from llfsm_verify.report.json import inputs_object, span_object
from llfsm_verify.report.wording import input_text

if TYPE_CHECKING:
    from rich.console import RenderableType

NAMES: dict[Kind, str] = {
    "state": "states",
    "transition": "transitions",
    "branch": "branches",
    "condition": "conditions (MC/DC)",
}
COLOURS: dict[Status, str] = {
    "covered": "green", "reachable": "yellow", "unreachable": "cyan", "unknown": "magenta",
}  # fmt: skip
HEADINGS: dict[Status, str] = {
    "covered": "Covered",
    "reachable": "Not covered, and reachable",
    "unreachable": "Unreachable, by all configurations",
    "unknown": "Unknown",
}
MOST = 20
"""Goals of a status that are listed; the JSON has all."""


def coverage_text(found: Coverage) -> Iterator[RenderableType]:
    """What `llfsm coverage --format text` prints."""
    shown = [status for status in STATUSES if status != "covered" or found.runs]
    heads = {"reachable": "not covered"} if found.runs else {}
    yield Text(" " * 18 + "".join(f"{heads.get(status, status):>13}" for status in shown), "bold")
    for kind, counts in found.counts().items():
        line = Text(f"{NAMES[kind]:<18}")
        for status in shown:
            line.append(f"{counts[status]:>13}", COLOURS[status] if counts[status] else "dim")
        yield line
    for status in STATUSES[1:]:
        if status != "reachable" or found.runs:
            yield from _listed(found, status)
    yield Text()
    yield from map(Text, _beside(found))


def _listed(found: Coverage, status: Status) -> Iterator[Text]:
    goals = list(found.of(status))
    if not goals:
        return
    models = [*([] if found.surroundings is None else [found.surroundings]), *found.modelled]
    under = f" with {', '.join(models)} as modelled" if models and status == "unreachable" else ""
    yield Text(f"\n{HEADINGS[status]}{under}:", COLOURS[status])
    for judged in goals[:MOST]:
        lengths = " and ".join(counted(len(run), "step") for run in judged.runs)
        after = f", after {lengths}" if judged.runs else ""
        yield Text(f"  {judged.goal.span}: {goal_text(judged.goal)}{after}")
    if len(goals) > MOST:
        yield Text(f"  and {len(goals) - MOST} more like this (--format json has all)")


def goal_text(goal: Goal) -> str:
    """What is to be covered, in a clause."""
    if goal.kind == "state":
        return f"{goal.machine}: state {goal.text}"
    if goal.kind == "transition":
        return f"{goal.machine}: {goal.text}"
    if goal.kind == "branch":
        return f"{goal.machine}: `{goal.text}` is {'true' if goal.outcome else 'false'}"
    return f"{goal.machine}: `{goal.text}` decides alone in `{goal.decision}`"


def _beside(found: Coverage) -> Iterator[str]:
    for run in found.runs:
        yield f"{run.name}: {counted(run.steps, 'ringlet')}"
    if found.surroundings is not None:
        yield f"model of the surroundings, without which more may be reachable: {found.surroundings}"
    if found.modelled:
        yield f"models, of which nothing is to be covered: {', '.join(found.modelled)}"
    extent = "complete" if found.complete else f"not complete: {found.reason}"
    yield f"{counted(found.configurations, 'configuration')}, {extent}, {found.seconds:.2f} s"
    yield from map(input_text, found.inputs)


def report(found: Coverage, _: Arrangement, __: Style) -> Iterator[RenderableType]:
    """The report for people, as `report.formats` knows it."""
    return coverage_text(found)


def report_json(found: Coverage, *_: object) -> str:
    """The whole result as one JSON object (schema `coverage`), indented, without a final newline."""
    return json.dumps(coverage_object(found), indent=2, ensure_ascii=False)


def coverage_object(found: Coverage) -> dict[str, Json]:
    """The result as plain dictionaries and lists."""
    return {
        "format": FORMAT,
        "arrangement": found.arrangement,
        "path": found.path,
        "criterion": "masking MC/DC",
        "counts": {kind: _counts(counts) for kind, counts in found.counts().items()},
        "goals": [_goal(judged) for judged in found.goals],
        "runs": [{"name": run.name, "steps": run.steps} for run in found.runs],
        "surroundings": found.surroundings,
        "models": list(found.modelled),
        "complete": found.complete,
        "reason": found.reason,
        "states": found.configurations,
        "inputs": inputs_object(found.inputs),
        "seconds": round(found.seconds, 6),
        "exit_code": found.exit_code,
    }


def _counts(counts: Mapping[Status, int]) -> Json:
    return {status: number for status, number in counts.items()}  # noqa: C416 - its keys are texts like any


def _goal(judged: Judged) -> Json:
    goal = judged.goal
    return {
        "kind": goal.kind,
        "machine": goal.machine,
        "text": goal.text,
        "outcome": goal.outcome,
        "decision": goal.decision or None,
        "span": span_object(goal.span),
        "status": judged.status,
        "runs": [
            [{"process": step.process, "choices": dict(step.choices)} for step in run] for run in judged.runs
        ],
    }  # fmt: skip

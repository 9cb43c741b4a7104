"""The schedule: every machine instance stands in exactly one place of one process."""

from __future__ import annotations

from collections.abc import Sequence

from llfsm_verify.arrangement.draft import ProcessDraft, Unreadable
from llfsm_verify.arrangement.fields import Report
from llfsm_verify.arrangement.model import ENVIRONMENT, Process
from llfsm_verify.arrangement.nodes import Mapping, Node, mark
from llfsm_verify.diagnostics import Span
from llfsm_verify.language.scope import did_you_mean


def resolve_processes(
    report: Report,
    drafts: Sequence[ProcessDraft] | Unreadable,
    machines: dict[str, Span],
    broken: set[str],
    whole: Span,
) -> tuple[Process, ...]:
    """The processes of the arrangement at `whole`; `machines` are the instances and where they stand."""
    if isinstance(drafts, Unreadable):
        return ()
    if not drafts:
        report.error("E084", "the arrangement has no `schedule`", whole, "write `schedule: […]` with all machines")
        return ()
    seen: dict[str, Span] = {}
    found: list[Process] = []
    for draft in drafts:
        name = "main" if draft.name is None else report.name(draft.name, "the name of a process")
        slots = _slots(report, draft.slots, machines, broken, seen)
        if name is None or slots is None:
            return ()
        found.append(Process(name, slots, mark(draft.slots) if draft.name is None else draft.name.span))
    for name, span in machines.items():
        if name not in seen:
            report.error("E083", f"machine `{name}` is not in the schedule", span, "put it into the schedule")
    return tuple(found)


def _slots(
    report: Report, node: Node, machines: dict[str, Span], broken: set[str], seen: dict[str, Span]
) -> tuple[str, ...] | None:
    """The machines of one process in order, None when there is no such list."""
    hint = "write the names of the machines in the order of their turns"
    if isinstance(node, Mapping):
        report.error("E031", "a schedule must be a list", mark(node), "several processes are written under `processes`")
        return None
    sequence = report.sequence(node, "a schedule")
    if sequence is None:
        return None
    if not sequence.items:
        report.error("E080", "the schedule is empty", mark(node), hint)
        return None
    slots: list[str] = []
    for item in sequence.items:
        scalar = report.scalar(item, "an entry of the schedule")
        if scalar is None or scalar.text in broken:
            continue
        if scalar.text not in machines:
            near = did_you_mean(scalar.text, machines)
            if scalar.text == ENVIRONMENT:
                near = "remove it: the model of the surroundings begins every cycle, and has no turn in the schedule"
            report.error("E081", f"there is no machine `{scalar.text[:60]}`", mark(scalar), near)
        elif scalar.text in seen:
            again = "write another instance of it under `machines` for a second place"
            report.error("E082", f"machine `{scalar.text}` has two places in the schedule", mark(scalar), again)
        else:
            seen[scalar.text] = mark(scalar)
            slots.append(scalar.text)
    return tuple(slots)

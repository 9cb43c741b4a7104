"""The schedule: every machine instance stands in exactly one place of one process."""

from __future__ import annotations

from llfsm_verify.arrangement.fields import Report, mark
from llfsm_verify.arrangement.model import Process
from llfsm_verify.arrangement.nodes import Mapping, Node
from llfsm_verify.diagnostics import Span
from llfsm_verify.language.scope import did_you_mean


def read_processes(
    report: Report, fields: dict[str, Node], machines: dict[str, Span], broken: set[str], whole: Span
) -> tuple[Process, ...]:
    """The processes of the arrangement with the keys `fields`; `machines` are the instances and where they stand."""
    if "schedule" in fields and "processes" in fields:
        report.error("E084", "`schedule` and `processes` cannot both be there", mark(fields["processes"]), "keep one")
        return ()
    seen: dict[str, Span] = {}
    found: list[Process] = []
    if "processes" in fields:
        mapping = report.mapping(fields["processes"], "`processes`")
        if mapping is not None and not mapping.items:
            report.error("E080", "there are no processes", mark(mapping), "write `{main: […]}`")
        for key, value in mapping.items if mapping else ():
            name = report.name(key, "the name of a process")
            slots = _slots(report, value, machines, broken, seen)
            if name is None or slots is None:
                return ()
            found.append(Process(name, slots, key.span))
        if not found:
            return ()
    elif "schedule" in fields:
        slots = _slots(report, fields["schedule"], machines, broken, seen)
        if slots is None:
            return ()
        found.append(Process("main", slots, mark(fields["schedule"])))
    else:
        report.error("E084", "the arrangement has no `schedule`", whole, "write `schedule: […]` with all machines")
        return ()
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
            report.error("E081", f"there is no machine `{scalar.text[:60]}`", mark(scalar), near)
        elif scalar.text in seen:
            again = "write another instance of it under `machines` for a second place"
            report.error("E082", f"machine `{scalar.text}` has two places in the schedule", mark(scalar), again)
        else:
            seen[scalar.text] = mark(scalar)
            slots.append(scalar.text)
    return tuple(slots)

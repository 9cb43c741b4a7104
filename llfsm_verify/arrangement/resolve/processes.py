"""Who has turns: every machine instance in exactly one place of one process, and the model of the surroundings."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

from llfsm_verify.arrangement.draft import ProcessDraft, Unreadable
from llfsm_verify.arrangement.model import ENVIRONMENT, Machine, Process, WhiteboardVariable
from llfsm_verify.diagnostics import Span
from llfsm_verify.language.scope import did_you_mean
from llfsm_verify.language.trees import of_kind
from llfsm_verify.language.typed import Read
from llfsm_verify.yaml.fields import Report
from llfsm_verify.yaml.nodes import Mapping, Node, mark


def resolve_processes(
    report: Report,
    drafts: Sequence[ProcessDraft] | Unreadable,
    machines: dict[str, Span],
    broken: set[str],
    whole: Span,
    plants: Sequence[str] = (),
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
        slots = _slots(report, draft.slots, "schedule", machines, broken, seen, plants)
        pool = None if draft.pool is None else _slots(report, draft.pool, "pool", machines, broken, seen)
        if name is None or slots is None or (pool is None and draft.pool is not None):
            return ()
        place = mark(draft.slots) if draft.name is None else draft.name.span
        found.append(Process(name, (*slots, *(pool or ())), place, pool or ()))
    for name, span in machines.items():
        if name not in seen:
            hint = "put it into the schedule, or into `pool` if another machine loads it"
            report.error("E083", f"machine `{name}` is neither in the schedule nor in the pool", span, hint)
    return tuple(found)


def _slots(
    report: Report,
    node: Node,
    what: str,
    machines: dict[str, Span],
    broken: set[str],
    seen: dict[str, Span],
    plants: Sequence[str] = (),
) -> tuple[str, ...] | None:
    """The machines of the schedule, or of the pool, of one process in order, None when there is no such list."""
    hint = "write the names of the machines in the order of their turns"
    if isinstance(node, Mapping) and what == "schedule":
        report.error("E031", "a schedule must be a list", mark(node), "several processes are written under `processes`")
        return None
    sequence = report.sequence(node, f"a {what}")
    if sequence is None:
        return None
    if not sequence.items:
        report.error("E080", f"the {what} is empty", mark(node), hint if what == "schedule" else "remove it")
        return None
    slots: list[str] = []
    for item in sequence.items:
        scalar = report.scalar(item, f"an entry of the {what}")
        if scalar is None or scalar.text in broken:
            continue
        if scalar.text not in machines:
            near = did_you_mean(scalar.text, machines)
            if scalar.text in (ENVIRONMENT, *plants):
                near = "remove it: the model of the surroundings begins every cycle, and has no turn in the schedule"
            report.error("E081", f"there is no machine `{scalar.text[:60]}`", mark(scalar), near)
        elif scalar.text in seen:
            again = "write another instance of it under `machines` for a second place"
            where = "the schedule" if what == "schedule" else "the schedule and the pool"
            report.error("E082", f"machine `{scalar.text}` appears twice in {where}", mark(scalar), again)
        else:
            seen[scalar.text] = mark(scalar)
            slots.append(scalar.text)
    return tuple(slots)


def resolve_surroundings(
    report: Report, machines: Sequence[Machine], whiteboard: tuple[WhiteboardVariable, ...], used: Collection[str]
) -> tuple[tuple[Machine, ...], tuple[WhiteboardVariable, ...]]:
    """The models of the surroundings as machines that are never suspended and never finish, and the whiteboard with
    the inputs that they write marked. `used`: those that are there already, whose place is that of their names."""
    inputs = {w.variable.name for w in whiteboard if w.role == "input"}
    written: dict[str, tuple[str, Span]] = {}
    for machine in machines:
        writes = machine.writes()
        for name, span in dict.fromkeys((n, machine.span) for n, _ in writes) if machine.name in used else writes:
            owner, first = written.setdefault(name, (machine.name, span))
            if owner != machine.name and name in inputs:
                message = f"the plants `{owner}` and `{machine.name}` both write the input `{name}`"
                report.error("E532", message, span, "let one of them write it", (f"`{owner}` writes it at {first}",))
    states = [state for machine in machines for state in machine.states]
    for state in states:
        if state.on_suspend or state.on_resume:
            message = "the model of the surroundings is never suspended, so `on_suspend` and `on_resume` never run"
            report.error("E087", message, state.span, "remove them")
    for entry in whiteboard:
        if entry.changes != "step" and entry.variable.name in written:
            message = f"the model of the surroundings writes `{entry.variable.name}`, so `changes` has no meaning"
            report.error("E088", message, entry.variable.span, f"remove `changes: {entry.changes}`")
    for read in (r for s in states for r in of_kind(s, Read)):
        name = read.variable.name
        if name in inputs and name not in written:
            message = f"the model of the surroundings reads `{name}`, an input that it does not write"
            report.error("E156", message, read.span, f"write it too: `{name} = choose(…);`")
    marked = tuple(replace(w, driven=w.role == "input" and w.variable.name in written) for w in whiteboard)
    return tuple(_unending(machine) for machine in machines), marked


def _unending(machine: Machine) -> Machine:
    states = tuple(replace(s, stays=not s.transitions) for s in machine.states)
    return replace(machine, states=states, suspend=None, model=True)

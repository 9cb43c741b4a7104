"""A watched arrangement together with its outside guard, as an arrangement of two processes that can be verified.

The process `watched` is the arrangement between two machines. *Monitors* have the last turn of its cycle, so they read
what a frame shows; `broken` is what a guard knows that has read all frames so far. *Inbox* has the first turn: it takes
what the guard asks for, one command where a cycle begins, as a run does. The process `guarding` has one machine,
*guard*, which looks and asks in one ringlet. The two processes take turns in any order except the assumption on the
guard's pace, which is a formula: in any so many cycles of the first the second has a turn. The bound of the reaction is
another one.

Who else may give commands is left out, as the computed bound leaves it out. So is the model of the surroundings, since
arrangements of several processes have none: inputs have any values. An input that changes once a cycle may also change
where a cycle of the guard ends. The last two only add runs to those of which the bound is proved.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.guards.codes import NOT_GUARDABLE, UNFIT
from llfsm_verify.extensions.guards.guardable import not_safe
from llfsm_verify.extensions.guards.layout import Layout
from llfsm_verify.extensions.guards.reactions import Rights
from llfsm_verify.extensions.guards.transform import Task, property_monitor, read_files, with_slots
from llfsm_verify.extensions.guards.wanted import Fresh, Names, level_above
from llfsm_verify.plug import (
    ActionKind,
    Arrangement,
    DocumentValue,
    Draft,
    NewMachine,
    NewState,
    Order,
    Pace,
    reaction_time,
    resolve,
)

PROPERTIES = "reaction.ltl"
"""The name of the property file."""
LOWEST = "behaviour"


@dataclass(frozen=True, slots=True)
class Watch:
    """An arrangement with an outside guard: the texts of its files by their names, its own first, and what they say."""

    files: Mapping[str, str]
    properties: str
    """The assumption on the pace, that the reaction keeps the computed bound, and that it keeps one less by one."""
    arrangement: Arrangement


@dataclass(frozen=True, slots=True)
class _Parts:
    """What is added, by name."""

    broken: str
    asked: str
    taken: str
    monitors: tuple[str, ...]
    inbox: str
    guard: str
    level: str
    processes: tuple[str, str]


def with_outside_guard(draft: Draft, orders: Sequence[Order], pace: Pace, task: Task, folder: Path) -> Watch:
    """The arrangement of a draft with a guard beside it that gives these commands, as it will stand in `folder`.

    DiagnosticError: something is wrong, or does not go with an outside guard (E437, E438).
    """
    arrangement = resolve(draft)
    problems = list(_unfit(arrangement, orders, task))
    if problems:
        raise DiagnosticError(problems)
    fresh = Fresh(source.text for source in draft.sources)
    parts = _Parts(
        fresh("broken"),
        fresh("asked"),
        fresh("taken"),
        tuple(fresh("monitor") for _ in task.lines),
        fresh("inbox"),
        fresh("guard"),
        level_above(arrangement),
        (fresh("watched"), fresh("guarding")),
    )
    names = Names({}, parts.broken, parts.monitors, parts.inbox, parts.level, (), {}, Rights())
    known = resolve(with_slots(draft, names))
    layout = _Layout(draft, arrangement, names)
    for name, line in zip(parts.monitors, task.lines, strict=True):
        machine, arguments = property_monitor(line, task, known, names, arrangement)
        layout.define(name, arguments, machine)
    layout.define(parts.inbox, {}, _inbox(parts, orders, arrangement))
    layout.define(parts.guard, {}, _guard(parts, pace))
    layout.arrange(parts, orders)
    files = layout.files()
    return Watch(
        {**files, PROPERTIES: _properties(parts, orders, pace)},
        _properties(parts, orders, pace),
        resolve(read_files(files, folder)),
    )


def _unfit(arrangement: Arrangement, orders: Sequence[Order], task: Task) -> Iterator[Diagnostic]:
    for line in task.lines:
        refusal = not_safe(line, task.clock)
        if refusal is not None:
            yield Diagnostic(
                NOT_GUARDABLE, f"no frame violates `{line.name}`: {refusal.reason}", refusal.span, hint=refusal.hint
            )
    if len(arrangement.processes) > 1:
        message = "several processes and a guard beside them are not written as files"
        yield Diagnostic(
            UNFIT, message, arrangement.processes[1].span, hint="an outside guard needs one process: write `schedule`"
        )
    if arrangement.profile.snapshot == "cycle":
        message = "with `snapshot: cycle` an arrangement has one process, and the guard would be a second one"
        yield Diagnostic(UNFIT, message, arrangement.span, hint="use `snapshot: ringlet`")
    if arrangement.access is not None and arrangement.access.refuses:
        message = "with `on_violation: refuse` the clearances of machines are part of what they do"
        yield Diagnostic(UNFIT, message, hint="write `on_violation: reject`")
    declared = {(operator.kind, operator.target) for operator in arrangement.operators}
    for order in orders:
        if order.kind == "enter":
            message = f"`{order.text}` is for operators alone, and in the proof a machine gives the commands"
            yield Diagnostic(UNFIT, message, hint=f"machines can also give `restart {order.target}`")
        elif (order.kind, order.target) not in declared:
            message = f"`{order.text}` would be refused: `operators` does not declare it"
            yield Diagnostic(UNFIT, message, hint=f"write `operators: {{{order.kind}: [{order.target}]}}`")


class _Layout(Layout):
    """The files of a watched arrangement with its guard."""

    def named_files(self) -> list[tuple[str, ...]]:
        return [keys for keys in super().named_files() if keys[0] == "machines"]

    def arrange(self, parts: _Parts, orders: Sequence[Order]) -> None:
        """The whiteboard, processes, clearances; what does not go with two processes is taken out."""
        document, arrangement = self._document, self._arrangement
        for slot in (parts.broken, parts.asked):
            document.put(("whiteboard", slot), {"type": "bool", "init": "false"})
        document.put(("whiteboard", parts.taken), {"type": f"0..{len(orders)}", "init": "0"})
        # A machine of the pool has its turn after the schedule, and so has a monitor there, which inbox loads.
        scheduled = [m.name for m in arrangement.machines if m.loaded]
        pool = [m.name for m in arrangement.machines if not m.loaded]
        last = [] if pool else list(parts.monitors)
        watched, guarding = parts.processes
        turns = {watched: [parts.inbox, *scheduled, *last], guarding: [parts.guard]}
        if document.has("schedule"):
            document.put(("schedule",), turns)
            document.rename("schedule", "processes")
        else:
            document.put(("processes",), turns)
        if pool:
            document.put(("pool",), {watched: [*pool, *parts.monitors]})
        for key in ("observe", "environment", "operators"):
            document.remove(key)
        written = {order.target: LOWEST for order in orders if order.value is not None}
        level = dict.fromkeys
        access: dict[str, DocumentValue] = {
            "levels": [LOWEST, parts.level],
            "machines": level((*parts.monitors, parts.inbox, parts.guard), parts.level),
            "write": {**written, **level((parts.broken, parts.asked, parts.taken), parts.level)},
            **({"on_violation": "refuse"} if self._suspends_all() else {}),
        }
        document.put(("access",), access)


def _inbox(parts: _Parts, orders: Sequence[Order], arrangement: Arrangement) -> NewMachine:
    lines = []
    for number, order in enumerate(orders):
        start = "if" if not number else "} else if"
        lines.append(f"{start} ({parts.asked} && {parts.taken} == {number}) {{")
        lines.append(f"  {parts.taken} = {number + 1}; {order.statement}")
    actions: dict[ActionKind, str | Sequence[str]] = {}
    if any(not machine.loaded for machine in arrangement.machines):
        actions["on_entry"] = " ".join(f"load({name});" for name in parts.monitors)
    actions["internal"] = [*lines, "}"]
    about = "Takes what the guard asks for, one command where a cycle begins, as a run does."
    return NewMachine("Inbox", [NewState("INBOX", actions, stays=True)], comments=[about])


def _guard(parts: _Parts, pace: Pace) -> NewMachine:
    about = "Looks at the frames that have come, and asks for the commands when one of them breaks a rule."
    if pace.looks == 1:
        state = NewState("LOOK", {"internal": [f"if ({parts.broken}) {parts.asked} = true;"]}, stays=True)
        return NewMachine("Guard", [state], comments=[about])
    count = f"if ({parts.broken} && looks < {pace.looks}) looks = looks + 1;"
    ask = f"if (looks == {pace.looks}) {parts.asked} = true;"
    return NewMachine(
        "Guard",
        [NewState("LOOK", {"internal": [count, ask]}, stays=True)],
        variables={"looks": {"type": f"0..{pace.looks}", "init": "0"}},
        comments=[about],
        notes={"looks": "since the one that saw such a frame"},
    )


def _properties(parts: _Parts, orders: Sequence[Order], pace: Pace) -> str:
    worst = reaction_time(pace, len(orders)).cycles
    named = ", ".join(order.text for order in orders)
    lines = [
        f"# In any {pace.every} cycles of `{parts.processes[0]}` the guard has a turn.",
        f"assume paced: {_paced(parts, pace.every)}",
        f"# {named}: at most so many cycles after the frame that breaks the rule.",
        f"within_{worst}: {_within(parts, len(orders), worst)}",
        "# One cycle less is violated, if the rule can be.",
        f"within_{worst - 1}: {_within(parts, len(orders), worst - 1)}",
    ]
    return "\n".join(lines) + "\n"


def _paced(parts: _Parts, every: int) -> str:
    """In any so many cycles the guard has a turn: after each end of a cycle, before the next but `every` - 1."""
    look = f"{parts.guard}.ran"
    end = f"(cycle && !{look})"
    text = look
    for _ in range(every - 1):
        text = f"{look} || {end} && X(!{end} W ({text}))"
    return f"G ({end} -> X(!{end} W ({text})))"


def _within(parts: _Parts, commands: int, cycles: int) -> str:
    """All commands are taken in the first so many cycles that begin after the frame."""
    begins, taken = f"{parts.inbox}.ran", f"{parts.taken} == {commands}"
    text = taken
    for _ in range(cycles - 1):
        text = f"{taken} || X(!{begins} W ({begins} && ({text})))"
    return f"G ({parts.broken} -> X(!{begins} W ({begins} && ({text}))))"

"""From an arrangement to a guarded one, as texts of files.

The initial letter of a run is one that no monitor in the schedule reads, since it has a turn only after it. A monitor
that is made here has read it already, where that is possible.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.guards.codes import UNFIT
from llfsm_verify.extensions.guards.layout import Layout
from llfsm_verify.extensions.guards.rewiring import instances, renamings
from llfsm_verify.extensions.guards.switch import switch_machine
from llfsm_verify.extensions.guards.wanted import Names, Wanted, as_requested, names
from llfsm_verify.plug import (
    Arrangement,
    Clock,
    Draft,
    GivenArrangement,
    InstanceDraft,
    MachineDraft,
    Monitor,
    MonitorAction,
    Monitored,
    MonitorVerdict,
    NewMachine,
    Observer,
    Property,
    PropertySet,
    Reading,
    Scalar,
    Span,
    Timing,
    TooManyInitial,
    UnreadablePart,
    WhiteboardDraft,
    bind,
    implied,
    monitor_machine,
    monitor_properties,
    read_arrangement,
    resolve,
)
from llfsm_verify.plug import Layout as RecordLayout
from llfsm_verify.plug import Sequence as NodeSequence

ALARM = "alarm"
"""The parameter through which a monitor of the user's sets the alarm."""


@dataclass(frozen=True, slots=True)
class Task:
    """What the monitors look for: `lines` with a machine made for each, or with the machine of the user's, `own`."""

    lines: tuple[Property, ...]
    assumptions: tuple[Property, ...] = ()
    own: tuple[str, str] | None = None
    """The name and the text of a machine file."""
    clock: Clock | None = None
    """Of bounds in time in the properties."""

    @property
    def monitors(self) -> int:
        return len(self.lines) if self.own is None else 1


@dataclass(frozen=True, slots=True)
class Guarded:
    """A guarded arrangement: the texts of its files by their names, its own first, and what they say."""

    names: Names
    wanted: Wanted
    files: Mapping[str, str]
    draft: Draft
    arrangement: Arrangement
    original: Arrangement
    made: bool
    """The monitors were made from the properties: they set the alarm as soon as one is violated."""


def guard(draft: Draft, wanted: Wanted, task: Task, folder: Path) -> Guarded:
    """The guarded arrangement that a draft and the requests lead to, as it will stand in `folder`.

    DiagnosticError: something in the arrangement, the properties or what is wanted is wrong, or cannot be guarded.
    """
    arrangement = resolve(draft)
    texts = [source.text for source in draft.sources]
    if task.own is not None:
        texts.append(re.sub(rf"\b{ALARM}\b", "", task.own[1]))
    found = names(arrangement, texts, wanted, task.monitors)
    wider = with_slots(draft, found)
    if task.own is not None:
        wider = _with_machine(wider, found, task.own)
    known = resolve(wider)
    assert not isinstance(wider.arrangement, UnreadablePart)
    if task.own is not None and (problems := list(_wrong_writes(known, found))):
        raise DiagnosticError(problems)
    layout = Layout(draft, arrangement, found)
    for span, name in renamings(known, wider.arrangement, found.requests):
        layout.replace(span, name)
    layout.route(known)
    if task.own is not None:
        arguments = {
            found.requests.get(key.text, key.text): found.requests.get(value.text, value.text)
            for key, value in _own(wider, found).arguments
            if isinstance(value, Scalar)
        }
        machine_draft = _own(wider, found).machine
        assert isinstance(machine_draft, MachineDraft)
        layout.add_machine(found.monitors[0], arguments, machine_draft)
    else:
        for name, line in zip(found.monitors, task.lines, strict=True):
            # A monitor that begins again later begins with another letter.
            original = None if wanted.until is not None else arrangement
            machine, arguments = property_monitor(line, task, known, found, original)
            layout.add_machine(name, arguments, machine)
    layout.add_machine(found.switch, {}, switch_machine(found, wanted, taken_back=task.own is not None))
    files = layout.files()
    result = read_files(files, folder)
    return Guarded(found, wanted, files, result, resolve(result), arrangement, task.own is None)


def read_files(files: Mapping[str, str], folder: Path) -> Draft:
    first, *others = files
    return read_arrangement(
        GivenArrangement(folder / first, files[first], files={str(folder / name): files[name] for name in others})
    )


def with_slots(draft: Draft, found: Names) -> Draft:
    """The draft with the slots of a guard on its whiteboard."""
    arrangement = draft.arrangement
    assert not isinstance(arrangement, UnreadablePart)
    routed = {entry.name.text: entry for entry in arrangement.whiteboard}
    slots = [
        WhiteboardDraft(implied(slot, routed[output].name.span), routed[output].type, routed[output].init)
        for output, slot in found.requests.items()
    ]
    span = arrangement.span
    slots.append(WhiteboardDraft(implied(found.alarm, span), implied("bool", span)))
    return replace(draft, arrangement=replace(arrangement, whiteboard=(*arrangement.whiteboard, *slots)))


def _with_machine(draft: Draft, found: Names, own: tuple[str, str]) -> Draft:
    """The draft with the monitor of the user's as its last machine."""
    arrangement = draft.arrangement
    assert not isinstance(arrangement, UnreadablePart)
    assert not isinstance(arrangement.processes, UnreadablePart)
    reading = Reading(Path())
    machine = reading.machine_text(*own)
    span = arrangement.span if not reading.sources else Span(reading.sources[0], 0, 1)
    parameters = machine.parameters if isinstance(machine, MachineDraft) else ()
    variables = {entry.name.text for entry in arrangement.whiteboard}
    arguments = []
    for parameter in parameters:
        bound = found.alarm if parameter.name.text == ALARM else parameter.name.text
        if parameter.kind != "whiteboard" or bound not in variables:
            message = f"nothing says what the parameter `{parameter.name.text}` of this monitor stands for"
            hint = f"a monitor has whiteboard parameters, called like variables, and `{ALARM}`"
            raise DiagnosticError(Diagnostic(UNFIT, message, parameter.name.span, hint=hint))
        arguments.append((parameter.name, implied(bound, parameter.name.span)))
    (process,) = arrangement.processes
    assert isinstance(process.slots, NodeSequence)
    name = implied(found.monitors[0], span)
    slots = replace(process.slots, items=(*process.slots.items, name))
    wider = replace(
        arrangement,
        machines=(*instances(arrangement), InstanceDraft(name, machine, tuple(arguments))),
        processes=(replace(process, slots=slots),),
    )
    return reading.added(draft, wider)


def _wrong_writes(known: Arrangement, found: Names) -> Iterator[Diagnostic]:
    """What the monitor of the user's writes and should not, or what others could write as well."""
    classes = () if known.access is None else known.access.write
    for name, span in known.machine(found.monitors[0]).writes():
        if name in found.requests:
            message = f"a monitor judges `{name}`, which is routed, and does not write it"
            yield Diagnostic(UNFIT, message, span, hint=f"set `{ALARM}`: --fallback says what is written instead")
        elif name != found.alarm and name not in classes:
            levels = "" if known.access is not None else "levels: [low], "
            lowest = "low" if known.access is None else known.access.levels[0]
            message = f"this monitor writes `{name}`, which has no class, and nothing says who else may"
            hint = f"write `access: {{{levels}write: {{{name}: {lowest}}}}}` in the arrangement"
            yield Diagnostic(UNFIT, message, span, hint=hint)


def _own(draft: Draft, found: Names) -> InstanceDraft:
    assert not isinstance(draft.arrangement, UnreadablePart)
    return next(i for i in instances(draft.arrangement) if i.name.text == found.monitors[0])


def property_monitor(
    line: Property, task: Task, known: Arrangement, found: Names, original: Arrangement | None
) -> tuple[NewMachine, dict[str, str]]:
    """The machine that monitors a property of the requests, and the arguments of its instance. It has read the initial
    letter of `original`."""
    made = monitor_properties(line, task.assumptions, Timing(task.clock, every_letter_ticks=True))
    if original is not None:
        made = begun(made, original, (line, *task.assumptions))
    places = {key: place for p in (*task.assumptions, line) for key, place in p.atoms.items()}
    places = {
        key: implied(as_requested(place, found.requests), place.span(0, len(place.text))).fragment
        for key, place in places.items()
    }
    monitor = monitor_machine(made, places, known, MonitorAction((found.alarm,)))
    return monitor.machine, {name: name for name in (*monitor.reads.parameters, found.alarm)}


MOST_INITIAL = 1024
"""Initial configurations that are looked at."""


def begun(made: Monitored, arrangement: Arrangement, lines: Sequence[Property]) -> Monitored:
    """The monitor that has read the initial letter of the arrangement, where all initial configurations show the same
    one, and it decides nothing; else the monitor as it is. `lines`: the property and the assumptions.
    """
    letter = _initial_letter(made.monitor.atoms, arrangement, lines)
    if letter is None:
        return made
    state = made.monitor.step(0, letter)
    after = _from(made.monitor, state)
    if after.verdicts[0] is not MonitorVerdict.NOT_YET or MonitorVerdict.FALSE not in after.verdicts:
        return made
    return replace(made, monitor=after)


def _initial_letter(atoms: Sequence[str], arrangement: Arrangement, lines: Sequence[Property]) -> int | None:
    """The mask of the atoms that hold; None: that is not the same in all initial configurations, or unknown."""
    program = bind(arrangement, PropertySet(tuple(lines))).program()
    layout = RecordLayout.of(program)
    observer = Observer(program, layout)
    places = {name: place for place, name in enumerate(observer.names)}
    if not set(atoms) <= set(places):
        return None
    try:
        masks = {observer.first_letter(record) for record in layout.initial(MOST_INITIAL)}
    except (TooManyInitial, OverflowError):
        return None
    letters = {sum(1 << i for i, atom in enumerate(atoms) if mask >> places[atom] & 1) for mask in masks}
    return letters.pop() if len(letters) == 1 else None


def _from(monitor: Monitor, state: int) -> Monitor:
    """The monitor that begins in another state: what is reachable from there."""
    order = [state]
    for known in order:
        order += [target for target in dict.fromkeys(e.target for e in monitor.edges[known]) if target not in order]
    numbers = {old: new for new, old in enumerate(order)}
    return Monitor(
        monitor.atoms,
        tuple(monitor.verdicts[old] for old in order),
        tuple(tuple(replace(e, target=numbers[e.target]) for e in monitor.edges[old]) for old in order),
        tuple(monitor.hopeless[old] for old in order),
    )

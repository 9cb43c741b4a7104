"""A trace as the rows of a table: what each step did, long stretches without an event folded into one row."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from llfsm_verify.checking.trace import Event, Sampled, Trace, TraceStep
from llfsm_verify.program.program import FaultSite

MARK = "•"
"""Stands before an atom whose value in that letter causes the failure."""

FOLD_FROM = 4
"""So many uneventful steps in a row become one row."""


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the table. `mark` says where the row lies in the loop; the other cells are ready to print."""

    mark: Literal["", "first", "inside", "last", "only"]
    step: str
    process: str
    machine: str
    state: str
    fired: str
    inputs: str
    changes: str
    atoms: str
    folded: bool = False


def rows(trace: Trace, *, fold: bool = True) -> Iterator[Row]:
    """The rows of `trace`, the initial configuration first (step 0; its values are left to the caller).

    Inputs that were only in the surroundings stand in parentheses, where their value is another one than was shown
    last; not at all where they have one value throughout and are no cause. What models chose is shown likewise.
    Atoms that other columns show already are left out: `m.ran`, and inputs shown in the step. What causes the
    failure is never left out, and stands behind a MARK.
    A step is uneventful when no transition fired, no variable and no atom changed, and every input had the
    value that was shown last. With `fold`, FOLD_FROM or more of them in a row, on one side of the loop's start
    and with the same causes, become one row that says how many there were.
    """
    seen_elsewhere = {f"{step.machine}.ran" for step in trace.steps}
    yield _initial_row(trace, seen_elsewhere)
    loop = len(trace.steps) if trace.loop is None else trace.loop
    before = dict(trace.initial_atoms)
    inputs: dict[str, str] = {}
    still = _still(trace)
    quiet: list[tuple[int, Row]] = []
    for index, step in enumerate(trace.steps):
        new = tuple(s for s in step.world if inputs.get(s.input) != s.text and s.input not in still)
        told = tuple(s for s in step.sampled if s.input or (inputs.get(s.choice) != s.text and not _stays_away(s)))
        row, changed = _row(trace, index, replace(step, sampled=told, world=new), before, seen_elsewhere)
        eventful = (
            step.fired is not None
            or bool(step.changes or step.events)
            or changed
            or any(inputs.get(s.input or s.choice) != s.text for s in (*told, *new))
            or (trace.fault is not None and index == len(trace.steps) - 1)
        )
        before.update(step.atoms)
        inputs.update((s.input or s.choice, s.text) for s in step.choices)
        if not fold or eventful or index == loop or (quiet and quiet[-1][1].atoms != row.atoms):
            yield from _flush(quiet, loop, len(trace.steps))
            quiet = []
        if fold and not eventful:
            quiet.append((index, row))
        else:
            yield row
    yield from _flush(quiet, loop, len(trace.steps))


def _stays_away(read: Sampled) -> bool:
    """An operator who may act does not."""
    return read.choice.startswith("operator.") and read.text == "false"


def _still(trace: Trace) -> frozenset[str]:
    """The inputs that have one value in the whole trace, and that no cause reads."""
    causes = (*trace.initial_causes, *(cause for step in trace.steps for cause in step.causes))
    read = {name for cause in causes for name, _ in cause.variables}
    values: dict[str, set[str]] = {}
    for step in trace.steps:
        for s in step.choices:
            values.setdefault(s.input, set()).add(s.text)
    return frozenset(name for name, texts in values.items() if len(texts) == 1 and name not in read)


def _flush(quiet: Sequence[tuple[int, Row]], loop: int, end: int) -> Iterator[Row]:
    if len(quiet) < FOLD_FROM:
        yield from (row for _, row in quiet)
        return
    first, last = quiet[0][0], quiet[-1][0]
    names = list(dict.fromkeys(row.machine for _, row in quiet))
    machines = ", ".join(names) if len(names) <= 4 else f"{len(names)} machines"
    text = f"{len(quiet)} steps without an event"
    mark = _mark(first, last, loop, end)
    marks = quiet[0][1].atoms
    yield Row(mark, f"{first + 1}–{last + 1}", "", machines, "", text, "", "", marks, folded=True)


def _mark(first: int, last: int, loop: int, end: int) -> Literal["", "first", "inside", "last", "only"]:
    if first < loop:
        return ""
    if first == loop:
        return "only" if last == end - 1 else "first"
    return "last" if last == end - 1 else "inside"


def _initial_row(trace: Trace, hidden: set[str]) -> Row:
    marked = {cause.atom for cause in trace.initial_causes}
    shown = [(name, value) for name, value in trace.initial_atoms if name not in hidden or name in marked]
    return Row("", "0", "", "", "", "initially", "", "", _atoms(shown, marked))


def _atoms(shown: Sequence[tuple[str, bool]], marked: set[str]) -> str:
    return ", ".join(f"{MARK if name in marked else ''}{atom_text(name, value)}" for name, value in shown)


def initial_text(trace: Trace) -> str:
    """The first configuration in one line."""
    return ", ".join(f"{name} = {text}" for name, text in trace.initial)


def _row(trace: Trace, index: int, step: TraceStep, before: dict[str, bool], hidden: set[str]) -> tuple[Row, bool]:
    """The row of a step, and whether an atom changed that no other column shows."""
    hidden = hidden | {s.input for s in step.choices}
    marked = {cause.atom for cause in step.causes}
    changed = {name for name, value in step.atoms if before.get(name) != value and name not in hidden}
    shown = [(name, value) for name, value in step.atoms if name in changed or name in marked]
    loop = len(trace.steps) if trace.loop is None else trace.loop
    faulted = trace.fault is not None and index == len(trace.steps) - 1
    row = replace(
        step_row(index + 1, step, faulted=faulted),
        mark=_mark(index, index, loop, len(trace.steps)),
        atoms=_atoms(shown, marked),
    )
    return row, bool(changed)


def step_row(number: int, step: TraceStep, *, faulted: bool = False) -> Row:
    """The row of a step by itself, whatever comes before and after it; `number` counts from 1."""
    # A transition already says how its machine's state changed.
    shown = [c for c in step.changes if step.fired is None or c.variable != step.machine]
    # The source of the transition stands in the column before.
    told = {event.kind for event in step.events}
    refused = told & {"refused"}
    fired = (step.fired or "").replace(f"{step.state} -> ", "→ ", 1)
    return Row(
        "",
        str(number),
        step.process or "",
        step.machine if step.machine is not None else "(ended)",
        step.state,
        "FAULT" if faulted or "faulted" in told else fired,
        ", ".join([*(_value(s) for s in step.sampled if not _stays_away(s)), *(f"({_value(s)})" for s in step.world)]),
        ", ".join([*(f"{c.variable}: {c.before} → {c.after}" for c in shown), *("refused" for _ in refused)]),
        "",
    )


def _value(s: Sampled) -> str:
    return f"{s.input or s.choice} = {s.text}"


def atom_text(name: str, value: bool) -> str:
    """The atom when it is true, its negation when it is not."""
    if value:
        return name
    return f"!{name}" if all(c.isalnum() or c in "_@." for c in name) else f"!({name})"


def loop_text(trace: Trace) -> str:
    """Where the trace ends or what repeats, in a sentence."""
    if trace.loop is not None:
        first, last = trace.loop + 1, len(trace.steps)
        what = f"step {first} repeats" if first == last else f"steps {first} to {last} repeat"
        return f"{what} forever"
    if trace.fault is not None:
        return f"step {len(trace.steps)} ends the run in a fault"
    if trace.escape and trace.steps:
        return (
            f"the last chance is lost in step {len(trace.steps)}: no run goes on from there and meets the assumptions"
        )
    if trace.escape:
        return "no run goes on from the initial configuration and meets the assumptions"
    if not trace.steps and trace.witness:
        return "already shown in the initial configuration"
    if not trace.steps:
        return "already violated in the initial configuration"
    if trace.witness:
        return f"shown by step {len(trace.steps)}, however the run goes on"
    return f"violated after step {len(trace.steps)}, however the run goes on"


def sentences(trace: Trace) -> list[str]:
    """What is said below the table, without full stops: events, how the trace ends, why the property fails."""
    because = because_text(trace)
    return [*_event_texts(trace), *(text for text in (loop_text(trace), because) if text is not None)]


def _event_texts(trace: Trace) -> Iterator[str]:
    """Each place where something was refused, or a fault unloaded a machine, when it is come to first."""
    told: set[FaultSite] = set()
    for number, step in enumerate(trace.steps, 1):
        for event in step.events:
            if event.site not in told:
                told.add(event.site)
                yield event_text(number, step, event)


def event_text(number: int, step: TraceStep, event: Event) -> str:
    """What was refused in step `number`, or which fault unloaded its machine."""
    what = "something is refused" if event.kind == "refused" else f"a fault unloads `{step.machine}`"
    place = "" if event.site.span is None else f" ({event.site.span})"
    return f"in step {number} {what}: {event.site.message}{place}"


def because_text(trace: Trace) -> str | None:
    """Why the property fails, in a sentence without its full stop; None: the trace does not say."""
    return None if trace.because is None else f"it fails because {trace.because}"

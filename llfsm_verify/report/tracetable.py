"""A trace as the rows of a table: what each step did, stretches in which nothing relevant changed folded to a row."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from llfsm_verify.checking.trace import Change, Sampled, Trace, TraceStep
from llfsm_verify.report.cycles import Times, cycles_text, moments

MARK = "•"
"""Stands before an atom whose value in that letter causes the failure."""

FOLD_FROM = 2
"""So many uneventful steps in a row become one row."""

READ = re.compile(r"\w+\.read\([^()]*\)")
"""An atom that says what one step read, `m.read(car)`; the column of inputs shows what it was."""

OPERATED = re.compile(r"operator\.(\w+)\(")
"""How the name of a choice of an operator begins."""

Mark = Literal["", "first", "inside", "last", "only"]


@dataclass(frozen=True, slots=True)
class Row:
    """One line of the table. `mark` says where the row lies in the loop; the other cells are ready to print."""

    mark: Mark
    step: str
    process: str
    machine: str
    state: str
    fired: str
    inputs: str
    changes: str
    atoms: str
    folded: bool = False
    cycle: str = ""
    time: str = ""
    """Logical time at which the cycle begins. Both are told in the first row of a cycle."""
    begins: bool = False
    """The first step of a cycle is the first one of the row."""


class LastShown:
    """The value of each input that was shown last: an input is shown again where it has another one."""

    def __init__(self, texts: dict[str, str]) -> None:
        self._texts = texts

    def fresh(self, step: TraceStep) -> TraceStep:
        """The step with those inputs alone that are to be shown, which count as shown from now on."""
        sampled = tuple(s for s in step.sampled if self._is_new(s))
        world = tuple(s for s in step.world if self._texts.get(_name(s)) != s.text)
        self._texts.update((_name(s), s.text) for s in step.choices)
        return replace(step, sampled=sampled, world=world, changes=own_changes(step))

    def _is_new(self, read: Sampled) -> bool:
        if OPERATED.match(read.choice):  # an event, also if the same has come before
            return not _stays_away(read)
        return self._texts.get(_name(read)) != read.text

    def over(self, steps: Sequence[TraceStep], still: Collection[str]) -> str:
        """What is to be shown of the inputs in several steps: the value of one that had another before, and which ones
        vary."""
        values: dict[str, set[str]] = {}
        only_world: set[str] = set()
        for step in steps:
            for s in step.choices:
                values.setdefault(_name(s), set()).add(s.text)
            only_world.update(_name(s) for s in step.world)
            only_world.difference_update(_name(s) for s in step.sampled)
        told = []
        for name, texts in values.items():
            text = next(iter(texts)) if len(texts) == 1 else None
            if name in still or OPERATED.match(name) or (text is not None and self._texts.get(name) == text):
                continue
            self._texts.pop(name, None) if text is None else self._texts.update({name: text})
            said = f"{name} varies" if text is None else f"{name} = {text}"
            told.append(f"({said})" if name in only_world else said)
        return ", ".join(told)


def own_changes(step: TraceStep) -> tuple[Change, ...]:
    """The variables that a step changed, without stored inputs, whose new values are among what it read."""
    read = {s.input for s in step.choices}
    return tuple(change for change in step.changes if change.variable not in read)


def rows(trace: Trace, *, fold: bool = True) -> Iterator[Row]:
    """The rows of `trace`, the initial configuration first (step 0; its values are left to the caller).

    An input is shown where it has another value than was shown last; in parentheses where it was only in the
    surroundings, and there not at all where it has one value throughout and is no cause. What models chose is shown
    likewise. Atoms that other columns show already are left out. What causes the failure is never left out, and stands
    after a MARK.
    A step is uneventful when no transition fired, no variable changed and no atom of the property. With `fold`,
    FOLD_FROM or more of them in a row, on one side of the loop's start and with the same causes, become one row that
    says how many there were; and so does all that follows where the property has failed for good.
    """
    return _Table(trace).rows(fold=fold)


class _Table:
    def __init__(self, trace: Trace) -> None:
        self._trace = trace
        self._steps = trace.steps
        self._loop = len(trace.steps) if trace.loop is None else trace.loop
        self._causal = _read_by_causes(trace)
        self._still = _still(trace) - self._causal
        self._moments = moments(trace.steps)
        self._times = Times.until(trace.period, max((m.cycle for m in self._moments), default=1))
        self._ran = {f"{step.machine}.ran" for step in trace.steps}
        self._inputs = {s.input for step in trace.steps for s in step.choices if s.input}
        self._changed = [self._atoms(step, before) for step, before in zip(trace.steps, self._before(), strict=True)]
        bits = {name: str(value).lower() for name, value in trace.initial_atoms if name in self._inputs}
        self._shown = LastShown({**dict(trace.initial), **bits})
        self._told = 0

    def rows(self, *, fold: bool) -> Iterator[Row]:
        yield self._first()
        failed = self._trace.failed_at
        end = len(self._steps) if failed is None or not fold else failed
        quiet: list[int] = []
        eventful = list(self._eventful())
        for index in range(end):
            breaks = index == self._loop or self._marks_differ(quiet, index)
            if not fold or eventful[index] or breaks:
                yield from self._flush(quiet)
                quiet = []
            if fold and not eventful[index]:
                quiet.append(index)
            else:
                yield self._row(index)
        yield from self._flush(quiet)
        if len(self._steps) - end >= FOLD_FROM:
            rest = range(end, len(self._steps))
            yield self._folded(rest, f"{len(rest):,} steps after the violation", "")
        else:
            yield from (self._row(index) for index in range(end, len(self._steps)))

    def _before(self) -> Iterator[dict[str, bool]]:
        """The atoms before each step, as the letters until then have them."""
        known = dict(self._trace.initial_atoms)
        for step in self._steps:
            yield dict(known)
            known.update(step.atoms)

    def _atoms(self, step: TraceStep, before: dict[str, bool]) -> frozenset[str]:
        """The atoms that changed, without those that other columns show."""
        changed = {name for name, value in step.atoms if before.get(name) != value}
        return frozenset(n for n in changed - self._inputs - self._ran if not READ.fullmatch(n))

    def _eventful(self) -> Iterator[bool]:
        asked = {name for name, _ in self._trace.initial_atoms} & self._inputs
        if self._trace.because is not None:
            asked &= self._causal  # the others stand in assumptions, or do not matter
        last = {name: str(value).lower() for name, value in self._trace.initial_atoms if name in asked}
        for index, (step, changed) in enumerate(zip(self._steps, self._changed, strict=True)):
            read = {s.input: s.text for s in step.choices if s.input in asked}
            faults = self._trace.fault is not None and index == len(self._steps) - 1
            new = any(last.get(name) != text for name, text in read.items())
            last.update(read)
            yield bool(step.fired or own_changes(step) or step.events or changed or new or faults)

    def _flush(self, quiet: Sequence[int]) -> Iterator[Row]:
        if len(quiet) < FOLD_FROM:
            yield from map(self._row, quiet)
        else:
            marks = next((self._marks(i) for i in quiet if self._steps[i].observed), "")
            yield self._folded(quiet, f"{len(quiet):,} steps without an event", marks)

    def _folded(self, indices: Sequence[int], text: str, marks: str) -> Row:
        first, last = indices[0], indices[-1]
        steps = [self._steps[i] for i in indices]
        names = list(dict.fromkeys(step.machine or "(ended)" for step in steps))
        machines = ", ".join(names) if len(names) <= 4 else f"{len(names)} machines"
        cycle, time = self._when(first, last)
        inputs = self._shown.over(steps, self._still)
        return Row(
            self._mark(first, last), f"{first + 1}–{last + 1}", "", machines, "", text, inputs, "", marks, folded=True,
            cycle=cycle, time=time, begins=self._moments[first].begins,
        )  # fmt: skip

    def _row(self, index: int) -> Row:
        step = self._steps[index]
        faulted = self._trace.fault is not None and index == len(self._steps) - 1
        fresh = self._shown.fresh(replace(step, world=tuple(s for s in step.world if s.input not in self._still)))
        marked = {cause.atom for cause in step.causes}
        shown = [(name, value) for name, value in step.atoms if name in self._changed[index] or name in marked]
        cycle, time = self._when(index, index)
        return replace(
            step_row(index + 1, fresh, faulted=faulted),
            mark=self._mark(index, index), atoms=_atoms(shown, marked), cycle=cycle, time=time,
            begins=self._moments[index].begins,
        )  # fmt: skip

    def _when(self, first: int, last: int) -> tuple[str, str]:
        """The cycles and times of these steps; nothing where the last row has said them."""
        (begin, begins), (end, _) = self._moments[first], self._moments[last]
        several = len({step.process for step in self._steps[first : last + 1]} - {None}) > 1
        if several or (begin == end and not begins):
            return "", ""
        return cycles_text(begin, end), self._times.of(begin, end)

    def _marks_differ(self, quiet: Sequence[int], index: int) -> bool:
        """The step has other causes than those; steps inside a cycle that is observed as a whole have none to tell."""
        if not self._steps[index].observed:
            return False
        last = next((i for i in reversed(quiet) if self._steps[i].observed), None)
        return last is not None and self._marks(last) != self._marks(index)

    def _marks(self, index: int) -> str:
        """The causes in a step in which nothing changed."""
        marked = {cause.atom for cause in self._steps[index].causes}
        return _atoms([(name, value) for name, value in self._steps[index].atoms if name in marked], marked)

    def _mark(self, first: int, last: int) -> Mark:
        if first < self._loop:
            return ""
        if first == self._loop:
            return "only" if last == len(self._steps) - 1 else "first"
        return "last" if last == len(self._steps) - 1 else "inside"

    def _first(self) -> Row:
        marked = {cause.atom for cause in self._trace.initial_causes}
        shown = [(name, value) for name, value in self._trace.initial_atoms if name not in self._ran or name in marked]
        return Row("", "0", "", "", "", "initially", "", "", _atoms(shown, marked))


def _name(read: Sampled) -> str:
    return read.input or read.choice


def _stays_away(read: Sampled) -> bool:
    """An operator who may act does not."""
    operated = OPERATED.match(read.choice)
    return operated is not None and operated[1] != "value" and read.text == "false"


def _read_by_causes(trace: Trace) -> frozenset[str]:
    """The variables and inputs that the causes of a failure read."""
    causes = (*trace.initial_causes, *(cause for step in trace.steps for cause in step.causes))
    return frozenset(name for cause in causes for name, _ in cause.variables)


def _still(trace: Trace) -> frozenset[str]:
    """The inputs that have one value in the whole trace."""
    values: dict[str, set[str]] = {}
    for step in trace.steps:
        for s in step.choices:
            values.setdefault(s.input, set()).add(s.text)
    return frozenset(name for name, texts in values.items() if len(texts) == 1)


def _atoms(shown: Sequence[tuple[str, bool]], marked: Collection[str]) -> str:
    return ", ".join(f"{MARK if name in marked else ''}{atom_text(name, value)}" for name, value in shown)


def initial_text(trace: Trace) -> str:
    """The first configuration in one line."""
    return ", ".join(f"{name} = {text}" for name, text in trace.initial)


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

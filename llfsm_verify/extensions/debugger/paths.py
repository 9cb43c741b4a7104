"""Where the steps of a debugger come from besides recordings: inputs set by hand, or a saved trace."""

from __future__ import annotations

import random
from typing import Protocol

from llfsm_verify.plug import (
    ANEW,
    Choice,
    DebugError,
    Drawing,
    Draws,
    Execution,
    Move,
    NextStep,
    Program,
    Schedule,
    ValueProblem,
    choice_value,
    free_inputs,
    unknown_input,
    value_text,
)  # fmt: skip


class StepPath(Protocol):
    """Gives the steps of a run one after the other."""

    kind: str
    """What users call it."""

    def next(self, record: bytes, number: int) -> NextStep | str:
        """The step `number` (from 1), which leads on from `record`; or why the path has no more. DebugError."""


class Free:
    """Inputs keep the values that they are given, at first their `init`; processes take turns.

    With a seed, who steps is drawn, and so is all that was not set, by `law`. Otherwise what else a turn chooses
    (ages, `choose`) has its lowest value until it is set.
    """

    kind = "arrangement"

    def __init__(self, execution: Execution, seed: int | None = None, law: Drawing = ANEW) -> None:
        self._execution = execution
        self.program = execution.program
        self._random = None if seed is None else random.Random(seed)  # noqa: S311 - a reproducible sequence is wanted
        self._draws = Draws(law, len(self.program.slots))
        self.settable = _settable(self.program)
        """By the names of users: what can be set."""
        self.held: dict[str, int] = {}
        """By the names of `settable`: what was set."""
        self.turn: int | None = None
        """The process that takes the next step, if that was said."""
        self.last: int | None = None
        """The process that took the last step."""
        self._inits = _inits(self.program)

    def set(self, name: str, text: str) -> None:
        """Give an input or a choice a value, from the next step on. DebugError: there is no such input or value."""
        choice = self._known(name)
        try:
            self.held[name] = choice_value(choice, text)
        except ValueProblem as problem:
            raise DebugError(f"{name}: {problem}") from None

    def release(self, name: str) -> None:
        """Take back what was set."""
        self._known(name)
        self.held.pop(name, None)

    def _known(self, name: str) -> Choice:
        if name not in self.settable:
            if any(v.name == name and v.origin.kind == "input" for v in self.program.vars):
                raise DebugError(unknown_input(self.program, name))
            known = ", ".join(self.settable) or "none"
            raise DebugError(f"there is no input `{name[:60]}`; what can be set: {known}")
        return self.settable[name]

    def value(self, name: str) -> str:
        """The text of what an input or a choice will be in the next step."""
        choice = self.settable[name]
        if name in self.held:
            return value_text(choice.type, choice.labels, self.held[name])
        if self._random is not None:
            return "drawn"
        return value_text(choice.type, choice.labels, self._inits[name])

    def next(self, record: bytes, number: int) -> NextStep | str:  # noqa: ARG002 - steps have no numbers here
        enabled = self._execution.enabled(record)
        if not enabled:
            return "the arrangement has ended"
        if self.turn is not None and self.turn not in enabled:
            name = self.program.processes[self.turn].name
            raise DebugError(f"process `{name}` has ended; `turn` names another one")
        given = self.held
        values = {name: given.get(name, self._inits[name]) for name in self.settable}
        if self._random is not None:
            left = {choice.name: name for name, choice in self.settable.items() if name not in given}
            drawn = self._draws.next([self.settable[name] for name in left.values()], self._random)
            values |= {left[name]: value for name, value in drawn.items()}
        choices = {c.name: values[c.source] for c in self.program.choices}
        for name, value in values.items():
            choices.setdefault(name, value)  # inputs that only formulas read
        return NextStep(Move(self._process(enabled), choices))

    def _process(self, enabled: list[int]) -> int:
        if self.turn is not None:
            process, self.turn = self.turn, None
            return process
        if self._random is not None:
            return self._random.choice(enabled)
        count, after = len(self.program.processes), 0 if self.last is None else self.last + 1
        return min(enabled, key=lambda p: (p - after) % count)


def _settable(program: Program) -> dict[str, Choice]:
    found: dict[str, Choice] = {}
    for choice in program.choices:
        found.setdefault(choice.source, choice)
    for one in program.inputs:
        found.setdefault(one.name, Choice(one.name, one.type, "input", one.name, one.labels))
    return found


def _inits(program: Program) -> dict[str, int]:
    inits: dict[str, int] = {i.name: i.init for i in program.inputs}
    for var in program.vars:
        if var.origin.kind == "input" and isinstance(var.init, int):
            inits.setdefault(var.name, var.init)
    for choice in program.choices:
        inits.setdefault(choice.source, choice.type.low)
    return inits


def free_value(program: Program, name: str, text: str) -> int | None:
    """The value of an input that never changes and has no `init`; None: there is no such input. DebugError."""
    choice = free_inputs(program).get(name)
    if choice is None:
        return None
    try:
        return choice_value(choice, text)
    except ValueProblem as problem:
        raise DebugError(f"{name}: {problem}") from None


class Traced:
    """The steps of a saved trace; those of its loop again and again."""

    kind = "trace"

    def __init__(self, schedule: Schedule, *, fails: bool) -> None:
        self._schedule = schedule
        self._fails = fails

    def next(self, record: bytes, number: int) -> NextStep | str:  # noqa: ARG002 - a path of its own needs no record
        moves, loop = self._schedule.ringlets, self._schedule.loop
        at = number - 1
        if at >= len(moves):
            if loop is None:
                return "the trace ends here"
            at = loop + (at - loop) % (len(moves) - loop)
        return NextStep(moves[at], None, self._fails and at == len(moves) - 1)

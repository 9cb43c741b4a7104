"""A recorded run: which process steps, and every input that is not held at a value, is drawn at random."""

from __future__ import annotations

import random
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.replay.confirm import Letter, Misfit, Schedule, atoms_of, first_letter
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.checking.trace import TraceStep
from llfsm_verify.limits import DEFAULT_STEPS
from llfsm_verify.logic.formula import Formula
from llfsm_verify.logic.word import truth
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Choice, FaultSite, Program
from llfsm_verify.runtime.stepping.drawing import (
    ANEW,
    Drawing,
    Draws,
    drawable,
    free_inputs,
    free_values,
    unknown_input,
)
from llfsm_verify.runtime.stepping.visited import Visits
from llfsm_verify.values import ValueProblem, choice_value

Values = Mapping[str, str]
"""Texts of values by inputs."""


@dataclass(frozen=True, slots=True)
class Script:
    """The inputs that hold from a step on (counted from 1; 0: from the start), and from a logical time on, in
    milliseconds."""

    steps: Mapping[int, Values] = field(default_factory=dict)
    times: Mapping[Fraction, Values] = field(default_factory=dict)


class RandomRun:
    """One run: which process steps and every choice that is not made is random.

    It ends where the state formula `until` is true. `drawn` are the choices to draw, in this order; others that the
    program has (since a formula looks at them) are drawn beside, so that a formula does not change the run. `law` says
    how often, and with which probabilities. With a `seed`, inputs that never change are drawn from it.
    """

    def __init__(
        self,
        execution: Execution,
        script: Script,
        source: random.Random,
        *,
        until: Formula | None = None,
        drawn: Sequence[str] | None = None,
        law: Drawing = ANEW,
        seed: int | None = None,
    ) -> None:
        self._execution = execution
        self._script = script
        self._random = source
        self._beside = random.Random()  # noqa: S311 - no secrets
        self._beside.setstate(source.getstate())
        choices = execution.program.choices
        order = [c.name for c in choices] if drawn is None else drawn
        by_name = {c.name: c for c in choices}
        self._drawn = [by_name[name] for name in order if name in by_name]
        self._others = [c for c in choices if c.name not in set(order)]
        self._draws = Draws(law, len(execution.program.slots))
        self._until = until
        first = {**script.steps.get(0, {}), **script.times.get(Fraction(0), {})}
        self.free = tuple(free_values(execution.program, first, law, seed).items())
        """The values of inputs that never change and have no `init`."""
        self._record = execution.start(self.free)
        self.visits = Visits(execution.program, execution.layout)
        self.visits.see(self._record)
        self._inputs: dict[str, str] = {}
        self._waiting = sorted(script.times)
        self._cycles: dict[int, int] = {}
        self._letter: Letter = frozenset()
        self.initial = execution.shown(self._record)
        self.before: tuple[TraceStep, ...] = ()
        """The steps of a run from whose end on this one goes."""
        self.move: Move | None = None
        """The last one, with the choices that it read."""
        self.fault: FaultSite | None = None
        self.overflowed = False
        self.ended = False
        self._begin(Schedule(self.free, (), None))

    def _begin(self, schedule: Schedule) -> None:
        """Stand at the beginning of a schedule, where what is looked for may leave 64 bits."""
        self.free = schedule.free
        self._record = self._execution.start(schedule.free)
        try:
            self._letter = frozenset() if self._until is None else first_letter(self._execution, schedule)
        except OverflowError:
            self.overflowed = True

    @property
    def reached(self) -> bool:
        """What is looked for is true now."""
        return self._until is not None and not self.overflowed and truth(self._until, self._letter)

    def follow(self, schedule: Schedule) -> None:
        """Begin where this run ends: its loop is taken once, and a step that ends in a fault not at all. Misfit: the
        program cannot follow it."""
        self._begin(schedule)
        unknown, self.overflowed = self.overflowed, False
        steps: list[TraceStep] = []
        for move in schedule.ringlets:
            enabled = self._execution.enabled(self._record)
            if move.process is None and not enabled:
                break
            if move.process not in enabled:
                raise Misfit(f"step {len(steps) + 1} is one of a process that cannot step there")
            step = self._take(move, complete=True)
            if self.fault is not None or self.overflowed:
                self.fault, self.overflowed = None, False
                break
            steps.append(step)
        self.overflowed = unknown and not any(step.observed for step in steps)
        self.before = tuple(steps)
        self.initial = self._execution.shown(self._record)

    def steps(self, steps: int | None, cycles: int | None) -> Iterator[TraceStep]:
        """Until there were `steps` ringlets or `cycles` cycles more, or the run ended."""
        if self.overflowed:
            return
        number = done = 0
        self._inputs.update(self._script.steps.get(0, {}))
        limit = steps if steps is not None or cycles is not None else DEFAULT_STEPS
        while not self.reached and (limit is None or number < limit) and (cycles is None or done < cycles):
            enabled = self._execution.enabled(self._record)
            if not enabled:
                self.ended = True
                return
            number += 1
            process = self._random.choice(enabled)
            self._set(len(self.before) + number, process)
            choices = self._choices(self._drawn, self._random) | self._choices(self._others, self._beside)
            step = self._take(Move(process, choices))
            yield step
            if self.fault is not None or self.overflowed:
                return
            done += step.cycle

    def _set(self, number: int, process: int) -> None:
        """The inputs that the script has for a step."""
        period = self._execution.program.period
        while period is not None and self._waiting and self._waiting[0] <= self._cycles.get(process, 0) * period:
            self._inputs.update(self._script.times[self._waiting.pop(0)])
        self._inputs.update(self._script.steps.get(number, {}))

    def _take(self, move: Move, *, complete: bool = False) -> TraceStep:
        """Take a step. Misfit: it reads a choice that the move does not give, which shall be `complete`."""
        program, before = self._execution.program, self._record
        result = self._execution.step(before, move)
        for name in [program.choices[number].name for number, _ in result.samples[: result.read]] if complete else ():
            if name not in move.choices:
                raise Misfit(f"a step reads `{name}`, which the run does not give", name)
        step = self._execution.describe(before, move, result, ())
        read = {program.choices[number].name for number, _ in result.samples}
        self.move = Move(move.process, {name: value for name, value in move.choices.items() if name in read})
        if result.status > 0:
            self.fault = program.faults[result.status - 1]
        elif result.status < 0:
            self.overflowed = True
        else:
            self._record = result.record
            self.visits.see(self._record)
            assert move.process is not None, "an arrangement that has ended takes no step"
            self._cycles[move.process] = self._cycles.get(move.process, 0) + step.cycle
            if step.observed and self._until is not None:
                self._letter = atoms_of(self._execution, result.record)
        return step

    def _choices(self, choices: Sequence[Choice], source: random.Random) -> dict[str, int]:
        texts = {c.name: self._inputs.get(c.source) if c.kind != "age" else None for c in choices}
        drawn = self._draws.next([c for c in choices if texts[c.name] is None], source)
        return {c.name: drawn[c.name] if (text := texts[c.name]) is None else choice_value(c, text) for c in choices}


@dataclass(slots=True)
class Simulated:
    """A run that is made while it is reported, and how far it goes."""

    arrangement: Arrangement
    program: Program
    run: RandomRun
    seed: int
    begin: bool
    """Whether it goes on with a saved trace, or begins."""
    held: Mapping[str, str]
    """Inputs that are held at the texts of values."""
    sought: str | None
    steps: int | None
    cycles: int | None
    taken: int = 0
    """Steps so far."""

    def turns(self) -> Iterator[TraceStep]:
        """Its steps, each when it is taken."""
        for step in self.run.steps(self.steps, self.cycles):
            self.taken += 1
            yield step


def input_problem(program: Program, inputs: Mapping[str, str], *, later: bool = False) -> str | None:
    """Why these inputs cannot be given at the beginning, or `later`; None: they can."""
    choices = drawable(program) | ({} if later else free_inputs(program))
    for name, text in inputs.items():
        if name not in choices:
            return unknown_input(program, name)
        try:
            choice_value(choices[name], text)
        except ValueProblem as problem:
            return f"{name}: {problem}"
    return None

"""A recorded run: which process steps, and every input that nobody holds at a value, is drawn at random."""

from __future__ import annotations

import random
from collections.abc import Iterator, Mapping

from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.checking.trace import TraceStep
from llfsm_verify.checking.values import ValueProblem, choice_value
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Choice, FaultSite, Program

DEFAULT_STEPS = 20

Script = Mapping[int, Mapping[str, str]]
"""From step (from 1) to the inputs that hold from then on, as text."""


class RandomRun:
    """One run: which process steps and every choice that nobody made is random."""

    def __init__(self, execution: Execution, script: Script, source: random.Random) -> None:
        self._execution = execution
        self._script = script
        self._random = source
        self._record = execution.start()
        self._inputs: dict[str, str] = {}
        self.initial = execution.shown(self._record)
        self.fault: FaultSite | None = None
        self.overflowed = False
        self.ended = False

    def steps(self, steps: int | None, cycles: int | None) -> Iterator[TraceStep]:
        """Until there were `steps` ringlets or `cycles` cycles, or the run ended."""
        number = done = 0
        self._inputs.update(self._script.get(0, {}))
        limit = steps if steps is not None or cycles is not None else DEFAULT_STEPS
        while (limit is None or number < limit) and (cycles is None or done < cycles):
            enabled = self._execution.enabled(self._record)
            if not enabled:
                self.ended = True
                return
            number += 1
            self._inputs.update(self._script.get(number, {}))
            step = self._step(self._random.choice(enabled))
            yield step
            if self.fault is not None or self.overflowed:
                return
            done += step.cycle

    def _step(self, process: int) -> TraceStep:
        program = self._execution.program
        move = Move(process, {choice.name: self._choose(choice) for choice in program.choices})
        result = self._execution.step(self._record, move)
        step = self._execution.describe(self._record, move, result, ())
        if result.status > 0:
            self.fault = program.faults[result.status - 1]
        elif result.status < 0:
            self.overflowed = True
        else:
            self._record = result.record
        return step

    def _choose(self, choice: Choice) -> int:
        text = self._inputs.get(choice.source) if choice.kind != "age" else None
        if text is not None:
            return choice_value(choice, text)
        return self._random.randint(choice.type.low, choice.type.high)


def input_problem(program: Program, inputs: Mapping[str, str]) -> str | None:
    """Why these inputs cannot be given, or None."""
    choices = {choice.source: choice for choice in program.choices if choice.kind != "age"}
    written = {v.name for v in program.vars if v.origin.kind == "input"}
    for name, text in inputs.items():
        if name not in choices and name in written and any(choice.kind == "choose" for choice in program.choices):
            known = ", ".join(c.name for c in program.choices if c.kind == "choose")
            return f"`{name}` is written by the model of the surroundings; what it chooses can be set: {known}"
        if name not in choices:
            known = ", ".join(choices) or "none that a step reads"
            return f"`{name}` is not an input of the arrangement; inputs: {known}"
        try:
            choice_value(choices[name], text)
        except ValueProblem as problem:
            return f"{name}: {problem}"
    return None

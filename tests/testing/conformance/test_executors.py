"""The suite for executors: it passes ours, and fails each of those that are wrong on purpose, in a case with a name."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import pytest

from llfsm_verify.backends.native.code import OVERFLOW
from llfsm_verify.program.program import Program
from llfsm_verify.testing.conformance import Native, Reference, Step, check_executor, executor_cases
from llfsm_verify.values import Value
from tests.quick import examples


@pytest.mark.slow
@pytest.mark.parametrize("executor", [Native, Reference])
def test_our_executors_pass(executor: type) -> None:
    assert [o for o in check_executor(executor, drawn=examples(40)) if not o.passed] == []


class NeverFaults(Reference):
    def step(self, state: object, process: int | None, choices: Mapping[str, int]) -> Step:
        step = super().step(state, process, choices)
        return replace(step, status=0) if step.status > 0 else step


class NeverOverflows(Reference):
    def step(self, state: object, process: int | None, choices: Mapping[str, int]) -> Step:
        step = super().step(state, process, choices)
        return replace(step, status=0) if step.status == OVERFLOW else step


class NumbersFaultsFromZero(Reference):
    def step(self, state: object, process: int | None, choices: Mapping[str, int]) -> Step:
        step = super().step(state, process, choices)
        return replace(step, status=step.status - 1) if step.status > 1 else step


class ResetsOutputsInACycle(Reference):
    def __init__(self, program: Program) -> None:
        super().__init__(program)
        self._fresh = self.first({}).outputs

    def step(self, state: object, process: int | None, choices: Mapping[str, int]) -> Step:
        return super().step(replace(state, outputs=self._fresh), process, choices)


class KeepsOutputsAfterTheEnd(Reference):
    def step(self, state: object, process: int | None, choices: Mapping[str, int]) -> Step:
        step = super().step(state, process, choices)
        return step if process is not None else replace(step, state=state)


class IgnoresChoices(Reference):
    def step(self, state: object, process: int | None, choices: Mapping[str, int]) -> Step:
        return super().step(state, process, {})


class IgnoresFreeValues(Reference):
    def first(self, free: Mapping[str, Value]) -> object:
        return super().first({})


class RefusesNothing(Reference):
    def step(self, state: object, process: int | None, choices: Mapping[str, int]) -> Step:
        try:
            return super().step(state, process, choices)
        except ValueError:
            return Step(state, 0, (), ())


class SwapsSamples(Reference):
    def step(self, state: object, process: int | None, choices: Mapping[str, int]) -> Step:
        step = super().step(state, process, choices)
        return replace(step, samples=step.samples[::-1])


class TellsNoEvents(Reference):
    def step(self, state: object, process: int | None, choices: Mapping[str, int]) -> Step:
        return replace(super().step(state, process, choices), events=())


class ForgetsTheLastStep(Reference):
    def steps(self, state: object) -> Iterator[tuple[int | None, Step]]:
        *found, _ = super().steps(state)
        yield from found


class LeavesNoProcessOut(Reference):
    def enabled(self, state: object) -> Sequence[int]:
        return range(len(self._program.processes))


WRONG = {
    NeverFaults: ("a range that is left", "step 3 shows `n == 2` instead of `!F001`"),
    NeverOverflows: ("64 bits", "step 17 shows `n > 0` instead of `!64`"),
    NumbersFaultsFromZero: ("an index outside", "instead of `!F003`"),
    ResetsOutputsInACycle: ("a cycle", "step 2 shows"),
    KeepsOutputsAfterTheEnd: ("the end", "step 3 shows"),
    IgnoresChoices: ("an input", "step 1 shows"),
    IgnoresFreeValues: ("free values", "step 1 shows"),
    RefusesNothing: ("refused steps", "a stutter before the end is not refused"),
    SwapsSamples: ("random", "is another one"),
    TellsNoEvents: ("random", "is another one"),
    ForgetsTheLastStep: ("random", "that are possible before step"),
    LeavesNoProcessOut: ("random", "are enabled instead of"),
}
"""Of each wrong executor the case that catches it (`random`: one of them), and something of what is said then."""


@pytest.mark.slow
@pytest.mark.parametrize("executor", WRONG)
def test_a_wrong_executor_fails(executor: type) -> None:
    name, says = WRONG[executor]
    found = [case() for case in executor_cases(executor) if case.name.startswith(name)]
    wrong = [o.wrong for o in found if not o.passed]
    assert wrong and all(says in w for w in wrong), wrong

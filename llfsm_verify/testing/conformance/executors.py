"""The suite for executors of step programs: schedules with known letters and faults, and random programs."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice
from typing import Generic, Protocol, TypeVar

from llfsm_verify.backends.native.code import OVERFLOW
from llfsm_verify.backends.native.executor import NativeProgram, StepResult
from llfsm_verify.backends.reference import Event, Interpreter
from llfsm_verify.backends.reference import Outcome as Interpreted
from llfsm_verify.program.program import Choice, Program
from llfsm_verify.testing.conformance.known import RUNS, Run
from llfsm_verify.testing.conformance.outcome import PATIENCE, Case, Outcome, Wrong, demand_hypothesis, outcomes_of
from llfsm_verify.values import Value

S = TypeVar("S")
T = TypeVar("T")

DRAWN, SEED = 40, 1
"""Random programs, and the seed from which they are drawn."""
WALKS, STEPS, FANS = 3, 12, 64
"""Walks through each, their steps, and the successors of a state that are compared."""


@dataclass(frozen=True, slots=True)
class Step(Generic[S]):
    """One step. `status` 0: done; 1 + the number of a fault; OVERFLOW. Unless it is 0, `state` is the one before."""

    state: S
    status: int
    samples: tuple[tuple[str, int], ...]
    """Names and values of the choices, in the order of first reading."""
    events: tuple[Event, ...]


class Executor(Protocol[S]):
    """What runs one step program, as `program.program` says. A state has the values of variables and outputs."""

    def first(self, free: Mapping[str, Value]) -> S:
        """The initial state in which free variables have these values, else their `init`."""
        ...

    def enabled(self, state: S) -> Sequence[int]:
        """The processes that may step."""
        ...

    def step(self, state: S, process: int | None, choices: Mapping[str, int]) -> Step[S]:
        """One step, None: the stutter. A choice that is not given has its lowest value. ValueError: it is not enabled,
        or a value is outside its type."""
        ...

    def steps(self, state: S) -> Iterable[tuple[int | None, Step[S]]]:
        """Every step: process by process, and for each all choices that it reads, the one read last changing first."""
        ...

    def values(self, state: S) -> Mapping[str, Value]:
        """Of the variables, by name."""
        ...

    def outputs(self, state: S) -> Mapping[str, Value]:
        """Of the outputs, by name."""
        ...


class Native:
    """Machine code (`backends.native`)."""

    def __init__(self, program: Program) -> None:
        self._native = NativeProgram(program, events=True)
        self._quiet = NativeProgram(program)

    def first(self, free: Mapping[str, Value]) -> bytes:
        return self._native.layout.first(free)

    def enabled(self, state: bytes) -> Sequence[int]:
        return self._native.enabled(state)

    def step(self, state: bytes, process: int | None, choices: Mapping[str, int]) -> Step[bytes]:
        return self._step(self._native.step(state, process, choices))

    def _step(self, result: StepResult) -> Step[bytes]:
        names = self._native.program.choices
        samples = tuple((names[number].name, value) for number, value in result.samples)
        return Step(result.record, result.status, samples, result.events)

    def steps(self, state: bytes) -> Iterator[tuple[int | None, Step[bytes]]]:
        for edge in self._quiet.successors(state):
            record = edge.record if edge.status == 0 else state
            step = self._step(StepResult(edge.status, record, edge.samples, (), len(edge.samples)))
            yield None if edge.process < 0 else edge.process, step

    def values(self, state: bytes) -> Mapping[str, Value]:
        return self._native.layout.decode(state)

    def outputs(self, state: bytes) -> Mapping[str, Value]:
        return self._native.layout.decode_outputs(state)


@dataclass(frozen=True, slots=True)
class _State:
    values: dict[str, Value]
    outputs: dict[str, Value]


class Reference:
    """Plain Python (`backends.reference`)."""

    def __init__(self, program: Program) -> None:
        self._interpreter = Interpreter(program)
        self._program = program

    def first(self, free: Mapping[str, Value]) -> _State:
        inits = {v.name: v.init for v in self._program.vars}
        outputs = {v.name: v.init for v in self._program.vars if v.output} | {self._program.cycle: 1}
        return _State({n: v for n, v in {**inits, **free}.items() if n not in outputs}, outputs)

    def enabled(self, state: _State) -> Sequence[int]:
        return self._interpreter.enabled(state.values)

    def step(self, state: _State, process: int | None, choices: Mapping[str, int]) -> Step[_State]:
        def choose(choice: Choice) -> int:
            return choices.get(choice.name, choice.type.low)

        return self._step(self._interpreter.step(state.values, state.outputs, process, choose))

    def _step(self, outcome: Interpreted) -> Step[_State]:
        status = OVERFLOW if outcome.overflow else 0 if outcome.fault is None else outcome.fault + 1
        return Step(_State(outcome.values, outcome.outputs), status, outcome.samples, outcome.events)

    def steps(self, state: _State) -> Iterator[tuple[int | None, Step[_State]]]:
        for process, outcome in self._interpreter.successors(state.values, state.outputs):
            yield process, self._step(outcome)

    def values(self, state: _State) -> Mapping[str, Value]:
        return state.values

    def outputs(self, state: _State) -> Mapping[str, Value]:
        return state.outputs


Make = Callable[[Program], Executor[S]]
"""Makes the executor of a program."""


def check_executor(make: Make[S], *, drawn: int = DRAWN, seed: int = SEED) -> list[Outcome]:
    """The outcome of each case for an executor. `drawn` random programs come from `seed`."""
    return outcomes_of(executor_cases(make, drawn=drawn, seed=seed))


def executor_cases(make: Make[S], *, drawn: int = DRAWN, seed: int = SEED) -> list[Case]:
    """The cases of `check_executor`, to be called one by one; their names are different."""
    if drawn:
        demand_hypothesis()
    cases = [Case(run.name, run.about, partial(_perform, make, run), PATIENCE) for run in RUNS]
    cases.append(Case("refused steps", "a step that is not enabled is refused", partial(_refuses, make), PATIENCE))
    about = "every step of a random program is what plain Python does, or machine code where that is looked at"
    return cases + [
        Case(f"random {i + 1}", about, partial(_random, make, i, drawn, seed), PATIENCE) for i in range(drawn)
    ]


# ---------------------------------------------------------------- schedules with known letters


def _perform(make: Make[S], run: Run) -> None:
    program = run.program()
    executor = make(program)
    state = executor.first(dict(run.free))
    for number, (process, inputs, shown) in enumerate(run.steps, 1):
        before = executor.values(state)
        choices = {c.name: inputs[c.input] for c in program.choices if c.input in inputs}
        step = executor.step(state, process, choices)
        found = _shown(executor, program, step)
        wanted = "; ".join(sorted(shown.split("; "))) if shown else ""
        if found != wanted:
            raise Wrong(f"step {number} shows `{found}` instead of `{wanted}`")
        state = step.state
        if step.status and executor.values(state) != before:
            raise Wrong(f"step {number} fails, and yet changes variables")


def _shown(executor: Executor[S], program: Program, step: Step[S]) -> str:
    """What a step shows, as `Run.steps` write it."""
    if step.status == OVERFLOW:
        return "!64"
    if step.status:
        return f"!{program.faults[step.status - 1].code}"
    outputs = executor.outputs(step.state)
    return "; ".join(sorted(atom.name for atom in program.atoms if outputs[atom.output]))


def _refuses(make: Make[S]) -> None:
    program = RUNS[0].program()
    executor = make(program)
    first = executor.first({})
    (choice,) = program.choices
    for process, choices, what in ((None, {}, "a stutter before the end"), (0, {choice.name: 2}, "2 as a Boolean")):
        try:
            executor.step(first, process, choices)
        except ValueError:
            continue
        raise Wrong(f"{what} is not refused")


# ---------------------------------------------------------------- random programs


def _random(make: Make[S], number: int, of: int, seed: int) -> None:
    from llfsm_verify.testing.conformance.drawn import step_programs

    program = step_programs(of, seed)[number]
    chance = random.Random(seed)  # noqa: S311 - no secrets here
    made: object = make
    if made is Reference:  # which is not compared with itself
        _compare(make(program), Native(program), program, chance)
    else:
        _compare(make(program), Reference(program), program, chance)


def _compare(mine: Executor[S], other: Executor[T], program: Program, chance: random.Random) -> None:
    """Raises Wrong for the first step that is not the same."""
    for _ in range(WALKS):
        state, beside = mine.first({}), other.first({})
        for number in range(1, STEPS + 1):
            live, wanted_live = list(mine.enabled(state)), list(other.enabled(beside))
            if live != wanted_live:
                raise Wrong(f"before step {number} the processes {live} are enabled instead of {wanted_live}")
            fan = [(p, *_contents(mine, step)[:-1]) for p, step in islice(mine.steps(state), FANS)]
            wanted_fan = [(p, *_contents(other, step)[:-1]) for p, step in islice(other.steps(beside), FANS)]
            if fan != wanted_fan:
                raise Wrong(f"the {len(fan)} steps that are possible before step {number} are others: {fan}")
            process = chance.choice(live or [None])
            choices = {c.name: chance.randint(c.type.low, c.type.high) for c in program.choices}
            step, wanted = mine.step(state, process, choices), other.step(beside, process, choices)
            contents, wanted_contents = _contents(mine, step), _contents(other, wanted)
            if contents != wanted_contents:
                raise Wrong(f"step {number} is another one: {contents} instead of {wanted_contents}")
            if step.status:
                break
            state, beside = step.state, wanted.state


def _contents(executor: Executor[S], step: Step[S]) -> tuple[object, ...]:
    """What a step came to, to be compared."""
    state = (dict(executor.values(step.state)), dict(executor.outputs(step.state))) if not step.status else ()
    return step.status, state, step.samples, step.events

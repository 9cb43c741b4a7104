"""How an arrangement is going to run: its program, its cycles, its inputs.

What a simulation has and the world has not is left out, or refused.
"""

from __future__ import annotations

from collections.abc import Collection, Container, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from types import MappingProxyType

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.monitors import decidable
from llfsm_verify.checking.problem import bind
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.monitoring.states import Monitor
from llfsm_verify.program.program import Program
from llfsm_verify.runtime.live import IMPOSSIBLE, UNREPEATABLE
from llfsm_verify.runtime.live.loop import LiveCode, Loop, Prescribed
from llfsm_verify.runtime.stepping.drawing import ANEW, Drawing, free_values
from llfsm_verify.runtime.stepping.random_run import input_problem
from llfsm_verify.semantics.operators import OPERATOR
from llfsm_verify.semantics.storage import leaf_values, leaves
from llfsm_verify.values import Value, choice_value


def runnable(arrangement: Arrangement, *, simulated: bool, cycle_ms: Fraction | None = None) -> Arrangement:
    """The arrangement as it runs: in the real surroundings without the model of them.

    `cycle_ms`: how long a cycle takes where the arrangement is untimed, which is one of the timings that it is verified
    for. DiagnosticError (E483): a machine stands for something else, or nothing says how long a cycle takes.
    """
    if not simulated:
        posted = tuple(replace(entry, driven=False) for entry in arrangement.whiteboard)
        arrangement = replace(arrangement, plants=(), whiteboard=posted)
        for machine in arrangement.machines:
            if machine.model:
                message = (
                    f"machine `{machine.name}` is a model of something else (`model: true`), and can only be simulated"
                )
                raise DiagnosticError(
                    Diagnostic(IMPOSSIBLE, message, machine.span, hint="write --simulate, or the machine that runs")
                )
    if arrangement.timing == "timed" and arrangement.cycle_ms is not None:
        if cycle_ms is not None and cycle_ms != arrangement.cycle_ms:
            message = (
                f"a cycle of this arrangement takes {float(arrangement.cycle_ms):g} ms, not {float(cycle_ms):g} ms"
            )
            raise DiagnosticError(
                Diagnostic(IMPOSSIBLE, message, arrangement.span, hint="leave out --cycle-ms, or change `cycle_ms:`")
            )
        return arrangement
    if cycle_ms is None:
        message = "nothing says how long a cycle of this arrangement takes"
        raise DiagnosticError(
            Diagnostic(IMPOSSIBLE, message, arrangement.span, hint="give it, for example with --cycle-ms 100")
        )
    return replace(arrangement, timing="timed", cycle_ms=cycle_ms)


def safe_values(arrangement: Arrangement) -> dict[str, Value]:
    """What the outputs that have safe values get in the last frame, by the names of the program's variables."""
    found: dict[str, Value] = {}
    for entry in arrangement.whiteboard:
        if entry.safe is not None:
            variable = entry.variable
            values = leaf_values(variable.type, entry.safe)
            found |= {variable.name + leaf.suffix: v for leaf, v in zip(leaves(variable.type), values, strict=True)}
    return found


def starting_values(program: Program) -> dict[str, int]:
    """What each choice is at first: an input what it is at first, and operators do nothing."""
    first: dict[str, int] = {i.name: i.init for i in program.inputs}
    first |= {v.name: v.init for v in program.vars if v.origin.kind == "input" and isinstance(v.init, int)}
    return {c.name: first[c.input] for c in program.choices if c.input in first}


def drawn_choices(program: Program, held: Mapping[str, int], fed: Container[str] = ()) -> list[str]:
    """The choices that a simulation draws: those of models, and of inputs that are neither held nor `fed`."""
    return [
        c.name
        for c in program.choices
        if c.name not in held and not c.name.startswith(OPERATOR) and not (c.input and c.input in fed)
    ]


def script_of(program: Program, steps: Sequence[Mapping[str, int]]) -> list[Prescribed]:
    """What choices get before the ringlets of a run, given the choices by name for each of its steps.

    A run takes whole cycles of a process. DiagnosticError (E484): the steps take turns in another way.
    """
    if len(program.processes) > 1:
        message = "the trace is of an arrangement with several processes, whose ringlets it interleaves"
        raise DiagnosticError(
            Diagnostic(UNREPEATABLE, message, hint="a run takes whole cycles; `llfsm replay` repeats such a trace")
        )
    numbers = {choice.name: i for i, choice in enumerate(program.choices)}
    return [
        Prescribed(step, numbers[name], value)
        for step, choices in enumerate(steps)
        for name, value in choices.items()
        if name in numbers
    ]


MOST_PERIOD = 10**14
"""Nanoseconds of the longest cycle: the clock of the machine has 63 bits."""
MOST_ROUNDS = 1 << 62
NONE = PropertySet()
NANOSECONDS = 1_000_000
"""Of a millisecond."""


@dataclass(frozen=True, slots=True)
class Plan:
    """A program that can run, and what its inputs are at first."""

    arrangement: Arrangement
    program: Program
    cycle: Fraction
    """Milliseconds."""
    free: Mapping[str, int]
    """Values of inputs that never change and have no `init`."""
    held: Mapping[str, int]
    """Values of choices that nothing else gives."""
    monitors: Mapping[str, Monitor]
    unmonitored: Mapping[str, str]
    """Properties that no run decides, and why."""

    def period(self, rate: Fraction) -> int:
        """Nanoseconds of a cycle at so many times real time; 0: without waiting. ValueError: the cycle is too long."""
        period = max(1, int(self.cycle * NANOSECONDS / rate)) if rate else 0
        if period > MOST_PERIOD:
            longest = MOST_PERIOD // 10**9
            raise ValueError(f"a cycle would take {float(period / 10**9):g} s; the longest is {longest:,} s")
        return period

    def rounds(self, span: Fraction | None) -> int:
        """Cycles in so many milliseconds of logical time, begun ones too; -1 for no limit."""
        return -1 if span is None else min(MOST_ROUNDS, int(-(-span // self.cycle)))

    def code(self) -> LiveCode:
        """Its machine code."""
        return LiveCode(self.program, self.monitors, safe_values(self.arrangement))

    def loop(
        self,
        code: LiveCode,
        *,
        period: int,
        rounds: int = -1,
        seed: int | None = None,
        law: Drawing = ANEW,
        jitter: Fraction | None = None,
        strict: bool = False,
        stops_on_violation: bool = False,
        free: Mapping[str, int] = MappingProxyType({}),
        fed: Collection[str] = (),
        script: Sequence[Prescribed] = (),
    ) -> Loop:
        """A loop at its beginning. With `seed`, inputs that are neither held nor `fed` are drawn, by `law`."""
        loop = Loop(
            code, period=period, seed=seed, drawn=drawn_choices(self.program, self.held, fed), law=law,
            jitter=None if jitter is None else int(jitter * NANOSECONDS), strict=strict,
            stops_on_violation=stops_on_violation, free={**self.free, **free},
            held={**starting_values(self.program), **self.held},
        )  # fmt: skip
        loop.prescribe(script)
        loop.limit(rounds)
        return loop


def plan(
    given: Arrangement,
    *,
    simulated: bool,
    cycle_ms: Fraction | None = None,
    held: Mapping[str, str] = MappingProxyType({}),
    properties: PropertySet = NONE,
) -> Plan:
    """How an arrangement runs with inputs that are `held` at values, as users write them, and with monitors of
    properties.

    DiagnosticError: see `runnable`, or a property is wrong. ValueError: there is no such input or value.
    """
    arrangement = runnable(given, simulated=simulated, cycle_ms=cycle_ms)
    cycle = arrangement.cycle_ms
    assert cycle is not None, "a timed arrangement has it"
    program, monitors, unmonitored = monitored(arrangement, properties)
    problem = input_problem(program, held)
    if problem is not None:
        raise ValueError(problem)
    free = free_values(program, held)
    values = {c.name: choice_value(c, held[c.source]) for c in program.choices if c.source in held}
    return Plan(arrangement, program, cycle, free, values, monitors, unmonitored)


def monitored(
    arrangement: Arrangement, properties: PropertySet
) -> tuple[Program, Mapping[str, Monitor], Mapping[str, str]]:
    """The program of an arrangement that runs with monitors of properties, these, and why others have none."""
    problem = bind(arrangement, properties)
    return problem.program(keep_all_bits=True), *decidable(problem)

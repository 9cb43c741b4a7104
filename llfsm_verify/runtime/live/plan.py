"""How an arrangement is going to run: its program, its cycles, its inputs; what the command line and Python share."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from types import MappingProxyType

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.monitors import decidable
from llfsm_verify.checking.problem import bind
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.monitoring.states import Monitor
from llfsm_verify.program.program import Program
from llfsm_verify.runtime.live.loop import LiveCode, Loop, Prescribed
from llfsm_verify.runtime.live.preparing import drawn_choices, runnable, safe_values, starting_values
from llfsm_verify.runtime.stepping.drawing import ANEW, Drawing, free_values
from llfsm_verify.runtime.stepping.random_run import input_problem
from llfsm_verify.values import choice_value

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

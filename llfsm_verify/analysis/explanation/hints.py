"""Notes beside a violation that name the word of the property language for what may have been meant."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.trace import Trace
from llfsm_verify.language.trees import of_kind
from llfsm_verify.language.typed import After, Assign, AtState, Read
from llfsm_verify.logic.formula import time_text
from llfsm_verify.logic.parsing.bounds import decimal
from llfsm_verify.logic.properties import Property
from llfsm_verify.semantics.letters import TimePasses


def hints(trace: Trace, problem: Problem, line: Property) -> tuple[str, ...]:
    """Notes on the causes of a violation: inputs that no machine sampled, states whose `on_entry` has not run, clocks
    that are a cycle late for a bound in time."""
    return (*_unsampled(trace), *_unentered(trace, problem), *_late(trace, problem, line))


def _unsampled(trace: Trace) -> Iterator[str]:
    found: dict[str, int] = {}
    for number, step in enumerate(trace.steps, 1):
        read = {name for cause in step.causes for name, _ in cause.variables}
        for s in step.world:
            if s.input in read:
                found.setdefault(s.input, number)
    where = "it was in the surroundings only"
    for name, number in found.items():
        yield f"no machine sampled `{name}` at step {number}, {where}; `sampled({name})` is what machines saw last"


def _unentered(trace: Trace, problem: Problem) -> Iterator[str]:
    """Of states that are causes, those whose `on_entry` sets what is also a cause, and has not run yet."""
    states = {
        a.name: [at for at in of_kind(a.expression, AtState) if at.state >= 0]
        for a in problem.atoms
        if not isinstance(a.expression, TimePasses)
    }
    said: set[tuple[str, int]] = set()
    for number, causes in ((0, trace.initial_causes), *((i, s.causes) for i, s in enumerate(trace.steps, 1))):
        read = {name for cause in causes for name, _ in cause.variables}
        for at in (at for cause in causes if cause.value for at in states.get(cause.atom, ())):
            if problem.arrangement.environment is not None and at.machine == problem.arrangement.environment.name:
                continue  # its ringlets are no steps, so a trace does not show when it entered a state
            state = problem.arrangement.machine(at.machine).states[at.state]
            sets = _written_in(state.on_entry)
            if (at.machine, at.state) in said or not sets & read or not _before_entry(trace, number, at.machine):
                continue
            said.add((at.machine, at.state))
            place = f"at step {number}" if number else "in the initial configuration"
            there = f"`{at.machine}@{state.name}` is true {place}, and `on_entry` has not run yet"
            yield f"{there}; `{at.machine}.entered({state.name})` is true when it has"


def _late(trace: Trace, problem: Problem, line: Property) -> Iterator[str]:
    """The clock conditions, no longer than a bound of the property, of machines that the causes speak of, where a turn
    from the first cause on comes exactly when their time is over, or the trace ends before that.

    There people take `after` to be true, and do not count the cycle in which the machine comes to the state.
    """
    period = problem.arrangement.cycle_ms
    causes = [trace.initial_causes, *(step.causes for step in trace.steps)]
    first = next((number for number, found in enumerate(causes) if found), len(causes))
    most = max((time for _, bound in line.bounds for time in bound if time is not None), default=None)
    if most is None or period is None:
        return
    read = {name for found in causes for cause in found for name, _ in cause.variables}
    machines = {m.name: m for m in problem.arrangement.machines if m.name in read or _written_in(m.states) & read}
    began: dict[str | None, tuple[str, int]] = {}
    last = {step.machine: number for number, step in enumerate(trace.steps, 1) if trace.loop is None}
    cycle, told = 0, set[str]()
    for number, step in enumerate(trace.steps, 1):
        if began.get(step.machine, (None, 0))[0] != step.state:
            began[step.machine] = (step.state, cycle)
        machine, passed = machines.get(step.machine or ""), period * (cycle - began[step.machine][1])
        states = machine.states if machine is not None and number >= first else ()
        for after in (a for state in states if state.name == step.state for a in of_kind(state, After)):
            bound = after.bound
            if not isinstance(bound, Fraction) or bound % period or not period <= bound <= most:
                continue
            said = f"`{after.span.text}` of `{step.machine}@{step.state}`"
            if said not in told and (passed == bound or (passed < bound and last.get(step.machine) == number)):
                told.add(said)
                came = ", a cycle after it came" if began[step.machine][1] else ""
                cycles = f"{bound // period + 1:,} cycles of {time_text(decimal(period), ' ')} later"
                time = f"more than {time_text(decimal(bound), ' ')} have passed since its first turn there{came}"
                yield f"{said} is true when {time}: {cycles}, not {bound // period:,}"
        cycle += step.cycle


def _written_in(actions: object) -> set[str]:
    """The variables that statements assign to as a whole."""
    return {s.target.variable.name for s in of_kind(actions, Assign) if isinstance(s.target, Read)}


def _before_entry(trace: Trace, number: int, machine: str) -> bool:
    """Whether a machine has had no ringlet in its present state after step `number`."""
    own = [step for step in trace.steps[:number] if step.machine == machine]
    if not own:
        return True
    return own[-1].fired is not None and any(change.variable == machine for change in own[-1].changes)

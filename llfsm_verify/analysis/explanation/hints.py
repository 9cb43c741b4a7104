"""Notes beside a violation that name the word of the property language for what may have been meant."""

from __future__ import annotations

from collections.abc import Iterator

from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.trace import Trace
from llfsm_verify.language.trees import of_kind
from llfsm_verify.language.typed import Assign, AtState, Read
from llfsm_verify.semantics.letters import TimePasses


def hints(trace: Trace, problem: Problem) -> tuple[str, ...]:
    """Notes on the causes of a violation: inputs that no machine sampled, states whose `on_entry` has not run."""
    return (*_unsampled(trace), *_unentered(trace, problem))


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
            sets = {s.target.variable.name for s in of_kind(state.on_entry, Assign) if isinstance(s.target, Read)}
            if (at.machine, at.state) in said or not sets & read or not _before_entry(trace, number, at.machine):
                continue
            said.add((at.machine, at.state))
            place = f"at step {number}" if number else "in the initial configuration"
            there = f"`{at.machine}@{state.name}` is true {place}, and `on_entry` has not run yet"
            yield f"{there}; `{at.machine}.entered({state.name})` is true when it has"


def _before_entry(trace: Trace, number: int, machine: str) -> bool:
    """Whether a machine has had no ringlet in its present state after step `number`."""
    own = [step for step in trace.steps[:number] if step.machine == machine]
    if not own:
        return True
    return own[-1].fired is not None and any(change.variable == machine for change in own[-1].changes)

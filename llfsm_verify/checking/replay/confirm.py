"""From a walk of the search to a trace: replayed by the executor, confirmed by an independent evaluation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from llfsm_verify.checking.claims import Claim
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.checking.trace import Trace, TraceStep
from llfsm_verify.diagnostics import Disagreement
from llfsm_verify.kripke.observing import initial_atoms, observed_outputs
from llfsm_verify.limits import tick
from llfsm_verify.logic.bounds import HIDDEN
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Fairness

Letter = frozenset[str]
MAX_PASSES, MAX_UNROLLED = 16, 1 << 16
"""Passes and ringlets after which, both exceeded, a loop whose configuration does not recur is given up."""


class Misfit(Exception):
    """A schedule asks for what the program cannot do; the message says where. `missing` is the choice that it does not
    give, if that is all."""

    def __init__(self, message: str, missing: str | None = None) -> None:
        super().__init__(message)
        self.missing = missing


@dataclass(frozen=True, slots=True)
class Schedule:
    """A run as told to the executor: free variables of its start, ringlets, and where they repeat."""

    free: tuple[tuple[str, int], ...]
    ringlets: tuple[Move, ...]
    loop: int | None


@dataclass(frozen=True, slots=True)
class ReplayedRun:
    """What the executor did with a schedule: the letters of the observed word and the trace. `recurs` is False when the
    loop's choices were repeated many times and no configuration came back."""

    letters: tuple[Letter, ...]
    """c0, c1, … of the stem and, from `loop_letter` on, of the loop."""
    loop_letter: int | None
    trace: Trace
    status: int
    """0, or what ended the run: 1 + a fault's number, -1 for a value that left 64 bits."""
    recurs: bool = True


def perform(
    execution: Execution,
    schedule: Schedule,
    first: Letter,
    shown: Sequence[str] | None = None,
    *,
    open_end: bool = False,
) -> ReplayedRun:
    """Run a schedule. The loop's ringlets are repeated until the configuration at its start recurs.

    `first` is the first letter, which no step shows; `shown` names the atoms that the trace shows (by default those of
    users). With `open_end` the last ringlet may read choices that it does not give; they have their lowest values.
    Raises Misfit when the program cannot follow the schedule.
    """
    program = execution.program
    names = [a.name for a in program.atoms if not a.name.startswith(HIDDEN)] if shown is None else shown
    record = execution.start(schedule.free)
    initial = record
    letters: list[Letter] = [first]
    steps: list[TraceStep] = []

    def run(ringlets: Sequence[Move]) -> int:
        nonlocal record
        for ringlet in ringlets:
            tick()
            enabled = execution.enabled(record)
            if (ringlet.process not in enabled) if ringlet.process is not None else enabled:
                raise Misfit(f"step {len(steps) + 1} is one of a process that cannot step there")
            result = execution.step(record, ringlet)
            for number, _ in result.samples:
                name = program.choices[number].name
                if name not in ringlet.choices and not (open_end and ringlet is schedule.ringlets[-1]):
                    raise Misfit(f"step {len(steps) + 1} reads `{name}`, which the run does not give", name)
            letter = frozenset() if result.status else atoms_of(execution, result.record)
            step = execution.describe(record, ringlet, result, tuple((name, name in letter) for name in names))
            steps.append(step)
            if result.status:
                return result.status
            if step.observed:
                letters.append(letter)
            record = result.record
        return 0

    stem = len(schedule.ringlets) if schedule.loop is None else schedule.loop
    status = run(schedule.ringlets[:stem])
    loop: int | None = None
    loop_letter: int | None = None
    recurs = True
    if schedule.loop is not None and not status:
        seen: dict[bytes, tuple[int, int]] = {}
        while True:
            here = execution.configuration(record)
            if here in seen:
                loop, loop_letter = seen[here]
                break
            seen[here] = (len(steps), len(letters))
            if len(seen) > MAX_PASSES and len(steps) > MAX_UNROLLED + stem:
                recurs = False
                break
            status = run(schedule.ringlets[stem:])
            if status:
                break
    fault = program.faults[status - 1] if status > 0 else None
    atoms = tuple((name, name in first) for name in names)
    trace = Trace(
        execution.shown(initial), execution.free(initial), atoms, tuple(steps), loop, fault, period=program.period
    )
    return ReplayedRun(tuple(letters), loop_letter, trace, status, recurs)


def end_of(execution: Execution, schedule: Schedule) -> bytes:
    """The configuration after a schedule without a loop, which the program can follow without a fault."""
    record = execution.start(schedule.free)
    for ringlet in schedule.ringlets:
        record = execution.step(record, ringlet).record
    return execution.configuration(record)


def first_letter(execution: Execution, schedule: Schedule) -> Letter:
    """The atoms that hold in the initial configuration, with inputs at their `init`. Raises AtomOverflow."""
    atoms = initial_atoms(execution.program, execution.layout, execution.start(schedule.free))
    return frozenset(name for name, holds in atoms.items() if holds)


def atoms_of(execution: Execution, record: bytes) -> Letter:
    """The names of the letter after the step that led to `record`."""
    values = execution.layout.decode_outputs(record)
    return frozenset(name for name, output in observed_outputs(execution.program) if values[output])


# ---------------------------------------------------------------- confirmation


def confirm_lasso(replayed: ReplayedRun, assumptions: Sequence[Claim], fairness: Sequence[Fairness], what: str) -> None:
    """The performed run goes on forever, is fair and satisfies the assumptions, evaluated on the lasso itself."""
    start = replayed.loop_letter
    if start is None or not replayed.recurs:
        raise Disagreement(f"{what}: the executor does not follow the loop that the search found")
    stem, loop = replayed.letters[:start], replayed.letters[start:]
    if not loop:
        raise Disagreement(f"{what}: the loop of the trace has no letter")
    for assumption in assumptions:
        if not assumption.true_on(stem, loop):
            raise Disagreement(f"{what}: the trace does not satisfy an assumption")
    unfair = unfair_to(loop, fairness)
    if unfair is not None:
        raise Disagreement(f"{what}: the loop of the trace is not fair ({unfair})")


def unfair_to(loop: Sequence[Letter], fairness: Sequence[Fairness]) -> str | None:
    """The name of a condition of fairness that a run which repeats `loop` forever breaks; None: it is fair."""
    shown = frozenset().union(*loop)
    for condition in fairness:
        if (condition.premise is None or condition.premise in shown) and condition.goal not in shown:
            return condition.name
    return None


def confirm_bad_prefix(replayed: ReplayedRun, claim: Claim, what: str) -> None:
    """No continuation that we try (constant words over the formula's atoms, alternations) satisfies the formula."""
    if replayed.status:
        raise Disagreement(f"{what}: the executor faults on the trace that the search found")
    if not claim.refuted_by(replayed.letters):
        raise Disagreement(f"{what}: the run shown could still go on to satisfy the property")

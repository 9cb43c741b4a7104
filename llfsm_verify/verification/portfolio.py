"""`--engine auto`: engines in a fixed order, each for what those before left undecided, within limits that are counted.

docs/decisions/0024-engines.md says why, and why no limit is a time.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from llfsm_verify.checking.groups import groups_of
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.verdict import Options, Result
from llfsm_verify.collector import collect_everything
from llfsm_verify.limits import Budget, LimitReached, reached
from llfsm_verify.program.program import Program, Unbounded
from llfsm_verify.verification.engines import ENGINES, Engines, Turn
from llfsm_verify.verification.merging import Merging, time_left

NAME = "auto"
Check = Callable[[Problem, Options], Result]

MOST_SLOTS = 20
"""Ringlets of a cycle up to which it is written for Z3 within a few seconds."""


@dataclass(frozen=True, slots=True)
class Stage:
    """A turn of an engine."""

    engine: str
    turn: Turn


def stages_of(engines: Engines) -> tuple[Stage, ...]:
    """The turns of all engines, in their order."""
    found = [Stage(name, turn) for name in engines for turn in engines.entry(name).turns]
    return tuple(sorted(found, key=lambda stage: stage.turn.place))


STAGES = stages_of(ENGINES)
"""A short attempt at what symbols show sooner than enumeration comes before the long searches."""
EACH_ENGINE = tuple(stage for stage in STAGES if stage.turn.alone)
"""For everything, within limits."""


class AutoEngine:
    """The engines of STAGES, one after the other (``--engine auto``)."""

    name = NAME

    def __init__(self, find: Callable[[str], Check], stages: Sequence[Stage] | None = None) -> None:
        """`find` gives the engine of a name."""
        self._find = find
        self._stages = STAGES if stages is None else stages

    def check(self, problem: Problem, options: Options) -> Result:
        """As the engines do. The result is that of the first engine alone where no other was asked."""
        sole = ENGINES.sole(options.own)
        if sole is not None:
            return self._find(sole)(problem, options)
        started = time.monotonic()
        merging = Merging(problem, faults=options.faults)
        try:
            with Budget(options.limits):
                program = groups_of(problem)[0].problem.program()
        except LimitReached:  # the first engine says so
            return self._find(self._stages[0].engine)(problem, replace(options, limits=options.limits.within(0.0)))
        endless = has_no_bounds(program)
        stopping: dict[str, set[str]] = {}  # by engine: which of our limits stopped it, as it says it
        skips_brief = len(program.slots) > MOST_SLOTS or asks_more(problem, options)
        for stage in self._stages:
            left = time_left(options, time.monotonic() - started)
            if merging.decided or (merging.asked and left is None):
                break
            if stage.turn.brief and skips_brief:
                continue
            wanted = limit_options(stage, left or options, endless=endless)
            unlimited = stage.turn.most is None
            stopped = stopping.get(stage.engine, set())
            if stage.turn.again and (not stopped or stopped & _ours(wanted, options) or (unlimited and endless)):
                continue
            if merging.asked:
                collect_everything()  # the memory of one engine is for the next
            try:
                result = self._find(stage.engine)(merging.open(problem), wanted)
            except MemoryError:
                if not merging.asked:
                    raise
                if stage.turn.brief:
                    continue
                break  # what is known by now is not lost
            merging.add(stage.engine, result)
            stopping[stage.engine] = _ours(wanted, options).intersection(merging.last.reasons)
            if result.interrupted:
                break
        return merging.result(NAME, time.monotonic() - started)


def auto(problem: Problem, options: Options) -> Result:
    """All of ours in turn."""
    from llfsm_verify.verification.verify import checker

    return AutoEngine(checker).check(problem, options)


def has_no_bounds(program: Program) -> bool:
    """A variable has no bounds, so that there may be infinitely many configurations."""
    return any(isinstance(v.type, Unbounded) for v in program.vars)


def asks_more(problem: Problem, options: Options) -> bool:
    """More than verdicts is wanted, and a proof tells less of that than an exploration: also whether any run satisfies
    the assumptions."""
    return bool(problem.assumptions) or options.witnesses or options.strict or options.vacuity == "all"


def limit_options(stage: Stage, options: Options, *, endless: bool) -> Options:
    """The options of a stage: those of the user, within our limits."""
    wanted = replace(options, effort=stage.turn.effort)
    if stage.turn.most is None:
        return wanted
    ours = stage.turn.most.endless if endless else stage.turn.most.states
    most = options.limits.max_states
    states = ours if most is None else min(ours, most)
    turn = stage.turn.most
    limits = replace(options.limits, max_states=states, max_steps=turn.steps, max_work=turn.work)
    return replace(wanted, limits=limits)


def _ours(wanted: Options, options: Options) -> set[str]:
    """What an engine says that a limit has stopped which is not the user's."""
    limits, said = wanted.limits, set[str]()
    if limits.max_steps is not None:
        said.add(reached(limits.max_steps, "steps"))
    if limits.max_work is not None:
        said.add(reached(limits.max_work, "work"))
    if limits.max_states is not None and limits.max_states != options.limits.max_states:
        said.add(reached(limits.max_states, "configurations"))
    return said

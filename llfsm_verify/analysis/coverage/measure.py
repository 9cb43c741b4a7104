"""Coverage of an arrangement: what runs cover, and what the reachable configurations say of the rest.

    $ llfsm coverage models/microwave/arrangement.yaml door.trace.yaml
    $ llfsm coverage models/microwave/arrangement.yaml --vectors oven.vectors.json

Mistakes:

    door.trace.yaml: error[E520]: this run is not one of `microwave` as it is now: the arrangement has changed …
    oven.rec: error[E521]: the recording cannot be counted: it goes on with an earlier run
    oven.vectors.json:1:17: error[E522]: …
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from llfsm_verify.analysis.coverage.goals import Goal, goals_of, modelled
from llfsm_verify.analysis.coverage.result import Coverage, Judged, Run, Taken
from llfsm_verify.analysis.lint.reach import Reach
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.replay.confirm import Schedule, perform
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.kripke.observing import Observer
from llfsm_verify.limits import Budget, Limits, tick
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Program
from llfsm_verify.semantics.probes import Outcome
from llfsm_verify.transforms.probing import Probed, probed
from llfsm_verify.values import value_text

MAX_STATES = 1_000_000
"""Configurations up to which is explored, unless the limits say otherwise."""


def told(arrangement: Arrangement, *, keep_all_bits: bool = False) -> Probed:
    """The program whose letters tell what a step covers."""
    return probed(arrangement, decisions=True, passed_over=modelled(arrangement), keep_all_bits=keep_all_bits)


class Performer:
    """Performs runs of an arrangement, and collects what comes out in them."""

    def __init__(self, arrangement: Arrangement) -> None:
        self.probed = told(arrangement, keep_all_bits=True)
        self.execution = Execution(self.probed.program)
        self._observer = Observer(self.probed.program, self.execution.layout)
        self._named = {name: outcome for outcome, name in self.probed.outputs.items()}
        self.seen: set[Outcome] = set()
        self.steps = 0

    def follow(self, schedule: Schedule, *, open_end: bool) -> None:
        """Perform a saved run to its end, or until its loop comes back. `open_end`: as of `perform`.

        Misfit: the arrangement has no such run.
        """
        done = perform(self.execution, schedule, frozenset(), (), open_end=open_end)
        self.steps += len(done.trace.steps)
        self.seen |= {self._named[name] for letter in done.letters for name in letter}

    def take(self, free: Iterable[tuple[str, int]], moves: Iterable[Move]) -> None:
        """Perform moves, one by one, until one leaves 64 bits."""
        record, mask, execution = self.execution.start(tuple(free)), 0, self.execution
        for move in moves:
            tick()
            result = execution.step(record, move)
            if result.status:
                break
            record = result.record
            self.steps += 1
            mask |= self._observer.letter(record)
        self.seen |= {self._named[name] for bit, name in enumerate(self._observer.names) if mask >> bit & 1}


def coverage(
    arrangement: Arrangement,
    seen: Iterable[Outcome] = (),
    runs: Sequence[Run] = (),
    limits: Limits | None = None,
) -> Coverage:
    """Judge each goal: covered where runs (`runs`) show these outcomes (`seen`), or by exploration.

    DiagnosticError: the arrangement has no meaning.
    """
    started = time.monotonic()
    limits = limits or Limits()
    reach = Reach(told(arrangement), Budget(replace(limits, max_states=limits.max_states or MAX_STATES)))
    try:
        goals = goals_of(arrangement, reach.probed)
        return Coverage(
            arrangement=arrangement.name,
            path=arrangement.path,
            goals=tuple(judge(goals, frozenset(seen), reach)),
            runs=tuple(runs),
            configurations=reach.configurations,
            complete=reach.complete,
            reason=None if reach.complete else reach.reason,
            modelled=tuple(sorted(modelled(arrangement))),
            surroundings=", ".join(arrangement.surroundings) or None,
            inputs=reach.inputs,
            seconds=time.monotonic() - started,
        )
    finally:
        reach.close()


def judge(goals: Iterable[Goal], seen: frozenset[Outcome], reach: Reach) -> Iterator[Judged]:
    """Each goal with its status; those that other runs reach with such runs."""
    for goal in goals:
        if goal.met_by(seen):
            yield Judged(goal, "covered")
            continue
        way = reachable_way(goal, reach)
        if way is not None:
            missing = sorted(way - seen, key=lambda outcome: outcome.value)
            runs = (reach.run_to(outcome).ringlets for outcome in missing)
            yield Judged(goal, "reachable", tuple(_taken(reach.probed.program, run) for run in runs))
        else:
            yield Judged(goal, "unreachable" if reach.complete and goal.ways else "unknown")


def reachable_way(goal: Goal, reach: Reach) -> frozenset[Outcome] | None:
    """The first way to cover a goal all of whose outcomes some run reaches."""
    return next((way for way in goal.ways if all(map(reach.has, way))), None)


def _taken(program: Program, moves: Iterable[Move]) -> tuple[Taken, ...]:
    choices = {choice.name: choice for choice in program.choices}

    def text(name: str, value: int) -> str:
        return value_text(choices[name].type, choices[name].labels, value)

    return tuple(
        Taken(
            None if move.process is None else program.processes[move.process].name,
            tuple((name, text(name, value)) for name, value in move.choices.items()),
        )
        for move in moves
    )

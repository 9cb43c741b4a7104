"""Inputs that no machine samples, kept still: a letter shows them as they were before, unless the violation needs more.

A search is free to give an input that no machine samples another value in every letter. Which values matter is found
out afterwards: those that do not are replaced by the one before, and each attempt is performed by the executor and
confirmed like the run itself. Source of the search: Zeller and Hildebrandt, Simplifying and isolating failure-inducing
input, IEEE TSE 28 (2002): delta debugging.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace

from llfsm_verify.checking.engine import Violated
from llfsm_verify.checking.goals.goal import Unconfirmed
from llfsm_verify.checking.replay.confirm import ReplayedRun
from llfsm_verify.diagnostics import Disagreement
from llfsm_verify.limits import LimitReached
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Program

MOST_STEPS = 100_000
"""Steps that are performed to find out which values matter."""
MOST_ATTEMPTS = 60

Place = tuple[int, str]
"""A step (from 0) and a choice that only its letter reads."""


def steady(
    run: Violated, replayed: ReplayedRun, program: Program, confirm: Callable[[Violated], ReplayedRun]
) -> ReplayedRun:
    """The same run with as few changes of unsampled inputs as were found to be enough; `replayed` where that is all.

    `confirm` performs a run; it raises Disagreement or Unconfirmed where that is no violation.
    """
    steps = replayed.trace.steps
    if len(steps) != len(run.schedule.ringlets) or not any(step.world for step in steps):
        return replayed
    search = _Search(run, replayed, program, confirm)
    return search.result()


class _Search:
    def __init__(
        self, run: Violated, replayed: ReplayedRun, program: Program, confirm: Callable[[Violated], ReplayedRun]
    ) -> None:
        self._run, self._replayed, self._confirm = run, replayed, confirm
        self._steps = replayed.trace.steps
        self._start = {i.name: i.init for i in program.inputs}
        self._left = min(MOST_ATTEMPTS, MOST_STEPS // max(1, len(self._steps)))

    def result(self) -> ReplayedRun:
        found = self._attempt(())
        if found is not None:
            return found
        kept = self._differing()
        best = self._replayed
        size = (len(kept) + 1) // 2
        while size and self._left > 0:
            i = 0
            while i < len(kept) and self._left > 0:
                fewer = [*kept[:i], *kept[i + size :]]
                found = self._attempt(fewer)
                if found is None:
                    i += size
                else:
                    kept, best = fewer, found
            size = 0 if size == 1 else (size + 1) // 2
        return best

    def _differing(self) -> list[Place]:
        """The places where the run has another value than it would with all of them still."""
        still = self._moves(())
        return [
            (i, s.choice)
            for i, step in enumerate(self._steps)
            for s in step.world
            if still[i].choices[s.choice] != s.value
        ]

    def _moves(self, kept: Collection[Place]) -> list[Move]:
        last = dict(self._start)
        moves: list[Move] = []
        for i, (step, move) in enumerate(zip(self._steps, self._run.schedule.ringlets, strict=True)):
            choices = dict(move.choices)
            for s in step.sampled:
                if s.input:
                    last[s.input] = s.value
            for s in step.world:
                if (i, s.choice) not in kept:
                    choices[s.choice] = last.get(s.input, s.value)
                last[s.input] = choices[s.choice]
            moves.append(Move(move.process, choices))
        return moves

    def _attempt(self, kept: Collection[Place]) -> ReplayedRun | None:
        """The run with these places as they are, and all others still; None: it is no violation then."""
        self._left -= 1
        schedule = replace(self._run.schedule, ringlets=tuple(self._moves(set(kept))))
        try:
            found = self._confirm(replace(self._run, schedule=schedule, letters=None))
        except (Disagreement, Unconfirmed, LimitReached):
            return None
        return found if len(found.trace.steps) == len(self._steps) else None

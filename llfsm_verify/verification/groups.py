"""One engine checks the groups of a problem one after the other, and the results become one
(docs/decisions/0064-groups.md).
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from textwrap import shorten

from llfsm_verify.checking.engine import Given, Session, Start
from llfsm_verify.checking.goals.kinds import goals_of
from llfsm_verify.checking.groups import MOST, Group, groups_of
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.verdict import Options, Progress, Result
from llfsm_verify.limits import Budget, LimitReached, Limits, reached
from llfsm_verify.stages import part
from llfsm_verify.verification import harness
from llfsm_verify.verification.engines import ENGINES
from llfsm_verify.verification.merging import MergingGroups, time_left

STATES, STEPS = 100_000, 1_000_000
"""Configurations and steps that a group may explore in the first round."""
GROWTH = 20
"""So many times as much in each further round."""
SHOWN = 40
"""Characters of the names that a group is told by."""


def check(name: str, start: Start, problem: Problem, options: Options, most: int = MOST) -> Result:
    """Verdicts for faults and for every property, as `harness.check` gives them; `most`: see `groups_of`. With an
    option that only one engine takes (a checkpoint), all properties are searched together."""
    groups = groups_of(problem, most)
    if len(groups) == 1 or ENGINES.sole(options.own) is not None:
        return harness.check(name, start, problem, options)
    rounds = _Rounds(name, start, problem, options)
    with suppress(LimitReached), Budget(options.limits):  # what is wrong is said before anything is searched
        goals_of(problem)
        for group in groups:
            group.problem.program(keep_all_bits=options.keep_all_bits)
    return rounds.result(groups)


class _Rounds:
    """The groups, round after round, until all is decided or was searched within the limits of the user."""

    def __init__(self, name: str, start: Start, problem: Problem, options: Options) -> None:
        self._name = name
        self._start = start
        self._problem = problem
        self._options = options
        self._started = time.monotonic()
        self._merging = MergingGroups(problem, faults=options.faults)
        self._last: Result | None = None
        self._interrupted = False

    @property
    def _seconds(self) -> float:
        return time.monotonic() - self._started

    def result(self, groups: Sequence[Group]) -> Result:
        """All verdicts."""
        size = 1
        while groups:
            portion = _Portion.of(self._options.limits, size, len(groups))
            for number, group in enumerate(groups, 1):
                place = f"group {number} of {len(groups)}" + (" again" if size > 1 else "")
                with part(f"{place}: {_short(p.name for p in group.problem.properties)} ({_short(group.needs)})"):
                    self._last = self._checked(group.problem, portion.limits, place)
                self._merging.add(self._name, portion.in_words(self._last))
            again = None if self._interrupted else self._merging.again(self._problem, portion.ours)
            groups = () if again is None else groups_of(again, 0)
            size *= GROWTH
        return replace(self._merging.result(self._name, self._seconds), interrupted=self._interrupted)

    def _checked(self, group: Problem, limits: Limits, place: str) -> Result:
        """One group. After the time limit or Ctrl-C the engine is not asked."""
        before, show = self._seconds, self._options.progress
        left = time_left(replace(self._options, limits=limits), before)
        start = _unasked if left is None or self._interrupted else self._start
        options = left or replace(self._options, limits=limits.within(0.0))
        if show is not None:
            options = replace(options, progress=lambda p: show(_placed(p, place, before)))
        try:
            result = harness.check(self._name, start, group, options, self._last)
        except KeyboardInterrupt:
            result = harness.check(self._name, _unasked, group, options, self._last)
            self._interrupted = True
        self._interrupted |= result.interrupted
        return result


def _short(names: Iterable[str]) -> str:
    return shorten(", ".join(names) or "no inputs", SHOWN, placeholder=" …")


def _unasked(given: Given) -> Session:
    """In the place of an engine: the time is over, else Ctrl-C has come."""
    given.budget.check_time()
    raise LimitReached(harness.INTERRUPTED)


def _placed(progress: Progress, place: str, before: float) -> Progress:
    """What an engine reports of one group; `before`: seconds until it began."""
    doing = f"{place}: {progress.doing}" if progress.doing else place
    return replace(progress, seconds=before + progress.seconds, doing=doing)


@dataclass(frozen=True, slots=True)
class _Portion:
    """What each group of a round may use. `ours` is what is said where a limit of the round ends a search, `whole`
    says, where one group has used its share of a limit, that all have."""

    limits: Limits
    ours: frozenset[str]
    whole: Mapping[str, str]

    @staticmethod
    def of(limits: Limits, size: int, groups: int) -> _Portion:
        """That of a round in which a group may explore `size` times as much as in the first."""
        whole = limits.max_steps, limits.max_work
        steps, work = (None if n is None else min(n, max(n // groups, STEPS)) for n in whole)
        most_states, most_steps = size * STATES, size * STEPS
        ours: set[str] = set()
        if limits.max_states is None or most_states < limits.max_states:
            ours.add(reached(most_states, "configurations"))
        if steps is None or most_steps < steps:
            ours.add(reached(most_steps, "steps"))
        said: dict[str, str] = {}
        if steps is not None and limits.max_steps is not None:
            said[reached(steps, "steps")] = reached(limits.max_steps, "steps")
        if work is not None and limits.max_work is not None:
            said[reached(work, "work")] = reached(limits.max_work, "work")
        states = most_states if limits.max_states is None else min(most_states, limits.max_states)
        steps = most_steps if steps is None else min(most_steps, steps)
        return _Portion(replace(limits, max_states=states, max_steps=steps, max_work=work), frozenset(ours), said)

    def in_words(self, result: Result) -> Result:
        """The result, with limits as the user or `auto` has set them."""

        def said(reason: str | None) -> str | None:
            return None if reason is None else self.whole.get(reason, reason)

        properties = tuple(replace(p, reason=said(p.reason)) for p in result.properties)
        return replace(result, properties=properties, faults=replace(result.faults, reason=said(result.faults.reason)))

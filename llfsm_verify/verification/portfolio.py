"""`--engine auto`: engines in a fixed order, each for what those before left undecided, within limits that are counted.

docs/decisions/0024-engines.md says why, and why no limit is a time.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.verdict import FAULTS, Attempt, FaultResult, Options, PropertyResult, Result, Verdict
from llfsm_verify.collector import collect_everything
from llfsm_verify.limits import Budget, LimitReached, reached
from llfsm_verify.program.program import Program, Unbounded
from llfsm_verify.verification.engines import ENGINES, Engines, Turn

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
                program = problem.program()
        except LimitReached:  # the first engine says so
            return self._find(self._stages[0].engine)(problem, replace(options, limits=options.limits.within(0.0)))
        endless = has_no_bounds(program)
        stopping: dict[str, set[str]] = {}  # by engine: which of our limits stopped it, as it says it
        skips_brief = len(program.slots) > MOST_SLOTS or asks_more(problem, options)
        for stage in self._stages:
            left = _left(options, time.monotonic() - started)
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


def _left(options: Options, seconds: float) -> Options | None:
    """The options with what is left of the time; None: nothing is."""
    timeout = options.limits.timeout
    if timeout is None:
        return options
    if seconds >= timeout:
        return None
    return replace(options, limits=options.limits.within(timeout - seconds))


class Merging:
    """The results of several engines as one: for each property, and for faults, that of the first engine to decide."""

    def __init__(self, problem: Problem, *, faults: bool = True) -> None:
        """`faults`: they are also to be decided."""
        self._wants_faults = faults
        self._order = [p.name for p in problem.properties]
        self._results: list[Result] = []
        self._attempts: list[Attempt] = []
        self._found: dict[str, PropertyResult] = {}
        self._faults: FaultResult | None = None
        self._why: dict[str | None, list[str]] = {None: [], **{name: [] for name in self._order}}
        """Why engines did not decide a property, or faults (None), in their order."""

    @property
    def asked(self) -> bool:
        """An engine has been."""
        return bool(self._results)

    @property
    def last(self) -> Attempt:
        """What the last engine did."""
        return self._attempts[-1]

    @property
    def decided(self) -> bool:
        """Nothing is left to look at."""
        found = self._faults is not None and self._faults.verdict is not Verdict.UNKNOWN
        return self.asked and (found or not self._wants_faults) and not any(self._is_open(name) for name in self._order)

    def _is_open(self, name: str) -> bool:
        found = self._found.get(name)
        return found is None or found.verdict is Verdict.UNKNOWN

    def open(self, problem: Problem) -> Problem:
        """What is left to look at."""
        return replace(problem, properties=tuple(p for p in problem.properties if self._is_open(p.name)))

    def add(self, engine: str, result: Result) -> None:
        """What an engine says about properties that were open, or about all of them."""
        decided: list[str] = []
        whys: list[tuple[str | None, str | None]] = []
        for item in result.properties:
            if item.verdict is Verdict.UNKNOWN:
                whys.append((item.name, item.reason))
                self._found.setdefault(item.name, item)
            else:
                decided.append(item.name)
                if self._is_open(item.name):
                    self._found[item.name] = item
        faults = result.faults
        if faults.verdict is Verdict.UNKNOWN:
            if self._wants_faults:
                whys.append((None, faults.reason))
            self._faults = self._faults or faults
        else:
            decided.append(FAULTS)
            if self._faults is None or self._faults.verdict is Verdict.UNKNOWN:
                self._faults = faults
        for name, reason in whys:
            self._why[name].append(f"{engine}: {reason or 'not decided'}")
        reasons = tuple(dict.fromkeys(reason for _, reason in whys if reason is not None))
        self._attempts.append(Attempt(engine, result.seconds, tuple(decided), reasons))
        self._results.append(result)

    def result(self, engine: str, seconds: float) -> Result:
        """All of it, under the name `engine`; of one engine alone its own. The counts are those of the search that came
        farthest."""
        explored = [r for r in self._results if r.exploration.depth is None] or self._results
        base = max(explored, key=lambda r: r.exploration.states)
        if len(self._results) == 1:
            return base
        assert self._faults is not None
        return replace(
            base,
            engine=engine,
            seconds=seconds,
            properties=tuple(self._said(name) for name in self._order),
            faults=replace(self._faults, reason=self._reason(None, self._faults.verdict)),
            interrupted=any(r.interrupted for r in self._results),
            escape=next((r.escape for r in self._results if r.escape is not None), None),
            attempts=tuple(self._attempts),
        )

    def _said(self, name: str) -> PropertyResult:
        found = self._found[name]
        return replace(found, reason=self._reason(name, found.verdict))

    def _reason(self, name: str | None, verdict: Verdict) -> str | None:
        return "; ".join(self._why[name]) if verdict is Verdict.UNKNOWN else None

"""The suite for engines: known answers, those of the reference, limits, Ctrl-C, and the same question asked again."""

from __future__ import annotations

from argparse import ArgumentParser
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import partial
from typing import cast

from llfsm_verify.checking.engine import Answer, Explored, Given, Holds, Session, Start, Unknown, Violated
from llfsm_verify.checking.goals.goal import Goal
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.verdict import Exploration, Options, PropertyResult, Result, Verdict
from llfsm_verify.engines.unrolled.options import UnrolledOptions
from llfsm_verify.limits import LimitReached, Limits
from llfsm_verify.testing.conformance.known import ENDLESS, KNOWN, Known
from llfsm_verify.testing.conformance.outcome import (
    PATIENCE,
    Answers,
    Case,
    Outcome,
    Wrong,
    demand_hypothesis,
    judge,
    outcomes_of,
)
from llfsm_verify.testing.conformance.stopping import StoppingBudget, interrupted
from llfsm_verify.verification import harness
from llfsm_verify.verification.engines import ENGINES, EngineEntry


class Delegate(Session):
    """Answers as `inner` does."""

    def __init__(self, inner: Session) -> None:
        self.inner = inner
        self.asks_again = inner.asks_again

    def search(self) -> None:
        self.inner.search()

    def ended(self, why: str | None) -> None:
        self.inner.ended(why)

    def answers(self, goal: Goal) -> Iterable[Answer]:
        return self.inner.answers(goal)

    def fault_runs(self) -> Iterable[tuple[int, Violated]]:
        return self.inner.fault_runs()

    def faults(self) -> Holds | Unknown:
        return self.inner.faults()

    def possible(self) -> bool | None:
        return self.inner.possible()

    def explored(self) -> Explored | None:
        return self.inner.explored()

    def watching(self, problem: Problem, nodes: int) -> Explored | None:
        return self.inner.watching(problem, nodes)

    def count(self) -> None:
        self.inner.count()

    def exploration(self) -> Exploration:
        return self.inner.exploration()

    def pulse(self) -> None:
        self.inner.pulse()

    def blamed(self, error: Exception) -> Exception | None:
        return self.inner.blamed(error)

    def close(self) -> None:
        self.inner.close()


Check = Callable[[Problem, Options], Result]

DRAWN, SEED = 25, 3
"""Random arrangements, and the seed from which they are drawn."""
ENDS = 60.0
"""Seconds of processor time within which an engine ends after a limit or Ctrl-C, with all that the harness does."""
VERY_DEEP = 10**6
"""Steps to which a bounded engine looks that is to be interrupted."""
STOPPED_AT = (1, 2, 5, 20, 100, 400)
"""Questions to the budget: at each of these numbers the search is stopped, in a check of its own."""
STOPPED = ("last step", "loop", "assumption for safety", "three kinds of faults")
"""Known arrangements on which a search is stopped."""
AGAIN = ("safety", "lap", "assumption for liveness", "regular", "three kinds of faults")
"""Known arrangements on which an engine is asked twice."""

ESCAPED = "the harness is told of Ctrl-C, a limit or want of memory in the search, and here it was afterwards"


def check_engine(
    engine: EngineEntry | str, *, drawn: int = DRAWN, seed: int = SEED, patience: float = PATIENCE
) -> list[Outcome]:
    """The outcome of each case for an engine: an entry, registered or not, or the name of one that is registered.

    `drawn` random arrangements come from `seed`. Unregistered: there is none of the name. ModuleNotFoundError: they are
    drawn by Hypothesis, which is not installed.
    """
    return outcomes_of(engine_cases(engine, drawn=drawn, seed=seed, patience=patience))


def engine_cases(
    engine: EngineEntry | str, *, drawn: int = DRAWN, seed: int = SEED, patience: float = PATIENCE
) -> list[Case]:
    """The cases of `check_engine`, to be called one by one; their names are different."""
    if drawn:
        demand_hypothesis()
    suite = _Suite(ENGINES.entry(engine) if isinstance(engine, str) else engine, patience)
    return [*suite.known(), *suite.own(), *suite.limits(), *suite.stops(), *suite.again(), *suite.drawn(drawn, seed)]


class _Suite:
    """The cases for one engine."""

    def __init__(self, entry: EngineEntry, patience: float) -> None:
        self._entry = entry
        self._patience = patience

    def _case(self, name: str, about: str, look: Callable[[], None], patience: float | None = None) -> Case:
        return Case(name, about, look, min(self._patience, patience or self._patience))

    def _check(self, problem: Problem, options: Options, change: Callable[[Start], Start] | None = None) -> Result:
        """What the engine says in the harness, or with what makes its sessions changed."""
        found = self._entry.load()
        if self._entry.asks_others:
            return cast(Check, found)(problem, options)
        start = cast(Start, found)
        return harness.check(self._entry.name, start if change is None else change(start), problem, options)

    # -------------------------------------------------- known answers

    def known(self) -> Iterator[Case]:
        """What the entry claims to decide is decided, and nothing that is said is wrong."""
        for known in KNOWN:
            yield self._case(known.name, known.about, partial(self._look_at, known))

    def _look_at(self, known: Known) -> None:
        judge(self._check(known.problem(), Options()), Answers.of(known), self._demanded(known))

    def _demanded(self, known: Known) -> frozenset[str]:
        decides = self._entry.decides
        names = {name for name, holds in known.holds.items() if ("proofs" if holds else "violations") in decides}
        return frozenset(names | ({"faults"} if "faults" in decides else set())) - known.open

    # -------------------------------------------------- its own options

    def own(self) -> Iterator[Case]:
        """Its own options can be arguments of a command, and their defaults are those of its classes."""
        if self._entry.own:
            about = "its own options can be arguments of a command, and their defaults are those of its classes"
            yield self._case("own options", about, self._options)

    def _options(self) -> None:
        parser = ArgumentParser("llfsm verify")
        for each in self._entry.classes():
            each.demand_defaults()
            for option in each.OPTIONS:
                option.add_to(parser)
        parser.format_help()
        parser.parse_args([])

    # -------------------------------------------------- limits

    def limits(self) -> Iterator[Case]:
        """What a limit cuts short is unknown, and is cut short."""
        said = "what it leaves undone is unknown, and nothing is claimed of it"
        for name, limits in (
            ("no time", Limits(timeout=0.0)),
            ("a second", Limits(timeout=1.0)),
            ("no memory", Limits(memory=1)),
            ("few configurations", Limits(max_states=500, timeout=5.0)),
        ):
            yield self._case(name, f"with this limit an endless search ends: {said}", partial(self._ends, limits), ENDS)
        for most in (1, 3, 8):
            for known in KNOWN:
                if known.name in STOPPED:
                    look = partial(self._keeps, known, most)
                    yield self._case(f"{most} configurations: {known.name}", f"with this limit {said}", look)

    def _ends(self, limits: Limits) -> None:
        result = self._check(ENDLESS.problem(), Options(limits))
        judge(result, Answers.of(ENDLESS))
        for found in result.properties:
            if found.verdict is not Verdict.UNKNOWN:
                raise Wrong(f"`{found.name}` is {found.verdict.value}, which nobody can know: {found.text}")

    def _keeps(self, known: Known, most: int) -> None:
        result = self._check(known.problem(), Options(Limits(max_states=most)))
        judge(result, Answers.of(known))
        explores = "max_states" in self._entry.options and not self._entry.asks_others
        if explores and known.name == "last step":
            for found in result.properties:
                if found.verdict is not Verdict.UNKNOWN:
                    raise Wrong(f"`{found.name}` is {found.verdict.value} after {most} of 13 configurations")

    # -------------------------------------------------- Ctrl-C, and other ends of a search

    def stops(self) -> Iterator[Case]:
        """A search that is stopped comes to its end, and the harness is told."""
        if self._entry.asks_others:
            return
        yield self._case("Ctrl-C", "Ctrl-C ends an endless search, which the harness is told", self._interrupted, ENDS)
        for name, error in (
            ("Ctrl-C at a tick", KeyboardInterrupt),
            ("a limit at a tick", LimitReached),
            ("no more memory at a tick", MemoryError),
        ):
            about = "raised by the budget, it ends the search, which the harness is told"
            for known in KNOWN:
                if known.name in STOPPED:
                    look = partial(self._stopped, known, error)
                    yield self._case(f"{name}: {known.name}", about, look)

    def _interrupted(self) -> None:
        pressed: list[BaseException] = []

        def change(start: Start) -> Start:
            return lambda given: _Interrupted(start(given), pressed)

        deep = UnrolledOptions(VERY_DEEP if self._entry.takes("depth") else None)
        try:
            result = self._check(ENDLESS.problem(), Options(own=(deep,)), change)
        except KeyboardInterrupt:
            if pressed:
                raise Wrong(ESCAPED) from None
            raise
        judge(result, Answers.of(ENDLESS))
        if pressed and not result.interrupted:
            raise Wrong("the harness was not told of Ctrl-C")

    def _stopped(self, known: Known, error: type[BaseException]) -> None:
        for at in STOPPED_AT:
            stops = _Stops(at, error)
            try:
                result = self._check(known.problem(), Options(), stops.change)
            except (KeyboardInterrupt, LimitReached, MemoryError):
                if stops.stopped:
                    raise Wrong(ESCAPED) from None
                raise
            judge(result, Answers.of(known))
            if stops.stopped and error is KeyboardInterrupt and not result.interrupted:
                raise Wrong(f"the harness was not told of Ctrl-C, which came with the budget's tick {at}")
            if not stops.stopped:
                return

    # -------------------------------------------------- again

    def again(self) -> Iterator[Case]:
        """The same question has the same answer."""
        for known in KNOWN:
            if known.name in AGAIN:
                about = "the same question has the same answer"
                yield self._case(f"again: {known.name}", about, partial(self._twice, known))

    def _twice(self, known: Known) -> None:
        first, second = (self._check(known.problem(), Options()) for _ in range(2))
        for one, other in zip(first.properties, second.properties, strict=True):
            if _said(one) != _said(other):
                raise Wrong(f"`{one.name}` has another answer when it is asked for again")
        if first.faults.verdict is not second.faults.verdict:
            raise Wrong("faults have another answer when they are asked for again")

    # -------------------------------------------------- random arrangements

    def drawn(self, number: int, seed: int) -> Iterator[Case]:
        """Nothing that is said of random arrangements is wrong, as far as the reference can say."""
        for i in range(number):
            about = "what is said of a random arrangement is what the reference says"
            yield self._case(f"random {i + 1}", about, partial(self._random, i, number, seed))

    def _random(self, number: int, of: int, seed: int) -> None:
        from llfsm_verify.testing.conformance.drawn import problems

        drawn = problems(of, seed)[number]
        judge(self._check(drawn.problem(), Options(Limits(max_states=20_000), effort=400_000)), drawn.answers)


def _said(found: PropertyResult) -> tuple[object, ...]:
    return found.verdict, found.trace, found.reason


class _Interrupted(Delegate):
    """Ctrl-C is pressed while it searches, as `pressed` shows."""

    def __init__(self, inner: Session, pressed: list[BaseException]) -> None:
        super().__init__(inner)
        self._pressed = pressed

    def search(self) -> None:
        with interrupted(0.5) as raised:
            try:
                self.inner.search()
            finally:
                self._pressed += raised


class _Stops:
    """Makes the first session of an engine one whose budget is used up in its search."""

    def __init__(self, at: int, error: type[BaseException]) -> None:
        self._at = at
        self._error = error
        self._budget: StoppingBudget | None = None

    @property
    def stopped(self) -> bool:
        """The budget has raised."""
        return self._budget is not None and self._budget.stopped

    def change(self, start: Start) -> Start:
        """`start`, with that budget."""

        def changed(given: Given) -> Session:
            if self._budget is not None:
                return start(given)
            budget = self._budget = StoppingBudget(given.options.limits, self._at, self._error("the limit is here"))
            given.problem.program(keep_all_bits=given.options.keep_all_bits)  # so that the search is what is stopped
            with budget:
                return _Stopped(start(replace(given, budget=budget)), budget)

        return changed


class _Stopped(Delegate):
    """Its search is stopped by the budget."""

    def __init__(self, inner: Session, budget: StoppingBudget) -> None:
        super().__init__(inner)
        self._budget = budget

    def search(self) -> None:
        try:
            with self._budget:
                self.inner.search()
        finally:
            self._budget.end()

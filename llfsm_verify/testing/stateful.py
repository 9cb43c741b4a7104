"""A state machine of Hypothesis that runs an arrangement, with its properties' monitors as invariants.

Its failed runs are made shorter (`polish`) in ways that Hypothesis cannot try, since it changes one choice at a time.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain, pairwise, product
from pathlib import Path
from typing import ClassVar

from hypothesis import Phase, event, settings
from hypothesis import strategies as st
from hypothesis.control import current_build_context, currently_in_test_context
from hypothesis.errors import HypothesisException
from hypothesis.stateful import INITIALIZE_RULE_MARKER, RULE_MARKER, RuleBasedStateMachine, initialize, rule

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.logic.reading import names_file
from llfsm_verify.runtime.stepping.monitored import MonitoredSimulation
from llfsm_verify.testing.run import Asked, Run, RunFailed, Subject, found_beside, load
from llfsm_verify.testing.strategies import starts, stretches
from llfsm_verify.testing.stretches import Stretch, Wrapper
from llfsm_verify.testing.tested import UntestedWarning
from llfsm_verify.values import Shown


class ArrangementStateMachine(RuleBasedStateMachine):
    """Runs an arrangement with random inputs; a violated property or a fault fails the test.

    Subclass it, name the arrangement and its properties, and let pytest collect its `TestCase`:

        class Lights(ArrangementStateMachine):
            arrangement = "arrangement.yaml"
            properties = "lights.ltl"  # or the lines themselves

        TestLights = Lights.TestCase

    Paths are relative to the file of the subclass. Rules and invariants of Hypothesis can be added. A rule goes on with
    the run by `self.step(Stretch({"car": True}, cycles=3))`, and looks at it by `self.simulation.values` and
    `self.state("ns")`; an `@invariant` is asked after each rule, and `after_ringlet`, when it is overridden, after
    each ringlet. The failure that Hypothesis has shrunk is shown as a table of steps with a program that repeats it,
    and saved as a trace.
    """

    arrangement: ClassVar[str | Path | Arrangement | Wrapper]
    """The arrangement's file, or what `lv.load` or `lv.build` gives."""
    properties: ClassVar[Asked] = ()
    """Lines of a property file, a path of one (a Path, or a str that ends in `.ltl`), or several of these."""
    strict: ClassVar[bool] = False
    """Properties that are not tested, or in part only, are an error (E470, E471), not a warning."""
    kept: ClassVar[Sequence[str]] = ()
    """Inputs that the rule here leaves alone, for rules of yours that set them."""
    longest: ClassVar[int | None] = None
    """Cycles in one stretch, at most; by default what the clocks and counters suggest."""
    traces: ClassVar[str | Path | None] = "traces"
    """The folder for traces of failures, relative to the file of the subclass. None: they are not saved."""

    _subject: ClassVar[Subject | None] = None

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        # Explaining takes longer than finding and shrinking, and a table of steps says more.
        phases = tuple(phase for phase in cls.TestCase.settings.phases if phase is not Phase.explain)
        cls.TestCase.settings = settings(cls.TestCase.settings, phases=phases)

    def __init__(self) -> None:
        super().__init__()
        subject = self.subject()
        try:
            self.run = subject.start()
        except RunFailed as failed:
            self._tell(failed)
            raise

    # ------------------------------------------------------------ looking

    @classmethod
    def subject(cls) -> Subject:
        """The arrangement with its monitors, loaded once. Raises DiagnosticError; TypeError: a class without one."""
        found = cls.__dict__.get("_subject")
        if isinstance(found, Subject):
            return found
        if not hasattr(cls, "arrangement"):
            raise TypeError(f'{cls.__name__} names no arrangement: write `arrangement = "FILE.yaml"` in the class')
        given = [cls.properties] if isinstance(cls.properties, (str, Path)) else list(cls.properties)
        beside = [found_beside(p, cls._folder()) if names_file(p) else p for p in given]
        arrangement = cls.arrangement
        if isinstance(arrangement, str | Path):
            arrangement = found_beside(arrangement, cls._folder())
        subject = load(arrangement, beside)
        for name in cls.kept:
            if name not in subject.stimuli:
                known = ", ".join(subject.stimuli) or "none at all"
                raise TypeError(f"{cls.__name__}.kept: there is no input {name!r} that can change, only {known}")
        if cls.strict:
            subject.demand_all()
        elif subject.untested_text:
            warnings.warn(f"{cls.__name__}: {subject.untested_text}", UntestedWarning, stacklevel=2)
        cls._subject = subject
        return subject

    @property
    def simulation(self) -> MonitoredSimulation:
        """Where the run stands. Step it by `step` only."""
        return self.run.simulation

    def state(self, machine: str) -> str:
        """The name of the state that a machine is in. KeyError: there is no such machine."""
        return self.simulation.state(machine)

    # ------------------------------------------------------------ going on

    @initialize(free=st.runner().flatmap(lambda machine: machine._starts()))
    def begin(self, free: dict[str, Shown]) -> None:
        """Inputs that never change get their values."""
        if free:
            try:
                self.run = self.subject().start(free)
            except RunFailed as failed:
                self._tell(failed)
                raise

    @rule(stretch=st.runner().flatmap(lambda machine: machine._stretches()))
    def step(self, stretch: Stretch) -> None:
        """Go on for a stretch. Raises RunFailed when it violates a property or faults, ValueError as `Run.take`."""
        __tracebackhide__ = True
        watches = type(self).after_ringlet is not ArrangementStateMachine.after_ringlet
        try:
            self.run.take(stretch, self.after_ringlet if watches else None)
        except RunFailed as failed:
            self._tell(failed)
            raise

    def after_ringlet(self) -> None:
        """Override it to look at the run after every ringlet; steps are slower then (Python, not machine code)."""

    def teardown(self) -> None:
        """An overriding one should call this one: it adds the steps to failures of other rules and invariants, and
        counts how long runs are for `--hypothesis-show-statistics`."""
        if currently_in_test_context():
            event(f"run of {_about(self.simulation.steps)} ringlets")
        error = sys.exception()
        if isinstance(error, Exception) and not isinstance(error, (RunFailed, HypothesisException)) and _final():
            error.add_note(f"{self.run.table()}\n{self.run.program()}")

    def _starts(self) -> st.SearchStrategy[dict[str, Shown]]:
        return starts(self.run.subject) if not self.run.performed else st.just({})

    def _stretches(self) -> st.SearchStrategy[Stretch]:
        return stretches(self.run, without=self.kept, longest=self.longest)

    # ------------------------------------------------------------ telling

    def _tell(self, failed: RunFailed) -> None:
        """Confirm the failure that Hypothesis has shrunk, save it, and say where. Disagreement: it is not confirmed."""
        if not _final():
            return
        if not self._own_rules():
            failed.run = polish(failed.run)
        confirmed = failed.run.findings
        if self.traces is None or not confirmed:
            return
        saved = failed.run.save(Path(found_beside(self.traces, self._folder())))
        for path in saved:
            failed.add_note(f"trace saved: {path} (`llfsm replay` runs it again; it passes once the failure is gone)")

    @classmethod
    def _own_rules(cls) -> bool:
        """The subclass has a say in what inputs there are, so a shorter run might be none that it allows."""
        theirs = [
            name
            for base in cls.__mro__[: cls.__mro__.index(ArrangementStateMachine)]
            for name, value in vars(base).items()
            if hasattr(value, RULE_MARKER) or hasattr(value, INITIALIZE_RULE_MARKER)
        ]
        return bool(theirs or cls.kept)

    @classmethod
    def _folder(cls) -> Path:
        """The folder of the file that defines the class; where we are, when there is no such file."""
        file = getattr(sys.modules.get(cls.__module__), "__file__", None)
        return Path(file).absolute().parent if file else Path.cwd()


def _final() -> bool:
    """Hypothesis runs the example that it is going to show."""
    return currently_in_test_context() and current_build_context().is_final


def _about(count: int) -> str:
    """The power of ten below, and the last number before the next one."""
    low = 10 ** (len(str(count)) - 1)
    return f"{low:,} to {10 * low - 1:,}" if count else "0"


MAX_TRIES = 5_000
"""Runs that are tried for one failure: well below a second of machine code."""
FEW_PAIRS = 600
"""So many lengths of two stretches are tried together."""


def polish(run: Run) -> Run:
    """A run that fails in the same way with no more steps and changes: `run` itself, when none is found.

    Greedy: stretches are left out or made shorter, and changes are left out or replaced by others, as long as the run
    still fails earlier, or as early with fewer changes. The last stretch may become longer meanwhile, as far as the sum
    becomes smaller.
    """
    best, tries = run, 0
    others = [(name, value) for name, each in run.subject.stimuli.items() for value in each.likely]
    improved = True
    while improved:
        improved = False
        for candidate in chain(_candidates(best.stretches), _with_others(best.stretches, others)):
            tries += 1
            if tries > MAX_TRIES:
                return best
            found = _failing(best, candidate)
            if found is not None and (found.steps, found.changes) < (best.steps, best.changes):
                best, improved = found, True
                break
    return best


def _candidates(stretches: Sequence[Stretch]) -> Iterator[list[Stretch]]:
    """Simpler runs: fewer stretches, then shorter ones, two at once where that is little work, then fewer changes."""
    total, count = sum(one.turns for one in stretches), len(stretches)
    for size in range(count - 1, 0, -1):
        for i in range(count - size + 1):
            front, back = stretches[:i], stretches[i + size :]
            yield _ending(front, back, total)
            if front and back:
                yield from (_ending([*front[:-1], front[-1].of(n)], back, total) for n in range(1, total))
    for i, one in enumerate(stretches[:-1]):
        for turns in range(one.turns):
            yield _ending([*stretches[:i], one.of(turns)], stretches[i + 1 :], total)
    for i, (one, two) in enumerate(pairwise(stretches[:-1])):
        if one.turns * two.turns <= FEW_PAIRS:
            for a, b in product(range(one.turns + 1), range(two.turns + 1)):
                yield _ending([*stretches[:i], one.of(a), two.of(b)], stretches[i + 2 :], total)
    for i, one in enumerate(stretches):
        for name in one.changes:
            rest = {other: value for other, value in one.changes.items() if other != name}
            yield [*stretches[:i], replace(one, changes=rest), *stretches[i + 1 :]]
        for name in one.reads:
            rest = {other: value for other, value in one.reads.items() if other != name}
            yield [*stretches[:i], replace(one, reads=rest), *stretches[i + 1 :]]


def _with_others(stretches: Sequence[Stretch], others: Sequence[tuple[str, Shown]]) -> Iterator[list[Stretch]]:
    """One change is replaced by each of `others`, of the same input or another one."""
    total = sum(one.turns for one in stretches)
    for i, one in enumerate(stretches):
        for name, value in one.changes.items():
            rest = {n: v for n, v in one.changes.items() if n != name}
            for other in others:
                if other[0] not in rest and other != (name, value):
                    changed = replace(one, changes={**rest, other[0]: other[1]})
                    yield _ending([*stretches[:i], changed], stretches[i + 1 :], total)


def _ending(front: Sequence[Stretch], back: Sequence[Stretch], total: int) -> list[Stretch]:
    """Both, the last stretch as long as the sum allows: it ends with the failure."""
    found = [*front, *back]
    if found:
        found[-1] = found[-1].of(max(1, total - sum(one.turns for one in found[:-1])))
    return found


def _failing(run: Run, stretches: Sequence[Stretch]) -> Run | None:
    """A run of these stretches, if it fails as `run` does."""
    assert run.failure is not None
    try:
        again = run.subject.start(run.free)
        for stretch in stretches:
            again.take(stretch)
    except RunFailed as failed:
        same = failed.failure.fault == run.failure.fault and set(failed.failure.names) >= set(run.failure.names)
        return failed.run if same else None
    return None

"""The harness: one engine checks one problem, and what all engines have in common is done here.

Limits and Ctrl-C end a search, and what it knows by then is said. Every run that an engine gives is performed by the
executor and confirmed before a user sees it. What holds is looked at for what makes it hold vacuously.

What only some checks need (explanations, witnesses, more counterexamples) is imported when it is used.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace

from llfsm_verify.analysis.vacuity.check import ESCAPE_LEAST, check_vacuity, look_for_escape, share_of
from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.checking.engine import Explored, Given, Holds, Session, Start, Unknown, Violated
from llfsm_verify.checking.goals.goal import Goal, Unconfirmed, lost_at
from llfsm_verify.checking.goals.kinds import goals_of
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.replay.confirm import ReplayedRun
from llfsm_verify.checking.replay.replayer import Replayer
from llfsm_verify.checking.trace import letter_steps
from llfsm_verify.checking.verdict import (
    FAULTS,
    NO_RUN,
    OPEN,
    PERHAPS_NO_RUN,
    EarlyVerdict,
    Escape,
    Exploration,
    FaultFinding,
    FaultResult,
    Options,
    Progress,
    PropertyResult,
    Result,
    Vacuity,
    Verdict,
)
from llfsm_verify.limits import Budget, LimitReached, memory_in_use, unlimited
from llfsm_verify.stages import following, stage

GRACE = 1.0
"""Seconds beyond the time limit until which violations already found are confirmed, then explained. As long is left
until two seconds for what cannot be stopped, and for printing (docs/decisions/0063-time-limits.md)."""
TOLD_BY_ENGINES = ("searching", "exploring", "looking for", "performing")
"""How stages begin of which an engine itself says more to those who wait."""
INTERRUPTED, NO_MEMORY = "interrupted", "the memory ran out"
STOPS = (KeyboardInterrupt, LimitReached, MemoryError)
"""What may end any piece of an engine's work."""


def check(name: str, start: Start, problem: Problem, options: Options, before: Result | None = None) -> Result:
    """Verdicts for faults and for every property, by the engine `name`. `before`: of other properties of the same
    arrangement; an escape from the assumptions, and faults if all was explored, are not looked for again.

    Raises Disagreement when a run fails its confirmation, and what the engine raises in its place; DiagnosticError when
    what the user asked for cannot be done.
    """
    return _Check(name, start, problem, options, before).result(examine=True)


class _Check:
    """One engine at work on one problem."""

    def __init__(
        self, name: str, start: Start, problem: Problem, options: Options, before: Result | None = None
    ) -> None:
        self._name = name
        self._start = start
        self._problem = problem
        self._options = options if options.progress is None else replace(options, progress=self._progress)
        self._show = options.progress
        self._last = Progress(0, 0, 0, 0, 0.0, 0)
        self._stages: list[str] = []
        """Those under way, the outermost first, where someone is shown what is going on."""
        self._budget = Budget(options.limits, self._pulse)
        self._session: Session | None = None
        self._replayer = Replayer(problem)
        self._why: str | None = None
        """What ended the search before its end."""
        self._interrupted = False
        known = before is not None and before.complete and before.faults.verdict is not Verdict.UNKNOWN
        self._known_faults = before.faults if before is not None and known else None
        self._escape = Escape(None if before is None else before.escape)
        self._early: dict[str, ReplayedRun] = {}
        """Violations that were confirmed while the search went on, by property."""
        self._early_fault: FaultFinding | None = None
        self._told = set() if self._known_faults is None else {FAULTS}
        self.refuted: set[str] = set()
        """The names of properties that the engine says are violated, without a run to show."""

    def _pulse(self) -> None:
        if self._session is not None:
            self._session.pulse()

    def _progress(self, progress: Progress) -> None:
        """Show what an engine reports, and what is going on beside its search."""
        self._last = progress
        if self._show is not None:
            self._show(replace(progress, doing=self._doing or progress.doing))

    @property
    def _doing(self) -> str:
        return next((name for name in self._stages if not name.startswith(TOLD_BY_ENGINES)), "")

    def _stage(self, name: str, begins: bool) -> None:
        """A stage begins or ends: show what is going on now, with the sizes of which the engine has told last."""
        if begins:
            self._stages.append(name)
        else:
            self._stages.pop()
        if begins and self._doing:
            self._progress(replace(self._last, seconds=self._budget.seconds, memory=memory_in_use()))

    def result(self, *, examine: bool) -> Result:
        """The verdicts. `examine`: look at what makes a pass empty."""
        with self._budget, nullcontext() if self._show is None else following(self._stage):
            self._goals = goals_of(self._problem)
            try:
                return self._checked(examine=examine)
            except Exception as error:
                blamed = None if self._session is None else self._session.blamed(error)
                if blamed is None:
                    raise
                raise blamed from error
            finally:
                if self._session is not None:
                    self._session.close()

    def _checked(self, *, examine: bool) -> Result:
        session: Session | None = None
        try:
            session = self._start(Given(self._problem, self._goals, self._options, self._budget, self._found))
            self._session = session
            with stage(f"searching ({self._name})"):
                session.search()
        except STOPS as stop:
            self._why = self._stopped(stop)
        if session is None:
            return self._unanswered()
        self._budget.grant(GRACE)
        try:
            session.ended(self._why)
        except STOPS as stop:
            self._stopped(stop)
        answered = self._properties(session)
        faults = self._faults(session)
        self._tell(FAULTS, faults.verdict)
        properties = self._explained(answered)
        self._budget.grant(0.0)
        if examine:
            try:
                for extended in self._extended(session, properties):
                    properties = extended
            except KeyboardInterrupt as stop:
                self._stopped(stop)
            except (LimitReached, MemoryError) as stop:
                from llfsm_verify.analysis.vacuity.proved import mark_unexamined

                why = self._stopped(stop)
                properties = tuple(p if p.vacuity.looked != "no" else mark_unexamined((p,), why)[0] for p in properties)
        whole = not self._interrupted
        try:
            session.count()
        except STOPS as stop:
            self._stopped(stop)
        result = self._whole(properties, faults, session.exploration(), whole=whole)
        tell = self._options.decided
        if tell is not None:
            for known in result.known():
                tell(known)
        return result

    def _stopped(self, stop: BaseException) -> str:
        """Remember Ctrl-C; what ended a piece of work, in words."""
        self._interrupted = self._interrupted or isinstance(stop, KeyboardInterrupt)
        return str(stop) or (INTERRUPTED if isinstance(stop, KeyboardInterrupt) else NO_MEMORY)

    def _whole(
        self, properties: tuple[PropertyResult, ...], faults: FaultResult, exploration: Exploration, *, whole: bool
    ) -> Result:
        """`whole`: Ctrl-C did not come before all verdicts were there."""
        decided = Verdict.UNKNOWN not in (faults.verdict, *(p.verdict for p in properties))
        complete = decided if exploration.complete is None else exploration.complete and whole
        return Result(
            arrangement=self._problem.arrangement.name,
            path=self._problem.arrangement.path,
            engine=self._name,
            complete=complete,
            exploration=exploration,
            seconds=self._budget.seconds,
            assumptions=tuple(p.name for p in self._problem.assumptions),
            properties=properties,
            faults=faults,
            interrupted=self._interrupted,
            strict=self._options.strict,
            asked_vacuity=self._options.strict or self._options.vacuity == "all",
            escape=self._escape.trace,
        )

    # -------------------------------------------------- verdicts

    def _unanswered(self) -> Result:
        """A limit or Ctrl-C came before the engine could begin."""
        properties = tuple(self._said(goal, Verdict.UNKNOWN, reason=self._why) for goal in self._goals)
        return self._whole(properties, FaultResult(Verdict.UNKNOWN, (), self._why), Exploration(), whole=False)

    def _said(self, goal: Goal, verdict: Verdict, reason: str | None = None) -> PropertyResult:
        line = goal.line
        assert line.kind != "assume"
        return PropertyResult(line.name, line.kind, line.text, line.span, verdict, self._name, None, reason)

    def _found(self, goal: Goal | None) -> None:
        """Confirm and tell at once what the session knows of a goal, or of faults, while it goes on searching."""
        session, name = self._session, FAULTS if goal is None else goal.line.name
        if self._options.decided is None or session is None or name in self._told:
            return
        try:
            if goal is None:
                self._found_fault(session)
                return
            for answer in session.answers(goal):
                if isinstance(answer, Violated):
                    self._early[name] = self._replayer.violation(goal, answer)
                    self._tell(name, Verdict.VIOLATED)
                elif isinstance(answer, Holds) and self._possible(session):
                    self._tell(name, Verdict.HOLDS)
                return
        except Unconfirmed:
            return  # the end of the search may have a better run

    def _found_fault(self, session: Session) -> None:
        for number, run in session.fault_runs():
            trace = self._replayer.fault(number, run)
            assert trace.fault is not None
            self._early_fault = FaultFinding(trace.fault, trace)
            self._tell(FAULTS, Verdict.VIOLATED)
            return
        if isinstance(session.faults(), Holds):
            self._tell(FAULTS, Verdict.HOLDS)

    def _tell(self, name: str, verdict: Verdict) -> None:
        """Tell a verdict once; a pass when it was looked at, where `strict` asks for that."""
        tell = self._options.decided
        stays = verdict is Verdict.VIOLATED or (verdict is Verdict.HOLDS and not self._options.strict)
        if tell is not None and stays and name not in self._told and (name != FAULTS or self._options.faults):
            self._told.add(name)
            tell(EarlyVerdict(name, verdict, self._name))

    def _properties(self, session: Session) -> list[PropertyResult | ReplayedRun]:
        """What is known of the goals, or the run that violates them, told as soon as it is. After the time limit runs
        that are found to be short are performed first."""
        answered: list[PropertyResult | ReplayedRun] = [self._said(goal, Verdict.UNKNOWN) for goal in self._goals]
        order = list(enumerate(self._goals))
        if self._budget.is_late:
            order.sort(key=lambda each: session.length(each[1]) or 0)
        for at, goal in order:
            result = self._answered(session, goal)
            if isinstance(result, PropertyResult) and result.verdict is Verdict.UNKNOWN:
                result = self._early.get(goal.line.name, result)
            if isinstance(result, ReplayedRun):
                self._tell(goal.line.name, Verdict.VIOLATED)
            elif OPEN.isdisjoint(result.notes):
                self._tell(result.name, result.verdict)
            answered[at] = result
        return answered

    def _answered(self, session: Session, goal: Goal) -> PropertyResult | ReplayedRun:
        """What is known of a goal, or a run that violates it, performed."""
        reason: str | None = None
        """Why it is not known; nothing holds beside a run that was not confirmed."""
        try:
            for answer in session.answers(goal):
                match answer:
                    case Violated():
                        try:
                            self._budget.check_time()
                            replayed = self._replayer.violation(goal, answer)
                        except (*STOPS, Unconfirmed) as stop:
                            reason = self._unconfirmed(stop)
                            continue
                        if not self._budget.is_late:
                            try:
                                replayed = self._replayer.steady(goal, answer, replayed)
                            except STOPS as stop:  # the violation is confirmed as it is
                                self._stopped(stop)
                        return replayed
                    case Holds():
                        if reason is None:
                            return self._held(session, goal, answer)
                        break
                    case Unknown(why, refuted):
                        reason = reason or why
                        if refuted:
                            self.refuted.add(goal.line.name)
                        break
        except STOPS as stop:
            why = self._ended(stop, session.length(goal))
            reason = reason or why
        return self._said(goal, Verdict.UNKNOWN, reason=reason or "the engine does not say")

    def _explained(self, answered: Sequence[PropertyResult | ReplayedRun]) -> tuple[PropertyResult, ...]:
        """The results, with explanations of the violations as far as there is time."""
        pairs = zip(answered, self._goals, strict=True)
        return tuple(r if isinstance(r, PropertyResult) else self._violated(goal, r) for r, goal in pairs)

    def _violated(self, goal: Goal, replayed: ReplayedRun) -> PropertyResult:
        from llfsm_verify.analysis.explanation.explain import explain, hints, unexplained

        said = self._said(goal, Verdict.VIOLATED)
        try:
            self._budget.check_time()
        except LimitReached as limit:
            return replace(said, trace=unexplained(replayed.trace, limit))
        with stage("explaining violations"):
            trace = explain(replayed, goal, self._problem)
        return replace(said, trace=trace, notes=(*_notes(goal, replayed), *hints(trace, self._problem, goal.line)))

    def _held(self, session: Session, goal: Goal, answer: Holds) -> PropertyResult:
        notes = {True: (), False: (NO_RUN,), None: (PERHAPS_NO_RUN,)}[self._possible(session)]
        return replace(self._said(goal, Verdict.HOLDS), notes=notes, proofs=answer.proofs)

    def _possible(self, session: Session) -> bool | None:
        """Whether some run satisfies the assumptions."""
        return session.possible() if self._problem.assumptions else True

    def _ended(self, stop: BaseException, found: int | None) -> str:
        """Why an answer is not known; `found`: the length of a run that the engine has not given."""
        return self._stopped(stop) if found is None else self._unconfirmed(stop)

    def _unconfirmed(self, stop: BaseException) -> str:
        """A violation that the executor has not performed is not shown."""
        return f"a violation was found, but not confirmed: {self._stopped(stop)}"

    def _faults(self, session: Session) -> FaultResult:
        if self._known_faults is not None:
            return self._known_faults
        findings: dict[int, FaultFinding] = {}
        reason: str | None = None
        answer: Holds | Unknown | None = None
        try:
            for number, run in session.fault_runs():
                if number not in findings:
                    try:
                        self._budget.check_time()
                        trace = self._replayer.fault(number, run)
                    except (*STOPS, Unconfirmed) as stop:
                        reason = self._unconfirmed(stop)
                        continue
                    assert trace.fault is not None
                    findings[number] = FaultFinding(trace.fault, trace)
            answer = session.faults()
        except STOPS as stop:
            why = self._ended(stop, session.length(None))
            reason = reason or why
        if not findings and self._early_fault is not None:
            return FaultResult(Verdict.VIOLATED, (self._early_fault,))
        if findings:
            return FaultResult(Verdict.VIOLATED, tuple(findings.values()))
        if isinstance(answer, Holds) and reason is None:
            return FaultResult(Verdict.HOLDS, (), proofs=answer.proofs)
        if isinstance(answer, Unknown):
            reason = reason or answer.reason
        return FaultResult(Verdict.UNKNOWN, (), reason)

    # -------------------------------------------------- beside verdicts

    def _extended(self, session: Session, results: tuple[PropertyResult, ...]) -> Iterator[tuple[PropertyResult, ...]]:
        """The results with what is shown beside verdicts, part after part: how empty passes are, runs of properties
        that hold, more counterexamples. Where one part is ended, those before it stay."""
        explored = session.explored()
        if explored is None:
            parts = self._from_proofs(session, results)
        elif self._interrupted:
            parts = iter(())
        else:
            parts = self._from_space(session, explored, results)
        for part in parts:
            results = part
            yield results
        if self._options.traces > 1 and any(r.trace is not None for r in results):
            yield self._with_others(session, results)

    def _from_space(
        self, session: Session, explored: Explored, results: tuple[PropertyResult, ...]
    ) -> Iterator[tuple[PropertyResult, ...]]:
        options, problem, possible = self._options, self._problem, self._possible(session)
        holds = any(r.verdict is Verdict.HOLDS for r in results)
        if problem.assumptions and possible and holds and self._escape.trace is None:
            budget = share_of(options, self._budget, ESCAPE_LEAST)
            self._escape = look_for_escape(explored, self._replayer, problem, budget)
        results = check_vacuity(explored, possible, problem, self._goals, results, options, self._budget, self._escape)
        yield results
        if options.witnesses:
            from llfsm_verify.analysis.vacuity.witnesses import add_witnesses

            yield add_witnesses(explored, self._replayer, problem, self._goals, results)

    def _from_proofs(
        self, session: Session, results: tuple[PropertyResult, ...]
    ) -> Iterator[tuple[PropertyResult, ...]]:
        """Of an engine that has no space to look into."""
        from llfsm_verify.analysis.vacuity.proved import ProvedPasses, mark_unexamined

        why = f"{self._name} explores no configurations"
        results = tuple(self._unseen(r, why) if r.verdict is Verdict.HOLDS else r for r in results)
        yield results
        ended = INTERRUPTED if self._interrupted else self._why
        if ended is not None:
            yield mark_unexamined(results, ended)
        elif session.asks_again:
            passes = ProvedPasses(self._problem, self._options)
            yield passes.examined(results, self._goals, self._decided, possible=self._possible(session))

    def _unseen(self, result: PropertyResult, why: str) -> PropertyResult:
        from llfsm_verify.analysis.vacuity.witnesses import mark_unwitnessed

        accepted = result.name in self._options.accepted
        vacuity = Vacuity(reason=f"not checked for vacuity: {why}", accepted=accepted)
        unseen = replace(result, vacuity=vacuity)
        return mark_unwitnessed(unseen, why) if self._options.witnesses else unseen

    def _decided(self, problem: Problem, effort: int) -> Mapping[str, bool | None]:
        """Whether other properties hold, by another session with little work."""
        options = Options(self._options.limits.within(self._budget.left), effort=effort, faults=False)
        other = _Check(self._name, self._start, problem, options)
        result = other.result(examine=False)
        if result.interrupted:
            raise KeyboardInterrupt
        return {
            r.name: (False if r.name in other.refuted else None)
            if r.verdict is Verdict.UNKNOWN
            else r.verdict is Verdict.HOLDS
            for r in result.properties
        }

    def _with_others(self, session: Session, results: tuple[PropertyResult, ...]) -> tuple[PropertyResult, ...]:
        """Violated properties with more counterexamples."""
        from llfsm_verify.analysis.enumeration import Others

        others = Others(self._problem, self._options, session)
        try:
            pairs = zip(results, self._goals, strict=True)
            return tuple(r if r.trace is None else others.of(r, g, self._options.traces) for r, g in pairs)
        finally:
            others.close()


@unlimited()
def _notes(goal: Goal, replayed: ReplayedRun) -> tuple[str, ...]:
    """Where on a lasso the property is lost already, whatever comes after."""
    if replayed.loop_letter is None:
        return ()
    try:
        monitor = goal.monitor()
        number = None if monitor is None else lost_at(monitor, goal.atoms, replayed.letters)
    except AutomatonTooLarge:
        return ()
    if number is None:
        return ()
    step = letter_steps(replayed.trace)[number]
    return (f"after step {step} nothing can satisfy it any more; the rest shows that the assumptions can hold",)

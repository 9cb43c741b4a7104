"""The explicit engine: breadth-first exploration, every property against the explored graph, and reductions.

Small spaces are searched as they are. A space that turns out to be large is searched again in its cone of influence;
what is found there is then looked for without it, so that traces do not depend on reductions.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import TYPE_CHECKING

from llfsm_verify.analysis.enumeration.enumerate import Others
from llfsm_verify.analysis.vacuity.check import examined
from llfsm_verify.analysis.vacuity.witnesses import witnessed
from llfsm_verify.checking.goals.goal import Unconfirmed
from llfsm_verify.checking.goals.kinds import goals_of
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.vacuity import NO_RUN, PERHAPS_NO_RUN
from llfsm_verify.checking.verdict import FaultFinding, FaultResult, Options, Progress, PropertyResult, Result, Verdict
from llfsm_verify.engines.explicit.checkpoints import CONTRADICTED, Checkpoints
from llfsm_verify.engines.explicit.counterexamples import Counterexamples
from llfsm_verify.engines.explicit.search import Search, Task
from llfsm_verify.engines.explicit.termination import longest_run
from llfsm_verify.jsonvalue import Json
from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.kripke.graph import Graph
from llfsm_verify.kripke.labels.notes import InputNote
from llfsm_verify.kripke.labels.wide import labels_of
from llfsm_verify.limits import Budget, LimitReached, memory_in_use
from llfsm_verify.program.cone import Cone, cone
from llfsm_verify.program.program import Program

if TYPE_CHECKING:
    from llfsm_verify.kripke.labels.labels import Labels

NAME = "explicit"
REDUCE_FROM = 250_000
"""Nodes from which on a space counts as large."""
PERHAPS_VACUOUS = f"{PERHAPS_NO_RUN}: a limit was reached"
REPEATED, REPEATED_LEAST = 4, 1_000_000
"""A search without reductions, which looks again for what one with them has found, may have that many times as many
nodes (and so many at least); else the trace is that of the reduced one."""
GRACE = 5.0
"""Seconds beyond the time limit in which violations already found are confirmed."""


class ExplicitEngine:
    """Explicit-state search (``--engine explicit``)."""

    name = NAME

    def check(self, problem: Problem, options: Options) -> Result:
        """Verdicts for faults and for every property.

        Raises Disagreement when a trace fails its confirmation; DiagnosticError (E413) in its place, where the search
        went on from a checkpoint.
        """
        return _Session(problem, options).run()


class _Found:
    """A search, and what makes traces of its findings."""

    def __init__(self, search: Search, counterexamples: Counterexamples, reduction: Cone | None, chains: bool) -> None:
        self.search = search
        self.counterexamples = counterexamples
        self.reduction = reduction
        self.chains = chains

    @property
    def name(self) -> str:
        """The reductions, as checkpoints name them."""
        return " ".join([*(["cone"] if self.reduction else []), *(["chains"] if self.chains else [])]) or "plain"

    @property
    def violated(self) -> set[str]:
        return {t.name for t in self.search.tasks if t.violation is not None}


class _Session:
    def __init__(self, problem: Problem, options: Options) -> None:
        self._problem = problem
        self._options = options
        self._ready = False
        self._budget = Budget(options.limits, self._pulse)
        with self._budget:
            self._goals = goals_of(problem)
        self._program = problem.program(keep_all_bits=options.keep_all_bits)
        self._interrupted = False
        self._unlabelled: BaseException | None = None
        """What ended the search for the classes of inputs."""
        self._plain: _Found | None = None
        """The search without reductions, while there is one: traces come from it."""
        self._running = self._unreduced()
        """The search that decides what holds."""
        self._ready = True
        self._most = (0, 0)
        """Configurations and transitions of the largest search given up for one with more reductions."""
        self._checkpoints: Checkpoints | None = None
        if options.checkpoint is not None:
            about: dict[str, Json] = {
                "keep_all_bits": options.keep_all_bits, "cone": options.cone, "chains": options.chains,
                "labels": options.labels,
            }  # fmt: skip
            self._checkpoints = Checkpoints(options.checkpoint, problem, about)

    def _found(self, program: Program, reduction: Cone | None = None, *, chains: bool = False) -> _Found:
        report = self._report if self._options.progress or self._options.checkpoint else None
        with_edges = bool(self._problem.properties)
        labels = self._labels(program)
        explorer = Explorer(program, self._budget, report, with_edges=with_edges, chains=chains, labels=labels)
        counterexamples = Counterexamples(self._problem, explorer, reduction)
        search = Search(explorer, self._problem, self._goals, self._budget)
        return _Found(search, counterexamples, reduction, chains)

    def _labels(self, program: Program) -> Labels | None:
        """The classes of the inputs of a program; where a limit or Ctrl-C ends the search for them, none, and the
        check ends with what it has."""
        try:
            return labels_of(program, self._budget) if self._options.labels else None
        except (KeyboardInterrupt, LimitReached) as stop:
            self._unlabelled = stop
            return None

    @cached_property
    def _cone(self) -> Cone:
        return cone(self._program)

    def _unreduced(self) -> _Found:
        if self._plain is None:
            self._plain = self._found(self._program)
        return self._plain

    def run(self) -> Result:
        """As `ExplicitEngine.check`."""
        try:
            with self._budget:
                return self._result()
        except CONTRADICTED as error:
            if self._checkpoints is None or not self._checkpoints.resumed:
                raise
            raise self._checkpoints.contradicted(error) from error

    def _result(self) -> Result:
        try:
            self._search()
        except KeyboardInterrupt:
            self._interrupted = True
            self._stop("interrupted")
        except (LimitReached, MemoryError) as limit:
            self._stop(str(limit) or "the memory ran out")
        self._budget.grant(GRACE)
        self._save()
        self._budget.grant(GRACE)
        results = tuple(self._result_of(i) for i in range(len(self._problem.properties)))
        faults = self._faults()
        results = self._extended(results)
        complete = self._complete
        self._count()
        running = self._running
        graph = running.search.graph
        states, transitions = graph.configurations, graph.transitions
        if not complete:
            states, transitions = max((states, transitions), self._most)
        return Result(
            arrangement=self._problem.arrangement.name,
            path=self._problem.arrangement.path,
            engine=NAME,
            complete=complete,
            states=states,
            transitions=transitions,
            seconds=self._budget.seconds,
            assumptions=tuple(p.name for p in self._problem.assumptions),
            properties=results,
            faults=faults,
            interrupted=self._interrupted,
            left_out=() if running.reduction is None else running.reduction.left_out,
            stored=len(graph) if running.chains else None,
            counted=running.search.explorer.counted,
            inputs=self._notes,
            strict=self._options.strict,
            asked_vacuity=self._options.strict or self._options.vacuity == "all",
            longest=longest_run(running.search.explorer, self._program) if running is self._plain else None,
            resumed_from=None if self._checkpoints is None else self._checkpoints.source(running.search),
        )

    @property
    def _notes(self) -> tuple[InputNote, ...]:
        labels = self._running.search.explorer.labels
        return () if labels is None else labels.notes

    def _extended(self, results: tuple[PropertyResult, ...]) -> tuple[PropertyResult, ...]:
        """The results with what is shown beside verdicts: how empty passes are, runs of properties that hold, more
        counterexamples."""
        decisive = self._running
        try:
            if self._complete:
                results = examined(decisive.search, self._problem, self._goals, results, self._options, self._budget)
                if self._options.witnesses:
                    made = decisive.counterexamples
                    results = witnessed(decisive.search, made, self._problem, self._goals, results)
            if self._options.traces > 1 and any(r.trace is not None for r in results):
                results = self._with_others(results)
        except KeyboardInterrupt:
            self._interrupted = True
        return results

    def _with_others(self, results: tuple[PropertyResult, ...]) -> tuple[PropertyResult, ...]:
        """Violated properties with more counterexamples."""
        others = Others(self._problem, self._options, self._budget)
        try:
            pairs = zip(results, self._goals, strict=True)
            return tuple(r if r.trace is None else others.of(r, g, self._options.traces) for r, g in pairs)
        finally:
            others.close()

    def _stop(self, why: str) -> None:
        for found in self._all():
            found.search.graph.stopped = found.search.graph.stopped or why

    def _report(self, graph: Graph) -> None:
        if self._checkpoints is not None:
            self._checkpoints.maybe(self._running.search, self._running.name)
        self._show(graph, self._running.search.doing)

    def _pulse(self) -> None:
        """A sign of life in the middle of long work on a graph."""
        if self._ready:
            search = self._running.search
            self._show(search.graph, search.doing)

    def _show(self, graph: Graph, doing: str) -> None:
        if self._options.progress is not None:
            sizes = graph.configurations, graph.expanded, len(graph), graph.depth
            self._options.progress(Progress(*sizes, self._budget.seconds, memory_in_use(), doing))

    def _save(self) -> None:
        """A search that has not come to its end can be continued."""
        graph = self._running.search.graph
        if self._checkpoints is not None and (self._interrupted or graph.stopped) and not graph.exhausted:
            self._checkpoints.now(self._running.search, self._running.name)

    # -------------------------------------------------- searching

    def _search(self) -> None:
        self._running = self._first()
        self._check_labels()
        if self._checkpoints is not None:
            self._resume(self._checkpoints)
        while not self._running.search.run(REDUCE_FROM if any(self._open_reductions) else None):
            stronger = self._stronger()
            if stronger is None:
                self._running.search.run()
                break
            self._give_up(self._running)
            self._running = stronger
            self._check_labels()
        running = self._running
        names, faults = running.violated, running.search.graph.faults
        if running is not self._plain and (names or faults):
            most = max(REPEATED_LEAST, REPEATED * len(running.search.graph))
            plain = self._unreduced()
            self._check_labels()
            plain.search.find(names, faults, most)

    def _check_labels(self) -> None:
        """Raises what ended the search for classes: a search that was not asked for is not begun."""
        if self._unlabelled is not None:
            raise self._unlabelled

    def _give_up(self, found: _Found) -> None:
        """Give the memory of a search back, for one with more reductions."""
        graph = found.search.graph
        self._most = max(self._most, (graph.configurations, graph.transitions))
        found.search.explorer.close()
        if found is self._plain:
            self._plain = None

    def _first(self) -> _Found:
        """The search to begin with: a saved one, or with the reductions that are asked for."""
        options, saved = self._options, None if self._checkpoints is None else self._checkpoints.search
        with_cone, with_chains = options.cone == "on", options.chains == "on"
        if saved is not None:
            with_cone, with_chains = "cone" in saved, "chains" in saved
        return self._with(with_cone, with_chains)

    def _with(self, with_cone: bool, with_chains: bool) -> _Found:
        """The search with these reductions, as far as they are possible and reduce anything."""
        reduction = self._cone if with_cone else None
        if reduction is not None and not reduction.left_out:
            reduction = None
        with_chains = with_chains and self._program.observe == "ringlet"
        if reduction is None and not with_chains:
            return self._unreduced()
        return self._found(self._program if reduction is None else reduction.program, reduction, chains=with_chains)

    @property
    def _open_reductions(self) -> tuple[bool, bool]:
        """Whether the cone, and whether chains, are still to be tried should the space be large."""
        options, running = self._options, self._running
        useful = bool(self._problem.properties)
        cut = useful and options.cone == "auto" and not options.keep_all_bits and running.reduction is None
        return cut, useful and options.chains == "auto" and not running.chains

    def _stronger(self) -> _Found | None:
        """A search with more reductions than the one that has found the space to be large; None: there is none."""
        running = self._running
        cut, chained = self._open_reductions
        cut = cut and self._varies(running.search.explorer)
        chained = chained and running.search.explorer.is_worth_chains()
        found = self._with(cut or running.reduction is not None, chained or running.chains)
        return None if found.name == running.name else found

    def _varies(self, explorer: Explorer) -> bool:
        """Whether anything that the cone leaves out has different values, as far as a sample tells."""
        kept = {v.name for v in self._cone.program.vars}
        return explorer.varies([v.name for v in self._program.vars if not v.output and v.name not in kept])

    def _resume(self, checkpoints: Checkpoints) -> None:
        if checkpoints.search is not None:
            checkpoints.restore(self._running.search, self._running.name)
        if checkpoints.note is not None and self._options.tell is not None:
            self._options.tell(checkpoints.note)

    def _all(self) -> Iterator[_Found]:
        """The searches, those whose traces are preferred first."""
        if self._plain is not None:
            yield self._plain
        if self._running is not self._plain:
            yield self._running

    @property
    def _complete(self) -> bool:
        return self._running.search.complete and not self._interrupted

    def _count(self) -> None:
        """Count what chains have passed over; the verdicts do not need it."""
        search = self._running.search
        search.doing = "counting what chains have passed over"
        try:
            search.explorer.count()
        except KeyboardInterrupt:
            self._interrupted = True

    # -------------------------------------------------- verdicts

    def _result_of(self, index: int) -> PropertyResult:
        line = self._problem.properties[index]
        verdict, reason, trace = Verdict.UNKNOWN, None, None
        notes: tuple[str, ...] = ()
        for found in self._all():
            task = found.search.tasks[index]
            if task.violation is not None and trace is None:
                try:
                    trace, notes = found.counterexamples.of_property(task.goal, found.search.assumed, task.violation)
                    verdict, reason = Verdict.VIOLATED, None
                except (KeyboardInterrupt, LimitReached, Unconfirmed) as stop:
                    reason = self._unconfirmed(stop)
        decisive = self._running.search
        task = decisive.tasks[index]
        if trace is None and reason is None:
            if task.reason is None and task.clean and self._complete:
                verdict = Verdict.HOLDS
                notes = {True: (NO_RUN,), False: (), None: (PERHAPS_VACUOUS,)}[decisive.vacuous]
            else:
                reason = self._why_unknown(task, decisive.graph)
        assert line.kind != "assume"
        return PropertyResult(line.name, line.kind, line.text, line.span, verdict, NAME, trace, reason, notes)

    def _why_unknown(self, task: Task, graph: Graph) -> str:
        return task.reason or graph.stopped or _overflow(graph) or "the exploration was cut short"

    def _unconfirmed(self, stop: BaseException) -> str:
        """A violation that nobody has performed is not shown."""
        self._interrupted = self._interrupted or isinstance(stop, KeyboardInterrupt)
        return f"a violation was found, but not confirmed: {str(stop) or 'interrupted'}"

    def _faults(self) -> FaultResult:
        findings: dict[int, FaultFinding] = {}
        decisive = self._running.search.graph
        reason = decisive.stopped or _overflow(decisive)
        for found in self._all():
            graph = found.search.graph
            for number, node in sorted(graph.faults.items()):
                if number not in findings:
                    try:
                        trace = found.counterexamples.of_fault(number, graph.path_to(node))
                        findings[number] = FaultFinding(self._program.faults[number], trace)
                    except (KeyboardInterrupt, LimitReached) as stop:
                        reason = self._unconfirmed(stop)
        if findings:
            return FaultResult(Verdict.VIOLATED, tuple(findings[n] for n in sorted(findings)))
        if self._complete and not decisive.faults:
            return FaultResult(Verdict.HOLDS, ())
        return FaultResult(Verdict.UNKNOWN, (), reason)


def _overflow(graph: Graph) -> str | None:
    if graph.overflow is None:
        return None
    return "a value of type int left the 64 bits in which the executor holds it"

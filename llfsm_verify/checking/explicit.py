"""The explicit engine: breadth-first exploration, every property against the explored graph, and reductions.

Small spaces are searched as they are. A space that turns out to be large is searched again in its cone of influence;
what is found there is then looked for without it, so that traces do not depend on reductions.
"""

from __future__ import annotations

import time
from collections.abc import Iterator

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.binding import Bound
from llfsm_verify.checking.checkpoints import Checkpoints
from llfsm_verify.checking.counterexamples import Counterexamples, LoopTooLong
from llfsm_verify.checking.limits import Budget, memory_in_use
from llfsm_verify.checking.searching import Search, Task
from llfsm_verify.checking.verdict import FaultFinding, FaultResult, Options, Progress, PropertyResult, Result, Verdict
from llfsm_verify.kripke.checkpoint import Json
from llfsm_verify.kripke.explore import Explorer, LimitReached
from llfsm_verify.kripke.graph import Graph
from llfsm_verify.semantics.cone import Cone, cone
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.semantics.program import Program

NAME = "explicit"
REDUCE_FROM = 1_000_000
"""Nodes from which on a space counts as large."""
VACUOUS = "no run satisfies the assumptions, so this says nothing"
GRACE = 5.0
"""Seconds beyond the time limit in which violations already found are confirmed."""


class ExplicitEngine:
    """Explicit-state search (``--engine explicit``)."""

    name = NAME

    def check(self, arrangement: Arrangement, properties: Bound, options: Options) -> Result:
        """Verdicts for faults and for every property. Raises Disagreement when a trace fails its confirmation."""
        return _Session(arrangement, properties, options).run()


class _Found:
    """A search, and what makes traces of its findings."""

    def __init__(self, search: Search, counterexamples: Counterexamples) -> None:
        self.search = search
        self.counterexamples = counterexamples

    @property
    def violated(self) -> set[str]:
        return {t.line.name for t in self.search.tasks if t.violation is not None}


class _Session:
    def __init__(self, arrangement: Arrangement, bound: Bound, options: Options) -> None:
        self._arrangement = arrangement
        self._bound = bound
        self._options = options
        self._budget = Budget(options.limits)
        self._program = lower(arrangement, bound.atoms, keep_all_bits=options.keep_all_bits)
        self._interrupted = False
        self._cone: Cone | None = None
        self._plain = self._found(self._program, None)
        self._reduced: _Found | None = None
        self._running = self._plain
        self._checkpoints: Checkpoints | None = None
        if options.checkpoint is not None:
            about: dict[str, Json] = {"keep_all_bits": options.keep_all_bits, "cone": options.cone}
            self._checkpoints = Checkpoints(options.checkpoint, arrangement, bound, about)

    def _found(self, program: Program, reduction: Cone | None) -> _Found:
        report = self._report if self._options.progress or self._options.checkpoint else None
        explorer = Explorer(program, self._budget, report, with_edges=bool(self._bound.properties))
        counterexamples = Counterexamples(self._arrangement, self._bound, explorer, self._budget.tick, reduction)
        return _Found(Search(explorer, self._bound, self._budget), counterexamples)

    def run(self) -> Result:
        started = time.monotonic()
        try:
            self._search()
        except KeyboardInterrupt:
            self._interrupted = True
            for found in self._all():
                found.search.graph.stopped = found.search.graph.stopped or "interrupted"
        self._budget.grant(GRACE)
        self._save()
        self._budget.grant(GRACE)
        results = tuple(self._result(i) for i in range(len(self._bound.properties)))
        faults = self._faults()
        decisive = self._reduced or self._plain
        graph = decisive.search.graph
        return Result(
            arrangement=self._arrangement.name,
            path=self._arrangement.path,
            engine=NAME,
            complete=self._complete(decisive),
            states=graph.configurations,
            transitions=graph.transitions,
            seconds=time.monotonic() - started,
            assumptions=tuple(p.name for p in self._bound.assumptions),
            properties=results,
            faults=faults,
            interrupted=self._interrupted,
            left_out=() if self._cone is None else self._cone.left_out,
        )

    def _report(self, graph: Graph) -> None:
        if self._checkpoints is not None:
            self._checkpoints.maybe(self._running.search, self._name)
        if self._options.progress is not None:
            seconds = self._budget.seconds
            self._options.progress(
                Progress(graph.configurations, graph.expanded, len(graph), graph.depth, seconds, memory_in_use())
            )

    @property
    def _name(self) -> str:
        return "plain" if self._running is self._plain else "cone"

    def _save(self) -> None:
        """A search that has not come to its end can be gone on with."""
        graph = self._running.search.graph
        if self._checkpoints is not None and (self._interrupted or graph.stopped) and not graph.exhausted:
            self._checkpoints.now(self._running.search, self._name)

    # -------------------------------------------------- searching

    def _search(self) -> None:
        plain, options, saved = self._plain.search, self._options, None
        if self._checkpoints is not None:
            saved = self._checkpoints.search
            if saved == "plain":
                self._checkpoints.restore(plain)
            if self._checkpoints.note is not None and saved != "cone" and options.tell is not None:
                options.tell(self._checkpoints.note)
        if options.cone == "off" or (options.cone == "auto" and (options.keep_all_bits or not self._bound.properties)):
            plain.run()
            return
        if options.cone == "auto" and saved != "cone" and plain.run(REDUCE_FROM):
            return
        reduction = cone(self._program)
        if not reduction.left_out:
            plain.run()
            return
        self._cone = reduction
        self._reduced = self._found(reduction.program, reduction)
        self._running, reduced = self._reduced, self._reduced.search
        if self._checkpoints is not None and saved == "cone":
            self._checkpoints.restore(reduced)
            if self._checkpoints.note is not None and options.tell is not None:
                options.tell(self._checkpoints.note)
        reduced.run()
        plain.find(self._reduced.violated, reduced.graph.faults)

    def _all(self) -> Iterator[_Found]:
        """The searches, those whose traces are preferred first."""
        yield self._plain
        if self._reduced is not None:
            yield self._reduced

    def _complete(self, found: _Found) -> bool:
        return found.search.complete and not self._interrupted

    # -------------------------------------------------- verdicts

    def _result(self, index: int) -> PropertyResult:
        line = self._bound.properties[index]
        verdict, reason, trace = Verdict.UNKNOWN, None, None
        notes: tuple[str, ...] = ()
        for found in self._all():
            task = found.search.tasks[index]
            if task.violation is not None and trace is None:
                try:
                    trace, notes = found.counterexamples.of_property(
                        line, task.formula, found.search.assumed, task.violation
                    )
                    verdict, reason = Verdict.VIOLATED, None
                except (KeyboardInterrupt, LimitReached, LoopTooLong) as stop:
                    reason = self._unconfirmed(stop)
        decisive = self._reduced or self._plain
        task = decisive.search.tasks[index]
        if trace is None and reason is None:
            if task.reason is None and task.clean and self._complete(decisive):
                verdict = Verdict.HOLDS
                notes = (VACUOUS,) if decisive.search.vacuous else ()
            else:
                reason = self._why_unknown(task, decisive.search.graph)
        return PropertyResult(line.name, "ltl", line.text, line.span, verdict, NAME, trace, reason, notes)

    def _why_unknown(self, task: Task, graph: Graph) -> str:
        return task.reason or graph.stopped or _overflow(graph) or "the exploration was cut short"

    def _unconfirmed(self, stop: BaseException) -> str:
        """A violation that nobody has performed is not shown."""
        self._interrupted = self._interrupted or isinstance(stop, KeyboardInterrupt)
        return f"a violation was found, but not confirmed: {str(stop) or 'interrupted'}"

    def _faults(self) -> FaultResult:
        findings: dict[int, FaultFinding] = {}
        decisive = (self._reduced or self._plain).search.graph
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
        if self._complete(self._reduced or self._plain) and not decisive.faults:
            return FaultResult(Verdict.HOLDS, ())
        return FaultResult(Verdict.UNKNOWN, (), reason)


def _overflow(graph: Graph) -> str | None:
    if graph.overflow is None:
        return None
    return "a value of type int left the 64 bits in which the executor holds it"

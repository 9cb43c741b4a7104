"""The explicit engine: breadth-first exploration, then every property against the explored graph."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.safety import BadPrefix, safety
from llfsm_verify.automata.translate import translate
from llfsm_verify.checking.binding import Bound
from llfsm_verify.checking.counterexamples import Counterexamples
from llfsm_verify.checking.limits import Budget, memory_in_use
from llfsm_verify.checking.search import (
    Product,
    Projection,
    Reader,
    Walk,
    accepting_lasso,
    continued_bad_prefix,
    shortest_bad_prefix,
)
from llfsm_verify.checking.verdict import FaultFinding, FaultResult, Options, Progress, PropertyResult, Result, Verdict
from llfsm_verify.kripke.explore import Explorer, LimitReached
from llfsm_verify.kripke.graph import Graph
from llfsm_verify.logic.formula import Formula, apply, atom, atoms, negation
from llfsm_verify.logic.properties import Property
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.semantics.program import Program, Unbounded

NAME = "explicit"
FIRST_LOOK = 2_000
"""Configurations after which the properties are first looked at; then each time the graph has grown fourfold, so that a
violation near the start is found in a space that never ends."""
GROWTH = 4
VACUOUS = "no run satisfies the assumptions, so this says nothing"
GRACE = 5.0
"""Seconds beyond the time limit in which violations already found are confirmed."""


class ExplicitEngine:
    """Explicit-state search (``--engine explicit``)."""

    name = NAME

    def check(self, arrangement: Arrangement, properties: Bound, options: Options) -> Result:
        """Verdicts for faults and for every property. Raises Disagreement when a trace fails its confirmation."""
        return _Session(arrangement, properties, options).run()


@dataclass(slots=True)
class _Task:
    """One property, what is known of it so far, and its automata."""

    line: Property
    formula: Formula
    atoms: tuple[str, ...]
    prepared: bool = False
    monitor: BadPrefix | None = None
    """None once prepared: it would be too large, and only infinite runs are looked at."""
    safe: bool = False
    violation: Walk | None = None
    clean: bool = False
    """Looked for in all of the last graph, and not found."""
    reason: str | None = None


class _Session:
    def __init__(self, arrangement: Arrangement, bound: Bound, options: Options) -> None:
        self._arrangement = arrangement
        self._bound = bound
        self._options = options
        self._budget = Budget(options.limits)
        self._program: Program = lower(arrangement, bound.atoms, keep_all_bits=options.keep_all_bits)
        self._explorer = Explorer(
            self._program, self._budget, self._report if options.progress else None, with_edges=bool(bound.properties)
        )
        self._graph: Graph = self._explorer.graph
        self._streett = [f for f in self._program.fairness if f.premise is not None]
        self._assumed = [_formula(p) for p in bound.assumptions]
        self._tasks = [_Task(p, _formula(p), _atoms(_formula(p))) for p in bound.properties]
        self._bits = {name: i for i, name in enumerate(self._explorer.observed)}
        self._readers: dict[Formula, Reader | AutomatonTooLarge] = {}
        self._interrupted = False
        self._vacuous = False
        self._counterexamples = Counterexamples(arrangement, bound, self._explorer, self._budget.tick)

    def run(self) -> Result:
        started = time.monotonic()
        try:
            self._search()
        except KeyboardInterrupt:
            self._interrupted = True
            self._graph.stopped = "interrupted"
        complete = self._graph.complete and not self._interrupted
        self._budget.grant(GRACE)
        results = tuple(self._result(task, complete) for task in self._tasks)
        faults = self._faults(complete)
        return Result(
            arrangement=self._arrangement.name,
            path=self._arrangement.path,
            engine=NAME,
            complete=complete,
            states=self._graph.configurations,
            transitions=self._graph.transitions,
            seconds=time.monotonic() - started,
            assumptions=tuple(p.name for p in self._bound.assumptions),
            properties=results,
            faults=faults,
            interrupted=self._interrupted,
        )

    # -------------------------------------------------- search

    def _report(self, graph: Graph) -> None:
        assert self._options.progress is not None
        self._options.progress(
            Progress(graph.configurations, graph.expanded, graph.depth, self._budget.seconds, memory_in_use())
        )

    def _search(self) -> None:
        unbounded = any(isinstance(v.type, Unbounded) for v in self._program.vars)
        target = FIRST_LOOK
        while True:
            self._explorer.explore(target if self._tasks else None)
            for task in self._tasks:
                if task.violation is None:
                    self._look(task)
            if self._graph.exhausted or self._graph.stopped:
                self._check_assumptions()
                return
            if unbounded and self._tasks and all(t.violation for t in self._tasks):
                self._graph.stopped = "every property is violated, and this arrangement may have no end"
                return
            target = len(self._graph) * GROWTH

    def _look(self, task: _Task) -> None:
        """Search the graph as it is for a violation; `clean` tells that there is none in it, `reason` why that is not
        known. A bad prefix is looked for even where the automata for infinite runs are too large."""
        task.clean, task.reason = False, None
        try:
            task.violation = self._violation(task)
            task.clean = task.violation is None
        except (LimitReached, AutomatonTooLarge) as limit:
            task.reason = str(limit)

    def _violation(self, task: _Task) -> Walk | None:
        roots = self._explorer.first_letters
        tick = self._budget.tick
        if not task.prepared:
            task.prepared = True
            task.monitor = _monitor(task, tick)
            task.safe = task.monitor is not None and safety(task.formula, tick=tick).holds
        if task.monitor is not None:
            project = self._projection(task.atoms)
            if self._assumed:
                found = continued_bad_prefix(roots, task.monitor, project, self._assumptions_product(), tick)
                if found is not None:
                    return found
            else:
                found = shortest_bad_prefix(self._graph, roots, task.monitor, project, tick)
                if found is not None or task.safe:
                    return found
        wrong = self._reader(negation(task.formula))
        return accepting_lasso(self._graph, roots, [*self._assumption_readers(), wrong], self._fair_bits, tick)

    def _assumption_readers(self) -> list[Reader]:
        return [self._reader(f) for f in (*self._assumed, *self._premised())]

    def _assumptions_product(self) -> Product:
        return Product(self._graph, self._assumption_readers(), self._fair_bits, self._budget.tick)

    @property
    def _fair_bits(self) -> list[int]:
        return [self._bits[f.goal] for f in self._program.fairness if f.premise is None]

    def _check_assumptions(self) -> None:
        """Whether any run of the complete graph satisfies the assumptions; if none does, a *holds* says nothing."""
        if self._assumed and self._graph.complete:
            assumed = self._assumptions_product()
            try:
                self._vacuous = assumed.lasso(assumed.initial(self._explorer.first_letters)) is None
            except (LimitReached, AutomatonTooLarge):
                return

    def _reader(self, formula: Formula) -> Reader:
        found = self._readers.get(formula)
        if found is None:
            names = atoms(formula)
            try:
                found = Reader(translate(formula, names, tick=self._budget.tick), self._projection(names))
            except AutomatonTooLarge as error:
                found = error
            self._readers[formula] = found
        if isinstance(found, AutomatonTooLarge):
            raise found
        return found

    def _premised(self) -> list[Formula]:
        """Fairness with a premise, as formulas over its outputs."""
        return [
            apply("implies", apply("G", apply("F", atom(f.premise))), apply("G", apply("F", atom(f.goal))))
            for f in self._streett
            if f.premise is not None
        ]

    def _projection(self, names: Sequence[str]) -> Projection:
        return Projection([self._bits[n] for n in names])

    # -------------------------------------------------- verdicts

    def _result(self, task: _Task, complete: bool) -> PropertyResult:
        line = task.line
        verdict, reason, trace = Verdict.UNKNOWN, task.reason, None
        notes: tuple[str, ...] = ()
        if task.violation is not None:
            try:
                trace, notes = self._counterexamples.of_property(line, task.formula, self._assumed, task.violation)
                verdict, reason = Verdict.VIOLATED, None
            except (KeyboardInterrupt, LimitReached) as stop:
                reason = self._unconfirmed(stop)
        elif task.reason is None and complete and task.clean:
            verdict = Verdict.HOLDS
            notes = (VACUOUS,) if self._vacuous else ()
        elif reason is None:
            reason = self._graph.stopped or self._overflow() or "the exploration was cut short"
        return PropertyResult(line.name, "ltl", line.text, line.span, verdict, NAME, trace, reason, notes)

    def _unconfirmed(self, stop: BaseException) -> str:
        """A violation that nobody has performed is not shown."""
        self._interrupted = self._interrupted or isinstance(stop, KeyboardInterrupt)
        return f"a violation was found, but not confirmed: {str(stop) or 'interrupted'}"

    def _overflow(self) -> str | None:
        if self._graph.overflow is None:
            return None
        return "a value of type int left the 64 bits in which the executor holds it"

    def _faults(self, complete: bool) -> FaultResult:
        findings = []
        reason = self._graph.stopped or self._overflow()
        for number, node in sorted(self._graph.faults.items()):
            try:
                trace = self._counterexamples.of_fault(number, self._graph.path_to(node))
                findings.append(FaultFinding(self._program.faults[number], trace))
            except (KeyboardInterrupt, LimitReached) as stop:
                reason = self._unconfirmed(stop)
        if findings:
            return FaultResult(Verdict.VIOLATED, tuple(findings))
        if complete and not self._graph.faults:
            return FaultResult(Verdict.HOLDS, ())
        return FaultResult(Verdict.UNKNOWN, (), reason)


def _monitor(task: _Task, tick: Callable[[], None]) -> BadPrefix | None:
    """The bad-prefix monitor; None when it would be too large, and only infinite runs are looked at."""
    try:
        return BadPrefix(task.formula, task.atoms, tick)
    except AutomatonTooLarge:
        return None


def _formula(line: Property) -> Formula:
    assert line.formula is not None, "regular properties are refused by the parser"
    return line.formula


def _atoms(formula: Formula) -> tuple[str, ...]:
    return tuple(sorted(atoms(formula)))

"""The explicit engine: breadth-first exploration, every property against the explored graph, and reductions.

Small spaces are searched as they are. A space that turns out to be large is searched again in its cone of influence;
what is found there is then looked for without it, so that traces do not depend on reductions.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property, partial
from typing import TYPE_CHECKING

from llfsm_verify.backends.native.code import OVERFLOW
from llfsm_verify.checking.engine import Answer, Explored, Given, Holds, Session, Unknown, Violated
from llfsm_verify.checking.goals.goal import Goal
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.replay.overflow import overflow_text
from llfsm_verify.checking.verdict import Exploration, Progress
from llfsm_verify.engines.explicit.explored import ExploredGraph, Schedules, longest_run
from llfsm_verify.engines.explicit.options import ExplicitOptions
from llfsm_verify.engines.explicit.search import Search
from llfsm_verify.jsonvalue import Json
from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.kripke.graph import Graph
from llfsm_verify.kripke.labels.wide import labels_of
from llfsm_verify.kripke.witnesses import NoWitness
from llfsm_verify.limits import LimitReached, memory_in_use, processors
from llfsm_verify.program.program import Program

if TYPE_CHECKING:
    from llfsm_verify.engines.explicit.checkpoints import Checkpoints
    from llfsm_verify.kripke.labels.labels import Labels
    from llfsm_verify.transforms.cone import Cone

REDUCE_FROM = 250_000
"""Nodes from which on a space counts as large."""
REPEATED, REPEATED_LEAST = 4, 1_000_000
"""A search without reductions, which looks again for what one with them has found, may have that many times as many
nodes (and so many at least); else the trace is that of the reduced one."""


class _Found:
    """A search, and what makes schedules of its findings."""

    def __init__(self, search: Search, reduction: Cone | None, chains: bool) -> None:
        self.search = search
        self.schedules = Schedules(search.explorer, reduction)
        self.reduction = reduction
        self.chains = chains

    @property
    def name(self) -> str:
        """The reductions, as checkpoints name them."""
        return " ".join([*(["cone"] if self.reduction else []), *(["chains"] if self.chains else [])]) or "plain"

    @property
    def violated(self) -> set[str]:
        return {t.name for t in self.search.tasks if t.violation is not None}


class ExplicitSession(Session):
    """Explicit-state search (``--engine explicit``).

    DiagnosticError: a checkpoint that was named cannot be used. One that says what the arrangement does not do is found
    out when its runs are performed (E413).
    """

    def __init__(self, given: Given) -> None:
        self._problem = given.problem
        self._options = given.options
        self._own = given.options.of(ExplicitOptions)
        self._jobs = self._own.jobs or processors()
        self._budget = given.budget
        self._goals = given.goals
        self._tell = given.found
        self._ready = False
        self._program = given.problem.program(keep_all_bits=given.options.keep_all_bits)
        self._unlabelled: BaseException | None = None
        """What ended the search for the classes of inputs."""
        self._known_labels: dict[int, Labels | None] = {}
        """Classes of inputs by identity of the program, the whole one or its cone: searches come and go, these stay."""
        self._large = False
        """The space is known to be large, and edges are stored only where a property needs them, or a checkpoint."""
        self._plain: _Found | None = None
        """The search without reductions, while there is one: traces come from it."""
        self._running = self._unreduced()
        """The search that decides what holds."""
        self._ready = True
        self._most = (0, 0)
        """Configurations and transitions of the largest search given up for one with more reductions."""
        self._checkpoints: Checkpoints | None = None
        own = self._own
        if own.checkpoint is not None:
            about: dict[str, Json] = {
                "keep_all_bits": given.options.keep_all_bits, "cone": own.cone, "chains": own.compression,
                "labels": own.labels,
            }  # fmt: skip
            from llfsm_verify.engines.explicit.checkpoints import Checkpoints

            self._checkpoints = Checkpoints(own.checkpoint, self._problem, about, given.options.tell)

    def _found(self, program: Program, reduction: Cone | None = None, *, chains: bool = False) -> _Found:
        report = self._report if self._options.progress or self._own.checkpoint else None
        with_edges = bool(self._problem.properties)
        labels = self._labels(program)
        explorer = Explorer(
            program, self._budget, report, with_edges=with_edges, chains=chains, labels=labels, jobs=self._jobs
        )
        search = Search(explorer, self._problem, self._goals, self._tell)
        if self._large:
            search.drop_edges()
        return _Found(search, reduction, chains)

    def _labels(self, program: Program) -> Labels | None:
        """The classes of the inputs of a program; where a limit or Ctrl-C ends the search for them, none, and the
        check ends with what it has."""
        if not self._own.labels:
            return None
        if id(program) not in self._known_labels:
            try:
                self._known_labels[id(program)] = labels_of(program, self._budget)
            except (KeyboardInterrupt, LimitReached) as stop:
                self._unlabelled = stop
                return None
        return self._known_labels[id(program)]

    @cached_property
    def _cone(self) -> Cone:
        from llfsm_verify.transforms.cone import cone

        return replace(cone(self._program), late=self._problem.forgetting.late)

    def _unreduced(self) -> _Found:
        if self._plain is None:
            self._plain = self._found(self._program)
        return self._plain

    def ended(self, why: str | None) -> None:
        if why is not None:
            for found in self._all():
                found.search.graph.stopped = found.search.graph.stopped or why
        graph = self._running.search.graph
        if self._checkpoints is not None and graph.stopped and not graph.exhausted:  # it can be continued
            self._checkpoints.now(self._running.search, self._running.name)

    def blamed(self, error: Exception) -> Exception | None:
        return None if self._checkpoints is None else self._checkpoints.contradicted(error)

    def _report(self, graph: Graph) -> None:
        if self._checkpoints is not None:
            self._checkpoints.maybe(self._running.search, self._running.name)
        self._show(graph, self._running.search.doing)

    def pulse(self) -> None:
        if self._ready:
            search = self._running.search
            self._show(search.graph, search.doing)

    def _show(self, graph: Graph, doing: str) -> None:
        if self._options.progress is not None:
            sizes = graph.configurations, graph.expanded, len(graph), graph.depth
            self._options.progress(Progress(*sizes, self._budget.seconds, memory_in_use(), doing))

    # -------------------------------------------------- searching

    def search(self) -> None:
        self._running = self._first()
        self._check_labels()
        if self._checkpoints is not None:
            self._resume(self._checkpoints)
        while not self._running.search.run(REDUCE_FROM if self._may_reduce else None):
            self._large = self._checkpoints is None
            if self._large:
                self._running.search.drop_edges()
            stronger = self._stronger()
            if stronger is None:
                self._running.search.run()
                break
            self._give_up(self._running)
            self._running = stronger
            self._check_labels()
        running = self._running
        names, faults = running.violated, running.search.graph.faults
        if running is not self._plain and (names or faults) and not self._budget.is_late:
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
        options, saved = self._own, None if self._checkpoints is None else self._checkpoints.search
        with_cone, with_chains = options.cone == "on", options.compression == "on"
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
    def _may_reduce(self) -> bool:
        """Whether a space that turns out to be large is searched in another way from then on."""
        drops = bool(self._problem.properties) and self._checkpoints is None and not self._large
        return drops or any(self._open_reductions)

    @property
    def _open_reductions(self) -> tuple[bool, bool]:
        """Whether the cone, and whether chains, are still to be tried should the space be large."""
        options, running = self._own, self._running
        useful = bool(self._problem.properties)
        cut = useful and options.cone == "auto" and not self._options.keep_all_bits and running.reduction is None
        return cut, useful and options.compression == "auto" and not running.chains

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

    # -------------------------------------------------- answers

    def length(self, goal: Goal | None) -> int | None:
        if goal is None:
            return 0 if any(found.search.graph.faults for found in self._all()) else None
        index = self._index(goal)
        walks = (found.search.tasks[index].violation for found in self._all())
        return next((len(walk.nodes) for walk in walks if walk is not None), None)

    def _index(self, goal: Goal) -> int:
        return next(i for i, other in enumerate(self._goals) if other is goal)

    def answers(self, goal: Goal) -> Iterator[Answer]:
        index = self._index(goal)
        for found in self._all():
            walk = found.search.tasks[index].violation
            if walk is not None:
                self._perform(f"violates {goal.line.name}")
                yield found.schedules.of_walk(walk)
        decisive = self._running.search
        task = decisive.tasks[index]
        if decisive.is_clean(task):
            yield Holds()
        else:
            yield Unknown(task.reason or self._why_unknown())

    def _perform(self, what: str) -> None:
        """Say that what was found is performed now, which takes a while where runs are long. LimitReached: it is not,
        since the time is over."""
        self._budget.check_time()
        self._running.search.doing = f"performing a run that {what}"
        self.pulse()

    def fault_runs(self) -> Iterator[tuple[int, Violated]]:
        numbers = sorted({number for found in self._all() for number in found.search.graph.faults})
        for number in numbers:
            for found in self._all():
                graph = found.search.graph
                if number in graph.faults:
                    self._perform("faults")
                    yield number, found.schedules.of_fault(number, graph.path_to(graph.faults[number]))

    def faults(self) -> Holds | Unknown:
        decisive = self._running.search
        if decisive.complete and not decisive.graph.faults:
            return Holds()
        return Unknown(self._why_unknown())

    def possible(self) -> bool | None:
        return self._running.search.possible

    def explored(self) -> Explored | None:
        if not self._running.search.complete:
            return None
        running = self._running
        search = Search(running.search.explorer, self._problem, ())
        has_edges = search.graph.with_edges or not self._problem.properties
        return ExploredGraph(search, running.schedules, again=None if has_edges else partial(self._again, running))

    def _again(self, found: _Found) -> tuple[Search, Schedules]:
        """A search once more, with its edges."""
        program = found.search.explorer.program
        labels = self._labels(program)
        explorer = Explorer(program, self._budget, chains=found.chains, labels=labels, jobs=self._jobs)
        return Search(explorer, self._problem, ()), Schedules(explorer, found.reduction)

    def watching(self, problem: Problem, nodes: int) -> Explored:
        program = problem.program(keep_all_bits=self._options.keep_all_bits)
        try:
            labels = labels_of(program, self._budget) if self._own.labels else None
        except LimitReached:
            labels = None  # the limit ends the exploration just as well
        explorer = Explorer(program, self._budget, labels=labels, jobs=self._jobs)
        return ExploredGraph(Search(explorer, problem, ()), Schedules(explorer), nodes)

    def count(self) -> None:
        search = self._running.search
        search.doing = "counting what chains have passed over"
        search.explorer.count()

    def exploration(self) -> Exploration:
        running = self._running
        graph, labels = running.search.graph, running.search.explorer.labels
        states, transitions = graph.configurations, graph.transitions
        if not graph.complete:
            states, transitions = max((states, transitions), self._most)
        return Exploration(
            complete=graph.complete,
            states=states,
            transitions=transitions,
            left_out=() if running.reduction is None else running.reduction.left_out,
            stored=len(graph) if running.chains else None,
            counted=running.search.explorer.counted,
            inputs=() if labels is None else labels.notes,
            longest=longest_run(running.search.explorer, self._program) if running is self._plain else None,
            resumed_from=None if self._checkpoints is None else self._checkpoints.source(running.search),
        )

    def _why_unknown(self) -> str:
        graph = self._running.search.graph
        if graph.stopped is None and graph.overflow is not None:
            return self._overflow
        return graph.unfinished or "the exploration was cut short"

    @cached_property
    def _overflow(self) -> str:
        """Where the first of the steps that leave 64 bits is, once the search has ended."""
        graph = self._running.search.graph
        assert graph.overflow is not None
        try:
            run = self._running.schedules.of_fault(OVERFLOW - 1, graph.path_to(graph.overflow))
        except NoWitness:  # the step is in the middle of a chain
            return graph.unfinished or ""
        return overflow_text(self._problem.arrangement, self._problem.performed(), run.schedule)

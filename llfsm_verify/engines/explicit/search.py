"""One search of the explicit engine: a graph explored in stages, and every property looked for in it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from llfsm_verify.automata.automaton import Automaton, AutomatonTooLarge
from llfsm_verify.automata.omega.moves import Lazy
from llfsm_verify.automata.safety import PrefixMonitor
from llfsm_verify.checking.claims import Claim, add_premises, claim_of
from llfsm_verify.checking.engine import Excluded
from llfsm_verify.checking.goals.goal import Goal, bad_prefixes_of
from llfsm_verify.checking.problem import Problem, fixed_atoms, world_atoms
from llfsm_verify.checking.reach import FIRST_LOOK, GROWTH
from llfsm_verify.engines.explicit.bad_prefixes import (
    continued_bad_prefix,
    has_continued_bad_prefix,
    shortest_bad_prefix,
)
from llfsm_verify.engines.explicit.escapes import Assumed, Question, find_escape
from llfsm_verify.kripke.compiled import kernels
from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.kripke.narrow import Keeps, keeps_of, narrow_lasso
from llfsm_verify.kripke.paths import Living
from llfsm_verify.kripke.product_search import Product, Projection, Reader, Walk, accepting_lasso
from llfsm_verify.limits import LimitReached
from llfsm_verify.program.program import Unbounded
from llfsm_verify.stages import stage

LAST_LOOK = 0.5
"""Seconds beyond the time limit until which properties are looked for in what was explored."""


@dataclass(slots=True)
class Task:
    """One property and what a search knows of it so far."""

    goal: Goal
    prepared: bool = False
    monitor: PrefixMonitor | None = None
    """None once prepared: there are no bad prefixes to look for, and only infinite runs are looked at."""
    safe: bool = False
    violation: Walk | None = None
    clean: int | None = None
    """Looked for and not found in the graph when so many of its nodes were expanded."""
    reason: str | None = None

    @property
    def name(self) -> str:
        return self.goal.line.name


@dataclass(frozen=True, slots=True)
class Reading:
    """An automaton, and the keys of the atoms whose bits it reads."""

    automaton: Automaton | Lazy
    atoms: tuple[str, ...]


class Search:
    """Explores with one explorer and looks for violations of every property, until nothing is left to find.

    `tasks` are in the order of the goals.
    """

    def __init__(
        self,
        explorer: Explorer,
        problem: Problem,
        goals: Sequence[Goal],
        found: Callable[[Goal | None], None] = lambda _: None,
    ) -> None:
        """`found` is told what is known of a goal, or of faults (None), while there is more to find."""
        self.explorer = explorer
        self._found = found
        self.graph = explorer.graph
        self._problem = problem
        self.doing = ""
        """What is going on beside exploration, for those who wait."""
        self.target = FIRST_LOOK
        """Nodes at which the properties are looked at next."""
        self.assumed = [claim_of(p, problem.clock) for p in problem.assumptions]
        self.possible: bool | None = None if self.assumed else True
        """Some run of the complete graph satisfies the assumptions; None: that is not known."""
        self.tasks = [Task(goal) for goal in goals]
        self._bits = {name: i for i, name in enumerate(explorer.observed)}
        self._readers: dict[Claim | Goal, Reader | AutomatonTooLarge] = {}

    @property
    def complete(self) -> bool:
        return self.graph.complete

    def run(self, most: int | None = None) -> bool:
        """Explore and look; false when it stopped only because there are `most` nodes."""
        unbounded = any(isinstance(v.type, Unbounded) for v in self.explorer.program.vars)
        while True:
            if most is not None and len(self.graph) >= most:
                return False
            goal = self.target if self.tasks else most
            self.explorer.explore(goal if most is None or goal is None else min(goal, most))
            if self.graph.exhausted or self.graph.stopped or len(self.graph) >= self.target:
                if self.graph.stopped:
                    self.explorer.budget.grant(LAST_LOOK)
                if self.graph.faults or self.complete:
                    self._found(None)
                self._look_at(self.tasks)
                self.target = max(self.target, len(self.graph)) * GROWTH
            if self.graph.exhausted or self.graph.stopped:
                self._check_assumptions()
                return True
            if unbounded and self.tasks and all(t.violation for t in self.tasks):
                self.graph.stopped = "every property is violated, and this arrangement may have no end"
                return True

    def is_clean(self, task: Task) -> bool:
        """No run of the whole graph violates it."""
        return task.reason is None and self.complete and task.clean == self.graph.expanded

    def find(self, names: Iterable[str], faults: Iterable[int], most: int) -> None:
        """Go on until these properties' violations and these faults are found, there are `most` nodes, or a limit is
        reached."""
        wanted, sites = [t for t in self.tasks if t.name in set(names)], set(faults)
        while any(t.violation is None for t in wanted) or not sites <= set(self.graph.faults):
            if self.graph.exhausted or self.graph.stopped or len(self.graph) >= most:
                return
            self.explorer.explore(min(self.target, most))
            self._look_at(wanted)
            self.target = max(self.target, len(self.graph)) * GROWTH

    # -------------------------------------------------- looking

    def _look_at(self, tasks: Sequence[Task]) -> None:
        for task in tasks:
            if task.violation is None:
                self._look(task)
                if task.violation is not None or self.is_clean(task):
                    self._found(task.goal)
                    self.doing = ""

    def _look(self, task: Task) -> None:
        """Search the graph as it is for a violation; `clean` tells that there is none in it, `reason` why that is not
        known. A bad prefix is looked for even where the automata for infinite runs are too large."""
        task.clean, task.reason = None, None
        self.doing = f"looking for violations of {task.name}"
        try:
            self.explorer.budget.check_time()
            with stage(f"looking for violations of {task.name}"):
                task.violation = self._violation(task)
            if task.violation is None:
                task.clean = self.graph.expanded
            else:
                self._shorten(task, task.violation)
        except (LimitReached, AutomatonTooLarge, MemoryError) as limit:
            task.reason = str(limit) or "the memory ran out"
        finally:
            self.doing = ""

    def _shorten(self, task: Task, found: Walk) -> None:
        """A bad prefix found in a part of the graph is a shortest one when all shorter walks lie in that part: explore
        so far, and look again. A limit leaves it as it is."""
        before = self.graph.expanded
        if found.loop is not None or self.assumed:
            return
        while self.graph.depth < len(found.nodes) - 2 and not self.graph.exhausted and self.graph.stopped is None:
            self.explorer.explore(len(self.graph) + 1)
        if self.graph.expanded > before:
            task.violation = self._violation(task)

    def answers(self, goal: Goal, excluded: Excluded | None = None) -> bool:
        """Whether the graph is enough to look for violations of another goal: without edges it is for invariants."""
        return self.graph.with_edges or (excluded is None and goal.is_invariant() and goal.monitor() is not None)

    def drop_edges(self) -> None:
        """Store no edges from now on that do not matter: none, if the letters alone tell whether the properties hold,
        else those with which an automaton does anything but wait."""
        if self.assumed or not self.graph.with_edges or self.explorer.program.observe == "cycle":
            return
        try:
            keeps = [self._keeps(task) for task in self.tasks]
        except (LimitReached, AutomatonTooLarge, MemoryError):
            return
        some = [each for each in keeps if each is not None]
        if len(some) < len(keeps):
            return
        if all(task.goal.is_invariant() for task in self.tasks):
            self.explorer.drop_edges()
        elif self.graph.sequences is None:
            self.explorer.narrow(lambda letter: any(each(letter) for each in some))

    def _keeps(self, task: Task) -> Keeps | None:
        """The letters of the edges that matter to a property: none for an invariant; None: all."""
        self._prepare(task)
        if task.goal.is_invariant():
            return None if task.monitor is None else lambda _: False
        if task.monitor is not None or self._assumption_readers() or self._fair_bits:
            return None
        return keeps_of(self._wrong_reader(task.goal))

    def violation(self, goal: Goal, excluded: Excluded | None = None) -> Walk | None:
        """A violation of another goal in the graph as it is, that is not excluded; None: there is none in it.

        LimitReached, AutomatonTooLarge: that is not known."""
        return self._violation(Task(goal), excluded)

    def violates(self, goal: Goal, *, assuming: bool = True) -> bool:
        """Whether there is a violation of another goal in the graph as it is; `violation`, without the time for a run.
        `assuming` False: also one that violates the assumptions.

        LimitReached, AutomatonTooLarge: that is not known."""
        roots = self.explorer.first_letters
        if not self.graph.with_edges:
            return self._bad_letter(goal, goal.monitor()) is not None
        monitor, safe = bad_prefixes_of(goal)
        if monitor is not None:
            project = self._projection(goal.atoms)
            if self.assumed and assuming:
                found = has_continued_bad_prefix(roots, monitor, project, self._assumptions_product())
            else:
                found = shortest_bad_prefix(self.graph, roots, monitor, project) is not None
            if found or safe:
                return found
        others = self._assumption_readers()[0 if assuming else len(self.assumed) :]
        whole = Product(self.graph, [*others, self._wrong_reader(goal)], self._fair_bits)
        return whole.accepts(whole.initial(roots))

    def _violation(self, task: Task, excluded: Excluded | None = None) -> Walk | None:
        roots = self.explorer.first_letters
        self._prepare(task)
        if not self.graph.with_edges:
            if not task.goal.is_invariant():
                names, shown = self.explorer.observed, self.explorer.witnesses.shown
                return narrow_lasso(self.graph, roots, self._wrong_reader(task.goal), len(names), shown)
            return self._bad_letter(task.goal, task.monitor)
        if task.monitor is not None:
            monitor, names = task.monitor, task.goal.atoms
            if excluded is not None:
                monitor, names = excluded.prefixes(monitor), (*names, *excluded.names)
            project = self._projection(names)
            if self.assumed:
                found = continued_bad_prefix(roots, monitor, project, self._assumptions_product())
            else:
                found = shortest_bad_prefix(self.graph, roots, monitor, project)
            if found is not None or task.safe:
                return found
        readers = [*self._assumption_readers(), self._wrong_reader(task.goal)]
        if excluded is not None:
            names = (*task.goal.atoms, *excluded.names)
            readers.append(Reader(excluded.runs(task.monitor), self._projection(names)))
        return accepting_lasso(self.graph, roots, readers, self._fair_bits)

    def _prepare(self, task: Task) -> None:
        if not task.prepared:
            task.monitor, task.safe = bad_prefixes_of(task.goal)
            task.prepared = True

    def _bad_letter(self, goal: Goal, monitor: PrefixMonitor | None) -> Walk | None:
        """A walk to a letter that violates an invariant: to the first one found, which is a shortest walk but in a
        graph of chains."""
        assert monitor is not None
        assert goal.is_invariant()
        project, graph, first = self._projection(goal.atoms), self.graph, monitor.initial()

        def is_bad(letter: int) -> bool:
            return first is None or monitor.step(first, project(letter)) is None

        for root, letter in enumerate(self.explorer.first_letters):
            if is_bad(letter):
                return Walk((root,), ())
        bad = [(graph.letter_source(label), letter) for label, letter in enumerate(graph.alphabet) if is_bad(letter)]
        if not bad:
            return None
        source, letter = min(bad)
        path = tuple(graph.path_to(source))
        return Walk(path, (None,) * (len(path) - 1), ends=letter)

    def readings(self, goal: Goal) -> list[Reading]:
        """What reads a violation of a goal: the automata of the assumptions and that of the goal's violations."""
        own = Reading(self._wrong_reader(goal).automaton, goal.atoms)
        return [*(Reading(self._claim_reader(claim).automaton, claim.atoms) for claim in self.assumed), own]

    def violation_from(self, goal: Goal, starts: Iterable[tuple[int, tuple[int, ...]]]) -> Walk | None:
        """An infinite run of the graph as it is that violates a goal, from one of these nodes, each with the states of
        the automata of `readings` there; None: there is none. LimitReached, AutomatonTooLarge: that is not known.
        """
        *assumed, wrong = [*self._assumption_readers(), self._wrong_reader(goal)]
        begins = (0,) * (len(assumed) - len(self.assumed))
        both = Product(self.graph, [*assumed, wrong], self._fair_bits)
        if both.is_empty:
            return None
        return both.lasso([(node, (*states[:-1], *begins, states[-1])) for node, states in starts])

    def escape(self) -> Walk | None:
        """The shortest walk of the complete graph to where the assumptions are escaped; None: there is none.

        LimitReached, AutomatonTooLarge: that is not known."""
        about_world, readers = world_atoms(self._problem), self._assumption_readers()
        outside = [about_world.issuperset(claim.atoms) for claim in self.assumed]
        world = [reader for reader, kept in zip(readers, outside, strict=False) if kept] + readers[len(self.assumed) :]
        assumptions = [Assumed(r.automaton, c.atoms) for r, c in zip(readers, self.assumed, strict=False)]
        fixed = {name: self._bits[name] for name in fixed_atoms(self._problem) if name in self._bits}
        products = self._assumptions_product(), Product(self.graph, world, self._fair_bits)
        return find_escape(Question(*products, assumptions, fixed, self.explorer.first_letters))

    def _assumption_readers(self) -> list[Reader]:
        return [self._claim_reader(claim) for claim in (*self.assumed, *add_premises(self.explorer.program))]

    def _assumptions_product(self) -> Product:
        return Product(self.graph, self._assumption_readers(), self._fair_bits)

    @property
    def _fair_bits(self) -> list[int]:
        return [self._bits[f.goal] for f in self.explorer.program.fairness if f.premise is None]

    @stage("looking for a run that satisfies the assumptions")
    def _check_assumptions(self) -> None:
        """Find out whether any run of the complete graph satisfies the assumptions: else a *holds* says nothing."""
        if self.assumed and self.graph.complete:
            assumed = self._assumptions_product()
            try:
                self.doing = "looking for a run that satisfies the assumptions"
                self.possible = assumed.accepts(assumed.initial(self.explorer.first_letters))
                kernels().load(*Living.kernels)  # `escape` has little time, and is not to spend it on compiling
            except (LimitReached, AutomatonTooLarge):
                pass  # then it is not known
            finally:
                self.doing = ""

    def _claim_reader(self, claim: Claim) -> Reader:
        return self._reader(claim, claim.atoms, claim.automaton)

    def _wrong_reader(self, goal: Goal) -> Reader:
        return self._reader(goal, goal.atoms, goal.violations)

    def _reader(self, what: Claim | Goal, names: Sequence[str], make: Callable[[], Automaton | Lazy]) -> Reader:
        """The reader of a claim or of a goal's violations, made once."""
        found = self._readers.get(what)
        if found is None:
            try:
                found = Reader(make(), self._projection(names))
            except AutomatonTooLarge as error:
                found = error
            self._readers[what] = found
        if isinstance(found, AutomatonTooLarge):
            raise found
        return found

    def _projection(self, names: Sequence[str]) -> Projection:
        return Projection([self._bits[n] for n in names])

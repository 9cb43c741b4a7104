"""Whether a machine may take the place of one in a run: what could happen from where the run stands.

The run goes on while this is found out, so the question is asked of each configuration at the end of a cycle that is
reachable from the one where it stood (with its operators and, in its place, the model of its surroundings): from all of
them the arrangement with the new machine is explored, with the monitors in the states that they would have.

The surroundings of a run that is not simulated have a state that is not known. Those states of their model are taken
that it can have when the run is where it stood, among all that are reachable from the beginning.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import pairwise, product

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.omega.moves import moves_of
from llfsm_verify.backends.native.layout import Layout
from llfsm_verify.checking.goals.goal import bad_prefixes_of
from llfsm_verify.checking.goals.kinds import goals_of
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.reach import Reachable
from llfsm_verify.diagnostics import counted
from llfsm_verify.engines.explicit.search import Reading, Search
from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.kripke.graph import Graph
from llfsm_verify.kripke.product_search import Projection
from llfsm_verify.limits import Budget, LimitReached
from llfsm_verify.logic.formula import apply
from llfsm_verify.logic.properties import Property, PropertySet
from llfsm_verify.monitoring.lookup import MonitorTooLarge
from llfsm_verify.monitoring.states import Monitor
from llfsm_verify.program.moves import Move
from llfsm_verify.transforms.monitors import TooManyEdges
from llfsm_verify.verification.changes.state_transfer import (
    UNKNOWN,
    Accepted,
    HasLayout,
    StateTransfer,
    Untransferable,
    update_point,
)
from llfsm_verify.verification.changes.version import Version

MOST_ATOMS = 12
"""Of a property of which a monitor does not see every violation, with its assumptions."""

ALREADY = "it is violated already"


@dataclass(frozen=True, slots=True)
class Question:
    """What is asked, of a run that stands at `record`, of the layout of `code`, with its monitors in `states`."""

    running: Arrangement
    """With the model of its surroundings, where it has one."""
    following: Arrangement
    """The same with the new machine, or the new policy."""
    machine: str | None
    """The one that is replaced; None: a policy is."""
    properties: PropertySet
    """What the run monitors, or would if it could."""
    code: HasLayout
    record: bytes
    states: tuple[int, ...]
    earlier: tuple[tuple[Arrangement, str | None], ...] = ()
    """What ran before, the first one first, each with the machine that was replaced then; None: a policy was."""


@dataclass(frozen=True, slots=True)
class Counterexample:
    """A run of the arrangement with the new machine."""

    record: bytes
    """Where it begins, in the layout of its program with all bits kept."""
    states: tuple[int, ...]
    """Those of the monitors there."""
    moves: tuple[Move, ...]
    later: int
    """Cycles that the run would have gone on before."""
    endless: bool
    """Its end repeats forever, and that is the violation: no monitor sees it."""


@dataclass(frozen=True, slots=True)
class Refusal:
    """The machine must not be loaded, or it is unknown whether it may."""

    reason: str
    notes: tuple[str, ...] = ()
    broken: str | None = None
    """The property that is violated; None: a run ends in a fault, or there is no `counterexample`."""
    counterexample: Counterexample | None = None


def check_update(question: Question, budget: Budget) -> Accepted | Refusal:
    """Look at everything that is reachable. DiagnosticError: an arrangement or a property is wrong."""
    try:
        with budget:
            return _UpdateCheck(question, budget).outcome()
    except Untransferable as problem:
        return Refusal(str(problem))
    except (LimitReached, AutomatonTooLarge, MonitorTooLarge, TooManyEdges, MemoryError, OverflowError) as limit:
        return Refusal(f"{UNKNOWN}: {str(limit) or 'the memory ran out'}")


@dataclass(frozen=True, slots=True)
class _Found:
    """What speaks against a machine: `broken` as in `Refusal`, the nodes of a walk to it, and its moves, where they are
    known."""

    broken: str | None
    reason: str
    walk: Sequence[int] = ()
    moves: tuple[Move, ...] = ()
    endless: bool = False
    """The walk ends with what repeats forever."""


class _UpdateCheck:
    def __init__(self, question: Question, budget: Budget) -> None:
        self._question = question
        self._budget = budget
        properties = question.properties
        self._before = Version(question.running, properties, budget)
        stands = zip(question.states, self._before.false, strict=False)
        self._lost = {number for number, (state, false) in enumerate(stands) if state in false}
        """Monitors that had come to *violated* before."""
        self._after = Version(question.following, properties, budget, self._lost)
        if self._before.tables != self._after.tables or len(question.states) != len(self._before.tables):
            raise Untransferable("a property that is monitored would need another monitor")
        known = {v.name for v in self._before.plain.vars}
        unknown = [v.name for v in self._after.plain.vars if v.free and v.name not in known]
        if unknown:
            raise Untransferable(f"the machine reads `{unknown[0]}`, whose value the run does not keep")
        self._transfer = StateTransfer(self._before, self._after, self._after.layout.first(), question.machine)
        lost = (name for number, name in enumerate(self._before.monitors) if number in self._lost)
        self._reasons = {**self._after.reasons, **dict.fromkeys(lost, ALREADY)}
        names = list(self._after.monitors)
        goals = [
            (names.index(goal.line.name), goal) for goal in goals_of(self._after.problem) if goal.line.name in names
        ]
        self._endless = [pair for pair in goals if pair[0] not in self._lost and not bad_prefixes_of(pair[1])[1]]
        """The monitored properties that may be violated without a monitor ever seeing it."""

    def outcome(self) -> Accepted | Refusal:
        starts = self._starts()
        if not starts:
            return Refusal(
                "the run is in a configuration that the model of its surroundings excludes, so nothing that is "
                "proved with it counts"
            )
        before = self._explored(self._before, starts)
        points: dict[bytes, list[tuple[bytes, int]] | None] = {}
        untransferable = ""
        for node in range(len(before)):
            self._budget.tick()
            key = before.key(node)
            if not self._before.is_whole(key) or not self._lost.issuperset(self._before.violated(key)):
                continue
            if self._before.has_ended(key):
                continue  # nothing is loaded any more
            place = self._point(key)
            if place in points and points[place] is None:
                continue
            try:
                root = self._transferred(key)
            except Untransferable as problem:
                untransferable, points[place] = str(problem), None
            else:
                known = points.setdefault(place, [])
                assert known is not None
                known.append((root, node))
        roots: dict[bytes, int] = {}
        for root, node in (pair for found in points.values() if found is not None for pair in found):
            roots.setdefault(root, node)  # the first one is not later than others
        if not roots:
            return Refusal(
                untransferable or "a property is violated already wherever the run can be at the end of a cycle"
            )
        notes = [f"`{name}` is checked from now on only: {why}" for name, why in self._reasons.items()]
        lasting = bool(self._reasons or self._endless or self._after.problem.assumptions)
        space = self._after.reachable(roots, with_edges=lasting)
        after = space.explorer
        found = self._searched(space) or self._never_satisfied(after) or self._from_now(after)
        if found is not None:
            if not found.walk:
                return Refusal(found.reason, tuple(notes), found.broken)
            path = before.path_to(roots[after.graph.key(found.walk[0])])
            later = sum(self._before.is_whole(before.key(node)) for node in path) - 1
            return Refusal(found.reason, tuple(notes), found.broken, self._counterexample(after, found, later))
        allowed = frozenset(place for place, found in points.items() if found is not None)
        notes.append(
            f"checked: {counted(len(allowed), 'configuration')} in which it may be loaded, "
            f"{len(after.graph):,} from there on"
        )
        return Accepted(allowed, tuple(notes))

    # ------------------------------------------------------------ before

    def _starts(self) -> list[bytes]:
        """Where the run stands, with all states of the model of its surroundings that fit."""
        question, version = self._question, self._before
        known = question.code.layout.decode(question.record)
        names = [v.name for v in version.plain.vars if not v.output]
        if set(names) <= set(known):
            return [version.with_states({name: known[name] for name in names}, question.states)]
        if set(known) - set(names):
            lost = ", ".join(sorted(set(known) - set(names))[:3])
            raise Untransferable(
                f"the model of the surroundings has no {lost}, so nobody knows which of its states fit"
            )
        graph = self._explored(version, self._beginnings())
        wanted = update_point(question.code, question.record, question.states)
        keys = map(graph.key, range(len(graph)))
        return [key for key in keys if version.is_whole(key) and self._point(key) == wanted]

    def _beginnings(self) -> Iterable[bytes]:
        """Where the arrangement that runs can have begun: anywhere where the one before it can have been."""
        versions = [
            Version(arrangement, self._question.properties, self._budget) for arrangement, _ in self._question.earlier
        ]
        versions.append(self._before)
        found: Iterable[bytes] = versions[0].beginnings()
        machines = [machine for _, machine in self._question.earlier]
        for (before, after), machine in zip(pairwise(versions), machines, strict=True):
            graph = self._explored(before, found)
            transfer = StateTransfer(before, after, after.layout.first(), machine)
            carried: dict[bytes, None] = {}
            for key in map(graph.key, range(len(graph))):
                if before.is_whole(key):
                    with suppress(Untransferable):
                        carried[transfer.record(before.record(key))[: after.layout.configuration_bytes]] = None
            found = carried
        return found

    def _explored(self, version: Version, configurations: Iterable[bytes]) -> Graph:
        space = version.reachable(configurations)
        _whole(space.explore())
        return space.graph

    def _point(self, configuration: bytes) -> bytes:
        """Where the run is in a configuration of the arrangement before."""
        layout = self._question.code.layout
        values = self._before.layout.decode(configuration)
        return update_point(self._question.code, layout.encode(values), self._before.states(configuration))

    def _transferred(self, configuration: bytes) -> bytes:
        record = self._transfer.record(self._before.record(configuration))
        return record[: self._after.layout.configuration_bytes]

    # ------------------------------------------------------------ after

    def _searched(self, space: Reachable) -> _Found | None:
        """A violation that a monitor sees, or a fault; None: there is none."""
        names, sites = list(self._after.monitors), self._after.plain.faults
        own = range(len(sites))
        run = space.fault(range(len(sites), len(sites) + len(names)), own)
        if run is None:
            _whole(space.graph.unfinished)
            return None
        if run.fault in own:
            return _Found(None, f"a run would end in a fault: {sites[run.fault].message}", run.path, run.moves)
        name = names[run.fault - len(sites)]
        return _Found(name, f"`{name}` would be violated", run.path, run.moves)

    def _never_satisfied(self, explorer: Explorer) -> _Found | None:
        """An infinite run that violates what is monitored (`F p`) without its monitor seeing it; None: there is none.

        It goes on with whatever can have led the monitor to where it is.
        """
        if not self._endless:
            return None
        search = Search(explorer, self._after.problem, [goal for _, goal in self._endless])
        keys = [explorer.graph.key(root) for root in range(explorer.graph.roots)]
        for number, goal in self._endless:
            monitor = list(self._after.monitors.values())[number]
            table, reached = self._after.tables[number], self._reached(monitor, search.readings(goal))
            starts = [
                (root, states)
                for root, key in enumerate(keys)
                for states in reached[table.states[self._after.states(key)[number]]]
            ]
            walk = search.violation_from(goal, starts)
            if walk is not None:
                name = goal.line.name
                return _Found(name, f"`{name}` would be violated", walk.nodes, endless=True)
        return None

    def _reached(self, monitor: Monitor, readings: Sequence[Reading]) -> list[set[tuple[int, ...]]]:
        """For each state of a monitor the states in which these automata can be after one word. TooManyEdges."""
        moves = [moves_of(reading.automaton) for reading in readings]
        found: list[set[tuple[int, ...]]] = [set() for _ in monitor.edges]
        if any(move.is_empty for move in moves):
            return found
        names = list(dict.fromkeys((*monitor.atoms, *(name for reading in readings for name in reading.atoms))))
        if len(names) > MOST_ATOMS:
            raise TooManyEdges(f"a property that is not decided by finite runs has more than {MOST_ATOMS} atoms")
        seen = [Projection([names.index(name) for name in reading.atoms]) for reading in readings]
        own = Projection([names.index(name) for name in monitor.atoms])
        queue = [(0, (0,) * len(moves))]
        known = set(queue)
        for state, states in queue:
            for letter in range(1 << len(names)):
                self._budget.tick()
                target = monitor.step(state, own(letter))
                each = [[s for _, s in m(at, p(letter))] for m, at, p in zip(moves, states, seen, strict=True)]
                for joint in product(*each):
                    found[target].add(joint)
                    if (target, joint) not in known:
                        known.add((target, joint))
                        queue.append((target, joint))
        return found

    def _from_now(self, explorer: Explorer) -> _Found | None:
        """A violation of what is checked from now on only, or that no run meets the assumptions; None: neither."""
        problem = self._after.problem
        lines = [line for line in problem.properties if line.name in self._reasons]
        if not lines and not problem.assumptions:
            return None
        for line in (*lines, *problem.assumptions):
            if line.formula is None:
                return _Found(None, f"{UNKNOWN}: `{line.name}` has no monitor, and is not a formula")
        later = replace(
            problem, properties=tuple(map(_next, lines)), assumptions=tuple(map(_next, problem.assumptions))
        )
        search = _run(explorer, later)
        for task in search.tasks:
            walk = task.violation
            if walk is not None:
                return _Found(task.name, f"`{task.name}` would be violated", walk.nodes, endless=walk.loop is not None)
            if not search.is_clean(task):
                raise LimitReached(task.reason or "the search was cut short")
        if search.possible is not True:
            return _Found(None, f"{UNKNOWN}: no run from there on meets the assumptions")
        return None

    def _counterexample(self, explorer: Explorer, found: _Found, later: int) -> Counterexample:
        key = explorer.graph.key(found.walk[0])
        values, plain = self._after.layout.decode(key), Layout.of(self._after.plain)
        record = plain.encode_record({**values, **plain.initial_outputs()})
        moves = found.moves or tuple(explorer.witnesses.along(found.walk))
        return Counterexample(record, self._after.states(key), moves, later, found.endless)


def _whole(unfinished: str | None) -> None:
    """LimitReached: an exploration is unfinished."""
    if unfinished is not None:
        raise LimitReached(unfinished)


def _next(line: Property) -> Property:
    """The same of the run from its next letter on: the first one is not of this run."""
    assert line.formula is not None
    return replace(line, formula=apply("X", line.formula))


def _run(explorer: Explorer, problem: Problem) -> Search:
    search = Search(explorer, problem, goals_of(problem))
    search.run()
    return search

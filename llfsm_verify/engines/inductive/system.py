"""An arrangement with what is to be shown unreachable, as a transition system whose transitions are units of steps; the
violations of a property as such targets (`Plan`); and what an engine of proofs asks of it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import z3

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.backends.smt.arithmetic import Arithmetic, Term, is_bool, truth
from llfsm_verify.backends.smt.relation import Terms
from llfsm_verify.backends.smt.solver import SolverBudget
from llfsm_verify.backends.smt.unrolling import Unrolling
from llfsm_verify.checking.claims import Claim, add_premises
from llfsm_verify.checking.goals.goal import Goal, bad_prefixes_of
from llfsm_verify.engines.inductive.invariant import Invariant
from llfsm_verify.engines.inductive.observers import (
    FairLoops,
    Faults,
    Prefixes,
    Reader,
    Rounds,
    Scalar,
    State,
    Target,
    exactly_one,
    reader,
    scalars_beside,
    text_of,
)
from llfsm_verify.engines.unrolled.runs import BAD, EVERY, Table, TableMove, automaton_table, monitor_table
from llfsm_verify.limits import Budget
from llfsm_verify.program.program import Expr, Get, Int, Program, Type
from llfsm_verify.program.symbolic import Key
from llfsm_verify.program.terms import const
from llfsm_verify.transforms.cone import EMPTY, cone


@dataclass(frozen=True, slots=True)
class Stage:
    """A place in a run where it may be `bad`; the first `known` constraints of the course come before it."""

    known: int
    bad: z3.BoolRef


class System:
    """`unit` steps are one transition: a whole cycle where its length is the same in all runs, else one step.

    `scalars` are those of a state, between two units, in a fixed order: of the configuration, then of what the target's
    reader remembers. What is the same in all such states is left out.
    """

    def __init__(self, program: Program, target: Target, arithmetic: Arithmetic | None = None) -> None:
        """`arithmetic`: see `Terms`."""
        self.program = program
        self.target = target
        self.terms = Terms(program, arithmetic)
        self.unit, self._known = self._found_unit()
        keys = [(key, var.type) for key, var, _ in self.terms.configuration]
        if program.observe == "cycle" and self.unit == 1:
            keys += [(key, var.type) for key, var, _ in self.terms.outputs]
        self._keys = {scalar_of(key, kind): key for key, kind in keys if key not in self._known and not _single(kind)}
        self.configuration: tuple[Scalar, ...] = tuple(self._keys)
        self.scalars: tuple[Scalar, ...] = (*self.configuration, *scalars_beside(target, self.configuration))
        if len({text_of(s) for s in self.scalars}) < len(self.scalars):  # two would be one constant of the solver
            raise AssertionError("two scalars of a state have one name")

    def _found_unit(self) -> tuple[int, Mapping[Key, Term]]:
        """The steps of a transition, and the values of a configuration that are known between two of them."""
        terms, program = self.terms, self.program
        known: dict[Key, Term] = {}
        if EMPTY in program.vars:
            known[EMPTY.name, None] = terms.literal((EMPTY.name, None), 0)
        if len(program.processes) != 1 or program.processes[0].ended is not None:
            return 1, known
        process = program.processes[0]
        turn: Key = (process.turn, None)
        first = terms.literal(turn, 0)
        run = Unrolling(terms, "cycle", {**known, turn: first})
        for position in range(1, len(process.slots) + 1):
            run.extend()
            expected = terms.literal(turn, position % len(process.slots))
            if len(run.points[-2].ways) != 1 or not run.points[-1].values[turn].z3.eq(expected.z3):
                return 1, known
        return len(process.slots), {**known, turn: first}

    @property
    def by_cycles(self) -> bool:
        """A unit is a whole cycle."""
        return (self.program.processes[0].turn, None) in self._known

    @property
    def is_finite(self) -> bool:
        """Every variable of the configurations has bounds."""
        return all(isinstance(s.type, Int) for s in self.configuration)

    def course(self, name: str, *, anywhere: bool = False, start: State | None = None) -> Course:
        """A run from the beginning, or from anywhere: from `start`, or from an unknown state.

        `name` tells the constants of one course from those of another.
        """
        if anywhere and start is None:
            made = self.terms.arithmetic.constant
            start = {s: made(f"{text_of(s)}@{name}", s.type) for s in self.scalars}
        values = None if start is None else {**self._known, **{k: start[s] for s, k in self._keys.items()}}
        return Course(self, name, Unrolling(self.terms, f"{name}:", values), start)

    def configuration_of(self, values: Mapping[Key, Term]) -> dict[Scalar, Term]:
        """The scalars of a configuration."""
        return {s: values[k] for s, k in self._keys.items()}

    def well_formed(self, state: State, groups: Iterable[Iterable[Scalar]]) -> list[z3.BoolRef]:
        """Every scalar is in its range, and of each group of Bools one is true."""
        inside = [self.terms.arithmetic.within(t) for t in state.values()]
        one = [c for group in groups for c in exactly_one([state[s].z3 for s in group])]
        return [c for c in map(z3.simplify, [*inside, *one]) if not z3.is_true(c)]

    def formula(self, formula: Expr, state: State) -> z3.BoolRef:
        """A formula over the scalars, in a state. KeyError: it speaks of others."""
        beside = {s.name: t for s, t in state.items() if not isinstance(s, Get)}
        given = [(self.terms.before[self._keys[s]].z3, t.z3) for s, t in state.items() if isinstance(s, Get)]
        term = truth(self.terms.arithmetic, self.terms.expression(formula, beside))
        return z3.substitute(term, *given)


class Course:
    """A run that grows unit by unit, with what reads it. `constraints` hold for exactly the runs that are not bad."""

    def __init__(self, system: System, name: str, run: Unrolling, start: State | None) -> None:
        self.system = system
        self.run = run
        self.constraints: list[z3.BoolRef] = []
        here = system.configuration_of(run.points[0].values)
        self._reader: Reader = reader(system.target, name, system.terms.arithmetic, here, start)
        self._taken: dict[int, int] = {}
        self.bad = z3.BoolVal(False)
        """The first letter is bad (of a course from the beginning)."""
        if start is None:
            self.bad = z3.simplify(self._reader.read(run.points[0]))
            self._take()
        else:
            self._take()
            self.constraints += system.well_formed(self.state, self._reader.groups)

    @property
    def state(self) -> dict[Scalar, Term]:
        """The scalars after the last unit."""
        values = {**self.system.configuration_of(self.run.points[-1].values), **self._reader.state}
        return {s: values[s] for s in self.system.scalars}

    @property
    def well_formed(self) -> list[z3.BoolRef]:
        """`System.well_formed` of the state."""
        return self.system.well_formed(self.state, self._reader.groups)

    def advance(self) -> list[Stage]:
        """One unit more. Returns where it may be bad; the run goes on where it is not."""
        stages: list[Stage] = []
        self._reader.begin(self.system.configuration_of(self.run.points[-1].values))
        for _ in range(self.system.unit):
            here = self.run.begin()
            self._take()
            if isinstance(self.system.target, Faults):
                self._stage(here.fault(self.system.terms.arithmetic), stages)
            point = self.run.extend()
            bad = self._reader.read(point)
            self._stage(bad, stages)
        self._stage(self._reader.end(self.system.configuration_of(self.run.points[-1].values)), stages)
        return stages

    def _stage(self, bad: z3.BoolRef, stages: list[Stage]) -> None:
        self._take()
        bad = z3.simplify(bad)
        if not z3.is_false(bad):
            stages.append(Stage(len(self.constraints), bad))
            self.constraints.append(z3.Not(bad))

    def _take(self) -> None:
        """What the run and the reader have added since it was last asked."""
        for source in (self.run.constraints, self._reader.constraints):
            known = self._taken.get(id(source), 0)
            self.constraints += source[known:]
            self._taken[id(source)] = len(source)


def undistinguished(model: z3.ModelRef, states: Iterable[State]) -> tuple[State, State] | None:
    """Two states that are equal in a model; None: all differ."""
    seen: dict[tuple[int, ...], State] = {}
    kept = []  # a value has one number only while it is there
    for state in states:
        values = [model.eval(t.z3, model_completion=True) for t in state.values()]
        numbers = tuple(v.get_id() for v in values)
        if numbers in seen:
            return seen[numbers], state
        seen[numbers] = state
        kept.append(values)
    return None


def differ(one: State, other: State) -> z3.BoolRef:
    """Two states are not equal."""
    return z3.Or([t.z3 != other[s].z3 for s, t in one.items()])


def scalar_of(key: Key, kind: Type) -> Scalar:
    """How formulas name a scalar of the configuration."""
    return Get(key[0], None if key[1] is None else const(key[1]), kind)


def _single(kind: Type) -> bool:
    return isinstance(kind, Int) and not is_bool(kind) and kind.low == kind.high


@dataclass(frozen=True, slots=True)
class Proved:
    """By this invariant, which is to be certified before it counts."""

    invariant: Invariant


@dataclass(frozen=True, slots=True)
class Reached:
    """The prover says that the target can be reached."""


@dataclass(frozen=True, slots=True)
class Undecided:
    """`reason`: why it is not known, in a clause."""

    reason: str


Answer = Proved | Reached | Undecided


class Prover(Protocol):
    """A way of proving that the target of a system is not reached."""

    name: str
    depth: int
    """Unless --depth says otherwise."""
    effort: int
    """Z3's units of work for one question, unless a limit says otherwise."""
    integers: bool
    """It wants mathematical integers also where every value has bounds."""

    def ask(
        self, system: System, budget: Budget, depth: int, effort: int, total: SolverBudget, known: Sequence[Expr] = ()
    ) -> Answer:
        """`depth` bounds what the prover goes through, `effort` Z3's units of work for each question, and
        `total` those for all questions of an engine.

        `known` are formulas over the configuration that are inductive together; a proof has them in its invariant.
        LimitReached, KeyboardInterrupt: the budget's, or the user's.
        """
        ...


BOUNDS = (1, 4, 16, 64)
"""Rounds that are tried, one after the other."""


@dataclass(frozen=True, slots=True)
class Plan:
    """How a goal is proved.

    `prefixes`: no run has a bad prefix, where the goal has bad prefixes. `alone`: that is all there is to prove.
    `automata` with the letters `fair`: no run of all of them forever; under assumptions that is enough by itself.
    `atoms` are all that a proof reads.
    """

    prefixes: Prefixes | None
    alone: bool
    automata: tuple[Table, ...]
    fair: tuple[str, ...]
    atoms: frozenset[str]

    def missing(self, shown: Collection[str], *, assumed: bool) -> str | None:
        """What is still to be shown, in a clause, when proofs show so much; None: nothing."""
        forever = bool({"rounds", "loops"} & set(shown))
        if self.prefixes is not None and "prefixes" not in shown and not (forever and assumed):
            return "no run has a bad prefix"
        if (not self.alone and not forever) or (self.prefixes is None and not forever):
            return "no run violates it forever"
        return None

    @property
    def rounds(self) -> tuple[Rounds, ...]:
        return tuple(Rounds(self.automata, self.fair, bound) for bound in BOUNDS)

    @property
    def loops(self) -> FairLoops:
        return FairLoops(self.automata, self.fair)


def plan_of(goal: Goal, assumed: Sequence[Claim], program: Program) -> Plan:
    """Raises AutomatonTooLarge and LimitReached where the goal has no plan."""
    monitor, safe = bad_prefixes_of(goal)
    table: Table | None = None
    too_large: AutomatonTooLarge | None = None
    if monitor is not None:
        try:
            table = monitor_table(monitor, goal.atoms)
        except AutomatonTooLarge as limit:
            if safe:
                raise
            too_large = limit
    claims = [*assumed, *add_premises(program)]
    fair = tuple(f.goal for f in program.fairness if f.premise is None)
    if too_large is not None and not assumed:
        raise too_large
    atoms = frozenset(goal.atoms) | frozenset(a for c in claims for a in c.atoms)
    if safe and not assumed:
        assert table is not None
        return Plan(Prefixes(table), True, (), (), frozenset(goal.atoms))
    if safe:
        assert table is not None
        wrong = violating(table)
    else:
        wrong = automaton_table(goal.violations(), goal.atoms)
    others = [automaton_table(claim.automaton(), claim.atoms) for claim in claims]
    return Plan(None if table is None else Prefixes(table), safe, (wrong, *others), fair, atoms)


def violating(monitor: Table) -> Table:
    """The automaton of the runs with a bad prefix."""
    bad = monitor.states
    moves = [replace(m, target=bad) if m.target == BAD else m for m in monitor.moves]
    ever = TableMove(bad, bad, 1, EVERY)
    return Table(monitor.atoms, (*moves, ever), monitor.states + 1, 1)


def slice_program(program: Program, atoms: frozenset[str]) -> Program:
    """The part of a program that these atoms, faults and fairness depend on."""
    return cone(replace(program, atoms=tuple(a for a in program.atoms if a.name in atoms))).program

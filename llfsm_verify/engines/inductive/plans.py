"""What must be unreachable for a property to hold: its violations as targets of safety proofs."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.checking.claims import Claim, add_premises
from llfsm_verify.checking.goals.goal import Goal, bad_prefixes_of
from llfsm_verify.engines.inductive.observers import FairLoops, Prefixes, Rounds
from llfsm_verify.engines.unrolled.runs import BAD, EVERY, Table, TableMove, automaton_table, monitor_table
from llfsm_verify.program.program import Program
from llfsm_verify.transforms.cone import cone

BOUNDS = (1, 4, 16, 64)
"""Rounds that are tried, one after the other."""


@dataclass(frozen=True, slots=True)
class Plan:
    """How a goal is proved.

    `prefixes`: no bad prefix, unless there are none to look for. `alone`: then nothing else is left to prove.
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
    """AutomatonTooLarge, LimitReached: there is none."""
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

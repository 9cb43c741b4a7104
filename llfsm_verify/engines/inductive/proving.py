"""Proofs of goals: targets are handed to a prover, and what it says is certified before it counts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.backends.smt.arithmetic import Integers
from llfsm_verify.checking.goals.goal import Goal
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.verdict import Proof
from llfsm_verify.engines.inductive.certify import Certifier, Rejection
from llfsm_verify.engines.inductive.invariant import Invariant
from llfsm_verify.engines.inductive.observers import Faults, Scalar, Target
from llfsm_verify.engines.inductive.recheck import certifying_programs
from llfsm_verify.engines.inductive.system import (
    Plan,
    Proved,
    Prover,
    Reached,
    System,
    Undecided,
    plan_of,
    slice_program,
)
from llfsm_verify.engines.inductive.wording import proof_of
from llfsm_verify.engines.unrolled.question import Exhausted
from llfsm_verify.engines.unrolled.search import BoundedSearch
from llfsm_verify.program.program import Expr, Get, Local, Program
from llfsm_verify.program.terms import conjunction
from llfsm_verify.program.trees import nodes

MAX_LEMMAS = 60
MAX_SHORTENED = 100
"""Conjuncts up to which those that a proof does not need are left out."""


@dataclass(frozen=True, slots=True)
class Settled:
    """It holds, by these proofs; or it is violated, as a prover says."""

    holds: bool
    proofs: tuple[Proof, ...] = ()


@dataclass(frozen=True, slots=True)
class Open:
    """`reason`: why it is not known, in a clause."""

    reason: str


class Proving:
    """The proofs of one check."""

    def __init__(self, search: BoundedSearch, problem: Problem, prover: Prover, depth: int | None) -> None:
        """`depth`: of the prover, as `--depth` has it."""
        self._search = search
        self._given = problem
        self._problem = problem
        """With the assumptions that the present proof is under."""
        self._prover = prover
        self._depth = depth
        self._lemmas: list[Expr] = []
        """What proofs so far have shown of configurations, inductive by itself: later ones begin with it."""

    def faults(self, effort: int) -> Settled | Open:
        """Whether no run ends in a fault. `effort`: Z3's units of work for each question to the prover."""
        return self._asked(Faults(), frozenset(), None, effort)

    def goal(self, goal: Goal, effort: int) -> Settled | Open:
        """Whether a goal holds: without the assumptions, or under them."""
        search = self._search
        try:
            answer = self._planned(plan_of(goal, [], search.program), goal, effort)
            if not search.assumed or (isinstance(answer, Settled) and answer.holds):
                return answer
            plan = plan_of(goal, search.assumed, search.program)
        except AutomatonTooLarge as limit:
            return Open(str(limit))
        self._problem = self._given
        return self._for_ever(plan, goal, effort)

    def _planned(self, plan: Plan, goal: Goal, effort: int) -> Settled | Open:
        """Whether a goal holds without assumptions."""
        self._problem = replace(self._given, assumptions=())
        proofs: tuple[Proof, ...] = ()
        if plan.prefixes is not None:
            answer = self._asked(plan.prefixes, plan.atoms, goal, effort)
            if plan.alone or isinstance(answer, Open) or not answer.holds:
                return answer
            proofs = answer.proofs
        answer = self._for_ever(plan, goal, effort)
        return Settled(True, (*proofs, *answer.proofs)) if isinstance(answer, Settled) and answer.holds else answer

    def _for_ever(self, plan: Plan, goal: Goal, effort: int) -> Settled | Open:
        """Whether no run of the automata goes on forever."""
        reasons: list[str] = []
        finite = System(slice_program(self._search.program, plan.atoms), plan.loops, Integers()).is_finite
        if finite:
            answer = self._asked(plan.loops, plan.atoms, goal, effort)
            if isinstance(answer, Settled):
                return answer
            reasons.append(answer.reason)
        for target in plan.rounds:
            answer = self._asked(target, plan.atoms, goal, effort)
            if isinstance(answer, Open):
                reasons.append(answer.reason)
                break
            if answer.holds:
                return answer
        else:
            many = f"a run goes through more than {plan.rounds[-1].bound:,} rounds of what would violate it forever"
            shown = "" if finite else " (numbers that grow forever cannot be shown as a loop)"
            reasons.append(f"whether it is violated is not known: {many}, and may stop then{shown}")
        return Open(reasons[-1])

    def _asked(self, target: Target, atoms: frozenset[str], goal: Goal | None, effort: int) -> Settled | Open:
        program = slice_program(self._search.program, atoms)
        arithmetic = Integers() if self._prover.integers else None
        system = System(program, target, arithmetic)
        depth = self._prover.depth if self._depth is None else self._depth
        named = frozenset(system.scalars)
        known = [f for f in self._lemmas if named.issuperset(_scalars(f))]
        match self._prover.ask(system, self._search.budget, depth, effort, self._search.effort, known):
            case Reached():
                return Settled(False)
            case Undecided(reason):
                return Open(reason)
            case Proved(invariant):
                answer = self._certified(invariant, program, atoms, goal)
                if isinstance(answer, Settled) or not known:
                    return answer
                self._lemmas = []  # perhaps what was known is not inductive without what this program lacks
                return self._asked(target, atoms, goal, effort)

    def _certified(
        self, invariant: Invariant, program: Program, atoms: frozenset[str], goal: Goal | None
    ) -> Settled | Open:
        invariant = self._shortened(invariant, program)
        rejection: Rejection | None = None
        for where in certifying_programs(self._search.program, invariant.target, atoms, invariant.k):
            certifier = Certifier(where, invariant.target, None if invariant.is_bounded else Integers())
            answer = certifier.check(invariant, self._search.budget)
            if not isinstance(answer, Rejection):
                self._learn(invariant)
                return Settled(True, (proof_of(invariant, certifier.system, goal, self._problem, answer),))
            rejection = rejection or answer
        assert rejection is not None
        return Open(f"its proof was not certified: {rejection.reason}")

    def _learn(self, invariant: Invariant) -> None:
        """Keep what a proof has shown of configurations."""
        new = [c for c in invariant.conjuncts if c not in self._lemmas and not any(map(_is_beside, nodes(c)))]
        if new and invariant.is_bounded and len(self._lemmas) < MAX_LEMMAS:
            certifier = Certifier(self._search.program, Faults())
            try:
                self._lemmas = certifier.inductive([*self._lemmas, *new], self._search.budget)
            except Exhausted:
                pass  # then the next proof begins with less

    def _shortened(self, invariant: Invariant, program: Program) -> Invariant:
        """Without conjuncts that it does not need to be inductive and to imply what it shows."""
        conjuncts = list(invariant.conjuncts)
        if len(conjuncts) > MAX_SHORTENED:
            return invariant
        certifier = Certifier(program, invariant.target, None if invariant.is_bounded else Integers())
        for conjunct in tuple(conjuncts):
            rest = [c for c in conjuncts if c is not conjunct]
            shorter = replace(invariant, formula=conjunction(rest))
            if not isinstance(certifier.check(shorter, self._search.budget, others=False), Rejection):
                conjuncts = rest
        return replace(invariant, formula=conjunction(list(conjuncts)))


def _scalars(formula: Expr) -> Iterator[Scalar]:
    return (n for n in nodes(formula) if isinstance(n, (Get, Local)))


def _is_beside(e: Expr) -> bool:
    return isinstance(e, Local)

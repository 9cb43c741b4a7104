"""Saved invariants checked against an arrangement and its properties, as if they had never been checked."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import z3

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.backends.smt.arithmetic import Integers
from llfsm_verify.checking.claims import Claim, claim_of
from llfsm_verify.checking.goals.goal import Goal
from llfsm_verify.checking.goals.kinds import goals_of
from llfsm_verify.checking.problem import Problem
from llfsm_verify.engines.inductive.certify import Certifier, CheckedProof, Rejection
from llfsm_verify.engines.inductive.invariant import Invariant, Unreadable, read
from llfsm_verify.engines.inductive.observers import FairLoops, Faults, Rounds, Scalar, Target, text_of
from llfsm_verify.engines.inductive.plans import Plan, plan_of, slice_program
from llfsm_verify.engines.inductive.saved import Saved, SavedProof
from llfsm_verify.engines.inductive.system import System
from llfsm_verify.limits import Budget
from llfsm_verify.program.program import Expr, Program


@dataclass(frozen=True, slots=True)
class Checked:
    """What is known of one property (`name` None: of faults): that it is proved, not proved, or wrongly proved."""

    name: str | None
    accepted: bool
    reason: str
    """By whom it was checked, or why it is not proved."""
    wrong: bool = False
    """A proof was offered and rejected."""


class Rechecking:
    """Checks of saved proofs; nothing but their formulas is taken from them."""

    def __init__(self, problem: Problem, budget: Budget) -> None:
        self._problem = problem
        self._budget = budget
        self._program = problem.program()
        self._assumed = [claim_of(p, problem.clock) for p in problem.assumptions]
        self._certifiers: dict[tuple[Program, Target, bool], Certifier] = {}

    def check(self, saved: Sequence[Saved]) -> Iterator[Checked]:
        """The properties in order, then faults. LimitReached, Disagreement."""
        found = {s.name: s for s in saved}
        for goal in goals_of(self._problem):
            yield self._goal(goal, found.get(goal.line.name))
        faults = found.get(None)
        proofs = () if faults is None else faults.proofs
        if not any(p.shows == "faults" for p in proofs):
            yield Checked(None, False, "the file has no proof of it")
        else:
            yield self._all(None, proofs, {"faults"}, None)

    def _goal(self, goal: Goal, saved: Saved | None) -> Checked:
        name = goal.line.name
        if saved is None or not saved.proofs:
            return Checked(name, False, "the file has no proof of it")
        if saved.text != goal.line.text:
            return Checked(name, False, "the file proves another property of this name", wrong=True)
        found = self._under([], goal, saved)
        return found if found.accepted or not self._assumed else self._under(self._assumed, goal, saved)

    def _under(self, assumed: Sequence[Claim], goal: Goal, saved: Saved) -> Checked:
        name = goal.line.name
        try:
            plan = plan_of(goal, assumed, self._program)
        except AutomatonTooLarge as limit:
            return Checked(name, False, str(limit))
        shown: set[str] = {p.shows for p in saved.proofs}
        missing = plan.missing(shown, assumed=bool(assumed))
        if missing is not None:
            return Checked(name, False, f"the file does not show that {missing}", wrong=True)
        return self._all(name, saved.proofs, shown, plan)

    def _all(self, name: str | None, proofs: Sequence[SavedProof], shown: set[str], plan: Plan | None) -> Checked:
        by: tuple[str, ...] = ()
        for proof in proofs:
            if proof.shows not in shown:
                continue
            try:
                answer = self._one(proof, plan)
            except (Unreadable, ValueError) as problem:
                return Checked(name, False, f"{problem}", wrong=True)
            if isinstance(answer, Rejection):
                return Checked(name, False, answer.reason, wrong=True)
            by = answer.checked_by
        return Checked(name, True, f"checked by {' and '.join(name.split()[0] for name in by)}")

    def _one(self, proof: SavedProof, plan: Plan | None) -> CheckedProof | Rejection:
        target = _target(proof, plan)
        atoms = frozenset[str]() if plan is None else plan.atoms
        rejection: Rejection | Unreadable | None = None
        for program in certifying_programs(self._program, target, atoms, proof.k):
            try:
                answer = self._over(program, target, proof)
            except Unreadable as problem:
                answer = problem
            if isinstance(answer, CheckedProof):
                return answer
            rejection = rejection or answer
        if isinstance(rejection, Unreadable):
            raise rejection
        assert rejection is not None
        return rejection

    def _over(self, program: Program, target: Target, proof: SavedProof) -> CheckedProof | Rejection | Unreadable:
        certifier = self._certifier(program, target, bounded=True)
        invariant = Invariant(target, parse_expression(proof.smt, certifier.system.scalars), proof.k)
        if not invariant.is_bounded:
            certifier = self._certifier(program, target, bounded=False)
        return certifier.check(invariant, self._budget)

    def _certifier(self, program: Program, target: Target, *, bounded: bool) -> Certifier:
        key = program, target, bounded
        if key not in self._certifiers:
            self._certifiers[key] = Certifier(program, target, None if bounded else Integers())
        return self._certifiers[key]


def certifying_programs(program: Program, target: Target, atoms: frozenset[str], k: int) -> Iterator[Program]:
    """Where an invariant may be certified that was found over what `atoms` depend on: the whole program, where that can
    do, and then the part that they depend on.

    Only the latter does for `FairLoops`, if it alone is finite, since then its runs that go on forever have a loop; and
    for k-induction, whose states differ in what matters. Cycles may have one length there that they have not in all.
    """
    part = slice_program(program, atoms)
    needs_part = k > 0 or (isinstance(target, FairLoops) and not System(program, target, Integers()).is_finite)
    if not needs_part:
        yield program
    if needs_part or part.vars != program.vars:
        yield part


def _target(proof: SavedProof, plan: Plan | None) -> Target:
    """ValueError: there is nothing such to show."""
    if plan is None:
        return Faults()
    if proof.shows == "rounds" and proof.bound is not None:
        return Rounds(plan.automata, plan.fair, proof.bound)
    if proof.shows == "loops":
        return plan.loops
    if proof.shows == "prefixes" and plan.prefixes is not None:
        return plan.prefixes
    raise ValueError("the property has nothing such to show")


def parse_expression(text: str, scalars: Sequence[Scalar]) -> Expr:
    """A term of SMT-LIB 2 over scalars, named by `text_of`. Unreadable."""
    if not _stays_inside(text):
        raise Unreadable("the invariant is not one term")
    arithmetic = Integers()
    terms = {text_of(s): arithmetic.constant(text_of(s), s.type).z3 for s in scalars}
    try:
        found = z3.parse_smt2_string(f"(assert {text})", decls=terms)
    except z3.Z3Exception as problem:
        reason = problem.args[0] if problem.args else problem
        words = reason.decode(errors="replace") if isinstance(reason, bytes) else str(reason)
        raise Unreadable(f"the invariant cannot be read: {words.strip()}") from None
    if len(found) != 1:
        raise Unreadable("the invariant is not one term")
    return read(found[0], {terms[text_of(s)].get_id(): s for s in scalars})


def _stays_inside(text: str) -> bool:
    """A text does not end the command that it stands in: what came then would be commands, and some write files."""
    depth = 0
    for number, part in enumerate(text.split("|")):
        if number % 2:  # a name between bars
            continue
        if ";" in part or '"' in part:
            return False
        for sign in part:
            depth += (sign == "(") - (sign == ")")
            if depth < 0:
                return False
    return depth == 0

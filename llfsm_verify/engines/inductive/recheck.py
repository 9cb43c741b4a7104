"""Files of invariants, and invariants from them checked against an arrangement and its properties, as if they had never
been checked.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal, TypeVar, get_args

import z3

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.backends.smt.arithmetic import Integers
from llfsm_verify.checking.claims import Claim, claim_of
from llfsm_verify.checking.goals.goal import Goal
from llfsm_verify.checking.goals.kinds import goals_of
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.verdict import Proof, Result
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Source, Span
from llfsm_verify.engines.inductive.certify import Certifier, CheckedProof, Rejection
from llfsm_verify.engines.inductive.invariant import Invariant, Unreadable, read
from llfsm_verify.engines.inductive.observers import FairLoops, Faults, Rounds, Scalar, Target, text_of
from llfsm_verify.engines.inductive.system import Plan, System, plan_of, slice_program
from llfsm_verify.limits import Budget
from llfsm_verify.program.program import Expr, Program

FORMAT = "llfsm-invariants 1"
Shows = Literal["faults", "prefixes", "rounds", "loops"]
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class SavedProof:
    """What of a `Proof` is needed to check it; `smt` is the invariant as a term of SMT-LIB 2."""

    shows: Shows
    bound: int | None
    k: int
    smt: str


@dataclass(frozen=True, slots=True)
class Saved:
    """The proofs of one property by its name and text; those of the absence of faults have neither."""

    name: str | None
    text: str | None
    proofs: tuple[SavedProof, ...]


@dataclass(frozen=True, slots=True)
class SavedFile:
    """What a file of invariants says; `arrangement`: the name of the one that it was written for."""

    arrangement: str | None
    proved: tuple[Saved, ...]


def saved_text(result: Result) -> str:
    """The proofs in a result, as `read_saved` reads them."""
    items: list[tuple[str | None, str | None, tuple[Proof, ...]]] = [
        *((p.name, p.text, p.proofs) for p in result.properties),
        (None, None, result.faults.proofs),
    ]
    rows = [
        {
            "name": name,
            "text": text,
            "proofs": [
                {"shows": p.shows, "bound": p.bound, "k": p.k, "says": list(p.invariant), "smt": p.smt} for p in proofs
            ],
        }
        for name, text, proofs in items
        if proofs
    ]
    return json.dumps({"format": FORMAT, "arrangement": result.arrangement, "proved": rows}, indent=2) + "\n"


def read_saved(text: str, file: str) -> SavedFile:
    """What a file of invariants says. DiagnosticError (E453)."""
    hint = "write one with --engine pdr --save-invariants FILE"
    try:
        data = _typed(json.loads(text), dict)
        if data.get("format") != FORMAT:
            raise ValueError(f"its format is not `{FORMAT}`")
        named = data.get("arrangement")
        proved = tuple(_saved(row) for row in _typed(data.get("proved"), list))
        return SavedFile(named if isinstance(named, str) else None, proved)
    except json.JSONDecodeError as problem:
        place = Span(Source(file, text), problem.pos, problem.pos + 1) if problem.pos < len(text) else None
        message = "this is not a file of invariants: it is not JSON" + (
            " from here on" if place else ", or not all of it"
        )
        raise DiagnosticError(Diagnostic("E453", message, place, hint=hint, file=file)) from None
    except (ValueError, RecursionError) as problem:
        reason = "its parts are nested too deeply" if isinstance(problem, RecursionError) else problem
        message = f"this is not a file of invariants: {reason}"
        raise DiagnosticError(Diagnostic("E453", message, hint=hint, file=file)) from None


def _saved(row: object) -> Saved:
    fields = _typed(row, dict)
    name, text = fields.get("name"), fields.get("text")
    if name is not None:
        _typed(name, str)
        _typed(text, str)
    return Saved(name, text, tuple(_proof(p) for p in _typed(fields.get("proofs"), list)))


def _proof(row: object) -> SavedProof:
    fields = _typed(row, dict)
    shows, bound, k = fields.get("shows"), fields.get("bound"), _natural(fields.get("k"))
    known: dict[object, Shows] = {name: name for name in get_args(Shows)}
    if not isinstance(shows, str) or shows not in known:
        raise ValueError(f"a proof shows none of {', '.join(get_args(Shows))}")
    limit = _natural(bound) if shows == "rounds" else None
    return SavedProof(known[shows], limit, k, _typed(fields.get("smt"), str))


def _natural(value: object) -> int:
    number = _typed(value, int)
    if isinstance(value, bool) or not 0 <= number < 1 << 16:
        raise ValueError("a number in it is not a valid number, or is too large")
    return number


def _typed(value: object, kind: type[T]) -> T:
    if not isinstance(value, kind):
        raise ValueError(f"something else is in the place of a {kind.__name__}")
    return value


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

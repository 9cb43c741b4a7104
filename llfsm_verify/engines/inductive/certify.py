"""Invariants checked again: initiation, consecution and implication, by a fresh solver and by cvc5, where it is
installed.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec

import z3

from llfsm_verify.backends.smt.arithmetic import Arithmetic, BitVectors
from llfsm_verify.diagnostics import Disagreement
from llfsm_verify.engines.inductive.invariant import Invariant
from llfsm_verify.engines.inductive.observers import FairLoops, State, Target
from llfsm_verify.engines.inductive.system import Course, Stage, System, differ, undistinguished
from llfsm_verify.engines.unrolled.question import Exhausted, Question, smt2
from llfsm_verify.limits import Budget
from llfsm_verify.program.program import Expr, Program

EFFORT = 100_000_000
"""Z3's units of work for one condition."""
MOST_NESTED = 500
"""Places where a run may be bad that are written into one formula for another solver."""
BASE, STEP = "the base of the induction", "the step of the induction"
FAILS = {
    "initiation": "the invariant is not true in the beginning, or does not exclude a violation there",
    "consecution": "the invariant does not stay true",
    "implication": "the invariant does not exclude the violation",
    BASE: "a run violates it within the first k",
    STEP: "k steps without a violation are followed by one with a violation",
}
"""What it means that a condition fails."""


@dataclass(frozen=True, slots=True)
class CheckedProof:
    """`checked_by`: the solvers that have found every condition true."""

    checked_by: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Rejection:
    """`reason`: which condition fails, or why that is not known."""

    reason: str


class Certifier:
    """The conditions of proofs that `target` is not reached by runs of `program`, which share all but the invariant.

    They are built from the program anew: nothing of a prover is in them. Sources: Z. Manna and A. Pnueli, Temporal
    Verification of Reactive Systems: Safety, 1995 (initiation, consecution, implication); for k > 0 as `induction`.
    """

    def __init__(self, program: Program, target: Target, arithmetic: Arithmetic | None = None) -> None:
        """ValueError: the target is one of `FairLoops`, and the program has a variable without bounds."""
        self.system = System(program, target, arithmetic)
        if isinstance(target, FairLoops) and not self.system.is_finite:
            raise ValueError("in a space without bounds runs go on forever without a loop")
        self._finite = isinstance(self.system.terms.arithmetic, BitVectors)
        self._begun = _Unrolled(self.system.course("begun"))
        self._going = _Unrolled(self.system.course("going", anywhere=True))
        self._asked: dict[tuple[str, int], Question] = {}
        self._sound = 0
        """Units from the beginning in which no run is bad."""

    def check(self, invariant: Invariant, budget: Budget, *, others: bool = True) -> CheckedProof | Rejection:
        """Whether the invariant proves that the target is not reached. `others`: cvc5 is asked as well.

        Raises LimitReached, and Disagreement when two solvers contradict each other.
        """
        impossible: list[list[z3.BoolRef]] = []
        try:
            for what, question, condition in self._conditions(invariant):
                if question.ask(condition, budget) is not None:
                    return Rejection(f"{what} fails: {FAILS[what]}")
                if others:
                    impossible.append([*question.told, *condition])
            for what, ask in ((BASE, self._base), (STEP, self._step)) if invariant.k > 0 else ():
                found = ask(invariant, budget)
                if found is None:
                    return Rejection(f"{what} fails: {FAILS[what]}")
                if others:
                    impossible += found
        except Exhausted:
            return Rejection("the solver that checks it gave up")
        except KeyError as name:
            return Rejection(f"it speaks of {name}, which is not a variable")
        by = [f"Z3 {z3.get_version_string()}"]
        if others:
            opinion = other_opinion(map(smt2, impossible), budget, finite=self._finite)
            if opinion.agrees is False:
                raise Disagreement(f"{opinion.solver} refutes a certificate that Z3 accepts")
            if opinion.agrees:
                by.append(opinion.solver)
        return CheckedProof(tuple(by))

    def inductive(self, formulas: Sequence[Expr], budget: Budget) -> list[Expr]:
        """Those of some formulas, true in the beginning, that stay true together: the greatest such part (C. Flanagan
        and K. R. M. Leino, Houdini, an annotation assistant for ESC/Java, FME 2001). LimitReached, Exhausted."""
        begun, going, system = self._begun, self._going, self.system
        first = self._question("begun", begun, begun.known(0))
        kept = [f for f in formulas if first.ask([z3.Not(system.formula(f, begun.at(0)))], budget) is None]
        after = self._question("going", going, going.known(1))
        while True:
            here = [system.formula(f, going.at(0)) for f in kept]
            staying = [f for f in kept if after.ask([*here, z3.Not(system.formula(f, going.at(1)))], budget) is None]
            if len(staying) == len(kept):
                return kept
            kept = staying

    def _conditions(self, invariant: Invariant) -> Iterator[tuple[str, Question, list[z3.BoolRef]]]:
        """What must be impossible, by the question that knows what comes before: all of it for k = 0."""
        begun, going = self._begun, self._going
        beginning = self._question("begun", begun, begun.known(0))
        yield "initiation", beginning, [z3.Not(self._holds(invariant, begun, 0))]
        yield "initiation", beginning, [begun.course.bad]
        here = self.system.formula(invariant.formula, going.at(0))
        after = self._question("going", going, going.known(1))
        yield "consecution", after, [here, z3.Not(self._holds(invariant, going, 1))]
        for stage in going.stages(0) if invariant.k == 0 else ():
            yield "implication", self._question("going", going, stage.known), [here, stage.bad]

    def _base(self, invariant: Invariant, budget: Budget) -> Iterator[list[z3.BoolRef]] | None:
        """No run is bad within the first k units: what is impossible then, written when it is asked for. None: that is
        not so. It is the same for all invariants, and asked once."""
        begun = self._begun
        question = self._question(BASE, begun, 0)
        for unit in range(self._sound, invariant.k):
            budget.check()  # not every unit has a question, and there may be many
            for stage in begun.stages(unit):
                question.learn(begun.course.constraints, stage.known)
                if question.ask([stage.bad], budget) is not None:
                    return None
            self._sound = unit + 1
        stages = [stage for unit in range(invariant.k) for stage in begun.stages(unit)]
        return (self._somewhere(stages, i) for i in range(0, len(stages), MOST_NESTED))

    def _somewhere(self, stages: Sequence[Stage], first: int) -> list[z3.BoolRef]:
        """That a run from the beginning is bad at one of the stages from number `first` on, MOST_NESTED of them."""
        constraints = self._begun.course.constraints
        known = 0 if first == 0 else stages[first - 1].known
        within = stages[first : first + MOST_NESTED]
        whole = z3.BoolVal(False)
        for before, stage in zip(reversed([known, *(s.known for s in within[:-1])]), reversed(within), strict=True):
            whole = z3.And(*constraints[before : stage.known], z3.Or(stage.bad, whole))
        return [*constraints[:known], whole]

    def _step(self, invariant: Invariant, budget: Budget) -> list[list[z3.BoolRef]] | None:
        """After k units that are not bad, between states that all differ, comes none that is: what is impossible then,
        with those differences that it takes. None: that is not so."""
        going, impossible = self._going, []
        here = self.system.formula(invariant.formula, going.at(0))
        states: list[State] = []
        for i in range(invariant.k + 1):
            budget.check()
            states.append(going.at(i))
        different: list[z3.BoolRef] = []
        for stage in going.stages(invariant.k):
            question = self._question("going", going, stage.known)
            while (model := question.ask([here, *different, stage.bad], budget)) is not None:
                equal = undistinguished(model, states)
                if equal is None:
                    return None
                different.append(differ(*equal))
            impossible.append([*going.course.constraints[: stage.known], here, *different, stage.bad])
        return impossible

    def _holds(self, invariant: Invariant, course: _Unrolled, units: int) -> z3.BoolRef:
        """The formula after so many units, and that all scalars are in their ranges."""
        return z3.And(self.system.formula(invariant.formula, course.at(units)), *course.well_formed(units))

    def _question(self, name: str, course: _Unrolled, known: int) -> Question:
        """A solver of its own that knows the first constraints of a course."""
        question = self._asked.get((name, known))
        if question is None:
            question = self._asked[name, known] = Question(finite=self._finite, effort=EFFORT)
            question.add(course.course.constraints[:known])
        return question


class _Unrolled:
    """A course as far as it was asked for: what is after each unit."""

    def __init__(self, course: Course) -> None:
        self.course = course
        self._behind: list[tuple[State, list[z3.BoolRef], int]] = []
        self._stages: list[list[Stage]] = []
        self._keep()

    def _keep(self) -> None:
        self._behind.append((self.course.state, self.course.well_formed, len(self.course.constraints)))

    def _go(self, units: int) -> None:
        while len(self._stages) < units:
            self._stages.append(self.course.advance())
            self._keep()

    def at(self, units: int) -> State:
        """The state after so many units."""
        self._go(units)
        return self._behind[units][0]

    def well_formed(self, units: int) -> list[z3.BoolRef]:
        """What `System.well_formed` asks of that state."""
        self._go(units)
        return self._behind[units][1]

    def known(self, units: int) -> int:
        """How many constraints the course has by then."""
        self._go(units)
        return self._behind[units][2]

    def stages(self, unit: int) -> list[Stage]:
        """Where a unit may be bad, the first being 0."""
        self._go(unit + 1)
        return self._stages[unit]


CVC_EFFORT = 1_000_000
"""cvc5's units of work for all questions together: some 20 seconds at most."""
MOST_TEXT = 20_000_000
"""Characters of a question."""
USED = "resource::resourceUnitsUsed"
"""The statistic that counts them."""


@dataclass(frozen=True, slots=True)
class Opinion:
    """`agrees` None: the solver is not there, cannot read a question, or gave one up."""

    solver: str
    agrees: bool | None


def is_installed() -> bool:
    return find_spec("cvc5") is not None


def other_opinion(texts: Iterable[str], budget: Budget, *, finite: bool) -> Opinion:
    """Whether all questions, in SMT-LIB 2, are impossible. `finite`: bit-vectors, not integers.

    When the time is up there is no opinion, and what another solver has found stands.
    """
    if not is_installed():
        return Opinion("cvc5", None)
    import cvc5

    name = f"cvc5 {cvc5.__version__}"
    agrees: bool | None = True
    effort = CVC_EFFORT
    for text in texts:
        if effort <= 0 or len(text) > MOST_TEXT:
            return Opinion(name, None)
        answer, units = _answer(text, effort, budget, finite=finite)
        if answer is False:
            return Opinion(name, False)
        agrees = agrees and answer
        effort -= units
    return Opinion(name, agrees)


def _answer(text: str, effort: int, budget: Budget, *, finite: bool) -> tuple[bool | None, int]:
    """Whether one question is impossible, and the units of work that it took."""
    import cvc5

    manager = cvc5.TermManager()
    solver = cvc5.Solver(manager)
    solver.setOption("rlimit-per", str(effort))
    if budget.left is not None:
        solver.setOption("tlimit-per", str(max(1, round(1000 * budget.left))))
    parser = cvc5.InputParser(solver, cvc5.SymbolManager(manager))
    logic = "QF_BV" if finite else "QF_NIA" if "(* " in text else "QF_LIA"
    parser.setStringInput(cvc5.InputLanguage.SMT_LIB_2_6, f"(set-logic {logic})\n{text}", "condition")
    said = ""
    try:
        while True:
            command = parser.nextCommand()
            if command.isNull():
                break
            said += command.invoke(solver, parser.getSymbolManager())
    except RuntimeError as problem:  # what it cannot read is no answer
        logging.getLogger(__name__).info("cvc5: %s", problem)
        return None, 0
    words = said.split()
    answer = True if "unsat" in words else False if "sat" in words else None
    return answer, int(solver.getStatistics()[USED]["value"])

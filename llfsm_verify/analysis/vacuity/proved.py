"""How empty passes are that were proved: stronger formulas, put to the same engine once more."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

from llfsm_verify.analysis.vacuity.check import (
    LIMITS,
    Holds,
    assumptions_finding,
    formula_findings,
    formula_of,
    not_looked_for,
    stronger_line,
)
from llfsm_verify.checking.goals.goal import Goal
from llfsm_verify.checking.problem import Problem, only_shown
from llfsm_verify.checking.verdict import (
    NO_RUN,
    PERHAPS_NO_RUN,
    Looked,
    Options,
    PropertyResult,
    Vacuity,
    VacuityFinding,
    Verdict,
)
from llfsm_verify.limits import LimitReached
from llfsm_verify.logic.formula import FALSE, Formula, to_text
from llfsm_verify.logic.properties import Property

EFFORT, EFFORT_ASKED = 1_000_000, 20_000_000
"""Z3's units of work for all stronger formulas together, without being asked for and when asked."""
EFFORT_IMPOSSIBLE = 200_000_000
"""Those for a proof that no run satisfies the assumptions, where none was found: a verdict depends on it."""
IMPOSSIBLE = "impossible"
"""The name of the property that holds where no run satisfies the assumptions."""
Decide = Callable[[Problem, int], Mapping[str, bool | None]]
"""Whether each property holds, by name, found with so many units of work; None: that is not known."""


class ProvedPasses:
    """Looks at properties that were proved under the assumptions of `problem`.

    Antecedents that are never true are found, and with ``--vacuity`` subformulas that do not matter: by the method of
    `vacuity.check`. Atoms that never hold are not looked for, nor is anything empty in regular properties and
    automata of files.
    """

    def __init__(self, problem: Problem, options: Options) -> None:
        self._problem = problem
        self._escape = not_looked_for(problem, "only a search of all configurations tells")
        self._everything = options.strict or options.vacuity == "all"
        self._names: dict[Formula, str] = {}
        self._known: Mapping[str, bool | None] = {}

    def examined(
        self, results: Sequence[PropertyResult], goals: Sequence[Goal], decide: Decide, *, possible: bool | None
    ) -> tuple[PropertyResult, ...]:
        """The results with what was found of those that hold. `possible`: some run satisfies the assumptions."""
        held = {r.name: g for r, g in zip(results, goals, strict=True) if r.verdict is Verdict.HOLDS}
        if possible is None and held and self._is_disproved(next(iter(held.values())), decide):
            possible = False
            results = [replace(r, notes=tuple(map(_now_known, r.notes))) for r in results]
        if possible:
            for goal in held.values():
                self._gather(goal)
            like = next((goal.line for goal in held.values()), None)
            if like is not None and self._names:
                edges = {key: f for goal in held.values() for key, f in goal.line.edges.items()}
                like = replace(like, edges=edges)
                lines = [stronger_line(like, f, name) for f, name in self._names.items()]
                effort = EFFORT_ASKED if self._everything else EFFORT
                try:
                    self._known = decide(self._claiming(tuple(lines)), effort)
                except LIMITS:
                    pass  # then nothing is known of them, and that is said
        return tuple(r if r.name not in held else self._of(r, held[r.name], possible) for r in results)

    def _claiming(self, lines: tuple[Property, ...]) -> Problem:
        """The problem with these lines in the place of its own; searches read atoms that only traces had."""
        shown = only_shown((*lines, *self._problem.assumptions))
        return replace(self._problem, properties=lines, shown=shown)

    def _is_disproved(self, goal: Goal, decide: Decide) -> bool:
        """Whether no run satisfies the assumptions: then all would violate what is never true, and none does."""
        line = stronger_line(goal.line, FALSE, IMPOSSIBLE)
        try:
            return decide(self._claiming((line,)), EFFORT_IMPOSSIBLE).get(IMPOSSIBLE) is True
        except LIMITS:
            return False  # then it stays unknown, and that is said

    def _gather(self, goal: Goal) -> None:
        """Stronger formulas that will be asked for."""

        def ask(formula: Formula) -> bool:
            self._names.setdefault(formula, f"stronger {len(self._names)}")
            return False

        try:
            for _ in self._findings(goal, ask):
                pass
        except LIMITS:
            pass  # it is met again, and said

    def _of(self, result: PropertyResult, goal: Goal, possible: bool | None) -> PropertyResult:
        vacuity = result.vacuity
        if possible is None:
            return replace(
                result, vacuity=_not_looked(vacuity, "whether any run satisfies the assumptions is not known")
            )
        if not possible:
            found: tuple[VacuityFinding, ...] = (assumptions_finding(self._problem),)
            return replace(result, vacuity=self._looked(vacuity, found, possible=False))
        if formula_of(goal.line) is None:
            return result  # it says already that it was not looked at
        some: list[VacuityFinding] = []
        try:
            some.extend(self._findings(goal, self._holds))
        except LIMITS as limit:
            return replace(result, vacuity=_not_looked(vacuity, str(limit) or "the memory ran out", some))
        return replace(result, vacuity=self._looked(vacuity, tuple(some)))

    def _looked(self, vacuity: Vacuity, found: tuple[VacuityFinding, ...], *, possible: bool = True) -> Vacuity:
        """Stronger formulas tell nothing of runs that escape the assumptions."""
        reason = self._escape.reason if possible else None
        looked: Looked = "all" if self._everything and reason is None else "antecedents"
        return replace(vacuity, findings=found, looked=looked, reason=reason)

    def _findings(self, goal: Goal, holds: Holds) -> Iterator[VacuityFinding]:
        formula = formula_of(goal.line)
        if formula is not None:
            everything, assumed = self._everything, bool(self._problem.assumptions)
            yield from formula_findings(formula, holds, everything=everything, assumed=assumed)

    def _holds(self, formula: Formula) -> bool:
        known = self._known.get(self._names.get(formula, ""))
        if known is None:
            raise LimitReached(f"whether `{to_text(formula)}` also holds is not known")
        return known


def _now_known(note: str) -> str:
    return NO_RUN if note == PERHAPS_NO_RUN else note


def mark_unexamined(results: Sequence[PropertyResult], why: str) -> tuple[PropertyResult, ...]:
    """The results of a check that was ended before it looked; `why`."""
    return tuple(replace(r, vacuity=_not_looked(r.vacuity, why)) if r.verdict is Verdict.HOLDS else r for r in results)


def _not_looked(vacuity: Vacuity, why: str, found: Sequence[VacuityFinding] = ()) -> Vacuity:
    return replace(vacuity, findings=tuple(found), reason=f"not checked for vacuity: {why}")

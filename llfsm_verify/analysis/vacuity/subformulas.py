"""Antecedents that are never true, and subformulas that do not matter, of one formula that holds."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator

from llfsm_verify.checking.vacuity import VacuityFinding
from llfsm_verify.logic.formula import FALSE, TRUE, Formula, is_boolean, to_text
from llfsm_verify.logic.rewriting.strengthening import Occurrence, consequent, parts, replace_subformula

MOST = 200
"""Occurrences of subformulas that are looked at; formulas with more are written by programs."""

Holds = Callable[[Formula], bool]


class TooManySubformulas(Exception):
    """A formula has more occurrences of subformulas than are looked at."""


def findings(formula: Formula, holds: Holds, *, everything: bool, assumed: bool = False) -> Iterator[VacuityFinding]:
    """What is vacuous in `formula`, which holds: outermost first, and nothing inside of what was found.

    `holds` decides a stronger formula, under assumptions when `assumed`. Without `everything` only the consequents of
    implications are replaced. Raises
    TooManySubformulas, and what `holds` raises, after what was found before.
    """
    todo = deque([Occurrence(formula)])
    looked = 0
    while todo:
        place = todo.popleft()
        looked += 1
        if looked > MOST:
            raise TooManySubformulas(f"it has more than {MOST} subformulas")
        right = consequent(place)
        if right is not None:
            stronger = replace_subformula(formula, right.path, FALSE)
            if stronger not in (TRUE, FALSE) and right.node is not FALSE and holds(stronger):
                yield _never(place, stronger, formula, assumed)
                continue
        for part in parts(place):
            if part.node in (TRUE, FALSE):
                continue
            if everything and part != right:
                stronger = replace_subformula(formula, part.path, part.extreme)
                if stronger is not FALSE and holds(stronger):
                    subject = to_text(part.node)
                    message = f"`{subject}` does not matter: `{to_text(stronger)}` also holds"
                    yield VacuityFinding("subformula", message, subject, to_text(stronger))
                    continue
            todo.append(part)


def _never(place: Occurrence, stronger: Formula, formula: Formula, assumed: bool) -> VacuityFinding:
    """An implication, the right side of which may be anything."""
    subject, witness = to_text(place.node.args[0]), to_text(stronger)
    if place.node.op == "[]->":
        nothing = f"nothing ever matches `{subject}`{' under the assumptions' if assumed else ''}"
        return VacuityFinding("antecedent", f"{nothing}: `{witness}` also holds", subject, witness)
    everywhere = _is_everywhere(formula, place.path)
    verb = "is never true" if is_boolean(place.node.args[0]) else "never holds"
    where = "in any run" if everywhere else "where it is asked for"
    where += " under the assumptions" if assumed else ""
    return VacuityFinding("antecedent", f"`{subject}` {verb} {where}: `{witness}` also holds", subject, witness)


def _is_everywhere(formula: Formula, path: tuple[int, ...]) -> bool:
    """Whether an occurrence is one in every configuration: it stands below `G` and conjunctions alone."""
    always = False
    for i in path:
        if formula.op not in ("G", "and"):
            return False
        always = always or formula.op == "G"
        formula = formula.args[i]
    return always

"""What formulas say of the initial configuration alone: where `G` may have been forgotten, and `initially`, which says
that the beginning is meant."""

from __future__ import annotations

from llfsm_verify.diagnostics import Diagnostic, Span
from llfsm_verify.logic import codes
from llfsm_verify.logic.formula import BOOLEAN, PAST, Formula, apply, postorder, to_text

SHOWN = 120
"""Characters of a formula in a message, and then an ellipsis."""


def unguarded(formula: Formula) -> Formula | None:
    """The first atom, or operator that looks back, that no operator which looks ahead stands around; None: all are
    under one, or under `initially`."""
    todo, seen = [formula], set[Formula]()
    while todo:
        node = todo.pop()
        if node.op == "atom" or node.op in PAST:
            return node
        if node.op in BOOLEAN and node not in seen:
            seen.add(node)
            todo.extend(reversed(node.args))
    return None


def without_initially(formula: Formula) -> Formula:
    """The formula that means the same without the word."""
    done: dict[Formula, Formula] = {}
    for node in postorder(formula):
        args = tuple(done[a] for a in node.args)
        if node.op == "initially":
            done[node] = args[0]
        else:
            done[node] = node if args == node.args else apply(node.op, *args, bound=node.key)
    return done[formula]


def forgotten(formula: Formula, place: Span, *, arrow: bool = False, ours: bool = True) -> Diagnostic | None:
    """The warning (W302) about a formula, as it was written, that asks for something at the initial configuration only;
    None: nothing of the kind, or `initially` says that it is meant.

    `arrow`: it has the sign `-->`. `ours`: it is in our syntax, which has `initially`.
    """
    atom = unguarded(formula)
    if atom is None:
        return None
    while formula.op == "and":  # the part that is in question
        formula = next(part for part in formula.args if unguarded(part) is not None)
    why = "looks back, but is asked at the beginning" if atom.op in PAST else "stands under no temporal operator"
    message = f"`{to_text(atom, SHOWN)}` {why}, so it is about the initial configuration only"
    always, throughout = apply("G", formula), "if it is to be true throughout"
    if arrow and formula.op == "implies":
        throughout = "for `leads to`"
        then = formula.args[1]
        always = apply("G", apply("implies", formula.args[0], then if then.op == "F" else apply("F", then)))
    hint = f"write `{to_text(always, SHOWN)}` {throughout}, or `{to_text(apply('initially', formula), SHOWN)}` if "
    hint += "the beginning is meant"
    if any(node.op == "initially" for node in postorder(formula)):
        whole = apply("initially", without_initially(formula))
        hint = f"write `{to_text(whole, SHOWN)}` if all of this is about the beginning, or put the rest under `G`"
    if not ours:
        hint = "put it under `G` (in SPIN `[]`) if it is to be true throughout; where the beginning is meant, "
        hint += "`--accept-vacuity NAME` lets it pass under `--strict`"
    return Diagnostic(codes.INITIAL_ONLY, message, place, hint=hint)

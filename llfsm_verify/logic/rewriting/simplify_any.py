"""Formulas with any operators made simpler where that is sound: their plain parts, and what joins them."""

from __future__ import annotations

from llfsm_verify.logic.bounds import rebuilt, without_steps
from llfsm_verify.logic.formula import ARITY, EXPRESSIONS, Formula, negation, postorder
from llfsm_verify.logic.rewriting.normal_form import both, either, nnf, temporal
from llfsm_verify.logic.rewriting.simplify import Simplifier


def simplify_any(formula: Formula) -> Formula:
    """An equivalent of `formula`: step bounds written out, each largest subformula of plain temporal logic simplified.

    The rules for plain formulas hold at every position of every word, so they hold below operators of the past, of time
    and after expressions as well. Expressions themselves stay as they are.
    """
    written = without_steps(formula)
    order = postorder(written)
    plain: set[Formula] = set()
    for node in order:
        if node.op in ARITY and all(a in plain for a in node.args):
            plain.add(node)
    simplifier = Simplifier()
    if written in plain:
        return simplifier.simplify(nnf(written))
    done: dict[Formula, Formula] = {}
    for node in order:
        if node not in plain:
            done[node] = _joined(node, tuple(_part(node, a, done, simplifier) for a in node.args))
    return done[written]


def _part(owner: Formula, part: Formula, done: dict[Formula, Formula], simplifier: Simplifier) -> Formula:
    if part in done:
        return done[part]
    if owner.op in EXPRESSIONS or (owner.op in ("[]->", "<>->", "closure") and part is owner.args[0]):
        return part  # a letter
    done[part] = simplifier.simplify(nnf(part))
    return done[part]


def _joined(node: Formula, args: tuple[Formula, ...]) -> Formula:
    match node.op:
        case "and":
            return both(args)
        case "or":
            return either(args)
        case "not":
            return negation(args[0])
        case "X" | "F" | "G" | "U" | "W" | "R" | "M":
            return temporal(node.op, *args)
    return rebuilt(node, args)

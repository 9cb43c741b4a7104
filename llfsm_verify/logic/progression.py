"""What a finite word leaves of a formula, without automata: whether every continuation violates or satisfies it."""

from __future__ import annotations

from collections.abc import Sequence

from llfsm_verify.logic.formula import FALSE, TRUE, Formula, postorder, size
from llfsm_verify.logic.rewriting.normal_form import both, either, nnf
from llfsm_verify.logic.word import Letter, holds_in

MAX_SIZE = 20_000
"""Distinct subformulas of what is left over before `evaluate_prefix` gives up."""


def progress(formula: Formula, letter: Letter) -> Formula:
    """The formula that the rest of a word must satisfy for `letter` and the rest to satisfy `formula`.

    `formula` is in negation normal form. Source: Bacchus and Kabanza, Using temporal logics to express search control
    knowledge for planning, Artificial Intelligence 116 (2000).
    """
    done: dict[Formula, Formula] = {}
    for node in postorder(formula):
        done[node] = progressed(node, letter, done)
    return done[formula]


def evaluate_prefix(formula: Formula, letters: Sequence[Letter]) -> bool | None:
    """False: no continuation of `letters` satisfies `formula`. True: all do. None: not decided by simplification.

    None is also the answer for some words that are bad prefixes: what is left over may be unsatisfiable without looking
    so. False and True are always right.
    """
    rest = nnf(formula)
    for letter in letters:
        rest = progress(rest, letter)
        if rest in (TRUE, FALSE):
            return rest is TRUE
        if size(rest) > MAX_SIZE:
            return None
    return None if rest not in (TRUE, FALSE) else rest is TRUE


def progressed(node: Formula, letter: Letter, done: dict[Formula, Formula]) -> Formula:
    """What `progress` makes of a node; `done` has what it makes of the arguments."""
    match node.op:
        case "true" | "false":
            return node
        case "atom":
            return TRUE if holds_in(node.key, letter) else FALSE
        case "not":
            return FALSE if done[node.args[0]] is TRUE else TRUE
        case "and":
            return both(done[a] for a in node.args)
        case "or":
            return either(done[a] for a in node.args)
        case "X":
            return node.args[0]
        case "F":
            return either((done[node.args[0]], node))
        case "G":
            return both((done[node.args[0]], node))
        case "U" | "W":
            a, b = (done[x] for x in node.args)
            return either((b, both((a, node))))
        case "R" | "M":
            a, b = (done[x] for x in node.args)
            return both((b, either((a, node))))
    raise ValueError(f"not in negation normal form: {node.op}")

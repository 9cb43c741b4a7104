"""What formulas say of the initial configuration alone: where `G` may have been forgotten, and `initially`, which says
that the beginning is meant."""

from __future__ import annotations

from collections.abc import Mapping

from llfsm_verify.diagnostics import Diagnostic, Span
from llfsm_verify.logic import codes
from llfsm_verify.logic.formula import (
    BINDING,
    BOOLEAN,
    PAST,
    Formula,
    apply,
    atoms,
    is_boolean,
    mapped,
    postorder,
    to_text,
)

SHOWN = 120
"""Characters of a formula in a message, and then an ellipsis."""
_ALL_BEGIN = BOOLEAN | {"alt", "inter", "nlm", "first_match", "closure"}
_NO_NAMES: Mapping[str, Formula] = {}


def unguarded(formula: Formula, names: Mapping[str, Formula] = _NO_NAMES) -> tuple[Formula, Formula] | None:
    """The first atom, or operator that looks back, that no operator which looks ahead stands around, and the outermost
    operator with an expression around it (or again the atom); None: all are under one, or under `initially`.

    The atoms in `names` stand for formulas. In an expression only what must be at the first letter of every match is
    meant: `a` in `{a;b}` and `{a[*2]}`, but not in `{[*];a}` and `{a[*];b}`.
    """
    todo, seen = [(formula, formula)], set[Formula]()
    while todo:
        node, around = todo.pop()
        around = around if around.op in BINDING else node
        if node.op == "atom" or node.op in PAST:
            if node.key not in names or unguarded(names[node.key]):
                return node, around
        elif node not in seen:
            seen.add(node)
            args = node.args
            if node.op in ("seq", "fuse", "[]->", "<>->"):  # a fusion with a letter goes on at the same letter
                args = args[: 1 + (node.op != "seq" and is_boolean(args[0]))]
            elif node.op not in _ALL_BEGIN and (node.op != "repeat" or node.key == "0:"):
                continue
            todo.extend((a, around) for a in reversed(args))
    return None


def without_initially(formula: Formula) -> Formula:
    """The formula that means the same without the word."""
    return mapped(formula, lambda node, args: args[0] if node.op == "initially" else None)


def forgotten(
    formula: Formula,
    place: Span,
    *,
    name: str = "NAME",
    arrow: bool = False,
    syntax: str = "llfsm",
    names: Mapping[str, Formula] = _NO_NAMES,
) -> Diagnostic | None:
    """The warning (W302) about a formula, as it was written, that asks for something at the initial configuration only;
    None: nothing of the kind, or `initially` says that it is meant.

    `name`: that of the property. `arrow`: it has the sign `-->`. `names`: what definitions in it stand for.
    """

    def text(f: Formula) -> str:
        if syntax == "llfsm":
            return to_text(f, SHOWN)
        from llfsm_verify.logic.syntaxes.writing import write_formula

        return write_formula(syntax, f, SHOWN)

    found = unguarded(formula, names)
    if found is None:
        return None
    atom, around = found
    while formula.op == "and":  # the part that is in question
        formula = next(part for part in formula.args if unguarded(part, names) is not None)
    why = "looks back, but is asked at the beginning" if atom.op in PAST else "stands under no temporal operator"
    what = "it is about" if around is atom else "its matches begin at"
    message = f"`{text(around)}` {why}, so {what} the initial configuration only"
    always, throughout = apply("G", formula), "if it is to be true throughout"
    if arrow and formula.op == "implies":
        throughout = "for `leads to`"
        then = formula.args[1]
        always = apply("G", apply("implies", formula.args[0], then if then.op == "F" else apply("F", then)))
    hint = f"write `{text(always)}` {throughout}"
    if syntax != "llfsm":
        hint += f"; where the beginning is meant, `--accept-vacuity {name}` lets it pass under `--strict`"
    elif any(n.op == "initially" for n in postorder(formula, *map(names.__getitem__, names.keys() & atoms(formula)))):
        whole = apply("initially", without_initially(formula))
        hint = f"write `{text(whole)}` if all of this is about the beginning, or put the rest under `G`"
    else:
        hint += f", or `{text(apply('initially', formula))}` if the beginning is meant"
    return Diagnostic(codes.INITIAL_ONLY, message, place, hint=hint)

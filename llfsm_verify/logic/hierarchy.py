"""Where the form of a formula puts it in the hierarchy of Manna and Pnueli."""

from __future__ import annotations

from dataclasses import dataclass

from llfsm_verify.logic.formula import Formula, postorder


@dataclass(frozen=True, slots=True)
class Form:
    """Classes that the form shows; a formula may belong to one without its form showing it."""

    safety: bool
    guarantee: bool
    obligation: bool
    recurrence: bool
    persistence: bool


def form(formula: Formula) -> Form:
    """The classes of a formula in negation normal form.

    Source: Chang, Manna and Pnueli, Characterization of temporal property classes, ICALP 1992; Černá and Pelánek,
    Relating hierarchy of temporal properties to model checking, MFCS 2003.
    """
    known: dict[Formula, Form] = {}
    for node in postorder(formula):
        known[node] = _form(node, [known[a] for a in node.args])
    return known[formula]


def _form(node: Formula, args: list[Form]) -> Form:
    if node.op in ("true", "false", "atom", "not"):
        return Form(True, True, True, True, True)
    safety = all(a.safety for a in args)
    guarantee = all(a.guarantee for a in args)
    obligation = all(a.obligation for a in args)
    recurrence = all(a.recurrence for a in args)
    persistence = all(a.persistence for a in args)
    first, last = args[0], args[-1]
    match node.op:
        case "and" | "or" | "X":
            return Form(safety, guarantee, obligation, recurrence, persistence)
        case "F":
            return Form(False, guarantee, guarantee, guarantee, persistence)
        case "G":
            return Form(safety, False, safety, recurrence, safety)
        case "U":
            obligation = first.obligation and last.guarantee
            return Form(False, guarantee, obligation, first.recurrence and last.guarantee, persistence)
        case "W":
            obligation = first.safety and last.obligation
            return Form(safety, False, obligation, recurrence, first.safety and last.persistence)
        case "R":
            obligation = first.obligation and last.safety
            return Form(safety, False, obligation, recurrence, first.persistence and last.safety)
        case "M":
            obligation = first.guarantee and last.obligation
            return Form(False, guarantee, obligation, first.guarantee and last.recurrence, persistence)
    raise ValueError(f"not in negation normal form: {node.op}")

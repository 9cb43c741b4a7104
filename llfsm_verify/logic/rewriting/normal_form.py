"""Negation normal form, and the constructors that simplify what is evident in a formula."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from llfsm_verify.logic.formula import FALSE, TRUE, Formula, Op, apply, conjunction, disjunction, negation


def nnf(f: Formula, negate: bool = False) -> Formula:
    """`f` (or its negation) with `not` on atoms only, over `and or X F G U W R M`, simplified; iterative, memoised.

    `xor` and `iff` are written out; shared parts stay shared, so the size at most doubles for them.
    """
    return rewritten(f, negate, NORMAL)[f, negate]


Rewrite = Callable[[Formula, bool, Callable[[Formula, bool], Formula]], Formula]
"""What becomes of a subformula in a place (True: under an odd number of negations); told what its parts became."""


def rewritten(f: Formula, negate: bool, rewrite: Rewrite) -> dict[tuple[Formula, bool], Formula]:
    """What `rewrite` makes of `f` and of each of its subformulas in each of its places, arguments first."""
    done: dict[tuple[Formula, bool], Formula] = {}
    stack = [(f, negate)]
    while stack:
        node, negative = stack[-1]
        if (node, negative) in done:
            stack.pop()
            continue
        missing = [need for need in polar_parts(node, negative) if need not in done]
        if missing:
            stack.extend(reversed(missing))
        else:
            done[node, negative] = rewrite(node, negative, lambda a, n: done[a, n])
            stack.pop()
    return done


def polar_parts(f: Formula, negative: bool) -> list[tuple[Formula, bool]]:
    """The subformulas in the places where they stand: under an even (False) or an odd number of negations."""
    match f.op:
        case "not":
            return [(f.args[0], not negative)]
        case "implies":
            return [(f.args[0], not negative), (f.args[1], negative)]
        case "xor" | "iff":
            return [(a, n) for n in (False, True) for a in f.args]
    return [(a, negative) for a in f.args]


_DUAL: dict[Op, Op] = {
    "and": "or", "or": "and", "F": "G", "G": "F", "U": "R", "R": "U", "W": "M", "M": "W", "X": "X",
    "Y": "Z", "Z": "Y", "O": "H", "H": "O", "S": "T", "T": "S", "F<=": "G<=", "G<=": "F<=", "U<=": "R<=", "R<=": "U<=",
    "O[]": "H[]", "H[]": "O[]", "S[]": "T[]", "T[]": "S[]", "O<=": "H<=", "H<=": "O<=", "S<=": "T<=", "T<=": "S<=",
}  # fmt: skip


def _literal(f: Formula, negative: bool) -> Formula:
    return negation(f) if negative else f


Join = Callable[[Iterable[Formula]], Formula]


@dataclass(frozen=True, slots=True)
class Negations:
    """How negations are pushed down to the atoms: what becomes of an atom, and what joins the rewritten parts.

    `operator` is told the operator, its arguments and its bound.
    """

    literal: Callable[[Formula, bool], Formula]
    conjunction: Join
    disjunction: Join
    operator: Callable[[Op, Sequence[Formula], str], Formula]

    def __call__(self, f: Formula, negative: bool, of: Callable[[Formula, bool], Formula]) -> Formula:
        """As `Rewrite`."""
        match f.op:
            case "true" | "false":
                return TRUE if (f.op == "true") != negative else FALSE
            case "atom":
                return self.literal(f, negative)
            case "not":
                return of(f.args[0], not negative)
            case "implies":
                parts = of(f.args[0], not negative), of(f.args[1], negative)
                return self.conjunction(parts) if negative else self.disjunction(parts)
            case "xor" | "iff":
                a, b = f.args
                same = (f.op == "iff") != negative
                return self.disjunction(
                    [self.conjunction((of(a, n), of(b, n == same))) for n in (False, True)],
                )
        args = [of(a, negative) for a in f.args]
        op = _DUAL[f.op] if negative else f.op
        if op in ("and", "or"):
            return self.conjunction(args) if op == "and" else self.disjunction(args)
        return self.operator(op, args, f.key)


def both(formulas: Iterable[Formula]) -> Formula:
    """A conjunction without repetitions, constants, or a formula beside its negation."""
    return _join(formulas, "and", FALSE, TRUE)


def either(formulas: Iterable[Formula]) -> Formula:
    """A disjunction without repetitions, constants, or a formula beside its negation."""
    return _join(formulas, "or", TRUE, FALSE)


def _join(formulas: Iterable[Formula], op: Op, zero: Formula, one: Formula) -> Formula:
    kept: dict[Formula, None] = {}
    for f in formulas:
        for g in f.args if f.op == op else (f,):
            if g is zero or negation(g) in kept:
                return zero
            if g is not one:
                kept[g] = None
    return conjunction(kept) if op == "and" else disjunction(kept)


def temporal(op: Op, *args: Formula) -> Formula:
    """`X F G U W R M` applied to `args`, simplified where constants and repetition make it plain."""
    b = args[-1]
    if len(args) == 1:
        if b in (TRUE, FALSE) or (op in ("F", "G") and _absorbs(op, b)):
            return b
        return apply(op, b)
    a = args[0]
    if a is b:
        return a
    if op == "U":
        if b in (TRUE, FALSE) or a is FALSE or b.op == "F":
            return b
        return temporal("F", b) if a is TRUE else apply(op, a, b)
    if op == "R":
        if b in (TRUE, FALSE) or a is TRUE or b.op == "G":
            return b
        return temporal("G", b) if a is FALSE else apply(op, a, b)
    if op == "W":
        if TRUE in (a, b):
            return TRUE
        if b is FALSE:
            return temporal("G", a)
        return b if a is FALSE else apply(op, a, b)
    if FALSE in (a, b):
        return FALSE
    if b is TRUE:
        return temporal("F", a)
    return b if a is TRUE else apply(op, a, b)


def _absorbs(op: Op, f: Formula) -> bool:
    """`F f` is `f` for `F …` and `G F …`; `G f` is `f` for `G …` and `F G …`."""
    other: Op = "G" if op == "F" else "F"
    return f.op == op or (f.op == other and f.args[0].op == op)


NORMAL = Negations(_literal, both, either, lambda op, args, _: temporal(op, *args))
"""The rewriting of `nnf`."""

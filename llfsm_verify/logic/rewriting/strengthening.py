"""Stronger formulas by the extreme of a subformula's sign: `false` where it stands positively, `true` where not.

Any other subformula in that place makes a weaker formula (Kupferman and Vardi, Vacuity detection in temporal model
checking, STTT 4, 2003).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from llfsm_verify.logic.bounds import least_of, rebuilt, written_out
from llfsm_verify.logic.formula import BINDING, FALSE, TRUE, Formula, Op, apply, conjunction, disjunction, negation
from llfsm_verify.logic.rewriting.normal_form import temporal

CONSTANTS = (TRUE, FALSE)


@dataclass(frozen=True, slots=True)
class Occurrence:
    """A subformula in one place: the arguments to take from the top, and whether the number of negations is odd."""

    node: Formula
    path: tuple[int, ...] = ()
    negative: bool = False

    @property
    def extreme(self) -> Formula:
        """What in this place makes the whole formula strongest."""
        return TRUE if self.negative else FALSE


def parts(of: Occurrence) -> Iterator[Occurrence]:
    """The occurrences of the arguments that have one sign: none below `xor` and `<->`, in regular expressions, and in
    what was written out from a bound in steps."""
    node = of.node
    if node.op in ("xor", "iff", "closure") or written_out(node) is not None:
        return
    for i, a in enumerate(node.args):
        if node.op in BINDING and i == 0:
            continue
        flipped = node.op == "not" or (node.op == "implies" and i == 0)
        yield Occurrence(a, (*of.path, i), of.negative != flipped)


def consequent(of: Occurrence) -> Occurrence | None:
    """The occurrence of the right side, when this is an implication that has to hold: `a -> b`, `{r}[]->b`."""
    if of.node.op not in ("implies", "[]->") or of.negative:
        return None
    return Occurrence(of.node.args[1], (*of.path, 1), False)


def replace_subformula(formula: Formula, path: tuple[int, ...], by: Formula) -> Formula:
    """`formula` with `by` in the place of one occurrence, constants folded as far as they reach."""
    above = [formula]
    for i in path:
        above.append(above[-1].args[i])
    result = by
    for node, i in zip(reversed(above[:-1]), reversed(path), strict=True):
        result = _folded(node, (*node.args[:i], result, *node.args[i + 1 :]))
    return result


def _folded(node: Formula, args: tuple[Formula, ...]) -> Formula:
    """`node` with other arguments, without those constants that make it plainer."""
    if not any(a in CONSTANTS for a in args):
        return negation(args[0]) if node.op == "not" else rebuilt(node, args)
    first, last = args[0], args[-1]
    match node.op:
        case "not":
            return FALSE if first is TRUE else TRUE
        case "and":
            return FALSE if FALSE in args else conjunction(a for a in args if a is not TRUE)
        case "or":
            return TRUE if TRUE in args else disjunction(a for a in args if a is not FALSE)
        case "implies":
            if first is FALSE or last is TRUE:
                return TRUE
            return last if first is TRUE else negation(first)
        case "X" | "F" | "G" | "O" | "H" | "F<=" | "G<=":
            return first
        case "O[]" | "H[]" | "O<=" | "H<=":  # `O[2:5] true`: two letters are there
            settled = (first is FALSE) == (node.op[0] == "O") or least_of(node) == 0
            return first if settled else rebuilt(node, args)
        case "Y" | "Z":
            return first if (first is FALSE) == (node.op == "Y") else rebuilt(node, args)
        case "U" | "W" | "R" | "M":
            return temporal(node.op, *args)
        case "U<=" | "R<=" | "S<=" | "T<=" | "S[]" | "T[]":
            return _folded_bounded(node, first, last)
        case "S" | "T":
            if last in CONSTANTS:
                return last
            if (first is TRUE) == (node.op == "T"):
                return last
            return apply("O" if node.op == "S" else "H", last)
    return rebuilt(node, args)


_OF_ONE: dict[Op, Op] = {
    "U<=": "F<=", "R<=": "G<=", "S<=": "O<=", "T<=": "H<=", "S[]": "O[]", "T[]": "H[]",
}  # fmt: skip
"""What a bounded operator of two arguments is where the first one says nothing."""


def _folded_bounded(node: Formula, first: Formula, last: Formula) -> Formula:
    """`first U[…] last` or another such operator, one of them constant."""
    one, zero = (TRUE, FALSE) if node.op[0] in "US" else (FALSE, TRUE)
    if last is zero:
        return last
    if first is one:
        return _folded(apply(_OF_ONE[node.op], last, bound=node.key), (last,))
    if least_of(node) == 0:
        return last
    return zero if first is zero else rebuilt(node, (first, last))  # `p U[1s:2s] true`: p holds for a second

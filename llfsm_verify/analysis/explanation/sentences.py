"""Why a property fails on a run, as a clause: `ew@GREEN` is true at step 65 while `ns@GREEN` is true."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from llfsm_verify.analysis.explanation.causes import Reading, causes
from llfsm_verify.logic.bounds import written_out
from llfsm_verify.logic.expressions import derivative, letters, nullable
from llfsm_verify.logic.formula import FALSE, Formula, Op, is_boolean, negation, time_text, to_text
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.regular import RegularKind
from llfsm_verify.logic.regular_evaluate import Valuation, valuations

LONGEST = 100
"""Characters of a subformula that is quoted in a sentence."""
DEEPEST = 3
"""Disjunctions inside each other of which every part is explained."""
_DUAL: dict[Op, Op] = {
    "and": "or",
    "or": "and",
    "F": "G",
    "G": "F",
    "U": "R",
    "R": "U",
    "W": "M",
    "M": "W",
    "O": "H",
    "H": "O",
    "F<=": "G<=",
    "G<=": "F<=",
    "O<=": "H<=",
    "H<=": "O<=",
    "O[]": "H[]",
    "H[]": "O[]",
}


class Sentences:
    """Clauses about the false subformulas of one reading. `place` says where a letter is: `at step 65`."""

    def __init__(self, reading: Reading, place: Callable[[int], str], holds: Callable[[int, str], bool]) -> None:
        """`holds` tells the truth of an atom in a letter."""
        self._reading = reading
        self._place = place
        self._holds = holds

    def why(self) -> str:
        """Why the whole formula fails."""
        return self._why(self._reading.formula, False, 0)

    def _why(self, node: Formula, negative: bool, at: int, depth: int = 0) -> str:
        """Why `node` (negated, when `negative`), false at a position, is so there: one operator after the other on the
        way down to what fails first."""
        while True:
            node, negative = _unnegated(node, negative)
            if is_boolean(node):
                return self._values(node, negative, at)
            match self._kind(node, negative):
                case "and":
                    node, negative = next(p for p in _operands(node, negative) if self._fails(*p, at))
                case "X":
                    node, at = node.args[0], self._reading.after(at)
                case "G":
                    node, at = node.args[0], self._first(node.args[0], negative, at)
                case "G<=" | "H<=" | "H[]":
                    at = next(i for i in self._reading.window(node, at)[1] if self._fails(node.args[0], negative, i))
                    node = node.args[0]
                case "H":  # the last position at which it failed
                    node, at = (
                        node.args[0],
                        next(i for i in range(at, -1, -1) if self._fails(node.args[0], negative, i)),
                    )
                case "O<=" | "O[]" if window := self._reading.window(node, at)[1]:
                    return f"{_quoted(node.args[0], negative)} is not true {self._span(window[-1], window[0])}"
                case "O":
                    return f"{_said(node.args[0], negative, True, 'has not been')} up to {self._step(at)}"
                case "iff" | "xor" if self._reading.loop is not None:
                    return self._sides(node, at)
                case "or":
                    return self._none_of(node, negative, at, depth)
                case "F":
                    return self._never(node.args[0], negative, at)
                case "F<=":
                    return f"{_quoted(node.args[0], negative)} is not true {_when(node)} {self._step(at)}"
                case "U" | "W":
                    return self._until(node, negative, at)
                case "R" | "M":
                    return self._release(node, negative, at)
                case _:
                    return f"{_said(node, negative, False)} {self._where(at)}"

    def _kind(self, node: Formula, negative: bool) -> str:
        if node.op == "implies":
            return "and" if negative else "or"
        return _DUAL.get(node.op, node.op) if negative else node.op

    def _fails(self, node: Formula, negative: bool, at: int) -> bool:
        return self._reading.fails_at(node, negative, at)

    def _first(self, node: Formula, negative: bool, at: int) -> int:
        return next(i for i in self._reading.onward(at) if self._fails(node, negative, i))

    def _none_of(self, node: Formula, negative: bool, at: int, depth: int) -> str:
        """A disjunction: all of it is false. An antecedent is said to hold, as a whole."""
        chain = written_out(node)
        if chain is not None:
            last = at
            for _ in range(chain[1]):
                last = self._reading.after(last)
            return f"{_quoted(chain[0], negative)} is not true {self._span(at, last)}"
        if depth > DEEPEST:
            return f"{_said(node, negative, False)} {self._where(at)}"
        clauses = []
        for part, sign in _operands(node, negative):
            if node.op == "implies" and part is node.args[0] and sign:
                verb = "is true" if is_boolean(part) else "holds"
                clauses.append(f"{_quoted(part, False)} {verb} {self._where(at)}")
            else:
                clauses.append(self._why(part, sign, at, depth + 1))
        return ", and ".join(dict.fromkeys(clauses))

    def _sides(self, node: Formula, at: int) -> str:
        """Which operands of `<->` or `xor` hold."""
        held = [a for a in node.args if not self._fails(a, False, at)]
        if len(held) == 1:
            other = next(a for a in node.args if a is not held[0])
            return f"{_quoted(held[0], False)} holds {self._where(at)}, and {_quoted(other, False)} does not"
        a, b = (_quoted(each, False) for each in node.args)
        return f"{f'both {a} and {b} hold' if held else f'neither {a} nor {b} holds'} {self._where(at)}"

    def _never(self, node: Formula, negative: bool, at: int) -> str:
        plain, sign = _unnegated(node, negative)
        if self._kind(plain, sign) == "G" and is_boolean(plain.args[0]) and self._reading.loop is not None:
            here = self._first(plain.args[0], sign, max(at, self._reading.back))
            return f"{self._why(plain.args[0], sign, here)}, and again in every turn of the loop"
        since = "at any step" if at == 0 else f"from {self._step(at)} on"
        return f"{_quoted(node, negative)} is never true {since}"

    def _until(self, node: Formula, negative: bool, at: int) -> str:
        """Neither operand of `a U b` or `a W b` holds at some position, or (of `U`) b never does."""
        a, b = node.args
        for here in self._reading.onward(at):
            if self._fails(a, negative, here):
                ended = f"{_said(a, negative, False)} {self._where(here)}"
                return f"{ended}, before {_said(b, negative, True, 'has been')}"
        return self._never(b, negative, at)

    def _release(self, node: Formula, negative: bool, at: int) -> str:
        """The second operand of `a R b` or `a M b` ends too early, or (of `M`) the first never comes."""
        a, b = node.args
        for here in self._reading.onward(at):
            if self._fails(b, negative, here):
                early = f"{_said(b, negative, False)} {self._where(here)}"
                return f"{early}, and {_said(a, negative, True, 'has not been')} before"
        return self._never(a, negative, at)

    def _values(self, node: Formula, negative: bool, at: int) -> str:
        """The atoms that make a state formula false; those that have just changed first."""
        letter = self._reading.letter(at)
        found = sorted(causes(self._reading, node, negative=negative, at=at))
        if letter is None or not found:
            return f"{_said(node, negative, False)} {self._where(at)}"
        keys = [key for _, key in found]
        before = None if at == 0 else self._reading.letter(at - 1)
        new = [k for k in keys if before is None or self._holds(before, k) != self._holds(letter, k)]
        old = [k for k in keys if k not in new]
        if new and old:
            return f"{self._are(letter, new)} {self._where(at)} while {self._are(letter, old)}"
        return f"{self._are(letter, keys)} {self._where(at)}"

    def _are(self, letter: int, keys: Iterable[str]) -> str:
        """`a` and `b` are true, and `c` is false."""
        clauses = []
        keys = list(keys)
        for value in (True, False):
            names = [f"`{key}`" for key in keys if self._holds(letter, key) == value]
            if names:
                verb = "is" if len(names) == 1 else "are"
                clauses.append(f"{listed(names)} {verb} {'true' if value else 'false'}")
        return " and ".join(clauses)

    def _where(self, at: int) -> str:
        letter = self._reading.letter(at)
        return "after the last step" if letter is None else self._place(letter)

    def _span(self, first: int, last: int) -> str:
        return self._where(first) if first == last else f"from {self._step(first)} to {self._step(last)}"

    def _step(self, at: int) -> str:
        """The same after a preposition: `from step 3`, `of the initial configuration`."""
        return self._where(at).removeprefix("at ").removeprefix("in ")


def listed(names: list[str]) -> str:
    """`a`, `b` and `c`."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _operands(node: Formula, negative: bool) -> list[tuple[Formula, bool]]:
    if node.op == "implies":
        return [(node.args[0], not negative), (node.args[1], negative)]
    return [(a, negative) for a in node.args]


def _quoted(node: Formula, negative: bool) -> str:
    return f"`{to_text(negation(node) if negative else node, limit=LONGEST)}`"


def _when(node: Formula) -> str:
    """The bound in time of an operator, before what it counts from."""
    least, colon, most = node.key.rpartition(":")
    first, last = time_text(least, " "), time_text(most, " ")
    if not colon:
        return f"within {last} of"
    return f"from {first} to {last} after" if most else f"{first} or more after"


def _unnegated(node: Formula, negative: bool) -> tuple[Formula, bool]:
    while node.op == "not":
        node, negative = node.args[0], not negative
    return node, negative


def _said(node: Formula, negative: bool, value: bool, verb: str = "is") -> str:
    """That a subformula has a value: of `!a`, that `a` has the other one."""
    plain, sign = _unnegated(node, negative)
    return f"{_quoted(plain, False)} {verb} {'true' if value != sign else 'false'}"


# ---------------- regular properties: what was shown, and what could have followed

MOST_SHOWN = 6
"""Valuations of a forbidden sequence that are written out."""


def regular_reason(
    kind: RegularKind,
    expression: Formula,
    word: Sequence[frozenset[str]],
    place: Callable[[int], str],
    possible: Sequence[frozenset[str]] | None,
) -> str | None:
    """Why `word`, whose last letter closes a bad prefix, violates `kind expression`; None: there are no words for it.

    `place` says where a letter is: `at step 35`. `possible` are the letters with which, instead of the last, it would
    be no bad prefix (None: not known).
    """
    shown = valuations(expression, word)
    where = place(len(word) - 1)
    if kind == "enforce":
        return _unexpected(expression, shown, where, possible)
    return _completed(kind, expression, shown, where)


def _unexpected(
    expression: Formula, shown: Sequence[Valuation], where: str, possible: Sequence[frozenset[str]] | None
) -> str | None:
    rest = expression
    for valuation in shown[:-1]:
        rest = derivative(rest, valuation.__contains__)
        if rest is FALSE:
            return None
    following = [letter for letter in letters(expression) if _begins(rest, letter)]
    if possible is not None:
        # A match may begin with what no word goes on with: of `p p`, no two neighbours of which may be equal, nothing.
        following = [f for f in following if any(evaluate(f, (), (letter,)) for letter in possible)]
    now = f"{_valuation(expression, shown[-1])} {where}"
    if len(shown) == 1:
        return f"the run shows {now}, and has to begin with {_choice(following)}" if following else None
    before = f"after {_valuation(expression, shown[-2])}"
    if not following:
        return f"the run shows {now}, and nothing may follow {before}"
    return f"the run shows {now}, and {before} only {_choice(following)} may follow"


def _begins(expression: Formula, letter: Formula) -> bool:
    """Whether a match can begin with a letter."""
    return derivative(expression, lambda other: other is letter) is not FALSE


def _completed(kind: RegularKind, expression: Formula, shown: Sequence[Valuation], where: str) -> str | None:
    starts = range(len(shown) - 1, -1, -1) if kind == "forbid" else [0]
    for start in starts:
        rest = expression
        for valuation in shown[start:]:
            rest = derivative(rest, valuation.__contains__)
        if rest is not FALSE and nullable(rest):
            part = shown[start:]
            texts = [_valuation(expression, v) for v in part[-MOST_SHOWN:]]
            dots = "… then " if len(part) > MOST_SHOWN else ""
            return f"the run shows {dots}{', then '.join(texts)} {where}, which is forbidden"
    return None


def _valuation(expression: Formula, valuation: Valuation) -> str:
    names = [f"`{to_text(letter)}`" for letter in letters(expression) if letter in valuation]
    return listed(names) if names else "none of its letters"


def _choice(options: Sequence[Formula]) -> str:
    return " or ".join(f"`{to_text(option)}`" for option in options)

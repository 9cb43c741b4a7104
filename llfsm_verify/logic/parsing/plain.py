"""The formulas without arithmetic, bounds and mistakes, which are most: read by operator precedence in one pass.

Their atoms are values such as ``m.fired(RED, 0)``, and comparisons of two of them.

Whatever is not plainly such a formula is left to `parsing` and its grammar, which also says what is wrong with it.
Source: Dijkstra's shunting yard (Algol 60 translation, 1961).
"""

from __future__ import annotations

from typing import Final, NamedTuple

from llfsm_verify.diagnostics import DiagnosticError, Fragment
from llfsm_verify.logic.formula import FALSE, TRUE, Formula, Op, apply, atom, negation
from llfsm_verify.logic.parsing.tokens import Token, odd
from llfsm_verify.logic.parsing.words import MAX_BRACKETS, Words

MAX_WORDS = 1_000
"""Longer formulas are left to the grammar; those here are not deeper than that."""


class _Waiting:
    """An operator that waits for its last operand, or an open bracket."""

    __slots__ = ("count", "level", "op")

    def __init__(self, level: int, op: Op, count: int) -> None:
        self.level = level
        self.op = op
        self.count = count
        """The number of its operands; those of a flat chain are counted as they come."""


class _Infix(NamedTuple):
    op: Op
    level: int
    sort: str
    """`left`: a chain groups to the left; `flat`: it is one operator; `refused`: it needs parentheses."""


_INFIX: Final[dict[str, _Infix]] = {
    "IFF": _Infix("iff", 1, "left"), "IMPLIES": _Infix("implies", 2, "refused"), "OR": _Infix("or", 3, "flat"),
    "XOR": _Infix("xor", 4, "left"), "AND": _Infix("and", 5, "flat"),
    "U": _Infix("U", 6, "refused"), "W": _Infix("W", 6, "refused"), "R": _Infix("R", 6, "refused"),
    "M": _Infix("M", 6, "refused"), "S": _Infix("S", 6, "refused"), "T": _Infix("T", 6, "refused"),
}  # fmt: skip
_PREFIX: Final[dict[str, Op]] = {
    "NOT": "not", "G": "G", "F": "F", "X": "X", "Y": "Y", "Z": "Z", "O": "O", "H": "H",
}  # fmt: skip
_OPEN, _TIGHT = 0, 7
_CONSTANTS = ("NUMBER", "TRUE", "FALSE")
"""What a name is compared with besides another value."""


def parse_plain(words: Words) -> tuple[Formula, dict[str, Fragment]] | None:
    """The formula that all of `words` are, and its atoms in order; None: the grammar must tell."""
    if len(words.tokens) > MAX_WORDS:
        return None
    try:
        return _parsed(words)
    except DiagnosticError:  # a mistake inside quotes; there may be an earlier one
        return None


def _parsed(words: Words) -> tuple[Formula, dict[str, Fragment]] | None:
    tokens = words.tokens
    places: dict[str, Fragment] = {}
    operands: list[Formula] = []
    operators: list[_Waiting] = []
    brackets, i, count = 0, 0, len(tokens)
    operand_next = True
    while i < count:
        kind = tokens[i].type
        if operand_next:
            if kind in _PREFIX:
                if kind != "NOT" or odd(tokens[i]):
                    operators.append(_Waiting(_TIGHT, _PREFIX[kind], 1))
            elif kind == "LPAR":
                brackets += 1
                if brackets > MAX_BRACKETS:
                    return None
                operators.append(_Waiting(_OPEN, "true", 0))
            elif kind in ("TRUE", "FALSE"):
                operands.append(TRUE if kind == "TRUE" else FALSE)
                operand_next = False
            elif kind in ("NAME", "STRING"):
                last = i if kind == "STRING" else _atom_end(tokens, i)
                if last is None or (brackets == MAX_BRACKETS and _has_brackets(tokens[i : last + 1])):
                    return None
                place = _place(words, i, last)
                places.setdefault(place.text, place)
                operands.append(atom(place.text))
                operand_next, i = False, last
            else:
                return None
        elif kind == "RPAR":
            _reduce(operands, operators, _OPEN)
            if not operators:
                return None
            operators.pop()
            brackets -= 1
        else:
            infix = _INFIX.get(kind)
            if infix is None:
                return None
            _reduce(operands, operators, infix.level)
            chained = bool(operators) and operators[-1].level == infix.level
            if chained and infix.sort == "refused":
                return None
            if chained and infix.sort == "flat":
                operators[-1].count += 1
            else:
                _reduce(operands, operators, infix.level - 1)
                operators.append(_Waiting(infix.level, infix.op, 2))
            operand_next = True
        i += 1
    if operand_next:
        return None
    _reduce(operands, operators, _OPEN)
    return None if operators else (operands[0], places)


def _reduce(operands: list[Formula], operators: list[_Waiting], level: int) -> None:
    """Apply the operators above the last open bracket that bind more tightly than `level`."""
    while operators and operators[-1].level > level:
        top = operators.pop()
        args = operands[-top.count :]
        del operands[-top.count :]
        operands.append(negation(args[0]) if top.op == "not" else apply(top.op, *args))


def _atom_end(tokens: list[Token], i: int) -> int | None:
    """The last word of the atom that begins with the name `i`: a value, or two compared; None: it is neither."""
    last = _value_end(tokens, i)
    if last is None or not _is(tokens, last + 1, "COMPARE"):
        return last
    side = last + 2
    return _value_end(tokens, side) if _is(tokens, side, "NAME") else side if _is(tokens, side, *_CONSTANTS) else None


def _value_end(tokens: list[Token], i: int) -> int | None:
    """The last word of the value that begins with the name `i`: ``x``, ``m.x``, ``m@S`` or ``m.fired(S, 0)``."""
    if not _is(tokens, i + 1, "AT", "DOT"):
        return i
    if not _is(tokens, i + 2, "NAME"):
        return None
    if not _is(tokens, i + 3, "LPAR"):
        return i + 2
    i += 4
    while _is(tokens, i, "NAME", "NUMBER"):
        if _is(tokens, i + 1, "RPAR"):
            return i + 1
        if not _is(tokens, i + 1, "COMMA"):
            return None
        i += 2
    return None


def _has_brackets(tokens: list[Token]) -> bool:
    return any(token.type == "LPAR" for token in tokens)


def _is(tokens: list[Token], i: int, *kinds: str) -> bool:
    return i < len(tokens) and tokens[i].type in kinds


def _place(words: Words, first: int, last: int) -> Fragment:
    token = words.tokens[first]
    if first != last or token.type != "NAME":
        return words.atom(first, last)
    offsets = words.fragment.offsets[token.start : token.end]
    return Fragment(token.text, words.fragment.source, (*offsets, offsets[-1] + 1))

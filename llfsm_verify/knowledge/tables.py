"""Truth tables of theories as whole numbers with a bit for each row: an operator works on all rows of a block at once.

Row r of n inputs has input number i true where bit n - 1 - i of r is 1, so rows are in the order of binary numbers.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from llfsm_verify.knowledge.compiled import Compiled, compiled
from llfsm_verify.knowledge.theory import Literal, Theory
from llfsm_verify.language import typed
from llfsm_verify.limits import tick

MAX_INPUTS = 20
"""Of more inputs not all rows are looked at."""
_BITS = 14
"""A block has at most 2 ** _BITS rows, however many definitions are kept beside each other."""


@dataclass(frozen=True, slots=True)
class Undecided:
    """Valuations of the inputs on which a literal depends: where `neither` it nor its complement is proved, and where
    `both` are. None: there is no such valuation, or (not `looked`) there are more than MAX_INPUTS inputs."""

    neither: Mapping[str, bool] | None
    both: Mapping[str, bool] | None
    looked: bool


def undecided(theory: Theory, literal: Literal) -> Undecided:
    """Where a literal and its complement are not one true and one false: the first rows of the truth table."""
    sides = compiled(theory, literal), compiled(theory, literal.complement)
    inputs = [name for name in theory.inputs if any(name in side.inputs for side in sides)]
    if len(inputs) > MAX_INPUTS:
        return Undecided(None, None, looked=False)
    found: list[Mapping[str, bool] | None] = [None, None]
    for first, rows, (one, other) in tables(sides, inputs):
        for place, bits in enumerate((~(one | other) & ((1 << rows) - 1), one & other)):
            if bits and found[place] is None:
                found[place] = valuation(inputs, first + (bits & -bits).bit_length() - 1)
    return Undecided(found[0], found[1], looked=True)


def valuation(inputs: Sequence[str], row: int) -> dict[str, bool]:
    """What the inputs are in a row."""
    return {name: bool(row >> (len(inputs) - 1 - i) & 1) for i, name in enumerate(inputs)}


def tables(parts: Sequence[Compiled], inputs: Sequence[str]) -> Iterator[tuple[int, int, tuple[int, ...]]]:
    """The columns of these parts of one theory, whose inputs are among `inputs`, in blocks: the number of the first
    row, how many rows there are, and for each part the rows where it is true, the first one as the lowest bit."""
    definitions = {local.key: value for part in parts for local, value in part.definitions}  # alike where they meet
    within = min(_BITS, len(inputs))
    rows = 1 << within
    ones = (1 << rows) - 1
    for first in range(0, 1 << len(inputs), rows):
        columns: dict[str, int] = {}
        for i, name in enumerate(inputs):
            bit = len(inputs) - 1 - i
            varies = (ones // ((1 << (1 << bit)) + 1)) << (1 << bit) if bit < within else 0
            columns[name] = varies if bit < within else ones * (first >> bit & 1)
        for key, value in definitions.items():
            tick()
            columns[key] = _column(value, columns, ones)
        yield first, rows, tuple(_column(part.value, columns, ones) for part in parts)


def _column(expression: typed.Expression, columns: Mapping[str, int], ones: int) -> int:
    match expression:
        case typed.Literal(value=value):
            return ones if value else 0
        case typed.ReadLocal(local=local):
            return columns[local.key]
        case typed.Unary(operand=operand):
            return ones ^ _column(operand, columns, ones)
        case typed.Binary(op=op, left=left, right=right):
            one, other = _column(left, columns, ones), _column(right, columns, ones)
            return one & other if op == "and" else one | other
    raise TypeError(f"not a part of a compiled theory: {expression}")

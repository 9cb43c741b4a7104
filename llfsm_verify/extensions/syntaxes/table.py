"""What a reader of operators with precedences needs to know of a syntax."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from llfsm_verify.plug import FormulaOp as Op


@dataclass(frozen=True, slots=True)
class Infix:
    """An operator between two operands: how tightly it binds, and whether a chain of it groups to the right."""

    op: Op
    level: int
    right: bool = False


@dataclass(frozen=True, slots=True)
class SyntaxTable:
    """The words of a syntax.

    `tokens` has a named group for each kind of token: `SKIP`, `NAME` (operators in letters too), `ATOM` (an atom as it
    stands), `QUOTED` (an atom between two characters), `OPEN`, `CLOSE`, `SIGN`, `STEPS` (an operator with a bound), and
    for Spot `RANGE` (a repetition), `BINDER` and `VALUE` (`=0`). `prefix` and `infix` lead from the text of a sign or
    name to its operator; prefix operators bind tightest. `true` and `false` are the spellings of the constants;
    `equals` leads from signs of comparison to their spelling here.
    """

    name: str
    title: str
    tokens: re.Pattern[str]
    prefix: Mapping[str, Op]
    infix: Mapping[str, Infix]
    true: frozenset[str]
    false: frozenset[str]
    wrapper: re.Pattern[str] | None = None
    """What may open a formula (`ltl name {`), with the group `name`; the brace is closed after it, `;` may follow."""
    equals: Mapping[str, str] = field(default_factory=dict)
    unsettled: frozenset[Op] = frozenset()
    """Infix operators whose manual and parser group a mixture of them differently: it needs parentheses."""
    expressions: bool = False
    """There are regular expressions in braces."""

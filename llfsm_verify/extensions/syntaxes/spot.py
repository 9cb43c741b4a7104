"""Spot's syntax of linear temporal logic and PSL (Duret-Lutz, Spot's temporal logic formulas, chapters 2 and 3)."""

from __future__ import annotations

import re
from typing import Final

from llfsm_verify.extensions.syntaxes.table import Infix, SyntaxTable

RESERVED: Final = frozenset({"F", "G", "M", "R", "U", "V", "W", "X", "xor"})
NAME: Final = re.compile(r"(?:[A-EH-WYZa-z_][A-Za-z0-9_]*|[FGX][0-9][A-Za-z0-9_]*)\Z")
"""What is an atom without quotes, unless it is reserved or a constant."""

TOKENS: Final = re.compile(
    r"""
    (?P<SKIP>\s+|\#[^\n]*)
  | (?P<QUOTED>"[^"\n]*")
  | (?P<RANGE>\[(?:\*|:\*|=|->)\s*(?:\d+|\$|inf)?\s*(?:(?:\.\.|:|,|to)\s*(?:\d+|\$|inf)?)?\s*\]|\[\+\]|\[:\+\])
  | (?P<STEPS>(?:X\[!\]|[FGX]\[\s*\d+\s*(?:(?:\.\.|:|,|to)\s*(?:\d+|\$|inf)?)?\s*!?\s*\]))
  | (?P<BINDER>\[\]->|\[\]=>|<>->|<>=>|\|->|\|=>)
  | (?P<VALUE>=\s*[01](?![A-Za-z0-9_]))
  | (?P<SIGN>\[\]|<>|<->|<=>|<-->|->|=>|-->|\|\||\||\\/|\+|&&|&|/\\|\*|\^|!|~|\(\)|;|:
      |[\u00ac\u2227\u2228\u2192\u27f6\u21d2\u21d4\u2194\u2295\u25cb\u25c7\u22c4\u25a1\u25fb])
  | (?P<OPEN>[({])
  | (?P<CLOSE>[)}])
  | (?P<NAME>(?:[Tt][Rr][Uu][Ee]|[Ff][Aa][Ll][Ss][Ee]|[01])(?![A-Za-z0-9_])|[FGX](?![0-9])|[A-Za-z_][A-Za-z0-9_]*)
    """,
    re.VERBOSE,
)

_IMPLIES, _IFF = Infix("implies", 4, right=True), Infix("iff", 4, right=True)
_XOR, _OR = Infix("xor", 5), Infix("or", 6)

SPOT: Final = SyntaxTable(
    name="spot",
    title="Spot",
    tokens=TOKENS,
    prefix={
        "!": "not", "~": "not", "¬": "not", "X": "X", "()": "X", "○": "X", "F": "F", "<>": "F", "◇": "F", "⋄": "F",
        "G": "G", "[]": "G", "□": "G", "◻": "G",
    },
    infix={
        ";": Infix("seq", 2), ":": Infix("fuse", 3),
        "->": _IMPLIES, "=>": _IMPLIES, "-->": _IMPLIES, "→": _IMPLIES, "⟶": _IMPLIES, "⇒": _IMPLIES,
        "<->": _IFF, "<=>": _IFF, "<-->": _IFF, "↔": _IFF, "⇔": _IFF,
        "xor": _XOR, "^": _XOR, "⊕": _XOR,
        "|": _OR, "||": _OR, "\\/": _OR, "+": _OR, "∨": _OR,
        "&": Infix("and", 7), "&&": Infix("and", 7), "/\\": Infix("and", 7), "∧": Infix("and", 7), "*": Infix("and", 7),
        "U": Infix("U", 8, right=True), "W": Infix("W", 8, right=True), "M": Infix("M", 8, right=True),
        "R": Infix("R", 8, right=True), "V": Infix("R", 8, right=True),
    },
    true=frozenset({"1", "true"}),
    false=frozenset({"0", "false"}),
    unsettled=frozenset({"xor", "or"}),  # the manual's table has `|` bind tighter, the grammar's declarations `xor`
    expressions=True,
)  # fmt: skip

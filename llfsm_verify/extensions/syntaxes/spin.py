"""SPIN's syntax, as in `ltl name { … }` (Promela reference, ltl; the groupings are those that SPIN 6.5 shows)."""

from __future__ import annotations

import re
from typing import Final

from llfsm_verify.extensions.syntaxes.table import Infix, SyntaxTable

_TERM = r"(?:-?\d+|-?[A-Za-z_]\w*(?:\[[^\[\]\n]*\]|\s*[.@]\s*[A-Za-z_]\w*|\([\w\s,]*\))*)"
_WORDS = (
    "U|V|W|X|always|eventually|next|until|stronguntil|weakuntil|release|implies|equivalent|true|false"  # no operands
)

TOKENS: Final = re.compile(
    rf"""
    (?P<SKIP>\s+|\#[^\n]*|/\*.*?\*/)
  | (?P<QUOTED>"[^"\n]*"|\{{[^{{}}\n]*\}})
  | (?P<ATOM>(?!(?:{_WORDS})\b){_TERM}(?:\s*(?:==|!=|<=|>=|<(?!->|>)|>|[-+*/%](?!>))\s*(?!(?:{_WORDS})\b){_TERM})*)
  | (?P<SIGN>\[\]|<>|<->|->|\|\||\\/|&&|/\\|!)
  | (?P<OPEN>\()
  | (?P<CLOSE>\))
  | (?P<NAME>[A-Za-z_]\w*)
    """,
    re.VERBOSE | re.DOTALL | re.ASCII,
)

_IMPLIES, _IFF = Infix("implies", 1), Infix("iff", 1)
_UNTIL, _WEAK, _RELEASE = Infix("U", 4), Infix("W", 4), Infix("R", 4)

SPIN: Final = SyntaxTable(
    name="spin",
    title="SPIN",
    tokens=TOKENS,
    prefix={
        "!": "not", "[]": "G", "always": "G", "<>": "F", "eventually": "F", "X": "X", "next": "X",
    },
    infix={
        "->": _IMPLIES, "implies": _IMPLIES, "<->": _IFF, "equivalent": _IFF,
        "||": Infix("or", 2), "\\/": Infix("or", 2), "&&": Infix("and", 3), "/\\": Infix("and", 3),
        "U": _UNTIL, "until": _UNTIL, "stronguntil": _UNTIL, "W": _WEAK, "weakuntil": _WEAK,
        "V": _RELEASE, "release": _RELEASE,
    },
    true=frozenset({"true", "1"}),
    false=frozenset({"false", "0"}),
    wrapper=re.compile(r"\s*ltl\b\s*(?P<name>[A-Za-z_]\w*)?\s*\{"),
)  # fmt: skip

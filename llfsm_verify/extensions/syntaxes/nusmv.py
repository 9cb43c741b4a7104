"""The syntax of NuSMV and nuXmv, as in `LTLSPEC NAME name := …;` (NuSMV user manual, expressions and LTL)."""

from __future__ import annotations

import re
from typing import Final

from llfsm_verify.extensions.syntaxes.table import Infix, SyntaxTable

_OPERATORS = "G|F|X|U|V|Y|Z|O|H|S|T|xor|xnor|TRUE|FALSE"
_TERM = r"(?:-?\d+|-?[A-Za-z_][\w$]*(?:\[[^\[\]\n]*\]|\s*[.@]\s*[A-Za-z_]\w*)*)"

TOKENS: Final = re.compile(
    rf"""
    (?P<SKIP>\s+|\#[^\n]*|--[^\n]*)
  | (?P<QUOTED>"[^"\n]*")
  | (?P<STEPS>[FGOH]\s*\[\s*\d+\s*,\s*\d+\s*\])
  | (?P<ATOM>(?!(?:{_OPERATORS})\b){_TERM}(?:\s*(?:!=|<=|>=|=|<(?!->)|>|[-+*/](?!>))\s*(?!(?:{_OPERATORS})\b){_TERM})*)
  | (?P<SIGN><->|->|\||&|!)
  | (?P<OPEN>\()
  | (?P<CLOSE>\))
  | (?P<NAME>[A-Za-z_]\w*)
    """,
    re.VERBOSE | re.ASCII,
)

NUSMV: Final = SyntaxTable(
    name="nusmv",
    title="NuSMV",
    tokens=TOKENS,
    prefix={
        "!": "not", "G": "G", "F": "F", "X": "X", "Y": "Y", "Z": "Z", "O": "O", "H": "H",
    },
    infix={
        "->": Infix("implies", 1, right=True), "<->": Infix("iff", 2),
        "|": Infix("or", 3), "xor": Infix("xor", 3), "xnor": Infix("iff", 3), "&": Infix("and", 4),
        "U": Infix("U", 5), "V": Infix("R", 5), "S": Infix("S", 5), "T": Infix("T", 5),
    },
    true=frozenset({"TRUE", "1"}),
    false=frozenset({"FALSE", "0"}),
    wrapper=re.compile(r"\s*LTLSPEC\b\s*(?:NAME\s+(?P<name>[A-Za-z_][\w-]*)\s*:=)?"),
    equals={"=": "=="},
)  # fmt: skip

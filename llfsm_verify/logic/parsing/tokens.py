"""The words and signs of property files, and which atoms have to be quoted among them."""

from __future__ import annotations

import re
from typing import NamedTuple

MAX_TOKENS = 100_000
"""The most words and signs one property file may have (reading them takes about a second)."""


class Token(NamedTuple):
    """A word or sign: its type (a terminal of grammar.lark), text, and the character range it takes in the text."""

    type: str
    text: str
    start: int
    end: int


KEYWORDS = {
    "and": "AND", "or": "OR", "not": "NOT", "xor": "XOR", "true": "TRUE", "false": "FALSE",
    "G": "G", "F": "F", "X": "X", "U": "U", "W": "W", "R": "R", "M": "M",
    "Y": "Y", "Z": "Z", "O": "O", "H": "H", "S": "S", "T": "T",
}  # fmt: skip
"""Words that are no names unless quoted (or after `.` or `@`)."""

OF_STATES = frozenset({"entered", "fired"})
"""What is asked of a machine and a state: ``m.entered(STATE)``. The state's name may be a keyword."""

# In order: a longer sign stands before the shorter ones it begins with. A run of negations is one token, so that a
# formula of 200,000 of them is no deeper than one.
_PATTERNS = {
    "NEWLINE": r"\n",
    "BLANK": r"[ \t\r\f\v]+|\#[^\n]*",
    "NAME": r"[A-Za-z_][A-Za-z0-9_]*",
    "NUMBER": r"[0-9][A-Za-z0-9_]*(?:\.[0-9][A-Za-z0-9_]*)?",
    "STRING": r'"[^"\n]*"',
    "IFF": r"<->|<=>|↔",
    "IMPLIES": r"-->|->|==>|=>|→",
    "G": r"\[\]|□",
    "F": r"<>|◇",
    "COMPARE": r"==|!=|<=|>=|<|>",
    "ASSIGN": r":=|=",
    "NOT": r"(?:!(?!=)|[~¬])(?:[ \t]*(?:!(?!=)|[~¬]))*",
    "AND": r"&&|&|/\\|∧",
    "OR": r"\|\||\||\\/|∨",
    "XOR": r"\^|⊕",
    "MINUS": r"-",
    "ARITHMETIC": r"[+*/%]",
    "LPAR": r"\(",
    "RPAR": r"\)",
    "LSQB": r"\[",
    "RSQB": r"\]",
    "LBRACE": r"\{",
    "RBRACE": r"\}",
    "DOT": r"\.",
    "AT": r"@",
    "COMMA": r",",
    "COLON": r":",
    "QUESTION": r"\?",
    "OPEN_QUOTE": r'"[^\n]*',
    "OTHER": r".",
}
_TOKEN = re.compile("|".join(f"(?P<{name}>{pattern})" for name, pattern in _PATTERNS.items()))

OPENING = {"LPAR": "RPAR", "LSQB": "RSQB", "LBRACE": "RBRACE"}
CLOSING = {"RPAR": "LPAR", "RSQB": "LSQB", "RBRACE": "LBRACE"}
TEMPORAL_PAIRS = frozenset("UWRMST")
BINARY = TEMPORAL_PAIRS | {"IFF", "IMPLIES", "AND", "OR", "XOR", "COMPARE", "ASSIGN", "ARITHMETIC", "MINUS"}
PREFIX = frozenset({"NOT", "G", "F", "X", "Y", "Z", "O", "H", "INITIALLY"})
ENDS_OPERAND = frozenset({"NAME", "NUMBER", "STRING", "TRUE", "FALSE", "RPAR", "RSQB", "RBRACE"})
_BEGINS_OPERAND = PREFIX | {"NAME", "NUMBER", "STRING", "TRUE", "FALSE", "LPAR"}


def tokenise(text: str, start: int = 0, end: int | None = None, limit: int = MAX_TOKENS) -> list[Token]:
    """The tokens of ``text[start:end]``, ends of lines included, blanks and comments not.

    Stops after `limit` + 1 tokens. `OPEN_QUOTE` and `OTHER` are what no formula has.
    """
    tokens: list[Token] = []
    name_before = ""
    states = False
    """Inside ``@{…}``."""
    for match in _TOKEN.finditer(text, start, len(text) if end is None else end):
        kind = match.lastgroup or "OTHER"
        if kind == "BLANK":
            continue
        word = match.group()
        states = kind not in ("RBRACE", "NEWLINE") and (states or (kind == "LBRACE" and name_before == "AT"))
        of_state = (
            name_before == "LPAR" and len(tokens) > 2 and tokens[-2].text in OF_STATES and tokens[-3].type == "DOT"
        )
        if kind == "NAME" and not states and not of_state and name_before not in ("DOT", "AT"):
            kind = KEYWORDS.get(word, "NAME")
        if kind in _BEGINS_OPERAND and tokens and tokens[-1].text == "initially" and not states and _is_free(tokens):
            tokens[-1] = tokens[-1]._replace(type="INITIALLY")
        tokens.append(Token(kind, word, match.start(), match.end()))
        name_before = kind
        if len(tokens) > limit:
            break
    return tokens


def _is_free(tokens: list[Token]) -> bool:
    """Whether the last token is a name of its own: no field, and no state of a machine."""
    return tokens[-1].type == "NAME" and (len(tokens) < 2 or tokens[-2].type not in ("DOT", "AT"))


def odd(negations: Token) -> bool:
    """A `NOT` token holds an odd number of negations."""
    return negations.text[0] == "n" or sum(map(negations.text.count, "!~¬")) % 2 == 1


_TIGHT_BEFORE = frozenset({"DOT", "AT", "COMMA", "RPAR", "RSQB", "RBRACE"})
_TIGHT_AFTER = frozenset({"DOT", "AT", "LPAR", "LSQB", "LBRACE", "NOT"})


def spaced(tokens: list[Token]) -> list[bool]:
    """For each token whether a blank belongs before it, in the one spacing of atoms: ``m.fired(RED, -1) + a[2]``."""
    blanks: list[bool] = []
    before: str | None = None
    for token in tokens:
        tight = before is None or before in _TIGHT_AFTER or token.type in _TIGHT_BEFORE
        tight = tight or (before == "SIGN" and token.type != "MINUS")  # `--` is another sign in the language
        if token.type in ("LPAR", "LSQB"):
            tight = tight or before in ENDS_OPERAND
        blanks.append(not tight)
        sign = token.type == "MINUS" and before not in ENDS_OPERAND
        before = "SIGN" if sign else "WORD" if token.text == "not" else token.type
    return blanks


_STARTS = frozenset({"NAME", "NUMBER", "TRUE", "FALSE", "MINUS", "LPAR"})
_ENDS = frozenset({"NAME", "NUMBER", "TRUE", "FALSE", "RPAR", "RSQB", "RBRACE"})
_AFTER_OPERAND = frozenset({"MINUS", "ARITHMETIC", "COMPARE", "DOT", "AT", "COMMA", "LSQB", "LPAR", "RPAR", "RSQB"})


def needs_quotes(key: str) -> bool:
    """An atom of this key has to be quoted in a formula: `G`, `c ? a : b`, `3`, `(p)`, and all that is no atom."""
    tokens = tokenise(key)
    if len(tokens) == 1:
        return tokens[0].type != "NAME"
    compared = sum(token.type == "COMPARE" for token in tokens)
    return compared > 1 or not _pairs_fit(tokens) or not _brackets_fit(tokens)


def _pairs_fit(tokens: list[Token]) -> bool:
    """Each token may follow the one before it."""
    before = None
    states = False
    """Inside `@{…}`."""
    for token in tokens:
        if states:
            fits = token.type in (("NAME",) if before in ("LBRACE", "COMMA") else ("COMMA", "RBRACE"))
            states = token.type != "RBRACE"
        elif before == "AT" and token.type == "LBRACE":
            fits = states = True
        elif before in ("DOT", "AT"):
            fits = token.type == "NAME"
        elif before in _ENDS:
            fits = token.type in _AFTER_OPERAND
        else:
            fits = token.type in _STARTS or (before == "CALL" and token.type == "RPAR")
        if not fits:
            return False
        before = "CALL" if token.type == "LPAR" and before in _ENDS else token.type
    return before in _ENDS


def _brackets_fit(tokens: list[Token]) -> bool:
    """Brackets match, commas stand in calls and between states only, and no bracket encloses the whole."""
    stack: list[tuple[int, str]] = []
    for i, token in enumerate(tokens):
        if token.type in OPENING:
            call = token.type == "LPAR" and i > 0 and tokens[i - 1].type in _ENDS
            stack.append((i, "CALL" if call else token.type))
        elif token.type in CLOSING:
            if not stack or OPENING[tokens[stack[-1][0]].type] != token.type:
                return False
            if stack.pop()[0] == 0 and i == len(tokens) - 1:
                return False
        elif token.type == "COMMA" and (not stack or stack[-1][1] not in ("CALL", "LBRACE")):
            return False
    return not stack

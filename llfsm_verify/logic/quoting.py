"""Which atoms have to be quoted so that a formula reads back as it was printed."""

from __future__ import annotations

from llfsm_verify.logic.parsing.tokens import CLOSING, OPENING, Token, tokenise

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

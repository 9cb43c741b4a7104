"""Atoms as other tools write them, in the one spelling that names an atom here."""

from __future__ import annotations

from collections.abc import Mapping

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Fragment
from llfsm_verify.logic import codes
from llfsm_verify.logic.parsing.tokens import Token, spaced, tokenise


def atom_place(
    fragment: Fragment, start: int, end: int, quoted: bool, equals: Mapping[str, str]
) -> tuple[str, Fragment]:
    """The key of the atom at ``start:end`` with its place. `equals`: signs that have another spelling here.

    DiagnosticError (E307, E332): nothing between the quotes, or a character that no atom has.
    """
    text = fragment.text
    if not quoted and text[start:end].isascii() and text[start:end].isidentifier():
        return text[start:end], Fragment(text[start:end], fragment.source, fragment.offsets[start : end + 1])
    if quoted:
        start, end = start + 1, end - 1
        if "#" in text[start:end]:  # it would begin a comment
            at = text.index("#", start)
            message = "an atom cannot have the character `#`"
            raise DiagnosticError(Diagnostic(codes.CHARACTER, message, fragment.span(at, at + 1)))
    tokens: list[Token] = []
    for token in tokenise(text, start, end):
        if token.type in ("OTHER", "OPEN_QUOTE"):
            message = f"an atom cannot have the character `{token.text}`"
            raise DiagnosticError(Diagnostic(codes.CHARACTER, message, fragment.span(token.start, token.end)))
        if token.type == "NEWLINE":
            continue
        if not quoted and token.text in equals:
            token = Token("COMPARE", equals[token.text], token.start, token.end)
        tokens.append(token)
    if not tokens:
        span = fragment.span(start - 1, end + 1)
        raise DiagnosticError(Diagnostic(codes.QUOTED, "there is nothing between the quotes", span))
    key: list[str] = []
    offsets: list[int] = []
    for token, blank in zip(tokens, spaced(tokens), strict=True):
        places = fragment.offsets[token.start : token.end]
        if blank:
            key.append(" ")
            offsets.append(places[0])
        key.append(token.text)
        offsets.extend(places[min(i, len(places) - 1)] for i in range(len(token.text)))
    offsets.append(offsets[-1] + 1)
    return "".join(key), Fragment("".join(key), fragment.source, tuple(offsets))

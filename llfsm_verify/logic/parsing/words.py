"""The words of one formula with their places in the user's file, and the checks that need no grammar."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Fragment, Span
from llfsm_verify.logic import codes
from llfsm_verify.logic.parsing.tokens import CLOSING, OPENING, Token, spaced, tokenise

MAX_BRACKETS = 200
"""Brackets in brackets; the language's checker reads atoms with brackets again, by recursion."""


@dataclass(frozen=True, slots=True)
class Words:
    """The tokens of one formula (no ends of lines); their positions are characters of `fragment`."""

    fragment: Fragment
    tokens: list[Token]
    given: Words | None = None
    """The words in which names stood for some of these."""

    def span(self, first: int, last: int) -> Span:
        """The place of the tokens number `first` to `last`, both included."""
        return self.fragment.span(self.tokens[first].start, self.tokens[last].end)

    def error(self, code: str, message: str, first: int, last: int, hint: str | None = None) -> DiagnosticError:
        return DiagnosticError(Diagnostic(code, message, self.span(first, last), hint=hint))

    def use(self, i: int) -> Span | None:
        """The place of the name that stands for what has the token number `i` in it; None: it stands there itself."""
        if self.given is None:
            return None
        offsets, tokens, places = self.fragment.offsets, self.given.tokens, self.given.fragment.offsets
        line = range(places[tokens[0].start], places[tokens[-1].end])
        start = self.tokens[i].start
        # what is before the words of a definition has the place of its name, or of what the name follows
        before = next((offsets[at] for at in range(start, -1, -1) if offsets[at] in line), line.start)
        if before == offsets[start]:
            return None
        name = next(n for n, t in enumerate(tokens) if t.type == "NAME" and places[t.start] >= before)
        return self.given.span(name, name)

    def text(self, first: int, last: int) -> str:
        """What the user wrote, comments dropped and white space folded."""
        pieces: list[str] = []
        for before, token in zip([None, *self.tokens[first:last]], self.tokens[first : last + 1], strict=True):
            inside = token.type in ("RPAR", "RSQB") or (before is not None and before.type in ("LPAR", "LSQB"))
            if before is not None and before.end < token.start and not inside:
                pieces.append(" ")
            pieces.append(token.text)
        return "".join(pieces)

    def excerpt(self, first: int, last: int) -> str:
        """`text`, cut to what fits into a message."""
        text = self.text(first, min(last, first + 60))
        return text if len(text) <= 60 and last - first <= 60 else text[:59] + "…"

    def rest(self, first: int) -> str:
        """`text` from number `first` on, to be pasted; where that is long or not there, `…`."""
        text = self.text(first, min(len(self.tokens) - 1, first + 60)) if first < len(self.tokens) else "…"
        return text if len(text) <= 80 and len(self.tokens) - first <= 60 else "…"

    def atom(self, first: int, last: int) -> Fragment:
        """The tokens as an atom: its text is the atom's key (one way of spacing, quotes dropped)."""
        tokens: list[Token] = []
        for i in range(first, last + 1):
            token = self.tokens[i]
            tokens += self._unquote(i, first == last) if token.type == "STRING" else [token]
        return _in_one_spacing(self.fragment, tokens)

    def _unquote(self, i: int, alone: bool) -> list[Token]:
        token = self.tokens[i]
        _refuse_comment(self.fragment, token.start, token.end)
        inner = tokenise(self.fragment.text, token.start + 1, token.end - 1)
        if not inner:
            raise self.error(codes.QUOTED, "there is nothing between the quotes", i, i)
        for t in inner:
            if t.type == "OTHER":
                span = self.fragment.span(t.start, t.end)
                raise DiagnosticError(
                    Diagnostic(codes.CHARACTER, f"an atom cannot have the character {_shown(t.text)}", span)
                )
        if not alone and (len(inner) > 1 or not (inner[0].text[0].isalpha() or inner[0].text[0] == "_")):
            raise self.error(
                codes.QUOTED, "inside a larger atom only a name can be quoted", i, i,
                "quote the whole atom, or use parentheses",
            )  # fmt: skip
        return inner


def atom_place(fragment: Fragment, start: int, end: int, quoted: bool, equals: Mapping[str, str]) -> Fragment:
    """The atom at ``start:end`` as another tool writes it, with its key as the text. `equals`: signs that have another
    spelling here.

    DiagnosticError (E307, E332): nothing between the quotes, or a character that no atom has.
    """
    text = fragment.text
    if not quoted and text[start:end].isascii() and text[start:end].isidentifier():
        return Fragment(text[start:end], fragment.source, fragment.offsets[start : end + 1])
    if quoted:
        start, end = start + 1, end - 1
        _refuse_comment(fragment, start, end)
    tokens: list[Token] = []
    for token in tokenise(text, start, end):
        if token.type in ("OTHER", "OPEN_QUOTE"):
            message = f"an atom cannot have the character `{token.text}`"
            raise DiagnosticError(Diagnostic(codes.CHARACTER, message, fragment.span(token.start, token.end)))
        if not quoted and token.text in equals:
            token = Token("COMPARE", equals[token.text], token.start, token.end)
        if token.type != "NEWLINE":
            tokens.append(token)
    if not tokens:
        span = fragment.span(start - 1, end + 1)
        raise DiagnosticError(Diagnostic(codes.QUOTED, "there is nothing between the quotes", span))
    return _in_one_spacing(fragment, tokens)


def _refuse_comment(fragment: Fragment, start: int, end: int) -> None:
    """DiagnosticError: an atom with a character that would begin a comment."""
    at = fragment.text.find("#", start, end)
    if at >= 0:
        span = fragment.span(at, at + 1)
        raise DiagnosticError(Diagnostic(codes.CHARACTER, "an atom cannot have the character `#`", span))


def _in_one_spacing(fragment: Fragment, tokens: list[Token]) -> Fragment:
    """Tokens of a fragment, which may be spelt longer than there, as the text of an atom."""
    text: list[str] = []
    offsets: list[int] = []
    for token, blank in zip(tokens, spaced(tokens), strict=True):
        places = fragment.offsets[token.start : token.end]
        if blank:
            text.append(" ")
            offsets.append(places[0])
        text.append(token.text)
        offsets.extend(places)
        offsets.extend([places[-1]] * (len(token.text) - len(places)))
    offsets.append(offsets[-1] + 1)
    return Fragment("".join(text), fragment.source, tuple(offsets))


def check_words(words: Words) -> None:
    """DiagnosticError for characters that no formula has and for brackets that do not match or are too deep."""
    open_brackets: list[int] = []
    for i, token in enumerate(words.tokens):
        if token.type in OPENING:
            open_brackets.append(i)
            if len(open_brackets) > MAX_BRACKETS:
                raise words.error(codes.TOO_DEEP, f"more than {MAX_BRACKETS} brackets inside each other", i, i)
        elif token.type in CLOSING:
            if not open_brackets:
                raise words.error(codes.STRAY_BRACKET, f"this `{token.text}` closes nothing", i, i, "remove it")
            opening = words.tokens[open_brackets.pop()]
            if opening.type != CLOSING[token.type]:
                line = words.fragment.span(opening.start, opening.end).line
                message = f"this `{token.text}` does not match the `{opening.text}` of line {line}"
                raise words.error(codes.STRAY_BRACKET, message, i, i, "close brackets in the order they were opened")
        elif token.text == "-" and words.fragment.text.startswith(("-- ", "--\t"), token.start):
            message, hint = "`--` has no meaning in a formula", "a comment begins with `#`"
            raise words.error(codes.MISPLACED_SIGN, message, i, i + 1, hint)
        elif token.type == "OTHER":
            raise words.error(
                codes.CHARACTER, f"a formula cannot have the character {_shown(token.text)}", i, i, _say(token)
            )
        elif token.type == "OPEN_QUOTE":
            span = words.fragment.span(token.start, token.start + 1)
            raise DiagnosticError(Diagnostic(codes.OPEN_QUOTE, "this quote is not closed on its line", span))
    if open_brackets:
        i = open_brackets[-1]
        hint = f"write `{dict(zip('([{', ')]}', strict=True))[words.tokens[i].text]}`"
        raise words.error(codes.OPEN_BRACKET, f"this `{words.tokens[i].text}` is not closed", i, i, hint)


def _shown(character: str) -> str:
    return f"`{character}`" if character.isprintable() else f"U+{ord(character):04X}"


def _say(token: Token) -> str | None:
    if token.text in "'`“”‘’":
        return 'quotes are written `"`'
    if token.text in "≤≥≠":
        return "write " + {"≤": "`<=`", "≥": "`>=`", "≠": "`!=`"}[token.text]
    if token.text == ";":
        return "remove it: a property ends with its line"
    return None

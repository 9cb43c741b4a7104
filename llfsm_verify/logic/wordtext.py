"""Ultimately periodic words as text: `p0&!p1;cycle{p0}`."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Fragment
from llfsm_verify.logic import codes
from llfsm_verify.logic.parsing.words import atom_place

Letter = frozenset[str]
"""The atoms that hold; all others do not."""

_TOKEN = re.compile(r'\s+|"[^"\n]*"|cycle\s*\{|[;}]|&&?|[!~]|[^\s";{}&!~]+(?:\s+[^\s";{}&!~]+)*')
_OPERATOR = re.compile(r"\|\|?|\\/|/\\|<?-+>|<?=>|\^|[∧∨⊕→↔¬]")
_HINT = "write `p0&!p1;cycle{p0}`: letters separated by `;`, and after `cycle` those that repeat forever"


def parse_word(fragment: Fragment) -> tuple[list[Letter], list[Letter]]:
    """Stem and loop of the word written in `fragment`; DiagnosticError (E353) when it is no word.

    A letter is a conjunction of atoms and negated atoms; atoms that it does not name are false, `1` names none.
    """
    text = fragment.text
    stem: list[Letter] = []
    loop: list[Letter] | None = None
    closed = False
    true: set[str] = set()
    false: set[str] = set()
    wanted, negative, empty = True, False, True
    at = 0

    def wrong(message: str, start: int, end: int) -> DiagnosticError:
        return DiagnosticError(Diagnostic(codes.WORD, message, fragment.span(start, end), hint=_HINT))

    def finish() -> None:
        nonlocal wanted, empty
        clash = next(iter(true & false), None)
        if clash is not None:
            raise wrong(f"a letter in which `{clash}` holds and does not", 0, len(text))
        (stem if loop is None else loop).append(frozenset(true))
        true.clear()
        false.clear()
        wanted, empty = True, True

    while at < len(text):
        match = _TOKEN.match(text, at)
        if match is None:
            raise wrong(f"a word has no `{text[at]}` here", at, at + 1)
        token, start, at = match.group(), at, match.end()
        if token.isspace():
            continue
        if closed:
            raise wrong("there is text after the end of the loop", start, at)
        if token.startswith("cycle") and token.endswith("{"):
            if negative:
                raise wrong("only an atom can be negated in a letter", start, at)
            if loop is not None or not empty or not wanted:
                raise wrong("`;` is missing before `cycle`", start, at)
            loop = []
        elif token in ("}", ";"):
            if wanted:
                raise wrong(f"a letter is missing before `{token}`", start, at)
            finish()
            if token == "}":
                if loop is None:
                    raise wrong("this `}` closes nothing", start, at)
                closed = True
        elif token in ("&", "&&"):
            if wanted:
                raise wrong(f"an atom is missing before `{token}`", start, at)
            wanted = True
        elif token in ("!", "~"):
            if not wanted:
                raise wrong(f"`&` is missing before `{token}`", start, at)
            negative = not negative
        else:
            if not wanted:
                raise wrong(f"`&` or `;` is missing before `{token[:20]}`", start, at)
            if token in ("1", "true", "TRUE"):
                if negative:
                    raise wrong("no letter is false", start, at)
            elif token in ("0", "false", "FALSE"):
                if not negative:
                    raise wrong("no letter is false", start, at)
            else:
                _refuse_operators(token, start, wrong)
                if re.search(r"\w\s+\w", token) and token[0] != '"':
                    raise wrong(f"`&` or `;` is missing inside `{token[:20]}`", start, at)
                (false if negative else true).add(atom_place(fragment, start, at, token[0] == '"', {}).text)
            wanted, negative, empty = False, False, False
    if loop is None or not closed:
        raise wrong("a word ends in a loop: `cycle{…}`", max(0, len(text) - 1), len(text))
    return stem, loop


def _refuse_operators(token: str, start: int, wrong: Callable[[str, int, int], DiagnosticError]) -> None:
    """DiagnosticError: an atom in which a Boolean operator stands, or parentheses that are no list of arguments."""
    if token.startswith('"'):
        return
    operator = _OPERATOR.search(token)
    if operator is not None:
        message = f"a letter is a conjunction of atoms and negated atoms, without `{operator.group()}`"
        raise wrong(message, start + operator.start(), start + operator.end())
    level = 0
    for i, character in enumerate(token):
        level += (character == "(") - (character == ")")
        # What parentheses follow is the name of a question: `m.fired(S, 0)`.
        opens_nothing = character == "(" and not (i and (token[i - 1].isalnum() or token[i - 1] == "_"))
        if level < 0 or opens_nothing:
            raise wrong("a letter has no parentheses around atoms", start + i, start + i + 1)
    if level:
        raise wrong("this atom's `)` is missing", start, start + len(token))


def write_word(stem: Sequence[Sequence[tuple[str, bool]]], loop: Sequence[Sequence[tuple[str, bool]]]) -> str:
    """The text of a word whose letters name atoms with their truth."""
    letters = [
        "&".join(f"{'' if holds else '!'}{key if key.isidentifier() else _quoted(key)}" for key, holds in letter) or "1"
        for letter in (*stem, *loop)
    ]
    return ";".join([*letters[: len(stem)], f"cycle{{{';'.join(letters[len(stem) :])}}}"])


def _quoted(key: str) -> str:
    return f'"{key}"'

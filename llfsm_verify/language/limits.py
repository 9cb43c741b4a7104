"""The limits on one guard or action, checked before and while it is parsed: no input can exhaust the machine."""

from __future__ import annotations

import re

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Fragment

MAX_LENGTH = 64 * 1024
"""Characters of one guard or action."""

MAX_NESTING = 200
"""Brackets inside each other, prefix operators in a row, and the height of the syntax tree."""

MAX_ITERATIONS = 10_000
"""Iterations of all loops of one action together."""

MAX_UNROLLED = 256 * 1024
"""Characters of one action's loop bodies, repeated as often as they run: loops are unrolled when translated."""

_TOKEN = re.compile(r"//[^\n]*|/\*.*?\*/|[A-Za-z0-9_]+|[^\sA-Za-z0-9_]", re.DOTALL)
_PREFIXES = frozenset(("!", "-", "+", "not"))
_NESTING = ("(", "[", "{", *_PREFIXES)
"""What nests: a text with few of these is not nested deep."""


def nesting_error(fragment: Fragment, offset: int) -> DiagnosticError:
    hint = "split it: give parts of it a variable or a state of their own"
    message, place = f"nested more than {MAX_NESTING} deep", fragment.span(offset, offset + 1)
    return DiagnosticError(Diagnostic("E107", message, place, hint=hint))


def check_limits(fragment: Fragment) -> None:
    """Raise DiagnosticError when the text is too long or nested too deeply; one pass, linear in the text."""
    text = fragment.text
    if len(text) > MAX_LENGTH:
        message = f"the text has {len(text):,} characters, more than {MAX_LENGTH:,}"
        hint = "split it into several guards, actions or states"
        raise DiagnosticError(Diagnostic("E108", message, fragment.span(0, 1), hint=hint))
    if sum(map(text.count, _NESTING)) <= MAX_NESTING:
        return
    depth = prefixes = 0
    for match in _TOKEN.finditer(text):
        token = match[0]
        prefixes = prefixes + 1 if token in _PREFIXES else 0
        if token in "([{":
            depth += 1
        elif token in ")]}":
            depth -= 1
        if depth > MAX_NESTING or prefixes > MAX_NESTING:
            raise nesting_error(fragment, match.start())

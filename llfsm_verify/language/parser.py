"""Parsing guards and actions: limits first, then the LALR parser, with syntax errors put into plain words."""

from __future__ import annotations

import re
from collections.abc import Iterator
from decimal import Decimal
from functools import cache, lru_cache
from itertools import takewhile
from typing import cast

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Fragment, meant_at
from llfsm_verify.grammars import END, Parser, Token, Unfit, Unknown, parser_of
from llfsm_verify.language.builder import Builder, TooDeep
from llfsm_verify.language.codes import HINTS
from llfsm_verify.language.habits import IN_ACTIONS, IN_GUARDS, statement_word
from llfsm_verify.language.limits import check_limits, nesting_error
from llfsm_verify.language.scope import COMMANDS
from llfsm_verify.language.syntax import Expression, ParsedActions, ParsedExpression, Statement


@cache
def _parser() -> Parser:
    return parser_of("llfsm_verify.language", Builder(), ("guard", "actions"))


@lru_cache(maxsize=2048)
def _tree(text: str, start: str) -> tuple[object, ...]:
    """The tree of `text`: it counts from the text's beginning, so equal texts at other places share it."""
    parser = _parser()
    return tuple(parser.parse(parser.tokens(text), start))


def parse_guard(fragment: Fragment) -> ParsedExpression:
    """Parse one expression: a guard, an atom, a constant. Raises DiagnosticError at the first syntax error."""
    if not fragment.text.strip():
        raise DiagnosticError(
            Diagnostic("E109", "an expression is missing here", fragment.span(0, 1), hint="write `true` for always")
        )
    tree = _parse(fragment, "guard")
    return ParsedExpression(cast(Expression, tree[0]), fragment)


def parse_actions(fragment: Fragment) -> ParsedActions:
    """Parse a sequence of statements (it may be empty). Raises DiagnosticError at the first syntax error."""
    if not fragment.text.strip():
        return ParsedActions((), fragment)
    return ParsedActions(cast("tuple[Statement, ...]", _parse(fragment, "actions")), fragment)


def _parse(fragment: Fragment, start: str) -> tuple[object, ...]:
    check_limits(fragment)
    try:
        return _tree(fragment.text, start)
    except TooDeep as e:
        raise nesting_error(fragment, e.offset) from None
    except Unknown as e:
        raise DiagnosticError(_unknown_character(fragment, e.at)) from None
    except Unfit as e:
        raise DiagnosticError(_unexpected(fragment, e.token, e.expected, start)) from None


_NOT_IN_THE_LANGUAGE = {
    "#": "a comment starts with `//`",
    "'": "the language has no strings or characters; use an enumeration",
    '"': "the language has no strings or characters; use an enumeration",
    "\\": "write everything without `\\`",
    "$": "write the name alone",
    "`": "write the name alone",
    "→": "write `!a || b` for `a → b`",
    **{
        sign: f"write `{ours}`"
        for sign, ours in zip("≤≥≠¬∧∨−–·×", ["<=", ">=", "!=", "!", "&&", "||", "-", "-", "*", "*"], strict=True)
    },
}


def _unknown_character(fragment: Fragment, at: int) -> Diagnostic:
    character = fragment.text[at]
    span = fragment.span(at, at + 1)
    shown = character if character.isprintable() else f"U+{ord(character):04X}"
    return Diagnostic(
        "E102", f"unexpected character `{shown}`", span, hint=_NOT_IN_THE_LANGUAGE.get(character, HINTS["E102"])
    )


def _unexpected(fragment: Fragment, token: Token, expected: frozenset[str], start: str) -> Diagnostic:
    text = fragment.text
    before = max((each.end for each in _before(token, text)), default=0)
    at, span = token.start, fragment.span(token.start, token.end)
    if token.type == END:
        at, span = before, fragment.span(max(0, before - 1), before)
    slip = _slip(text, at)
    if slip is not None:
        start_of, end_of, instead = slip
        return Diagnostic(
            "E101", f"unexpected `{text[start_of:end_of]}`", fragment.span(start_of, end_of), hint=instead
        )
    habit = meant_at(IN_GUARDS if start == "guard" else IN_ACTIONS, text, at)
    number = next((n for n in _HALF_NUMBERS.finditer(text) if n.start() <= at < n.end()), None)
    if number is not None:
        message, instead = f"`{number[0]}` is not a number", f"write `{_whole(number[0])}`"
        return Diagnostic("E134", message, fragment.span(number.start(), number.end()), hint=instead)
    cast_before = _CAST.search(text, 0, at)
    if cast_before is not None:
        place = fragment.span(cast_before.start(), cast_before.end())
        hint = "remove it: a store converts to the type of the variable; for an integer, write `floor(…)` of a decimal"
        return Diagnostic("E101", "the language has no casts", place, hint=hint)
    if start == "guard" and token.type in ("EQUAL", "STORE", "STEP"):
        instead = "write `==` to compare" if token.type == "EQUAL" else "put it into an action of a state"
        return Diagnostic("E104", "a guard cannot change a variable", span, hint=instead)
    opening = at if text.startswith("/*", at) else at - 1
    if text.startswith("/*", opening) and token.type == "FACTOR":
        return Diagnostic(
            "E101", "this comment is never closed", fragment.span(opening, opening + 2), hint="write `*/`"
        )
    brackets = None if habit else _unmatched(text, token)
    if brackets is not None:
        wrong, message, instead = brackets
        return Diagnostic("E101", message, fragment.span(wrong.start, wrong.end), hint=instead)
    ended = token.type in (END, "RBRACE", "IF", "FOR", "ELSE") or "\n" in text[before:at]
    if (
        start == "actions"
        and not habit
        and "SEMICOLON" in expected
        and "IF" not in expected
        and (ended or _begins_statement(text, at))
    ):
        return Diagnostic(
            "E103", "`;` is missing after this statement", fragment.span(max(0, before - 1), before), hint="write `;`"
        )
    if token.type == END:
        return Diagnostic(
            "E101", "the text ends too early", span, hint=habit or _expectation(expected, start, text, at)
        )
    if token.type == "ELSE" and not habit:
        hint = "`else` follows the one statement of an `if`; write several in `{ … }`"
        return Diagnostic("E101", "this `else` has no `if`", span, hint=hint)
    hint = habit or _expectation(expected, start, text, at)
    if token.text in ("==", "<=", "<<") and start == "actions" and "EQUAL" in expected:
        hint = "write `=` to assign"
    if token.type == "NAME" and at > 0 and text[at - 1].isdigit():
        start_of_number = at - 1
        while start_of_number > 0 and (text[start_of_number - 1].isalnum() or text[start_of_number - 1] in "._"):
            start_of_number -= 1
        whole = fragment.span(start_of_number, token.end)
        instead = habit or "write digits, such as 12 or 0.5, or 0x and hexadecimal digits"
        if re.fullmatch(r"[0-9.]+[eE][0-9]*", whole.text):
            number = re.match(r"[0-9]+(?:\.[0-9]+)?[eE][+-]?(?:[12]?[0-9]|30)(?!\w)", text[start_of_number:])
            instead = "write it without an exponent, such as 0.001"
            if number is not None:
                whole = fragment.span(start_of_number, start_of_number + number.end())
                instead = f"write `{Decimal(number[0]):f}`"
        return Diagnostic("E134", f"`{whole.text}` is not a number", whole, hint=instead)
    return Diagnostic("E101", f"unexpected `{token.text}`", span, hint=hint)


_HALF_NUMBERS = re.compile(r"(?<![\w.\])])(?:[0-9]*\.(?![.\w])|\.[0-9]+|[0-9]+,[0-9]+)")
"""What has no digit on one side of the point, or a comma for it."""
_CAST = re.compile(r"\(\s*(?:u?int(?:8|16|32|64)?|bool|float|double|(?:un)?signed)\s*\)\s*\Z")


def _whole(number: str) -> str:
    """A number with digits on both sides of its point."""
    before, _, after = number.replace(",", ".").partition(".")
    return f"{before or 0}.{after or 0}"


SLIPS = {
    "=>": "write `>=`",
    "=<": "write `<=`",
    ":=": "write `=` to assign",
    "<-": "write `=` to assign",
    "!==": "write `!=`",
    "===": "write `==`",
    "<>": "write `!=`",
    "...": "write `..`",
    "&&=": "write `x = x && …`",
    "||=": "write `x = x || …`",
    "::": "write `.`",
    ">>>": "write `>>`, which keeps the sign of types that have one",
    "^^": "write `!=`",
    "**": "write a product",
    "AND": "write `and` or `&&`",
    "OR": "write `or` or `||`",
    "NOT": "write `not` or `!`",
    "while": "the language has no `while`; use `for` over a constant range, or a state with a transition to itself",
}
"""What other languages write, and what to write here."""


def _slip(text: str, at: int) -> tuple[int, int, str] | None:
    """The slip of another language's habit that stands at, or just before, the character where parsing stopped."""
    for written, instead in SLIPS.items():
        if written.isalpha():
            # `NOT ready` and `while (…) {` are names to the parser until what follows them does not fit.
            reach = 0 if written == "while" else len(text[:at].rstrip()) - len(written)
            found = re.compile(rf"\b{written}\b").search(text, max(0, reach), at + len(written))
            start = found.start() if found else -1
        else:
            start = text.find(written, max(0, at - len(written)), at + len(written))
        if start >= 0:
            return start, start + len(written), instead
    return None


def _before(token: Token, text: str) -> Iterator[Token]:
    """The tokens of `text` before this one, without comments."""
    return takewhile(lambda each: each.start < token.start, _parser().tokens(text))


_BRACKETS = {"LPAR": "RPAR", "LSQB": "RSQB", "LBRACE": "RBRACE"}
_SIGNS = {"LPAR": ")", "LSQB": "]", "LBRACE": "}"}


def _unmatched(text: str, token: Token) -> tuple[Token, str, str] | None:
    """The bracket that is wrong where `token` is not expected, what is wrong with it, and what to write."""
    opened: list[Token] = []
    for each in _before(token, text):
        if each.type in _BRACKETS:
            opened.append(each)
        elif each.type in _BRACKETS.values():
            opened.pop()
    last = opened[-1].type if opened else ""
    if token.type in _BRACKETS.values() and not opened:
        return token, f"this `{token.text}` closes nothing", "remove it"
    closes = token.type in _BRACKETS.values() and _BRACKETS[last] != token.type
    stops = token.type in ("SEMICOLON", "LBRACE") and last in ("LPAR", "LSQB")
    stores = token.type in ("EQUAL", "STORE") and last == "LSQB"
    if opened and (closes or stops or stores or token.type == END):
        return opened[-1], f"this `{opened[-1].text}` is never closed", f"write `{_SIGNS[last]}`"
    return None


_IS_STATEMENT = re.compile(rf"\s*(?:(?:{'|'.join(COMMANDS)})\s*\(|[^=]*[^=!<>]=(?!=)|[\w.\[\]]*(?:\+\+|--))")
_STATEMENT = re.compile(r"[A-Za-z_][\w.\[\]]*\s*(?:=(?!=)|[-+*/%&|^]=|\+\+|--)")


def _begins_statement(text: str, at: int) -> bool:
    """Whether a statement begins at `at`, after another one that lacks its end."""
    current = text[max(text.rfind(sign, 0, at) for sign in ";{}") + 1 : at]
    return _STATEMENT.match(text, at) is not None and _IS_STATEMENT.match(current) is not None


def _expectation(expected: frozenset[str], start: str, text: str, at: int) -> str:
    if start == "actions":
        if (word := statement_word(text, at)) is not None:
            return word
        if expected & {"EQUAL", "IF"}:
            return "write an assignment, such as `x = 1;`, or a command, such as `suspend(m);` (all: docs/files.md)"
    if expected & {"INTEGER", "NAME"} and "LPAR" in expected:
        return "an operand is missing before it"
    if "SEMICOLON" in expected and start == "actions":
        return "`;` or an operator is missing before it"
    if "?" in text and "COLON" in expected:
        return "`:` or an operator is missing before it"
    return "an operator, such as `&&`, is missing before it" if expected & {"AND", "OR"} else HINTS["E101"]

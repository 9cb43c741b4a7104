"""The values that arguments may have: names to choose from, and numbers, times and sizes as they are written."""

from __future__ import annotations

from argparse import ArgumentTypeError
from collections.abc import Callable, Iterable
from fractions import Fraction
from typing import TypeVar

from llfsm_verify.checking.engine_option import read_count, read_seconds
from llfsm_verify.cli.usage import UsageError
from llfsm_verify.limits import parse_size
from llfsm_verify.runtime.stepping.duration import duration_ms, excess

T = TypeVar("T")

PROPERTY_QUESTIONS = {
    "classify": "print the class (S G O R P T, B for S and G), a tab and the formula",
    "translate": "print the automaton in the format HOA",
    "accepts": "print whether the formula is true of the word `p0&!p1;cycle{p0}`",
    "equivalent": "print whether two formulas are true of the same words, else a word that tells them apart",
    "implies": "print whether the second formula is true where the first one is, else a word where it is not",
    "simplify": "print a simpler formula that is true of the same words",
    "print": "print the formula in another syntax, fully parenthesised",
    "draw": "draw the automaton",
    "example": "print a word of which the formula is true, a tab and one of which it is not",
}
MONITORS = ("text", "machine", "table", "dot")
SHELLS = ("bash", "zsh", "fish")

DRAWN = "INPUT=P"
"""How `--draw` is written."""

LEAST_WIDTH = 20


def assignments(
    option: str, items: Iterable[str], form: str = "INPUT=VALUE", instead: str = "leave one out"
) -> dict[str, str]:
    """Inputs with the texts of their values, written in this `form`. UsageError: one is not written so, or is given
    again (`instead`: what to do then)."""
    found: dict[str, str] = {}
    for item in items:
        name, equals, text = item.partition("=")
        if not equals:
            raise UsageError(f"{option} needs {form}, not `{item}`")
        if name.strip() in found:
            raise UsageError(f"{option} gives `{name.strip()}` twice: {instead}")
        found[name.strip()] = text.strip()
    return found


def property_text(text: str) -> str:
    """One or more lines of a property file, of which one is more than a comment."""
    if all(not line.strip() or line.lstrip().startswith("#") for line in text.splitlines()):
        raise ArgumentTypeError("there is no property in this text")
    return text


def word(read: Callable[[str], T]) -> Callable[[str], T]:
    """What reads a word of the command line, from what raises ValueError for others."""

    def reading(text: str) -> T:
        try:
            return read(text)
        except ValueError as wrong:
            raise ArgumentTypeError(str(wrong)) from None

    return reading


positive, seconds, size = word(read_count), word(read_seconds), word(parse_size)


def width(text: str) -> int:
    """The width of a table, in columns."""
    number = positive(text)
    if number < LEAST_WIDTH:
        raise ArgumentTypeError(f"a table needs {LEAST_WIDTH} columns at least")
    return number


def milliseconds(text: str) -> Fraction:
    """A positive time in milliseconds; a number without a unit is one of them."""
    value = duration_ms(text)
    if value is None:
        raise ArgumentTypeError(excess(text) or f"{text[:40]!r} is not a positive time such as 500ms, 90s, 5min or 2h")
    return value

"""The values that arguments may have: names to choose from, and numbers, times and sizes as they are written."""

from __future__ import annotations

from argparse import ArgumentTypeError
from collections.abc import Iterable
from fractions import Fraction

from llfsm_verify.cli.usage import UsageError
from llfsm_verify.limits import parse_size
from llfsm_verify.runtime.stepping.duration import duration_ms, excess

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
MOST = (1 << 63) - 1
"""The largest number that an option takes."""


def assignments(option: str, items: Iterable[str], form: str = "INPUT=VALUE") -> dict[str, str]:
    """Inputs with the texts of their values, written in this `form`. UsageError: one is not written so, or is given
    again."""
    found: dict[str, str] = {}
    for item in items:
        name, equals, text = item.partition("=")
        if not equals:
            raise UsageError(f"{option} needs {form}, not `{item}`")
        if name.strip() in found:
            raise UsageError(f"{option} gives `{name.strip()}` twice: leave one out")
        found[name.strip()] = text.strip()
    return found


def property_text(text: str) -> str:
    """One or more lines of a property file, of which one is more than a comment."""
    if all(not line.strip() or line.lstrip().startswith("#") for line in text.splitlines()):
        raise ArgumentTypeError("there is no property in this text")
    return text


def positive(text: str) -> int:
    """A whole number from 1."""
    digits = text.lstrip("0")
    if not (text.isascii() and text.isdigit() and digits):
        raise ArgumentTypeError(f"{text[:40]!r} is not a whole number from 1")
    if len(digits) > len(str(MOST)) or int(digits) > MOST:
        raise ArgumentTypeError(f"{text[:40]} is more than the largest number that is taken, {MOST:,}")
    return int(digits)


def width(text: str) -> int:
    """The width of a table, in columns."""
    number = positive(text)
    if number < LEAST_WIDTH:
        raise ArgumentTypeError(f"a table needs {LEAST_WIDTH} columns at least")
    return number


def seconds(text: str) -> float:
    """A positive number of seconds."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < 1e9:
        raise ArgumentTypeError(f"{text[:40]!r} is not a positive number of seconds")
    return value


def size(text: str) -> int:
    """A number of bytes, as `parse_size` reads it."""
    try:
        return parse_size(text)
    except ValueError as wrong:
        raise ArgumentTypeError(str(wrong)) from None


def milliseconds(text: str) -> Fraction:
    """A positive time in milliseconds; a number without a unit is one of them."""
    value = duration_ms(text)
    if value is None:
        raise ArgumentTypeError(excess(text) or f"{text[:40]!r} is not a positive time such as 500ms, 90s, 5min or 2h")
    return value

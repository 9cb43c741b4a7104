"""Values as people write them, and the numbers that step programs have in their place."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from decimal import Decimal
from fractions import Fraction
from itertools import product

from llfsm_verify.language.types import decimal_text
from llfsm_verify.program.program import BOOL, Choice, Input, Int, Type, Var

Value = int | tuple[int, ...]
"""A scalar's value, or the tuple of an array's elements."""

Shown = int | bool | str | Decimal
"""The name of an enumerator or state, a bool, or a number."""
_NUMBER = re.compile(r"-?[0-9]{1,20}(?:\.([0-9]{1,18}))?\Z", re.ASCII)
_HALF = re.compile(r"-?(?:[0-9]+\.|\.[0-9]+)\Z", re.ASCII)


def shown(kind: Type, labels: tuple[str, ...], value: int) -> Shown:
    """One number as users write it; `labels` name the values of `kind` from its lowest."""
    return showing(kind, labels)(value)


def showing(kind: Type, labels: tuple[str, ...]) -> Callable[[int], Shown]:
    """`shown` for one kind and labels."""
    if kind == BOOL:
        return bool
    if isinstance(kind, Int) and kind.digits:
        digits = kind.digits
        return lambda value: Decimal(decimal_text(value, digits))
    low, count = kind.low if isinstance(kind, Int) else 0, len(labels)
    return lambda value: labels[value - low] if 0 <= value - low < count else value


def text(value: Shown) -> str:
    """A value as properties write it."""
    if isinstance(value, Decimal):
        return f"{value:f}"  # never with an exponent
    return str(value).lower() if isinstance(value, bool) else str(value)


def value_text(kind: Type, labels: tuple[str, ...], value: int) -> str:
    """One number as properties write it."""
    return text(shown(kind, labels, value))


def element_names(variable: Var) -> tuple[str, ...]:
    """The names of a variable's scalars (``a[1].x``), in the order in which they are stored."""
    if variable.length is None:
        return (variable.name,)
    origin = variable.origin
    if origin.pattern:
        return tuple(origin.pattern.format(*at) for at in product(*(range(n) for n in origin.shape)))
    return tuple(f"{variable.name}[{i}]" for i in range(variable.length))


def elements(variable: Var, value: Value) -> Iterator[tuple[str, Shown]]:
    """Each scalar of a variable with its name, in the order in which they are stored."""
    numbers = value if isinstance(value, tuple) else (value,)
    for name, number in zip(element_names(variable), numbers, strict=True):
        yield name, shown(variable.type, variable.origin.labels, number)


def read_back(text: str) -> Shown:
    """The value that a trace shows as `text`. Names of enumerators are identifiers other than `true` and `false`."""
    if text in ("true", "false"):
        return text == "true"
    digits = text.removeprefix("-")
    if digits.replace(".", "", 1).isdecimal():
        return Decimal(text) if "." in digits else int(text)
    return text


class ValueProblem(Exception):
    """The text is no value of the type; the message says what is."""


def choice_value(choice: Choice | Input, text: str) -> int:
    """The number of the value that `text` names: an enumerator, `true` or `false`, or a number in the range."""
    kind = choice.type
    if choice.labels:
        if text in choice.labels:
            return kind.low + choice.labels.index(text)
        raise ValueProblem(f"`{text}` is not one of {', '.join(choice.labels)}")
    if kind.boolean:
        if text in ("true", "false"):
            return int(text == "true")
        raise ValueProblem(f"`{text}` is neither true nor false")
    match = _NUMBER.match(text)
    if match and (kind.digits or not match[1]):
        steps = Fraction(text) * 10**kind.digits
        if steps == int(steps) and kind.low <= steps <= kind.high:
            return int(steps)
    low, high = (decimal_text(bound, kind.digits) for bound in (kind.low, kind.high))
    what = f"multiple of {decimal_text(1, kind.digits)}" if kind.digits else "number"
    instead = "; write a digit on both sides of the point" if _HALF.match(text) else ""
    raise ValueProblem(f"`{text}` is not a {what} from {low} to {high}{instead}")


def number_of(choice: Choice | Input, value: Shown | float) -> int:
    """The number of a value that a program gives: as `choice_value`, of its text. ValueProblem."""
    if isinstance(value, float):
        value = Decimal(str(value))
    kind = choice.type
    if type(value) is int and not (choice.labels or kind.digits or kind.boolean) and kind.low <= value <= kind.high:
        return value
    return choice_value(choice, text(value))

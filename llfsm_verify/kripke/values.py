"""Numbers of a configuration as users write them: elements by their full names, enumerators and states by theirs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from decimal import Decimal
from itertools import product

from llfsm_verify.backends.native.layout import Value
from llfsm_verify.language.types import decimal_text
from llfsm_verify.program.program import BOOL, Int, Type, Var

Shown = int | bool | str | Decimal
"""The name of an enumerator or state, a bool, or a number."""


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

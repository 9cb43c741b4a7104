"""Values as bytes for `kept`: pickles in which data classes are made anew by their constructors.

What Python itself writes of a frozen data class with slots is set field by field when it is read; this takes half the
time, both ways. Fields that the constructor does not take have their default afterwards.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable, Sequence
from contextvars import ContextVar
from dataclasses import fields, is_dataclass
from io import BytesIO
from operator import attrgetter
from typing import Any

PROTOCOL = 5
Reducer = Callable[[Any], "str | tuple[Any, ...]"]

_known: ContextVar[Sequence[object]] = ContextVar("known")


class PackingError(ValueError):
    """A value is nested too deeply, or has parts that pickles cannot have."""


def pack(value: object, known: Sequence[object] = (), *, shared: bool = True) -> bytes:
    """The value, in which an object of `known` is only its number; equal bytes mean equal values.

    With `shared`, parts that are one object are one object again. Without it a part is written wherever it stands, so
    that the bytes do not depend on which equal parts are one object. Raises PackingError.
    """
    written = BytesIO()
    packer = pickle.Pickler(written, PROTOCOL)
    packer.fast = not shared
    packer.dispatch_table = _Reducers(known)
    try:
        packer.dump(value)
    except (RecursionError, TypeError, AttributeError, pickle.PicklingError) as error:
        raise PackingError(str(error)) from error
    return written.getvalue()


def unpack(data: bytes, known: Sequence[object] = ()) -> Any:
    """The value that `pack` has written, with the objects of `known` in it. Trusted data only: it can run code."""
    before = _known.set(known)
    try:
        return pickle.loads(data)  # noqa: S301 - trusted, as is said
    finally:
        _known.reset(before)


def numbered(number: int) -> object:
    """The object of `known` with this number; what is packed names this function."""
    return _known.get()[number]


class _Reducers(dict[type, Reducer]):
    """For each class how an object of it is taken apart, made when it is first asked for (`copyreg`)."""

    def __init__(self, known: Sequence[object]) -> None:
        super().__init__()
        numbers = {id(each): number for number, each in enumerate(known)}

        def reduced(value: object) -> str | tuple[Any, ...]:
            number = numbers.get(id(value))
            return value.__reduce_ex__(PROTOCOL) if number is None else (numbered, (number,))

        self.update(dict.fromkeys(map(type, known), reduced))

    def __missing__(self, kind: type) -> Reducer:
        if not is_dataclass(kind) or "__reduce__" in vars(kind):
            raise KeyError(kind)  # pickle takes it apart in its own way
        names = [field.name for field in fields(kind) if field.init]
        several = attrgetter(*names) if len(names) > 1 else None

        def taken_apart(value: object) -> tuple[Any, ...]:
            return kind, tuple(getattr(value, name) for name in names) if several is None else several(value)

        self[kind] = taken_apart
        return taken_apart

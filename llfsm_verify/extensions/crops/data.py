"""What states share: values under keys, each of which keeps the type that it first had."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator, Mapping, MutableMapping
from contextlib import suppress


class DataTypeError(TypeError):
    """A value of another type than the key had first; the message says which, and where both were stored."""


class LeftState(RuntimeError):
    """A state stores a value after the state machine has left it, or has paused it."""


class _Store:
    """The values, with the type of each key and the place where it got it."""

    def __init__(self) -> None:
        self.values: dict[str, object] = {}
        self.types: dict[str, tuple[type, str]] = {}
        self.lock = threading.Lock()


class Data(MutableMapping[str, object]):
    """A mapping for one execution of a state, or for the program that made it. A key that was deleted keeps its type;
    a value may be of a subclass, but a `bool` is not an `int` here. An int for a float is stored as that float. A
    key that was None first takes the type of its first other value, and cannot be None after that.

    DataTypeError: see there. LeftState: the execution does not count any more.
    """

    def __init__(self, values: Mapping[str, object] | None = None, *, _store: _Store | None = None) -> None:
        self._store = _Store() if _store is None else _store
        self._left: str | None = None
        for key, value in (values or {}).items():
            self[key] = value

    def _for(self) -> Data:
        """The same values, for one execution."""
        return Data(_store=self._store)

    def _leave(self, why: str) -> None:
        """Nothing can be stored by this one from now on."""
        with self._store.lock:
            self._left = why

    @property
    def left(self) -> bool:
        """Whether the execution does not count any more: the state machine has left the state, or has paused it."""
        return self._left is not None

    def _open(self) -> None:
        if self._left is not None:
            raise LeftState(self._left)

    def __getitem__(self, key: str) -> object:
        return self._store.values[key]

    def __setitem__(self, key: str, value: object) -> None:
        place = _place()
        with self._store.lock:
            self._open()
            first, where = self._store.types.setdefault(key, (type(value), place))
            if first is type(None) and value is not None:
                first, where = self._store.types[key] = (type(value), place)
            if first is float and isinstance(value, int) and not isinstance(value, bool):
                with suppress(OverflowError):
                    value = float(value)
            if not isinstance(value, first) or (isinstance(value, bool) and first is int):
                raise DataTypeError(
                    f"`{key}` has had the type {first.__name__} since {where}, and cannot be of type "
                    f"{type(value).__name__} ({place})"
                )
            self._store.values[key] = value

    def __delitem__(self, key: str) -> None:
        with self._store.lock:
            self._open()
            del self._store.values[key]

    def __iter__(self) -> Iterator[str]:
        return iter(list(self._store.values))

    def __len__(self) -> int:
        return len(self._store.values)

    def __repr__(self) -> str:
        return f"Data({self._store.values!r})"


def _place() -> str:
    """The line that stores a value: the nearest one that is not of this module, or of `collections.abc`."""
    frame = sys._getframe(1)
    inside = (__file__, sys.modules[MutableMapping.__module__].__file__)
    while frame.f_back is not None and (
        frame.f_code.co_filename in inside or frame.f_code.co_filename.startswith("<frozen")
    ):
        frame = frame.f_back
    return f"{frame.f_code.co_filename}:{frame.f_lineno}"

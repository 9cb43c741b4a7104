"""Modules whose names are imported when they are first asked for: the front door, `testing` and `plug`."""

from __future__ import annotations

import sys

TYPE_CHECKING = False  # `typing` would take most of the time of `import llfsm_verify`
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


def lazily(
    module: str, places: Mapping[str, tuple[str, ...]]
) -> tuple[Callable[[str], object], Callable[[], list[str]]]:
    """The `__getattr__` and `__dir__` of a module (PEP 562).

    `places`: by modules below this package, the names that are there, as an import statement has them: `Name`, or
    `Name as Other`. AttributeError: there is no such name.
    """
    found = {
        words.split(" as ")[-1]: (place, words.split(" as ")[0]) for place, names in places.items() for words in names
    }

    def load(name: str) -> object:
        from importlib import import_module

        if name not in found:
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        place, there = found[name]
        value = getattr(import_module(f"llfsm_verify.{place}"), there)
        setattr(sys.modules[module], name, value)
        return value

    def names() -> list[str]:
        return sorted({*vars(sys.modules[module]), *found})

    return load, names

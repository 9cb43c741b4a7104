"""Modules whose names are imported when they are first asked for: the front door, `testing` and `plug`."""

from __future__ import annotations

import sys
from importlib import import_module

TYPE_CHECKING = False  # `typing` would take most of the time of an import
if TYPE_CHECKING:
    from collections.abc import Mapping


def imported(module: str, places: Mapping[str, tuple[str, ...]], name: str) -> object:
    """What a module has under a name, which it then keeps: the work of its `__getattr__` (PEP 562).

    `places`: by modules below this package, the names that are there, as an import statement has them: `Name`, or
    `Name as Other`. AttributeError: there is no such name.
    """
    for place, names in places.items():
        for words in names:
            there, _, here = words.partition(" as ")
            if name == (here or there):
                found = getattr(import_module(f"llfsm_verify.{place}"), there)
                setattr(sys.modules[module], name, found)
                return found
    raise AttributeError(f"module {module!r} has no attribute {name!r}")

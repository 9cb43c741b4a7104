"""Modules whose names are imported when they are first asked for: the front door, `testing` and `plug`.

The stub of such a module (`.pyi`) imports its names: type checkers read it, and so does the run time.
"""

from __future__ import annotations

import re
import sys
from functools import cache
from importlib import import_module

IMPORT = re.compile(r"^from llfsm_verify\.(\S+) import (?:\(([^)]*)\)|(.*))$", re.MULTILINE)


@cache
def places(module: str) -> dict[str, tuple[str, str]]:
    """The names that a module's stub imports: where each is, below this package, and its name there."""
    file = sys.modules[module].__file__
    assert file is not None
    with open(f"{file.removesuffix('c')}i", encoding="utf-8") as stub:
        found = IMPORT.findall(stub.read())
    names = {}
    for place, several, one in found:
        for words in filter(None, map(str.strip, (several or one).split(","))):
            there, _, here = words.partition(" as ")
            names[here or there] = place, there
    return names


def imported(module: str, name: str) -> object:
    """What a module has under a name, which it then keeps: the work of its `__getattr__` (PEP 562).

    `__all__` is the names of its stub. AttributeError: there is no such name.
    """
    if name == "__all__":
        return sorted(places(module))
    if name not in places(module):
        raise AttributeError(f"module {module!r} has no attribute {name!r}")
    place, there = places(module)[name]
    found = getattr(import_module(f"llfsm_verify.{place}"), there)
    setattr(sys.modules[module], name, found)
    return found

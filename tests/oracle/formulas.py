"""State formulas, LTL and regular expressions as nested tuples, written out as text for the checker to read.

State formulas: `("atom", TEXT)`, `("true",)`, `("!", f)`, `("&&", f, g)`, `("||", f, g)`, `("->", f, g)`. LTL adds `X`,
`F`, `G` with one argument and `U`, `W`, `R`, `M` with two. Regular expressions: `("letter", f)`, `("seq", r, s)`,
`("alt", r, s)` and `("repeat", r, low, high)`, where `high` may be None.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

Tree = tuple[Any, ...]
UNARY, BINARY = ("X", "F", "G"), ("U", "W", "R", "M")


def text(f: Tree) -> str:
    """A formula as one writes it."""
    match f:
        case ("atom", name):
            return str(name)
        case ("true",):
            return "true"
        case ("!", a):
            return f"!({text(a)})"
        case (op, a) if op in UNARY:
            return f"{op} ({text(a)})"
        case (op, a, b):
            return f"({text(a)}) {op} ({text(b)})"
    raise AssertionError(f)


def regular_text(r: Tree) -> str:
    """A regular expression as one writes it."""
    match r:
        case ("letter", ("true",)):
            return "true"
        case ("letter", f):
            return f"[{text(f)}]"
        case ("seq", a, b):
            return f"({regular_text(a)}) ({regular_text(b)})"
        case ("alt", a, b):
            return f"({regular_text(a)} | {regular_text(b)})"
        case ("repeat", a, low, high):
            known = {(0, None): "*", (1, None): "+", (0, 1): "?"}
            count = f"{{{low},{'' if high is None else high}}}" if low != high else f"{{{low}}}"
            return f"({regular_text(a)}){known.get((low, high), count)}"
    raise AssertionError(r)


def parts(f: Tree) -> Iterator[Tree]:
    """A tree and all trees in it, the innermost first."""
    for a in f[1:]:
        if isinstance(a, tuple):
            yield from parts(a)
    yield f


def atoms(f: Tree) -> list[str]:
    """The texts of the atoms, each once."""
    return list(dict.fromkeys(p[1] for p in parts(f) if p[0] == "atom"))


def holds(f: Tree, letter: frozenset[str]) -> bool:
    """Whether a state formula holds in a letter."""
    match f:
        case ("atom", name):
            return name in letter
        case ("true",):
            return True
        case ("!", a):
            return not holds(a, letter)
        case ("&&", a, b):
            return holds(a, letter) and holds(b, letter)
        case ("||", a, b):
            return holds(a, letter) or holds(b, letter)
        case ("->", a, b):
            return not holds(a, letter) or holds(b, letter)
    raise AssertionError(f)

"""One walk over typed trees: every node of expressions, statements and whatever holds them, from left to right."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import TypeVar

from llfsm_verify.diagnostics import Span

T = TypeVar("T")

_LEAVES = frozenset({"span", "type", "variable", "local", "text", "values"})
"""Fields in which no node of the tree stands."""


class _Parts(dict[type, "tuple[str, ...] | None"]):
    """The fields in which nodes of a kind have parts, the last one first; None of what is not a node."""

    def __missing__(self, kind: type) -> tuple[str, ...] | None:
        parts: tuple[str, ...] | None = () if issubclass(kind, tuple) else None
        if is_dataclass(kind):
            known = fields(kind) if kind is not Span else ()
            parts = tuple(f.name for f in reversed(known) if f.name not in _LEAVES)
        self[kind] = parts
        return parts


_parts = _Parts()


def nodes(root: object) -> Iterator[object]:
    """Every node of the typed trees in `root` (a node, or tuples of nodes), without recursion."""
    stack, parts = [root], _parts
    while stack:
        node = stack.pop()
        if isinstance(node, tuple):
            stack.extend(reversed(node))
            continue
        yield node
        for name in parts[type(node)] or ():
            part = getattr(node, name)
            if parts[type(part)] is not None:
                stack.append(part)


def of_kind(root: object, kind: type[T]) -> Iterator[T]:
    """The nodes of this kind."""
    return (n for n in nodes(root) if isinstance(n, kind))

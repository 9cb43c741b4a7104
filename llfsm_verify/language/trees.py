"""One walk over typed trees: every node of expressions, statements and whatever holds them, from left to right."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import TypeVar

from llfsm_verify.diagnostics import Span

T = TypeVar("T")

_LEAVES = frozenset({"span", "type", "variable", "local", "text", "values"})
"""Fields in which no node of the tree stands."""
_parts: dict[type, tuple[str, ...]] = {}


def nodes(root: object) -> Iterator[object]:
    """Every node of the typed trees in `root` (a node, or tuples of nodes), without recursion."""
    stack = [root]
    while stack:
        node = stack.pop()
        if isinstance(node, tuple):
            stack.extend(reversed(node))
            continue
        kind = type(node)
        parts = _parts.get(kind)
        if parts is None:
            known = fields(kind) if is_dataclass(kind) and kind is not Span else ()
            parts = tuple(f.name for f in reversed(known) if f.name not in _LEAVES)
            _parts[kind] = parts
        yield node
        for name in parts:
            part = getattr(node, name)
            if isinstance(part, tuple) or is_dataclass(part):
                stack.append(part)


def of_kind(root: object, kind: type[T]) -> Iterator[T]:
    """The nodes of this kind."""
    return (n for n in nodes(root) if isinstance(n, kind))

"""Certificates changed in one place: every way to change each kind of field."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from llfsm_verify.analysis.certificates.making import sign as signed_sections

Json = Any
Path = tuple[int | str, ...]


def signed(document: dict[str, Json]) -> str:
    """The text of a document with the hashes of its sections made anew, as one who forges it would."""
    return signed_sections({key: value for key, value in document.items() if key != "digests"})


def changes(document: dict[str, Json], few: int) -> Iterator[tuple[Path, str, dict[str, Json]]]:
    """Where, how, and the changed document. Of equal elements in a row, the first, the last and some between are
    changed: at most `few` of each list."""
    for path, value in _places(document, (), few):
        for how, changed in _changed(value):
            yield path, how, _replaced(document, path, changed)


def _replaced(value: Json, path: Path, changed: Json) -> Json:
    """`value` with another part at `path`; all the rest is shared."""
    if not path:
        return changed
    copied = value.copy()
    copied[path[0]] = _replaced(value[path[0]], path[1:], changed)
    return copied


def _places(value: Json, path: Path, few: int) -> Iterator[tuple[Path, Json]]:
    yield path, value
    if isinstance(value, dict):
        for key in value:
            if key != "digests":
                yield from _places(value[key], (*path, key), few)
    elif isinstance(value, list):
        step = max(1, -(-len(value) // few))
        for i in sorted({*range(0, len(value), step), len(value) - 1}) if value else ():
            yield from _places(value[i], (*path, i), few)


def _changed(value: Json) -> Iterator[tuple[str, Json]]:
    """Other values in place of one, each unlike it."""
    match value:
        case bool():
            yield "flip", not value
            yield "drop", None
        case None:
            yield "zero", 0
            yield "text", "x"
            yield "list", []
        case int():
            yield "more", value + 1
            yield "less", value - 1
            yield "huge", value + (1 << 70)
            yield "text", str(value)
            yield "drop", None
            if value in (0, 1):
                yield "flag", bool(value)
        case str():
            yield "longer", value + "x"
            yield "number", 0
            other = _OTHER.get(value)
            if other is not None:
                yield "other", other
        case list():
            yield "object", {}
            yield "longer", [*value, 0]
            if value:
                yield "shorter", value[:-1]
                yield "behead", value[1:]
                yield "twice", [*value, value[-1]]
                yield "empty", []
            if len(value) > 1 and value[0] != value[-1]:
                yield "swap", [value[-1], *value[1:-1], value[0]]
        case dict():
            yield "list", []
            yield "longer", value | {"another": 0}
            for key in list(value)[:1]:
                yield "shorter", {k: v for k, v in value.items() if k != key}


_OTHER = {
    "add": "sub", "sub": "add", "mul": "add", "eq": "ne", "ne": "eq", "lt": "le", "le": "lt", "gt": "ge", "ge": "gt",
    "and": "or", "or": "and", "xor": "or", "not": "neg", "get": "const", "const": "get", "set": "sample", "div": "mod",
    "holds": "violated", "violated": "holds", "U": "R", "R": "U", "ringlet": "cycle", "cycle": "ringlet",
    "min": "max", "max": "min",
}  # fmt: skip

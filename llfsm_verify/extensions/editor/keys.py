"""What the keys of YAML files mean, by their published schemas: at any place, which keys and which words may stand."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from typing import cast

from llfsm_verify.plug import SCHEMAS

Schema = Mapping[str, object]
MOST = 64
"""Shapes of one place that are looked at."""


@cache
def _schema(sort: str) -> Schema:
    return SCHEMAS.load(sort)(sort) if sort in SCHEMAS else {}


def shapes(sort: str, keys: Sequence[str]) -> list[Schema]:
    """What may stand at a place, as JSON Schemas without references and choices; nothing where that is not known."""
    root = _schema(sort)
    found = list(_flat(root, root))
    for key in keys:
        found = [part for shape in found for one in _below(shape, key) for part in _flat(one, root)][:MOST]
    return found


def fields(sort: str, keys: Sequence[str]) -> dict[str, str]:
    """The keys of the mapping at a place, with what they mean."""
    found: dict[str, str] = {}
    root = _schema(sort)
    for shape in shapes(sort, keys):
        for key, value in cast(Mapping[str, Schema], shape.get("properties", {})).items():
            found.setdefault(key, _about(value, root))
        names = cast(Schema, shape.get("propertyNames", {})).get("enum", ())
        for key in cast(Sequence[str], names):
            found.setdefault(key, "")
    return found


def options(sort: str, keys: Sequence[str]) -> list[str]:
    """The words of which one stands at a place; none where something else may."""
    words = [word for shape in shapes(sort, keys) for word in cast(Sequence[object], shape.get("enum", ()))]
    return list(dict.fromkeys(str(word).lower() if isinstance(word, bool) else str(word) for word in words))


def about(sort: str, keys: Sequence[str]) -> str | None:
    """What the last of the keys means, with the words that may stand there."""
    if not keys or keys[-1] == "-":
        return None
    said = fields(sort, keys[:-1]).get(keys[-1])
    words = options(sort, keys)
    if not said and not words:
        return None
    return "\n\n".join(
        filter(None, [f"`{keys[-1]}`: {said}", f"one of {', '.join(f'`{w}`' for w in words)}" if words else ""])
    )


def is_shape(sort: str, keys: Sequence[str], name: str) -> bool:
    """Whether what is described under this name (`type`, `value`) may stand at a place."""
    root = _schema(sort)
    found: list[Schema] = list(_flat(root, root))
    for key in keys[:-1]:
        found = [part for shape in found for one in _below(shape, key) for part in _flat(one, root)][:MOST]
    last = [one for shape in found for one in _below(shape, keys[-1])] if keys else []
    return any(one.get("$ref") == f"#/$defs/{name}" for one in last)


def _below(shape: Schema, key: str) -> Iterator[Schema]:
    if key == "-":
        if isinstance(shape.get("items"), Mapping):
            yield cast(Schema, shape["items"])
        return
    properties = cast(Mapping[str, Schema], shape.get("properties", {}))
    if key in properties:
        yield properties[key]
    elif isinstance(shape.get("additionalProperties"), Mapping):
        yield cast(Schema, shape["additionalProperties"])


def _flat(shape: Schema, root: Schema) -> Iterator[Schema]:
    """The shapes that a schema stands for."""
    reference = shape.get("$ref")
    if isinstance(reference, str):
        name = reference.rsplit("/", 1)[1]
        yield from _flat(cast(Mapping[str, Schema], root["$defs"])[name], root)
        return
    yield shape
    for one in cast(Sequence[Schema], shape.get("oneOf", ())):
        if "required" not in one or "properties" in one:
            yield from _flat(one, root)
    for variant in cast(Sequence[Schema], shape.get("allOf", ())):
        if isinstance(variant.get("then"), Mapping):
            yield cast(Schema, variant["then"])


def _about(value: Schema, root: Schema) -> str:
    own = str(value.get("description", ""))
    reference = value.get("$ref")
    if not own and isinstance(reference, str):
        own = str(cast(Mapping[str, Schema], root["$defs"])[reference.rsplit("/", 1)[1]].get("description", ""))
    return own

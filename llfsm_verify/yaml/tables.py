"""Tables of fields: what the mappings of a kind of file may hold, for its reader, its JSON Schema and its page.

A value of a table has a method `schema`: the JSON Schema of what may stand there. Editors read YAML with types and we
read it without, so a schema takes a number where its digits may stand.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Protocol

from llfsm_verify.yaml.fields import VERSION

Schema = dict[str, object]
NAME = "^[A-Za-z_][A-Za-z0-9_]*$"
"""The pattern of names that users choose."""


class Value(Protocol):
    """What may stand under a key."""

    def schema(self) -> Schema:
        """As a JSON Schema."""


@dataclass(frozen=True, slots=True)
class Single:
    """One word, number or text."""

    kinds: tuple[str, ...] = ("string", "number", "boolean")
    """Types of JSON."""
    pattern: str | None = None
    least: int | None = None
    """Of a number."""
    most: int | None = None
    above: int | None = None
    """What a number is greater than."""

    def schema(self) -> Schema:
        """See `Value`."""
        limits = {"pattern": self.pattern, "minimum": self.least, "maximum": self.most, "exclusiveMinimum": self.above}
        return {"type": list(self.kinds)} | {key: limit for key, limit in limits.items() if limit is not None}


NUMBER = Single(("integer", "string"))
"""A whole number, or a text."""
TRUTHS = ("true", "false")


@dataclass(frozen=True, slots=True)
class Words:
    """One of a few words, or of the numbers and truth values that they stand for."""

    options: tuple[str, ...]
    texts: bool = True
    """Whether a number or truth value may also be written as a text."""

    def schema(self) -> Schema:
        """See `Value`."""
        typed = [{"true": True, "false": False}.get(o, int(o) if o.isdigit() else None) for o in self.options]
        return {"enum": [*(one for one in typed if one is not None), *(self.options if self.texts else ())]}


@dataclass(frozen=True, slots=True)
class ByName:
    """A mapping whose keys the user chooses."""

    value: Value
    names: str | tuple[str, ...] | None = None
    """The pattern of the keys, or all keys that are allowed."""
    least: int = 1
    empty: bool = False
    """Whether it may be left empty (null)."""

    def schema(self) -> Schema:
        """See `Value`."""
        kind = "pattern" if isinstance(self.names, str) else "enum"
        names = (
            {}
            if self.names is None
            else {"propertyNames": {kind: self.names if kind == "pattern" else list(self.names)}}
        )
        least = {"minProperties": self.least} if self.least else {}
        return {"type": _or_null("object", self), **least, **names, "additionalProperties": self.value.schema()}


@dataclass(frozen=True, slots=True)
class Several:
    """A list."""

    value: Value
    least: int = 1
    different: bool = True
    """Whether no value may be there twice."""
    most: int | None = None
    empty: bool = False
    """Whether it may be left empty (null)."""

    def schema(self) -> Schema:
        """See `Value`."""
        limits: Schema = {"minItems": self.least} if self.least else {}
        limits |= {} if self.most is None else {"maxItems": self.most}
        limits |= {"uniqueItems": True} if self.different else {}
        return {"type": _or_null("array", self), **limits, "items": self.value.schema()}


@dataclass(frozen=True, slots=True)
class Shared:
    """A value that is described under a name for all places where it may stand, also inside itself."""

    name: str

    def schema(self) -> Schema:
        """See `Value`."""
        return {"$ref": f"#/$defs/{self.name}"}


@dataclass(frozen=True, slots=True)
class Either:
    """A value of one shape or another."""

    values: tuple[Value, ...]

    def schema(self) -> Schema:
        """See `Value`."""
        return {"oneOf": [value.schema() for value in self.values]}


@dataclass(frozen=True, slots=True)
class Field:
    """A key, and what may stand under it."""

    name: str
    about: str
    """What it means: a sentence without its full stop, in the schema and on the page."""
    value: Value = Single()
    required: bool = False
    called: str = ""
    """Other names that people try, separated by spaces."""

    def schema(self) -> Schema:
        """Of its value."""
        described = {"description": _sentence(self.about)}
        return {**described, **self.value.schema(), **described}


@dataclass(frozen=True, slots=True)
class Table:
    """A mapping with known keys."""

    about: str
    fields: tuple[Field, ...]
    some: tuple[str, ...] = ()
    """Keys of which one has to be there, or more."""
    one: tuple[str, ...] = ()
    """Keys of which exactly one has to be there."""
    needs: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """By key those that have to be there if it is."""
    variants: Mapping[str, Table] = field(default_factory=dict)
    """By the word under the first key: more fields. With other words there may be any other fields."""

    @property
    def keys(self) -> tuple[str, ...]:
        """All of them, in the order of the page."""
        return tuple(one.name for one in self.fields)

    @property
    def required(self) -> tuple[str, ...]:
        """Those that have to be there."""
        return tuple(one.name for one in self.fields if one.required)

    def schema(self) -> Schema:
        """See `Value`."""
        found = {"type": "object", **self._parts()}
        if not self.variants:
            return {**found, "additionalProperties": False}
        return {**found, "allOf": [self._variant(word, table) for word, table in self.variants.items()]}

    def _parts(self) -> Schema:
        described = {one.name: one.schema() for one in self.fields}
        found: Schema = {"description": _sentence(self.about), "properties": described}
        if self.required:
            found["required"] = list(self.required)
        if self.some:
            found["anyOf"] = [{"required": [key]} for key in self.some]
        if self.one:
            found["oneOf"] = [{"required": [key]} for key in self.one]
        if self.needs:
            found["dependentRequired"] = {key: list(others) for key, others in self.needs.items()}
        return found

    def _variant(self, word: str, table: Table) -> Schema:
        then = {**table._parts(), "propertyNames": {"enum": list(dict.fromkeys((*self.keys, *table.keys)))}}
        return {"if": {"properties": {self.keys[0]: {"const": word}}}, "then": then}


FORMAT = Field(VERSION, "the format of files that it was written for", Words(("1",)))


def schema_of(name: str, title: str, table: Table, shared: Iterable[Field] = ()) -> Schema:
    """The JSON Schema (draft 2020-12) of a kind of file. `shared`: values that are described once, under their names;
    those that it uses are in it.
    """
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": f"urn:llfsm-verify:{name}"}
    found: Schema = {**head, "title": title, **table.schema()}
    known = {one.name: one.schema() for one in shared}
    used = list(_references(found))
    for reference in used:
        used += [other for other in _references(known[reference]) if other not in used]
    definitions = {key: part for key, part in known.items() if key in used}
    return {**found, "$defs": definitions} if definitions else found


def rows(fields: Iterable[Field]) -> list[str]:
    """The rows of a page for these fields, in Markdown."""
    return [f"| `{one.name}` | {one.about} |" for one in fields]


def _references(part: object) -> Iterator[str]:
    """The names of shared values in a schema."""
    if isinstance(part, dict):
        if "$ref" in part:
            yield part["$ref"].rsplit("/", 1)[1]
        part = list(part.values())
    if isinstance(part, list):
        for item in part:
            yield from _references(item)


def _or_null(kind: str, value: ByName | Several) -> str | list[str]:
    return [kind, "null"] if value.empty else kind


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:].rstrip('.')}."

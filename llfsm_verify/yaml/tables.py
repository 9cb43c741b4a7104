"""Tables of fields: what the mappings of a kind of file may hold, for its reader, its JSON Schema and its page.

A value of a table has a method `schema`: the JSON Schema of what may stand there. Editors read YAML with types and we
read it without, so a schema takes a number where its digits may stand.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
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

    def schema(self) -> Schema:
        """See `Value`."""
        limits = {"pattern": self.pattern, "minimum": self.least}
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
    names: str | None = None
    """The pattern of the keys."""
    least: int = 1

    def schema(self) -> Schema:
        """See `Value`."""
        names = {} if self.names is None else {"propertyNames": {"pattern": self.names}}
        least = {"minProperties": self.least} if self.least else {}
        return {"type": "object", **least, **names, "additionalProperties": self.value.schema()}


@dataclass(frozen=True, slots=True)
class Several:
    """A list."""

    value: Value
    least: int = 1
    different: bool = True
    """Whether no value may be there twice."""

    def schema(self) -> Schema:
        """See `Value`."""
        return {"type": "array", "minItems": self.least, "uniqueItems": self.different, "items": self.value.schema()}


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
        described = {one.name: {"description": _sentence(one.about), **one.value.schema()} for one in self.fields}
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


def schema_of(name: str, title: str, table: Table) -> Schema:
    """The JSON Schema (draft 2020-12) of a kind of file."""
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": f"urn:llfsm-verify:{name}"}
    return {**head, "title": title, **table.schema()}


def rows(fields: Iterable[Field]) -> list[str]:
    """The rows of a page for these fields, in Markdown."""
    return [f"| `{one.name}` | {one.about} |" for one in fields]


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:].rstrip('.')}."

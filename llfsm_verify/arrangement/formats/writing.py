"""What a format brings beside its reader, so that arrangements are written and guarded in it, and the values it takes.

Code that writes arrangements does not know their format. Values have the shape of documents: `build_arrangement` takes
them, and keys that lead inwards from the root name their places.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from llfsm_verify.arrangement.model import ActionKind
from llfsm_verify.diagnostics import Source, Span

Value = str | Sequence["Value"] | Mapping[str, "Value"]
Actions = Mapping[ActionKind, str | Sequence[str]]
"""Each in one line or several."""


@dataclass(frozen=True, slots=True)
class NewState:
    """A state of a machine that is written."""

    name: str
    actions: Actions = field(default_factory=dict)
    transitions: Sequence[tuple[str, str]] = ()
    """Guards and targets."""
    stays: bool = False
    runs: Sequence[str] = ()
    brief: bool = False
    """Its transitions stand on one line, in formats that have the choice."""


@dataclass(frozen=True, slots=True)
class NewMachine:
    """A machine that is written."""

    name: str
    states: Sequence[NewState]
    parameters: Mapping[str, Value] = field(default_factory=dict)
    variables: Mapping[str, Value] = field(default_factory=dict)
    initial: str | None = None
    suspend: str | None = None
    comments: Sequence[str] = ()
    """Lines for its readers."""
    notes: Mapping[str, str] = field(default_factory=dict)
    """Comments on variables."""


class Uneditable(Exception):
    """A text that cannot be edited."""

    def __init__(self, message: str, span: Span, hint: str) -> None:
        super().__init__(message)
        self.message, self.span, self.hint = message, span, hint


class Edits:
    """Replacements in one text."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self._parts: list[tuple[int, int, int, str]] = []

    def replace(self, start: int, end: int, text: str, *, depth: int = 0) -> None:
        """The characters from `start` to `end` become `text`; saying the same twice is saying it once. Of insertions at
        one place the deepest comes first."""
        part = (start, end, -depth, text)
        if start == end or part not in self._parts:
            self._parts.append(part)

    def result(self) -> str:
        """The text with all edits; insertions at one place and of one depth stay in their order."""
        text, at = [], 0
        for start, end, _, new in sorted(self._parts, key=lambda part: part[:3]):
            assert start >= at, "edits overlap"
            text += [self.source.text[at:start], new]
            at = end
        return "".join([*text, self.source.text[at:]])


class Editor(Protocol):
    """The text of an arrangement or a policy, and the edits of it. All that is not edited stays as it is written."""

    @property
    def edits(self) -> Edits:
        """Those of single words, by the places that the reader gave them."""

    def has(self, *keys: str) -> bool:
        """Whether something stands under keys."""

    def text(self, *keys: str) -> str | None:
        """The single value under keys; None: nothing is there."""

    def names(self, *keys: str) -> tuple[str, ...]:
        """The keys of the mapping under keys; no keys where it is missing."""

    def put(self, keys: tuple[str, ...], value: Value) -> None:
        """Set the last of the keys to `value`; those before it are there."""

    def remove(self, key: str) -> None:
        """Take an entry of the root out, if it is there and not the only one."""

    def rename(self, key: str, name: str) -> None:
        """Another key for an entry of the root."""

    def swap(self, keys: tuple[str, ...], others: Mapping[str, str]) -> None:
        """Write other words for those of the list under keys that have one; nothing where there is no list."""

    def append(self, keys: tuple[str, ...], item: str) -> None:
        """Add an item at the end of the list under keys, which is there."""

    def result(self) -> str:
        """The text with all edits."""


@dataclass(frozen=True, slots=True)
class Writer:
    """The functions that write a format."""

    arrangement: Callable[[Mapping[str, object]], str]
    """The text of a document of Python values, as `build_arrangement` takes it."""
    machine: Callable[[NewMachine], str] | None = None
    """The text of a machine in a file of its own; only guards need it, and `edit`."""
    edit: Callable[[Source], Editor] | None = None
    """Edits of a text that was read without errors. Uneditable: it has something that cannot be changed."""

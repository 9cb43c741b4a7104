"""What the names in the files of an arrangement stand for, and where (`indexing.py` finds that out).

A name is known by the place that declares it. A file has regions, each from an offset to the next one, with the words
that guards and actions may use there.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

Kind = Literal[
    "variable", "parameter", "state", "machine", "plant", "type", "value", "table", "property", "definition", "file"
]
WORD = re.compile(r"[A-Za-z_]\w*")


@dataclass(frozen=True, slots=True)
class Place:
    """The characters `start` to `end` (end not included) of a file, by its real path."""

    file: str
    start: int
    end: int


@dataclass(frozen=True, slots=True)
class Name:
    """Something that is declared at a place, which is what it is known by."""

    word: str
    kind: Kind
    place: Place
    about: str
    """In Markdown."""
    values: tuple[str, ...] = ()
    """Of a type and a variable: what may be compared with it."""
    inside: Mapping[str, Name] = field(default_factory=dict, compare=False, repr=False)
    """Of a machine: its states and variables; of a state: its variables."""
    whole: Place | None = field(default=None, compare=False)
    """All that belongs to it."""

    def of(self, kind: Kind) -> dict[str, Name]:
        """What is inside of one kind."""
        return {word: name for word, name in self.inside.items() if name.kind == kind}


Names = Mapping[str, Name]


@dataclass(frozen=True, slots=True)
class Region:
    """From the offset `start` of a file on, until the next region, these words stand for something."""

    file: str
    start: int
    names: Names
    machine: Name | None = None
    """The machine whose text this is."""


@dataclass(frozen=True, slots=True)
class Goal:
    """A line of a property file that is checked, `place` its formula."""

    name: str
    text: str
    place: Place


@dataclass(frozen=True, slots=True)
class Index:
    """All of this for the files of one arrangement."""

    regions: tuple[Region, ...] = ()
    uses: tuple[tuple[Place, Name], ...] = ()
    """Where names stand, declarations included."""
    outline: tuple[Name, ...] = ()
    """What files have at the top, and what is inside of that."""
    goals: tuple[Goal, ...] = ()

    def region(self, file: str, offset: int) -> Region | None:
        """The last one that begins at or before the offset."""
        found = [r for r in self.regions if r.file == file and r.start <= offset]
        return max(enumerate(found), key=lambda r: (r[1].start, r[0]), default=(0, None))[1]

    def declared(self, file: str, kind: Kind) -> dict[str, Name]:
        """What is declared of one kind, as seen from the beginning of a file."""
        first = next((r for r in self.regions if r.file == file), None)
        return {} if first is None else {w: n for w, n in first.names.items() if n.kind == kind}


def resolve_word(text: str, start: int, end: int, region: Region) -> Name | None:
    """What the word at `start` to `end` of a guard, an action or a property stands for, by what is before it."""
    word, before = text[start:end], text[max(0, start - 200) : start].rstrip()
    state = re.search(r"(\w+)\s*@\s*(?:\{[\w\s,]*)?$|(\w+)\s*\.\s*(?:fired|entered)\s*\($", before)
    if state:
        machine = region.names.get(state[1] or state[2])
        return None if machine is None else machine.of("state").get(word)
    path = re.search(r"(?:\w+\s*\.\s*)+$", before)
    if path is None:
        return region.names.get(word)
    names: Names = region.names
    for step in re.findall(r"\w+", path[0]):
        found = names.get(step)
        if found is None or found.kind not in ("machine", "plant", "state"):
            return None
        names = found.inside
    return names.get(word)

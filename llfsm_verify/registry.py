"""Registries: things that are found by a name, such as formats and engines, each imported when it is asked for.

What there is to choose from (choices of the command line, messages about a wrong name, endings of files) is derived
from a registry, so that something new enters by one entry.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Generic, TypeVar, cast

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Entry:
    """Something that has a name."""

    name: str
    place: str
    """Where it is: `module:attribute`."""
    about: str = ""
    """What it is, in a line."""
    suffixes: tuple[str, ...] = ()
    """The endings of file names that stand for it, in lower case and with the full stop."""

    def load(self) -> object:
        """What is at its place."""
        return at(self.place)


def at(place: str) -> object:
    """What is at `module:attribute`."""
    module, _, attribute = place.partition(":")
    return getattr(import_module(module), attribute)


class Unregistered(ValueError):
    """There is nothing of this name; the message says what there is."""


class Registry(Mapping[str, Entry], Generic[T]):
    """Entries by name, in the order in which they are offered."""

    def __init__(self, kind: str, entries: Iterable[Entry]) -> None:
        """`kind`: what an entry is, as messages call it. ValueError: two entries have one name or one suffix."""
        self.kind = kind
        self._entries: dict[str, Entry] = {}
        for entry in entries:
            self.add(entry)

    def add(self, entry: Entry) -> None:
        """One more. ValueError: its name, or one of its suffixes, is taken."""
        if entry.name in self._entries:
            raise ValueError(f"there are two of the name `{entry.name}`: {self.kind}")
        taken = set(self.suffixes) & set(entry.suffixes)
        if taken:
            raise ValueError(f"`{min(taken)}` already stands for another {self.kind}")
        self._entries[entry.name] = entry

    def load(self, name: str) -> T:
        """What is at the place of the entry. Unregistered."""
        if name not in self._entries:
            raise Unregistered(f"there is no {self.kind} `{name}`; there are: {', '.join(self._entries)}")
        return cast(T, self._entries[name].load())

    @property
    def suffixes(self) -> dict[str, str]:
        """The name that each ending of file names stands for."""
        return {suffix: entry.name for entry in self._entries.values() for suffix in entry.suffixes}

    def named_by(self, path: str) -> str | None:
        """The name that the ending of a file's name stands for; None: it stands for none."""
        name = Path(path).name.lower()
        return next((n for s, n in self.suffixes.items() if name.endswith(s) and name != s), None)

    def __getitem__(self, name: str) -> Entry:
        return self._entries[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._entries)

    def __len__(self) -> int:
        return len(self._entries)


def add_others(registry: Registry[T], group: str, entry_at: Callable[[EntryPoint], Entry]) -> list[str]:
    """Add what other packages register under an entry point group; sentences about what cannot be used.

    `entry_at` gets the entry at an entry point, or raises.
    """
    from importlib.metadata import entry_points

    broken = []
    for point in sorted(entry_points(group=group), key=lambda p: p.name):
        try:
            registry.add(entry_at(point))
        except Exception as error:  # noqa: BLE001 - whatever is wrong with one of others, ours go on
            where = "" if point.dist is None else f" of {point.dist.name}"
            why = f"{type(error).__name__}: {error}"
            broken.append(f"the {registry.kind} `{point.name}`{where} cannot be used ({why})")
    return broken


def meant(word: str, names: Iterable[str]) -> str:
    """The name that `word` may be a slip of, as the end of a sentence; nothing where none is near."""
    if not word:
        return ""
    from difflib import get_close_matches

    near = get_close_matches(word[:100], list(names), n=1)
    return f"; did you mean `{near[0]}`?" if near else ""

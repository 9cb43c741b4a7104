"""Registries: things that are found by a name, such as formats and engines, each imported when it is asked for.

What there is to choose from (choices of the command line, messages about a wrong name, endings of files) is derived
from a registry, so that something new enters by one entry.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from itertools import chain
from pathlib import Path
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any, Generic, TypeVar, cast

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

T = TypeVar("T")
EXTENSIONS = "llfsm_verify.extensions"


@dataclass(frozen=True, slots=True)
class Package:
    """A package of others that an entry needs, and that a plain installation does not bring."""

    module: str
    name: str
    """What `pip` calls it."""
    extra: str
    """The extra of ours that brings it."""


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
    binary: bool = False
    """Of a format that is written: it is not text, so it does not go to a terminal."""
    package: Package | None = None
    begins: str = ""
    """A regular expression: a text that begins like it is of this format, whatever the ending of its name says."""

    def load(self) -> object:
        """What is at its place."""
        return at(self.place)


def at(place: str) -> object:
    """What is at `module:attribute`."""
    module, _, attribute = place.partition(":")
    return getattr(import_module(module), attribute)


class Unregistered(ValueError):
    """There is nothing of this name; the message says what there is."""


class Unusable(Unregistered):
    """What another package registers is not at the place that its entry names, or cannot be imported."""


class Registry(Mapping[str, Entry], Generic[T]):
    """Entries by name, in the order in which they are offered.

    Those of extensions come after ours. Those of other packages are looked for when a name is asked for that is not
    there, or an ending that none of ours has.
    """

    def __init__(self, kind: str, entries: Iterable[Entry], group: str = "") -> None:
        """`kind`: what an entry is, as messages call it; `group`: of entry points that give entries, where others may
        add some. ValueError: two entries have one name or one suffix."""
        self.kind = kind
        self.group = group
        self._entries: dict[str, Entry] = {}
        self._broken: list[str] | None = None if group else []
        for entry in (*entries, *(extensions().get(group, ()) if group else ())):
            self.add(entry)
        self.ours = tuple(self._entries)
        """The names without those of other packages."""

    def add(self, entry: Entry) -> None:
        """One more. ValueError: its name, or one of its suffixes, is taken."""
        if entry.name in self._entries:
            raise ValueError(f"there are two of the name `{entry.name}`: {self.kind}")
        taken = set(self.suffixes) & set(entry.suffixes)
        if taken:
            raise ValueError(f"`{min(taken)}` already stands for another {self.kind}")
        self._entries[entry.name] = entry

    def entry(self, name: str) -> Entry:
        """What is registered under a name. Unregistered: nothing is; the message says what there is, and what other
        packages have that cannot be used."""
        broken = [] if name in self._entries else self.find_others()
        if name not in self._entries:
            there = f"there is no {self.kind} `{name}`; there are: {', '.join(self._entries)}"
            raise Unregistered("; ".join([there, *broken]))
        return self._entries[name]

    def load(self, name: str) -> T:
        """What is at the place of the entry. Unregistered; Unusable."""
        entry = self.entry(name)
        try:
            return cast(T, entry.load())
        except Exception as error:
            if name in self.ours:
                raise
            why = f"{type(error).__name__}: {error}"
            raise Unusable(f"the {self.kind} `{name}` of another package cannot be used ({why})") from error

    def find_others(self) -> list[str]:
        """Add what other packages register, once; sentences about what cannot be used."""
        if self._broken is None:
            from importlib.metadata import entry_points

            self._broken = []
            for point in sorted(entry_points(group=self.group), key=lambda p: p.name):
                try:
                    self.add(self.entry_at(point))
                except (Exception, SystemExit) as error:  # noqa: BLE001 - ours go on, whatever is wrong with others
                    where = "" if point.dist is None else f" of {point.dist.name}"
                    why = f"{type(error).__name__}: {error}"
                    self._broken.append(f"the {self.kind} `{point.name}`{where} cannot be used ({why})")
        return self._broken

    def entry_at(self, point: EntryPoint) -> Entry:
        """The entry of another package. It raises whatever is wrong with it."""
        entry = point.load()
        if not isinstance(entry, Entry):
            raise TypeError(f"{point.value} is not an Entry")
        return entry

    @property
    def binary(self) -> frozenset[str]:
        """The names of what is not text."""
        return frozenset(entry.name for entry in self._entries.values() if entry.binary)

    @property
    def suffixes(self) -> dict[str, str]:
        """The name that each ending of file names stands for."""
        return {suffix: entry.name for entry in self._entries.values() for suffix in entry.suffixes}

    def named_by(self, path: str) -> str | None:
        """The name whose ending the file has; None: no name has this ending."""
        name = Path(path).name.lower()
        found = self._ending(name)
        if found is None and Path(name).suffix:
            self.find_others()
            found = self._ending(name)
        return found

    def told_by(self, text: str) -> str | None:
        """The name whose beginning the text has; None: no name has it."""
        return next((e.name for e in self._entries.values() if e.begins and re.match(e.begins, text)), None)

    def _ending(self, name: str) -> str | None:
        return next((n for s, n in self.suffixes.items() if name.endswith(s) and name != s), None)

    def __getitem__(self, name: str) -> Entry:
        return self._entries[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._entries)

    def __len__(self) -> int:
        return len(self._entries)


class Choices(Collection[str]):
    """The names of several registries, or other names, as one that is chosen on the command line."""

    def __init__(self, *of: Registry[Any] | tuple[str, ...]) -> None:
        self._of = of

    def find_others(self) -> list[str]:
        """See `Registry`."""
        return [said for each in self._of if isinstance(each, Registry) for said in each.find_others()]

    def __contains__(self, name: object) -> bool:
        return any(name in each for each in self._of)

    def __iter__(self) -> Iterator[str]:
        return chain.from_iterable(self._of)

    def __len__(self) -> int:
        return sum(map(len, self._of))


@cache
def extensions() -> Mapping[str, tuple[Entry, ...]]:
    """What the extensions of this package register, by group; nothing where their folder is missing.

    This is the only place that knows of them. Each says in its `__init__.py` what it adds.
    """
    try:
        folder = import_module(EXTENSIONS)
    except ModuleNotFoundError as error:
        if error.name != EXTENSIONS:
            raise
        return {}
    found: dict[str, tuple[Entry, ...]] = {}
    for module in sorted(each.name for each in iter_modules(folder.__path__) if each.ispkg):
        for group, entries in import_module(f"{EXTENSIONS}.{module}").ENTRIES.items():
            found[group] = (*found.get(group, ()), *entries)
    return found


def meant(word: str, names: Iterable[str]) -> str:
    """The name that `word` may be a slip of, as the end of a sentence; nothing where none is near."""
    if not word:
        return ""
    from difflib import get_close_matches

    near = get_close_matches(word[:100], list(names), n=1)
    return f"; did you mean `{near[0]}`?" if near else ""

"""An option of an engine as data: the command line, Python's keywords, messages and tables are made from it."""

from __future__ import annotations

from argparse import ArgumentTypeError, BooleanOptionalAction
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self, TypeVar, get_args

from llfsm_verify.limits import MOST_JOBS

if TYPE_CHECKING:
    from argparse import _ActionsContainer

T = TypeVar("T")
MOST = (1 << 63) - 1
"""The largest number that an option takes."""
MOST_SECONDS = 1e9
When = Literal["auto", "on", "off"]
WHENS: tuple[str, ...] = get_args(When)


@dataclass(frozen=True, slots=True)
class Kind:
    """What the values of an option are."""

    wants: str
    """In words, after "needs"."""
    fits: Callable[[object], bool]
    """Whether it is such a value."""
    metavar: str | None = None
    read: Callable[[str], object] | None = None
    """From a word of the command line. ValueError."""
    choices: Mapping[str, object] = field(default_factory=dict)
    """The words of the command line to choose from, with their values."""


def is_count(value: object) -> bool:
    """Whether it is a whole number from 1."""
    return isinstance(value, int) and not isinstance(value, bool) and value >= 1


def _is_seconds(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and 0 < value < MOST_SECONDS


def read_count(text: str) -> int:
    """A whole number from 1. ValueError."""
    digits = text.lstrip("0")
    if not (text.isascii() and text.isdigit() and digits):
        raise ValueError(f"{text[:40]!r} is not a whole number from 1")
    if len(digits) > len(str(MOST)) or int(digits) > MOST:
        raise ValueError(f"{text[:40]} is more than the largest number that is taken, {MOST:,}")
    return int(digits)


def _is_jobs(value: object) -> bool:
    return isinstance(value, int) and is_count(value) and value <= MOST_JOBS


def read_jobs(text: str) -> int:
    """A number of threads or processes. ValueError."""
    if (number := read_count(text)) > MOST_JOBS:
        raise ValueError(f"{text[:40]} is more than {MOST_JOBS}, the largest number of jobs")
    return number


def read_seconds(text: str) -> float:
    """A positive number of seconds. ValueError."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not _is_seconds(value):
        raise ValueError(f"{text[:40]!r} is not a positive number of seconds")
    return value


def word(read: Callable[[str], T]) -> Callable[[str], T]:
    """What reads a word of the command line, from what raises ValueError for others."""

    def reading(text: str) -> T:
        try:
            return read(text)
        except ValueError as wrong:
            raise ArgumentTypeError(str(wrong)) from None

    return reading


COUNT = Kind("a whole number from 1", is_count, "N", read_count)
JOBS = Kind(f"a whole number from 1 to {MOST_JOBS}", _is_jobs, "N", read_jobs)
SECONDS = Kind("a positive number of seconds", _is_seconds, "SECONDS", read_seconds)
FILE = Kind("the name of a file", lambda value: isinstance(value, Path | str) and value != "", "FILE", str)
FLAG = Kind("True or False", lambda value: isinstance(value, bool))
SWITCH = replace(FLAG, choices={"on": True, "off": False})
WHEN = Kind(f"one of {', '.join(WHENS)}", WHENS.__contains__, choices={when: when for when in WHENS})


@dataclass(frozen=True, slots=True)
class EngineFeature:
    """Something that only some engines can be asked for, and that the harness gives them."""

    name: str
    """As Python's keyword and the entry of an engine name it."""
    flag: str
    usual: tuple[object, ...] = ()
    """Values that ask for nothing."""

    @property
    def attribute(self) -> str:
        """Where the parsed command line has its value."""
        return self.flag.removeprefix("--").replace("-", "_")

    def asks(self, given: Mapping[str, object]) -> bool:
        """Whether it is asked for among the values that were given."""
        return given.get(self.name) is not None and given[self.name] not in self.usual


@dataclass(frozen=True, slots=True, kw_only=True)
class EngineOption(EngineFeature):
    """An option of an engine's own."""

    kind: Kind
    help: str
    default: object = None
    """As Python gives it, and the same as that of its field. A FLAG that is True has a `--no-` beside it."""
    old: tuple[str, ...] = ()
    """Flags that mean the same, from earlier releases."""
    part_of: str | None = None
    """The option without which it means nothing."""
    alone: str = ""
    """What it is about, where that option is missing: the rest of a sentence, with {} for that option."""
    sole: bool = False
    """With this option `auto` asks only the engine that takes it, and sets no limits of its own."""

    def __post_init__(self) -> None:
        if wrong := [flag for flag in (self.flag, *self.old) if not flag.startswith("--")]:
            raise ValueError(f"the flag `{wrong[0]}` of the option `{self.name}` does not begin with `--`")
        if self.default is not None and not self.kind.fits(self.default):
            raise ValueError(f"the default of the option `{self.name}` is {self.default!r}, not {self.kind.wants}")

    @property
    def flags(self) -> tuple[str, ...]:
        """All that stand for it on the command line."""
        found = (self.flag, *self.old)
        return (*found, *(f"--no-{each[2:]}" for each in found)) if self.default is True else found

    def asks(self, given: Mapping[str, object]) -> bool:
        """See `EngineFeature`; its default asks for nothing."""
        return super(EngineOption, self).asks(given) and given[self.name] != self.default

    def add_to(self, to: _ActionsContainer) -> None:
        """Add it as an argument of the command line."""
        kind, more = self.kind, dict[str, Any](metavar=self.kind.metavar)
        if kind.choices:
            more["choices"] = tuple(kind.choices)
        elif kind.read is None:
            more = {"action": BooleanOptionalAction if self.default is True else "store_true"}
        else:
            more["type"] = word(kind.read)
        about = self.help.replace("%", "%%")
        action = to.add_argument(self.flag, *self.old, help=about, **more)
        action.default = next((w for w, value in kind.choices.items() if value == self.default), self.default)
        flag = not kind.choices and kind.read is None
        shown = {True: "on"}.get(action.default) if flag else action.default
        if shown is not None:
            action.help = f"{about} (default: {str(shown).removesuffix('.0').replace('%', '%%')})"


@dataclass(frozen=True, slots=True)
class EngineOptions:
    """What an engine is told beside what all engines are: one of `Options.own`."""

    OPTIONS: ClassVar[tuple[EngineOption, ...]] = ()

    @classmethod
    def demand_defaults(cls) -> None:
        """TypeError: an option cannot be left out; ValueError: its default is not that of its field."""
        usual = cls()
        for each in (option for option in cls.OPTIONS if option.default is not None):
            if (found := getattr(usual, each.name, each.default)) != each.default:
                raise ValueError(f"the default of `{each.name}` is {each.default!r}, and {found!r} in its class")

    @classmethod
    def made(cls, given: Mapping[str, Any]) -> Self:
        """From values by the names of options, of which some may be those of other engines."""
        make: Callable[..., Self] = cls
        return make(**cls.fields_of(given))

    @classmethod
    def fields_of(cls, given: Mapping[str, Any]) -> dict[str, Any]:
        """The values of the fields that have the name of an option."""
        return {each.name: given[each.name] for each in fields(cls) if each.name in given}

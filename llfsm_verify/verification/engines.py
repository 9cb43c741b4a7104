"""The engines, by the names that ``--engine`` knows them by, and all that is derived from what they say of themselves.

To add an engine, write a `checking.engine.Session` and one entry here; engines of others are found by the entry point
group `llfsm_verify.engines` (examples/engine/).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, cast, get_args

from llfsm_verify.checking.engine_option import EngineFeature, EngineOption, EngineOptions
from llfsm_verify.registry import Entry, Registry, at

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

GROUP = "llfsm_verify.engines"
"""Of entry points; each gives an `EngineEntry`."""
Decides = Literal["violations", "proofs", "faults"]


@dataclass(frozen=True, slots=True)
class TurnLimits:
    """What a turn of an exploring engine may do before others have theirs.

    `states` configurations, `endless` where a variable has no bounds, so that there may be infinitely many; `steps`, of
    which there are many where wide inputs are enumerated; `work`: units of Z3's work on the classes of wide inputs.
    """

    states: int
    endless: int
    steps: int
    work: int | None


@dataclass(frozen=True, slots=True)
class Turn:
    """One turn of an engine in ``--engine auto``, with limits of ours beside those of the user.

    `again`: only if such a limit stopped the engine before, which is higher now; without `most` every variable must
    also have bounds. `brief`: a short attempt. `alone`: these limits are also those of ``--engine all``.
    """

    place: int
    """Turns are taken in this order."""
    most: TurnLimits | None = None
    effort: int | None = None
    again: bool = False
    brief: bool = False
    alone: bool = False


@dataclass(frozen=True, slots=True)
class EngineEntry(Entry):
    """An engine: at its place is what makes its sessions (`checking.engine.Start`)."""

    decides: frozenset[Decides] = frozenset()
    """What it claims to decide on small arrangements: violations (of every kind of property), proofs that properties
    hold, faults."""
    options: frozenset[str] = frozenset()
    """Names of FEATURES that it takes, or of options that others have as their own."""
    own: tuple[str, ...] = ()
    """The places of classes of options (`EngineOptions`): it takes all options of these classes."""
    refuses: frozenset[str] = frozenset()
    """But for these."""
    turns: tuple[Turn, ...] = ()
    in_groups: bool = False
    """All that it searches together pays for each input that any property names, so properties come in groups."""
    asks_others: bool = False
    """At its place is no `Start`, but a function that takes a problem and options to a result."""

    def classes(self) -> Iterator[type[EngineOptions]]:
        """The classes of its own options."""
        yield from (cast(type[EngineOptions], at(place)) for place in self.own)

    def takes(self, name: str) -> bool:
        """Whether it takes an option."""
        own = (option.name for each in self.classes() for option in each.OPTIONS)
        return name in self.options or (name in own and name not in self.refuses)


BRIEF, EFFORT = 1_000_000, 20_000_000
"""Units of work of Z3: a second of it, and some tens of seconds."""
FIRST = TurnLimits(500_000, 500_000, 10_000_000, EFFORT)
"""Some seconds: by then most arrangements are decided."""
LARGE = TurnLimits(20_000_000, 2_000_000, 100_000_000, EFFORT)
PROVES: frozenset[Decides] = frozenset({"violations", "proofs", "faults"})
EXPLORES = frozenset({"traces", "witnesses", "max_states", "vacuity"})
INDUCTS = frozenset({"vacuity", "invariants"})
EXPLICIT, UNROLLED = (
    "llfsm_verify.engines.explicit.options:ExplicitOptions", "llfsm_verify.engines.unrolled.options:UnrolledOptions",
)  # fmt: skip
FEATURES = (
    EngineFeature("max_states", "--max-states"), EngineFeature("traces", "--all", (1,)),
    EngineFeature("witnesses", "--witness", (False,)), EngineFeature("vacuity", "--vacuity", (False,)),
    EngineFeature("invariants", "--save-invariants"),
)  # fmt: skip
"""What the harness does with some engines only."""


class Engines(Registry[Callable[..., object]]):
    """Ours, and those of others, which never take turns."""

    def __init__(self, kind: str, entries: Iterable[EngineEntry]) -> None:
        super().__init__(kind, entries, GROUP)

    def entry(self, name: str) -> EngineEntry:
        """What an engine says of itself. Unregistered."""
        found = super().entry(name)
        assert isinstance(found, EngineEntry)
        return found

    def classes(self, of: Iterable[str] | None = None) -> tuple[type[EngineOptions], ...]:
        """The classes of the options that engines have as their own; `of`: only these engines. Unregistered."""
        names = self if of is None else of
        return tuple(dict.fromkeys(each for name in names for each in self.entry(name).classes()))

    def options(self, of: Iterable[str] | None = None) -> tuple[EngineOption, ...]:
        """The options that engines have as their own; `of`: only these engines. Unregistered."""
        return tuple(option for each in self.classes(of) for option in each.OPTIONS)

    def asked(self, given: Mapping[str, object]) -> Iterator[EngineFeature]:
        """What is asked of an engine that not every engine takes, among values by the names of options."""
        return (each for each in (*self.options(), *FEATURES) if each.asks(given))

    def misplaced(self, name: str, given: Mapping[str, object]) -> EngineFeature | None:
        """The first of what is asked that the engine `name` does not take. Unregistered."""
        entry = self.entry(name)
        return next((each for each in self.asked(given) if not entry.takes(each.name)), None)

    def partial(self, given: Mapping[str, object]) -> tuple[EngineOption, EngineOption] | None:
        """An option that was given without the one that it is a part of, and that one."""
        whole = {option.name: option for option in self.options()}
        asked = (o for o in whole.values() if o.part_of is not None and o.asks(given) and o.part_of not in given)
        alone = (o for o in asked if whole[str(o.part_of)].default is None)
        return next(((option, whole[str(option.part_of)]) for option in alone), None)

    def own(self, given: Mapping[str, object]) -> tuple[EngineOptions, ...]:
        """What single engines are told: `Options.own` from values by the names of options."""
        made = (each.made(given) for each in self.classes())
        return tuple(each for each in made if each != type(each)())

    def sole(self, told: Iterable[object]) -> str | None:
        """The engine that takes a `sole` option which is set in these, of `Options.own`; None: none is set."""
        options = ((each, o) for each in told if isinstance(each, EngineOptions) for o in each.OPTIONS if o.sole)
        name = next((o.name for each, o in options if getattr(each, o.name) != o.default), None)
        entries = (e for e in map(self.entry, self) if name is not None and e.takes(name) and not e.asks_others)
        return next((e.name for e in entries), None)

    def takers(self, option: str) -> str:
        """The engines that take an option themselves: ``bmc, induction and pdr``."""
        entries = map(self.entry, self)
        *most, last = [e.name for e in entries if e.takes(option) and not e.asks_others]
        return f"{', '.join(most)} and {last}" if most else last

    def entry_at(self, point: EntryPoint) -> EngineEntry:
        """See `Registry`."""
        entry = point.load()
        if not isinstance(entry, EngineEntry):
            raise TypeError(f"{point.value} is not an EngineEntry")
        if entry.turns or entry.asks_others:
            raise ValueError("only our own engines take turns in `auto` and ask others")
        taken = {word for each in (*self.options(), *FEATURES) for word in (each.name, each.flag, each.attribute)}
        for option in (o for each in entry.classes() if each not in self.classes() for o in each.OPTIONS):
            if {option.name, option.flag, option.attribute} & taken:
                raise ValueError(f"there already is an option `{option.name}`")
        for each in entry.classes():
            each.demand_defaults()
        return entry


ENGINES = Engines(
    "engine",
    [
        EngineEntry(
            "auto", "llfsm_verify.verification.portfolio:auto", "each of the next four in turn", decides=PROVES,
            options=EXPLORES | INDUCTS, own=(EXPLICIT, UNROLLED), asks_others=True,
        ),
        EngineEntry(
            "explicit", "llfsm_verify.engines.explicit.engine:ExplicitSession", "all configurations, one by one",
            decides=PROVES, options=EXPLORES, own=(EXPLICIT,), in_groups=True,
            turns=(
                Turn(1, FIRST), Turn(3, LARGE, again=True, alone=True), Turn(7, again=True),
                Turn(8, replace(LARGE, work=None), again=True),
            ),
        ),
        EngineEntry(
            "bmc", "llfsm_verify.engines.bounded.engine:BoundedSession", "runs of growing length, by Z3",
            decides=frozenset({"violations"}), own=(UNROLLED,), turns=(Turn(4, effort=EFFORT, alone=True),),
        ),
        EngineEntry(
            "induction", "llfsm_verify.engines.inductive.engine:induction", "k-induction, by Z3",
            decides=frozenset({"violations"}), options=INDUCTS, own=(UNROLLED,), turns=(Turn(5, alone=True),),
        ),
        EngineEntry(
            "pdr", "llfsm_verify.engines.inductive.engine:pdr", "property-directed reachability, by Z3's Spacer",
            decides=PROVES, options=INDUCTS, own=(UNROLLED,),
            turns=(Turn(2, effort=BRIEF, brief=True), Turn(6, alone=True)),
        ),
        EngineEntry(
            "all", "llfsm_verify.verification.differential:all_engines", "the same four, which have to agree",
            decides=PROVES, options=EXPLORES | INDUCTS, own=(EXPLICIT, UNROLLED), refuses=frozenset({"checkpoint"}),
            asks_others=True,
        ),
    ],
)  # fmt: skip
DEFAULT_ENGINE = "auto"
"""The one that is asked where none is named: by the command line, the front door and the pytest plugin."""


def table() -> str:
    """What the engines are, in Markdown: the table of docs/command-line.md."""
    lines = ["| engine | how it searches | decides | also takes |", "|---|---|---|---|"]
    listed = [*(option for option in ENGINES.options() if option.part_of is None), *FEATURES]
    for name in ENGINES:
        entry = ENGINES.entry(name)
        decides = ", ".join(d for d in get_args(Decides) if d in entry.decides)
        options = " ".join(f"`{each.flag}`" for each in listed if entry.takes(each.name))
        lines.append(f"| `{name}` | {entry.about} | {decides} | {options} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(table(), end="")  # noqa: T201

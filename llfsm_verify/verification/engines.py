"""The engines, by the names that ``--engine`` knows them by, and all that is derived from what they say of themselves.

Who adds an engine writes a `checking.engine.Session` and one entry here; engines of others are found by the entry point
group `llfsm_verify.engines` (docs/engines.md).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, get_args

from llfsm_verify.registry import Entry, Registry

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
    """Those of the options in WRITTEN that it takes."""
    turns: tuple[Turn, ...] = ()
    asks_others: bool = False
    """At its place is no `Start`, but a function that takes a problem and options to a result."""


BRIEF, EFFORT = 1_000_000, 20_000_000
"""Units of work of Z3: a second of it, and some tens of seconds."""
FIRST = TurnLimits(500_000, 500_000, 10_000_000, EFFORT)
"""Some seconds: by then most arrangements are decided."""
LARGE = TurnLimits(20_000_000, 2_000_000, 100_000_000, EFFORT)
PROVES: frozenset[Decides] = frozenset({"violations", "proofs", "faults"})
EXPLORES = frozenset({"checkpoint", "traces", "cone", "compression", "labels", "witnesses", "max_states", "vacuity"})
UNROLLS = frozenset({"depth"})
INDUCTS = UNROLLS | {"vacuity", "invariants"}
WRITTEN = {
    "cone": "--cone", "compression": "--compression", "labels": "--labels", "max_states": "--max-states",
    "depth": "--depth", "checkpoint": "--checkpoint", "traces": "--all", "witnesses": "--witness",
    "vacuity": "--vacuity", "invariants": "--save-invariants",
}  # fmt: skip
"""The options that only some engines take, as users write them."""


class Engines(Registry[Callable[..., object]]):
    """Ours, and those of others, which never take turns."""

    def __init__(self, kind: str, entries: Iterable[EngineEntry]) -> None:
        super().__init__(kind, entries, GROUP)

    def entry(self, name: str) -> EngineEntry:
        """What an engine says of itself. Unregistered."""
        found = super().entry(name)
        assert isinstance(found, EngineEntry)
        return found

    def misplaced(self, name: str, asked: Iterable[str]) -> str | None:
        """The first of these options that the engine `name` does not take. Unregistered."""
        return next((option for option in asked if option not in self.entry(name).options), None)

    def takers(self, option: str) -> str:
        """The engines that take an option themselves: ``bmc, induction and pdr``."""
        entries = map(self.entry, self)
        *most, last = [e.name for e in entries if option in e.options and not e.asks_others]
        return f"{', '.join(most)} and {last}" if most else last

    def entry_at(self, point: EntryPoint) -> EngineEntry:
        """See `Registry`."""
        entry = point.load()
        if not isinstance(entry, EngineEntry):
            raise TypeError(f"{point.value} is not an EngineEntry")
        if entry.turns or entry.asks_others:
            raise ValueError("only our own engines take turns in `auto` and ask others")
        return entry


ENGINES = Engines(
    "engine",
    [
        EngineEntry(
            "auto", "llfsm_verify.verification.portfolio:auto", "each of the next four in turn", decides=PROVES,
            options=EXPLORES | INDUCTS, asks_others=True,
        ),
        EngineEntry(
            "explicit", "llfsm_verify.engines.explicit.engine:ExplicitSession", "all configurations, one by one",
            decides=PROVES, options=EXPLORES,
            turns=(
                Turn(1, FIRST), Turn(3, LARGE, again=True, alone=True), Turn(7, again=True),
                Turn(8, replace(LARGE, work=None), again=True),
            ),
        ),
        EngineEntry(
            "bmc", "llfsm_verify.engines.bounded.engine:BoundedSession", "runs of growing length, by Z3",
            decides=frozenset({"violations"}), options=UNROLLS, turns=(Turn(4, effort=EFFORT, alone=True),),
        ),
        EngineEntry(
            "induction", "llfsm_verify.engines.inductive.engine:induction", "k-induction, by Z3",
            decides=frozenset({"violations"}), options=INDUCTS, turns=(Turn(5, alone=True),),
        ),
        EngineEntry(
            "pdr", "llfsm_verify.engines.inductive.engine:pdr", "property-directed reachability, by Z3's Spacer",
            decides=PROVES, options=INDUCTS, turns=(Turn(2, effort=BRIEF, brief=True), Turn(6, alone=True)),
        ),
        EngineEntry(
            "all", "llfsm_verify.verification.differential:all_engines", "the same four, which have to agree",
            decides=PROVES, options=(EXPLORES | INDUCTS) - {"checkpoint"}, asks_others=True,
        ),
    ],
)  # fmt: skip
DEFAULT_ENGINE = "auto"
"""Whom everybody asks who names none: the command line, the front door, the pytest plugin."""


def table() -> str:
    """What the engines are, in Markdown: the table of docs/command-line.md."""
    lines = ["| engine | how it searches | decides | also takes |", "|---|---|---|---|"]
    for name in ENGINES:
        entry = ENGINES.entry(name)
        decides = ", ".join(d for d in get_args(Decides) if d in entry.decides)
        options = " ".join(f"`{WRITTEN[o]}`" for o in WRITTEN if o in entry.options)
        lines.append(f"| `{name}` | {entry.about} | {decides} | {options} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(table(), end="")  # noqa: T201

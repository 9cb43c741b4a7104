"""Monitors of properties, read from recorded letters or beside a simulation."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass

from llfsm_verify.api.options import Draw, laws_of
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.checking.doubts import doubts
from llfsm_verify.checking.problem import bind
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.logic import codes
from llfsm_verify.logic.bounds import TICK
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.monitoring.native import CompiledMonitors
from llfsm_verify.monitoring.properties import Monitored, Timing, monitor_properties
from llfsm_verify.report.monitor import summary
from llfsm_verify.runtime.stepping.drawing import drawing_of
from llfsm_verify.runtime.stepping.monitored import MonitoredSimulation
from llfsm_verify.semantics.letters import Observed
from llfsm_verify.semantics.lowering import lower

Letter = Collection[str] | Mapping[str, bool]
"""The atoms that hold, or a mapping that says of some atoms whether they hold; the others do not."""


@dataclass(frozen=True, slots=True, repr=False)
class PropertyMonitor:
    """The monitor of one property. `wrapped` is the value inside, which is private."""

    wrapped: Monitored

    def __repr__(self) -> str:
        return f"<PropertyMonitor {self.name}, monitorable {self.monitorability}>"

    def __str__(self) -> str:
        return summary(self.wrapped)

    @property
    def name(self) -> str:
        """What the property is called."""
        return self.wrapped.line.name

    @property
    def monitorability(self) -> str:
        """``always``: after every word a verdict can still come; ``sometimes``: not after each; ``never``: not at
        all."""
        return self.wrapped.monitor.monitorability.value

    @property
    def states(self) -> int:
        """The number of its states."""
        return len(self.wrapped.monitor.verdicts)

    def verdict(self, state: int) -> str:
        """``true``, ``false`` or ``not yet``: what holds of all that can follow in this state."""
        return self.wrapped.monitor.verdicts[state].value


@dataclass(frozen=True, slots=True)
class MonitorReading:
    """What monitors say after some letters."""

    read: int
    """The number of letters."""
    verdicts: Mapping[str, str]
    """``true``, ``false`` or ``not yet``, by the name of the property."""
    settled: Mapping[str, int]
    """The monitors that no letter changes any more, each with the number of letters read until then."""


class WatchedSimulation(MonitoredSimulation):
    """A `Simulation` with monitors that read every letter."""

    def __init__(self, monitors: MonitorSet, seed: int | None, hold: str | None, draw: Mapping[str, str]) -> None:
        self._set = monitors
        program = lower(monitors._arrangement, monitors._atoms)
        wanted = {m.name: m.wrapped.monitor for m in monitors}
        super().__init__(program, wanted, seed, drawing_of(program, hold, draw))

    @property
    def verdicts(self) -> dict[str, str]:
        """What each monitor says so far: ``true``, ``false`` or ``not yet``, by the name of the property."""
        return {name: self._set[name].verdict(state) for name, state in self.monitor_states.items()}


@dataclass(frozen=True, slots=True, repr=False)
class MonitorSet:
    """Monitors of several properties, one after the other, or by name as ``monitors["name"]``."""

    _arrangement: Arrangement
    _atoms: tuple[Observed, ...]
    _monitors: tuple[PropertyMonitor, ...]
    warnings: tuple[Diagnostic, ...] = ()
    """What may be meant otherwise in the properties, such as a formula that lacks `G`."""

    def __iter__(self) -> Iterator[PropertyMonitor]:
        return iter(self._monitors)

    def __len__(self) -> int:
        return len(self._monitors)

    def __getitem__(self, name: str) -> PropertyMonitor:
        """The monitor of the property of this name. KeyError: the message says which there are."""
        for monitor in self._monitors:
            if monitor.name == name:
                return monitor
        known = ", ".join(f"`{monitor.name}`" for monitor in self._monitors) or "none at all"
        raise KeyError(f"there is no monitor of `{name}`, only of {known}")

    def __repr__(self) -> str:
        return f"<MonitorSet of {self._arrangement.name}: {', '.join(m.name for m in self._monitors)}>"

    def __str__(self) -> str:
        return "\n".join(map(str, self._monitors))

    def start(self, seed: int | None = None, *, hold: str | None = None, draw: Draw | None = None) -> WatchedSimulation:
        """A simulation with the monitors beside it, as `Model.start` gives one without."""
        return WatchedSimulation(self, seed, hold, laws_of(draw))

    def read(self, letters: Iterable[Letter]) -> MonitorReading:
        """What the monitors say after recorded letters.

        ValueError: a letter has an atom that no property has, or a property has bounds in time, which letters by
        themselves do not show.
        """
        compiled = CompiledMonitors({m.name: m.wrapped.monitor for m in self._monitors})
        if TICK in compiled.atoms:
            raise ValueError("letters do not show how time passes, and a property has bounds in time")
        bits = {atom: 1 << i for i, atom in enumerate(compiled.atoms)}
        masks = []
        for number, letter in enumerate(letters, 1):
            unknown = [atom for atom in letter if atom not in bits]
            if unknown:
                known = ", ".join(f"`{atom}`" for atom in bits) or "none at all"
                raise ValueError(f"letter {number}: no property has an atom `{unknown[0]}`, only {known}")
            held = [a for a, holds in letter.items() if holds] if isinstance(letter, Mapping) else set(letter)
            masks.append(sum(bits[atom] for atom in held))
        compiled.feed(compiled.pack(masks))
        verdicts = {name: self[name].verdict(state) for name, state in compiled.states.items()}
        return MonitorReading(compiled.read, verdicts, dict(compiled.settled))


def monitors_of(arrangement: Arrangement, properties: PropertySet) -> MonitorSet:
    """The monitors of all lines but the assumptions, under these.

    DiagnosticError: what is wrong with the properties, or that a monitor is too large.
    """
    problem = bind(arrangement, properties)
    timing = Timing(problem.clock)
    made = []
    for line in properties.goals:
        try:
            made.append(PropertyMonitor(monitor_properties(line, properties.assumptions, timing)))
        except AutomatonTooLarge as limit:
            raise DiagnosticError(Diagnostic(codes.LIMIT, f"unknown: {limit}", line.span)) from None
    return MonitorSet(arrangement, problem.atoms, tuple(made), doubts(arrangement, properties))

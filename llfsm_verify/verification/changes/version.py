"""An arrangement in the examination of a machine: its program with monitors in it, and what its configurations say."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from functools import cached_property

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.backends.native.layout import Layout
from llfsm_verify.checking.monitors import decidable
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.reach import Reachable
from llfsm_verify.kripke.explore import MAX_ROOTS
from llfsm_verify.kripke.labels.labels import Labels
from llfsm_verify.kripke.labels.wide import labels_of
from llfsm_verify.kripke.observing import initial_atoms
from llfsm_verify.limits import Budget
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.monitoring.lookup import first_states, walk_table
from llfsm_verify.monitoring.states import MonitorVerdict
from llfsm_verify.transforms.monitors import monitor_name, with_monitors, within_names
from llfsm_verify.values import Value


class Version:
    """The arrangement before or after: its program with the monitors in it."""

    def __init__(
        self, arrangement: Arrangement, properties: PropertySet, budget: Budget, lost: Collection[int] | None = None
    ) -> None:
        """`lost` None: runs go on where a monitor has come to *violated*; else they end there in a fault, but for these
        monitors, which had come to it before."""
        self._budget = budget
        self.problem = bind(arrangement, properties)
        self.plain = self.problem.program(keep_all_bits=True)
        self.monitors, self.reasons = decidable(self.problem)
        self.tables = [walk_table(monitor) for monitor in self.monitors.values()]
        fatal = () if lost is None else set(range(len(self.tables))) - set(lost)
        self.program = with_monitors(self.plain, list(self.monitors.values()), self.tables, fatal)
        self.layout = Layout.of(self.program)
        self.false = [
            frozenset(t.numbers[q] for q, verdict in enumerate(m.verdicts) if verdict is MonitorVerdict.FALSE)
            for m, t in zip(self.monitors.values(), self.tables, strict=True)
        ]
        self._states = [self.layout.reader(monitor_name(k)) for k in range(len(self.tables))]
        self._within = [self.layout.reader(name) for name in within_names(self.plain)]
        self._ended = [None if p.ended is None else self.layout.reader(p.ended) for p in self.plain.processes]

    @cached_property
    def _labels(self) -> Labels | None:
        return labels_of(self.program, self._budget)

    def reachable(self, configurations: Iterable[bytes], *, with_edges: bool = False) -> Reachable:
        """What can be reached from these, which have room for nothing else."""
        return Reachable(self.program, self._budget, roots=configurations, labels=self._labels, with_edges=with_edges)

    def record(self, configuration: bytes) -> bytes:
        """With outputs as they are at first."""
        return configuration + self.layout.encode_outputs(self.layout.initial_outputs())

    def states(self, configuration: bytes) -> tuple[int, ...]:
        """Of the monitors."""
        return tuple(read(configuration) for read in self._states)

    def violated(self, configuration: bytes) -> Iterator[int]:
        """The numbers of the monitors that have come to *violated*."""
        return (k for k, read in enumerate(self._states) if read(configuration) in self.false[k])

    def is_whole(self, configuration: bytes) -> bool:
        """No process is in the middle of a cycle."""
        return not any(read(configuration) for read in self._within)

    def has_ended(self, configuration: bytes) -> bool:
        """All processes have ended."""
        return all(read is not None and read(configuration) for read in self._ended)

    def beginnings(self) -> Iterator[bytes]:
        """The initial configurations, the first letter read. Raises AtomOverflow."""
        layout, atoms = Layout.of(self.plain), [m.atoms for m in self.monitors.values()]
        for record in layout.initial(MAX_ROOTS):
            letter = initial_atoms(self.plain, layout, record)
            yield self.with_states(layout.decode(record), list(first_states(self.tables, atoms, letter)))

    def with_states(self, values: Mapping[str, Value], states: Sequence[int]) -> bytes:
        """The configuration with these values of variables, between two cycles, and states of monitors."""
        own = {monitor_name(k): states[k] for k in range(len(self.tables))}
        return self.layout.encode({**values, **own, **dict.fromkeys(within_names(self.plain), 0)})

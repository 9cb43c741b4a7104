"""Machines that starve or come late: stuck in a state, suspended forever or never given a turn, in the complete graph;
and by their texts, one that has no more turns while others go on (L023), and reads that come a cycle late (L024).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from llfsm_verify.analysis.lint.finding import Finding
from llfsm_verify.analysis.lint.reach import Arrays, Reach
from llfsm_verify.arrangement.model import Arrangement, Machine
from llfsm_verify.diagnostics import Span
from llfsm_verify.kripke.structure import column
from llfsm_verify.language.trees import of_kind
from llfsm_verify.language.typed import AtState, Literal, Observe, Read
from llfsm_verify.program.program import Program
from llfsm_verify.semantics.letters import Observed
from llfsm_verify.semantics.probes import DEAD

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Stuck:
    """From configuration `node` on (the nearest one) no run leads `machine` out of state number `state`."""

    machine: str
    state: int
    suspended: bool
    node: int


@dataclass(frozen=True, slots=True)
class PassedOver:
    """From configuration `node` on some run goes on forever without a turn of the live process number `process`."""

    process: int
    node: int


def stuck(arrangement: Arrangement, reach: Reach) -> Iterator[Stuck]:
    """EF AG `machine@state`, for states that the machine is meant to leave; `reach` is complete."""
    import numpy as np

    program, arrays = reach.program, reach.arrays
    backward = _Predecessors(arrays)
    dead = _flag(reach, program, DEAD)
    for machine in arrangement.machines:
        states = column(arrays.keys, reach.layout, f"{machine.name}.$state")
        live = ~dead & ~_gone(arrangement, reach, machine)
        leaves = np.zeros(len(states), dtype=np.bool_)
        leaving = (states[arrays.sources] != states[arrays.targets]) | dead[arrays.targets]
        leaves[arrays.sources[leaving]] = True
        backward.close(leaves)
        kept = live & ~leaves
        for state in np.unique(states[kept]):
            suspended = _is_suspend(machine, int(state))
            if _meant_to_leave(arrangement, machine, int(state), suspended=suspended):
                node = int(np.argmax(kept & (states == state)))
                yield Stuck(machine.name, int(state), suspended, node)


def _is_suspend(machine: Machine, state: int) -> bool:
    return state == (len(machine.states) if machine.suspend is None else machine.suspend)


def _meant_to_leave(arrangement: Arrangement, machine: Machine, state: int, *, suspended: bool) -> bool:
    if suspended and any(
        c.machine == machine.name and c.kind in ("resume", "restart")
        for other in arrangement.machines
        for c in other.commands()
    ):
        return True
    transitions = machine.states[state].transitions if state < len(machine.states) else ()
    return any(t.target != state and not _never(t.guard) for t in transitions)


def _never(guard: object) -> bool:
    return isinstance(guard, Literal) and not guard.value


def _gone(arrangement: Arrangement, reach: Reach, machine: Machine) -> NDArray[np.bool_]:
    """Where the machine has finished, or is not loaded, or its process has ended."""
    program = reach.program
    number = next(i for i, p in enumerate(arrangement.processes) if machine.name in p.schedule)
    ended = program.processes[number].ended
    gone = _flag(reach, program, f"{machine.name}.$finished")
    if any(v.name == f"{machine.name}.$loaded" for v in program.vars):
        gone |= ~_flag(reach, program, f"{machine.name}.$loaded")
    return gone if ended is None else gone | _flag(reach, program, ended)


def _flag(reach: Reach, program: Program, name: str) -> NDArray[np.bool_]:
    """Where a Boolean variable is true; nowhere where there is no such variable."""
    import numpy as np

    if all(v.name != name for v in program.vars):
        return np.zeros(len(reach.arrays.keys), dtype=np.bool_)
    found: NDArray[np.bool_] = column(reach.arrays.keys, reach.layout, name) != 0
    return found


def passed_over(arrangement: Arrangement, reach: Reach) -> Iterator[PassedOver]:
    """Endless runs without a turn of a live process; `reach` is complete. With fairness there are none."""
    import numpy as np

    if arrangement.fairness == "processes" or len(arrangement.processes) == 1:
        return
    program, arrays = reach.program, reach.arrays
    for number, process in enumerate(arrangement.processes):
        mine = 0
        for bit, outcome in enumerate(reach.probed.outputs):
            if outcome.probe.kind == "spent" and outcome.probe.machine in process.schedule:
                mine |= 1 << bit
        others = np.array([not letter & mine for letter in reach.alphabet], dtype=np.bool_)
        ended = program.processes[number].ended
        live = ~_flag(reach, program, DEAD)
        live &= np.bool_(True) if ended is None else ~_flag(reach, program, ended)
        kept = others[arrays.labels] & live[arrays.sources] & live[arrays.targets]
        endless = _endless(live, arrays.sources[kept], arrays.targets[kept])
        if endless.any():
            yield PassedOver(number, int(np.argmax(endless)))


def _endless(nodes: NDArray[np.bool_], sources: NDArray[np.int64], targets: NDArray[np.int64]) -> NDArray[np.bool_]:
    """The nodes from which an endless path goes on: those left when nodes without a successor are taken away."""
    import numpy as np

    left = nodes.copy()
    count = np.bincount(sources, minlength=len(nodes))
    backward = _Predecessors(Arrays(np.empty((len(nodes), 0), dtype=np.uint64), sources, targets, targets))
    frontier = np.nonzero(left & (count == 0))[0]
    while frontier.size:
        left[frontier] = False
        before = backward.of(frontier)
        np.subtract.at(count, before, 1)
        candidates = np.unique(before)
        frontier = candidates[left[candidates] & (count[candidates] == 0)]
    return left


class _Predecessors:
    """The edges of a graph by their targets."""

    def __init__(self, arrays: Arrays) -> None:
        import numpy as np

        order = np.argsort(arrays.targets, kind="stable")
        self._sources = arrays.sources[order]
        self._first = np.searchsorted(arrays.targets[order], np.arange(len(arrays.keys) + 1))

    def of(self, nodes: NDArray[np.int64]) -> NDArray[np.int64]:
        """The sources of all edges into `nodes`, with repetitions."""
        import numpy as np

        starts, counts = self._first[nodes], self._first[nodes + 1] - self._first[nodes]
        offsets = np.arange(int(counts.sum())) - np.repeat(np.cumsum(counts) - counts, counts)
        found: NDArray[np.int64] = self._sources[np.repeat(starts, counts) + offsets]
        return found

    def close(self, marked: NDArray[np.bool_]) -> None:
        """Mark everything from which something marked can be reached."""
        import numpy as np

        frontier = np.nonzero(marked)[0]
        while frontier.size:
            before = np.unique(self.of(frontier))
            frontier = before[~marked[before]]
            marked[frontier] = True


@dataclass(frozen=True, slots=True)
class _Text:
    """What the text of one machine has to do with the whiteboard and with other machines."""

    writes: frozenset[str]
    reads: dict[str, Span]
    """Variables of the whiteboard, and as ``m@`` the machines whose states it asks for, each where it stands first."""
    restarts: frozenset[str]

    @staticmethod
    def of(machine: Machine) -> _Text:
        text = (tuple(state.transitions for state in machine.states), machine.actions)
        reads = [(r.variable.name, r.span) for r in of_kind(text, Read) if r.variable.scope == "whiteboard"]
        reads += [(f"{a.machine}@", a.span) for a in of_kind(text, AtState) if a.machine != machine.name]
        first: dict[str, Span] = {}
        for name, span in reads:
            first.setdefault(name, span)
        return _Text(
            frozenset(name for name, _ in machine.writes()),
            first,
            frozenset(command.machine for command in machine.commands() if command.kind == "restart"),
        )

    def gives(self, name: str, other: _Text) -> list[str]:
        """What `other` reads of this one, the text of the machine `name`."""
        return [read for read in other.reads if read in self.writes or read == f"{name}@"]


def turns(arrangement: Arrangement, atoms: Iterable[Observed]) -> Iterator[Finding]:
    """L023 and L024. `atoms` are those of properties: where they ask whether a machine has finished, it may."""
    texts = {machine.name: _Text.of(machine) for machine in arrangement.texts}
    yield from _finishing(arrangement, texts, atoms)
    yield from _late(arrangement, texts)


def _finishing(arrangement: Arrangement, texts: dict[str, _Text], atoms: Iterable[Observed]) -> Iterator[Finding]:
    """States in which machines finish that others need, while others go on for good."""
    asked = (node for atom in atoms for node in of_kind(atom.expression, Observe))
    meant = {node.machine for node in asked if node.kind == "finished"}
    meant |= {o.target for o in arrangement.operators if o.kind in ("restart", "enter")}
    meant = meant.union(*(text.restarts for text in texts.values()))
    outputs = {entry.variable.name for entry in arrangement.whiteboard if entry.role == "output"}
    own = [m for m in arrangement.machines if m.loaded and not m.nested]
    endings = {m.name: [s for i, s in enumerate(m.states) if s.finishes and i != m.suspend] for m in own}
    places: dict[tuple[Span, str], list[str]] = {}
    for machine in own:
        text = texts[machine.name]
        needed = bool(text.writes & outputs) or any(
            text.gives(machine.name, other) for name, other in texts.items() if name != machine.name
        )
        once = not any(state.transitions for state in machine.states)  # it does something in its first turn, no more
        lasting = any(not endings[m.name] for m in own if m is not machine)
        if needed and lasting and not once and machine.name not in meant:
            for state in endings[machine.name]:
                if not state.internal or arrangement.finished == "keep":  # L015 says it
                    places.setdefault((state.span, state.name), []).append(machine.name)
    for (span, state_name), names in places.items():
        listed = ", ".join(f"`{name}`" for name in names)
        message = f"{listed} finish{'es' if len(names) == 1 else ''} in `{state_name}`, and other machines go on: "
        message += "the state has no transitions"
        hint = "add a transition; if it is meant, write `stays: true`, or `lint: {L023: why}`"
        yield Finding("L023", "note", message, span, tuple(names), "text", (), hint)


def _late(arrangement: Arrangement, texts: dict[str, _Text]) -> Iterator[Finding]:
    """Machines that have their turn before the only one which writes what they read, and give it nothing in return, not
    even through others: in a circle one has to be late."""
    writers: dict[str, set[str]] = {}
    for name, text in texts.items():
        for variable in text.writes:
            writers.setdefault(variable, set()).add(name)
    for operator in arrangement.operators:
        writers.setdefault(operator.target, set()).add("")
    feeds = {a: {b for b in texts if b != a and texts[a].gives(a, texts[b])} for a in texts}
    machines = {machine.name: machine for machine in arrangement.machines}
    for process in arrangement.processes:
        order = [name for name in process.schedule if machines[name].loaded]
        for i, reader in enumerate(order):
            for writer in order[i + 1 :]:
                given = [v for v in texts[writer].gives(writer, texts[reader]) if writers.get(v, {writer}) == {writer}]
                nested = machines[writer].nested or machines[reader].nested  # they have to follow their owner
                if not given or nested or writer in _fed(feeds, reader):
                    continue
                span = texts[reader].reads[given[0]]
                message = f"`{reader}` has its turn before `{writer}`, so it reads {_listed(given)} a cycle late"
                hint = f"put it after `{writer}` in the schedule, or accept it with `lint: {{L024: why}}`"
                yield Finding("L024", "note", message, span, (reader, writer), "text", (), hint)


def _fed(feeds: dict[str, set[str]], name: str) -> set[str]:
    """The machines that get something of `name`, also through others."""
    found, todo = set[str](), [name]
    while todo:
        for other in feeds[todo.pop()] - found:
            found.add(other)
            todo.append(other)
    return found


def _listed(given: list[str]) -> str:
    names = [f"the state of `{name[:-1]}`" if name.endswith("@") else f"`{name}`" for name in given]
    return ", ".join(names[:-1]) + (" and " if names[1:] else "") + names[-1]

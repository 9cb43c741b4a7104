"""What turns of machines do to others: one that has no more of them (L023), and reads that come a cycle late (L024)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from llfsm_verify.analysis.lint.finding import Finding
from llfsm_verify.arrangement.model import Arrangement, Machine
from llfsm_verify.diagnostics import Span
from llfsm_verify.language.trees import of_kind
from llfsm_verify.language.typed import AtState, Observe, Read
from llfsm_verify.semantics.letters import Observed


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
    meant |= {o.target for o in arrangement.operators if o.kind == "restart"}
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
    even through others: in a circle somebody has to be late."""
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

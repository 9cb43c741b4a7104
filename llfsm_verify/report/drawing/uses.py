"""What a machine's guards and actions read and write on the whiteboard, and what they watch and command of machines."""

from __future__ import annotations

from llfsm_verify.arrangement.model import ACTION_KINDS, Arrangement, Machine
from llfsm_verify.language.trees import nodes
from llfsm_verify.language.typed import Assign, AtState, Query, Read, Variable

_QUERIES = {"running": "is_running", "suspended": "is_suspended", "done": "done"}


def whiteboard_uses(machine: Machine) -> tuple[frozenset[str], frozenset[str]]:
    """The names of the whiteboard variables that `machine` reads, and of those that it writes."""
    reads: set[str] = set()
    writes: set[str] = set()
    set_only: set[int] = set()
    for node in nodes(_text(machine)):  # an assignment comes before its target
        if isinstance(node, Assign) and isinstance(node.target, Read):
            _note(node.target.variable, writes)
            if node.op is None:
                set_only.add(id(node.target))
        elif isinstance(node, Read) and id(node) not in set_only:
            _note(node.variable, reads)
    return frozenset(reads), frozenset(writes)


def watched(machine: Machine, arrangement: Arrangement) -> dict[str, tuple[str, ...]]:
    """The machines whose control `machine` reads, each with what is asked of it: ``@STATE``, ``is_suspended``."""
    found: dict[str, dict[str, None]] = {}
    for node in nodes(_text(machine)):
        if isinstance(node, AtState):
            state = "__suspend" if node.state < 0 else arrangement.machine(node.machine).states[node.state].name
            found.setdefault(node.machine, {})[f"@{state}"] = None
        elif isinstance(node, Query):
            found.setdefault(node.machine, {})[_QUERIES[node.kind]] = None
    return {name: tuple(asked) for name, asked in found.items()}


def commanded(machine: Machine) -> dict[str, tuple[str, ...]]:
    """The machines to which `machine` gives commands, each with their kinds."""
    found: dict[str, dict[str, None]] = {}
    for command in machine.commands():
        found.setdefault(command.machine, {})[command.kind] = None
    return {name: tuple(kinds) for name, kinds in found.items()}


def _text(machine: Machine) -> tuple[object, ...]:
    guards = tuple(t.guard for state in machine.states for t in state.transitions)
    actions = tuple(getattr(state, kind) for state in machine.states for kind in ACTION_KINDS)
    return (guards, actions)


def _note(variable: Variable, names: set[str]) -> None:
    if variable.scope == "whiteboard":
        names.add(variable.name)

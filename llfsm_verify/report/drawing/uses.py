"""Which whiteboard variables a machine's guards and actions read and write."""

from __future__ import annotations

from llfsm_verify.arrangement.model import ACTION_KINDS, Machine
from llfsm_verify.language.trees import nodes
from llfsm_verify.language.typed import Assign, Read, Variable


def whiteboard_uses(machine: Machine) -> tuple[frozenset[str], frozenset[str]]:
    """The names of the whiteboard variables that `machine` reads, and of those that it writes."""
    reads: set[str] = set()
    writes: set[str] = set()
    set_only: set[int] = set()
    guards = tuple(t.guard for state in machine.states for t in state.transitions)
    actions = tuple(getattr(state, kind) for state in machine.states for kind in ACTION_KINDS)
    for node in nodes((guards, actions)):  # an assignment comes before its target
        if isinstance(node, Assign) and isinstance(node.target, Read):
            _note(node.target.variable, writes)
            if node.op is None:
                set_only.add(id(node.target))
        elif isinstance(node, Read) and id(node) not in set_only:
            _note(node.variable, reads)
    return frozenset(reads), frozenset(writes)


def _note(variable: Variable, names: set[str]) -> None:
    if variable.scope == "whiteboard":
        names.add(variable.name)

"""Which whiteboard variables a machine's guards and actions read and write."""

from __future__ import annotations

from dataclasses import fields, is_dataclass

from llfsm_verify.arrangement.model import ACTION_KINDS, Machine
from llfsm_verify.diagnostics import Span
from llfsm_verify.language.typed import Assign, Read, Variable


def whiteboard_uses(machine: Machine) -> tuple[frozenset[str], frozenset[str]]:
    """The names of the whiteboard variables that `machine` reads, and of those that it writes."""
    reads: set[str] = set()
    writes: set[str] = set()
    pending: list[object] = [t.guard for state in machine.states for t in state.transitions]
    pending += [getattr(state, kind) for state in machine.states for kind in ACTION_KINDS]
    while pending:
        node = pending.pop()
        if isinstance(node, tuple):
            pending += node
        elif isinstance(node, Assign) and isinstance(node.target, Read):
            _note(node.target.variable, writes)
            if node.op is not None:
                _note(node.target.variable, reads)
            pending += [node.target.path, node.value]
        elif isinstance(node, Read):
            _note(node.variable, reads)
            pending.append(node.path)
        elif is_dataclass(node) and not isinstance(node, (Span, Variable)):
            pending += [getattr(node, f.name) for f in fields(node)]
    return frozenset(reads), frozenset(writes)


def _note(variable: Variable, names: set[str]) -> None:
    if variable.scope == "whiteboard":
        names.add(variable.name)

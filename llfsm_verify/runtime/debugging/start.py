"""Where a debugger begins: at the beginning of a run, or where an earlier run stood that goes on."""

from __future__ import annotations

from dataclasses import dataclass

from llfsm_verify.backends.native.layout import Layout
from llfsm_verify.checking.replay.confirm import Letter, Schedule, first_letter
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.kripke.observing import atoms_at
from llfsm_verify.program.program import Expr, Get, Local
from llfsm_verify.program.trees import nodes


@dataclass(frozen=True, slots=True)
class Stood:
    """The last frame of an earlier run: its number, and the record in it with its layout."""

    frame: int
    layout: Layout
    record: bytes


@dataclass(frozen=True, slots=True)
class Start:
    """The configuration in which a debugger begins."""

    free: tuple[tuple[str, int], ...] = ()
    """Of the beginning of a run: the values of inputs that never change."""
    stood: Stood | None = None

    def record(self, execution: Execution) -> bytes:
        """It, for a program of the arrangement."""
        first = execution.start(self.free)
        if self.stood is None:
            return first
        return self.stood.layout.relaid(self.stood.record, execution.layout, first)

    def letter(self, execution: Execution) -> Letter | None:
        """The atoms that hold there. None: where an earlier run stood, one of them asks for more than a configuration
        tells, such as an input. Raises AtomOverflow."""
        if self.stood is None:
            return first_letter(execution, Schedule(self.free, (), None))
        atoms = execution.program.atoms
        stored = {variable.name for variable in execution.program.vars if not variable.output}
        if not all(_tells(node, stored) for atom in atoms for node in nodes(atom.expression)):
            return None
        values = execution.layout.decode(self.record(execution))
        return frozenset(name for name, holds in atoms_at(atoms, values, {}).items() if holds)


def _tells(node: Expr, stored: set[str]) -> bool:
    return not isinstance(node, Local) and not (isinstance(node, Get) and node.var not in stored)

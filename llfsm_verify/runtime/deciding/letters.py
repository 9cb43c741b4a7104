"""Letters from the values of slots: what is true of states, variables and inputs at one moment."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping

from llfsm_verify.backends.reference import evaluate
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.replay.confirm import Letter
from llfsm_verify.diagnostics import Span
from llfsm_verify.kripke.observing import atoms_at
from llfsm_verify.logic.bounds import TICK
from llfsm_verify.program.program import Choice, Const, Expr, Get, Let, Local, Program, Set
from llfsm_verify.program.trees import distinct_nodes, spelt_out, statements
from llfsm_verify.runtime.live.slots import stored
from llfsm_verify.semantics.vocabulary import FIRST, KNOWN
from llfsm_verify.values import Value

INPUT = "input:"
EDGE, BEFORE = "$edge.", "$before."
"""The hidden variables by which `rose`, `fell` and `changed` compare a letter with the one before."""


class SlotLetters:
    """Makes the letters of a problem from the numbers of its slots."""

    def __init__(self, problem: Problem, program: Program) -> None:
        self._scalars = {
            choice.name: (var.name, None if var.length is None else number, choice)
            for _, var, number, choice in stored(program)
        }
        self.slots: dict[str, Choice] = {name: choice for name, (_, _, choice) in self._scalars.items()}
        """What can be known: inputs, variables and their elements, and the states of machines."""
        for choice in program.choices:
            if choice.input:
                self.slots.setdefault(choice.input, choice)
        self._atoms = [atom for atom in program.atoms if atom.name != TICK]
        self.timed = any(atom.name == TICK for atom in program.atoms)
        """Whether letters say when time passes."""
        self._lengths = {var.name: var.length for var in program.vars}
        names = {(variable, at): name for name, (variable, at, _) in self._scalars.items()}
        needed = {atom.name: _needed(atom.expression, names, self._lengths) for atom in self._atoms}
        self.needed = {name: tuple(dict.fromkeys(slots)) for name, slots in needed.items()}
        """The slots that each atom reads; what is no slot has the name that the step program gives it."""
        changed = (s for s in statements(program.letter) if isinstance(s, Set) and s.var.startswith((EDGE, BEFORE)))
        known: dict[str, Expr] = {}
        for s in statements(program.letter):
            if isinstance(s, Let) and s.local.name.startswith(KNOWN):
                known[s.local.name] = spelt_out(s.value, known)
        self._edges = [(s.var, spelt_out(s.value, known)) for s in changed]
        """How this letter differs from the one before, and what is kept of it for the next one, in this order."""
        self._edge_needs: dict[str, list[str]] = {}
        kept: list[str] = []
        for hidden, value in self._edges:  # what is kept for the next letter follows the edge that is about it
            if hidden.startswith(EDGE):
                kept = self._edge_needs[hidden] = []
            kept += (n for n in _needed(value, names, self._lengths) if not n.startswith((EDGE, BEFORE, FIRST)))
        self._lines = (*problem.properties, *problem.assumptions)

    def place(self, atom: str) -> Span | None:
        """Where the properties have an atom."""
        found = next((line.atoms[atom] for line in self._lines if atom in line.atoms), None)
        return None if found is None else found.span(0, len(found.text))

    def through_edges(self, needed: Collection[str]) -> tuple[str, ...]:
        """The slots that are read where letters follow each other without a gap: `rose(x)` then needs `x` alone."""
        return tuple(dict.fromkeys(n for name in needed for n in self._edge_needs.get(name, (name,))))

    def letter(self, numbers: Mapping[str, int], *, ticks: bool, before: dict[str, int] | None = None) -> Letter:
        """The letter where the slots have these numbers; `ticks`: time passes after it. Raises AtomOverflow.

        `before`: what the letter before, if there is one, has left for this one; it becomes what this one leaves.
        """
        variables: dict[str, Value] = {}
        arrays: dict[str, list[int]] = {}
        inputs: dict[str, int] = {}
        for name, number in numbers.items():
            if name not in self._scalars:
                inputs[INPUT + name] = number
                continue
            variable, at, _ = self._scalars[name]
            if at is None:
                variables[variable] = number
            else:
                arrays.setdefault(variable, [0] * (self._lengths[variable] or 0))[at] = number
        for variable, values in arrays.items():
            variables[variable] = tuple(values)
        if before is not None and self._edges:
            first = not before
            variables |= {FIRST: int(first)} | {hidden: before.get(hidden, 0) for hidden, _ in self._edges}
            for hidden, value in self._edges:
                skipped = first and hidden.startswith(EDGE)
                number = 0 if skipped else evaluate(value, variables, inputs, shared=True)
                variables[hidden] = before[hidden] = number
        true = {name for name, holds in atoms_at(self._atoms, variables, inputs).items() if holds}
        return frozenset(true | {TICK}) if ticks and self.timed else frozenset(true)


def _needed(
    expression: Expr, slots: Mapping[tuple[str, int | None], str], lengths: Mapping[str, int | None]
) -> Iterator[str]:
    for node in distinct_nodes(expression):
        if isinstance(node, Local) and node.name.startswith(INPUT):
            yield node.name[len(INPUT) :]
        elif isinstance(node, Local):
            yield node.name
        elif isinstance(node, Get):
            for at in _positions(node.index, lengths.get(node.var)):
                yield slots.get((node.var, at), node.var)


def _positions(index: Expr | None, length: int | None) -> Collection[int | None]:
    """The element of an array; all of them where only the run tells which."""
    if index is None:
        return (None,)
    return (index.value,) if isinstance(index, Const) else tuple(range(length or 0))

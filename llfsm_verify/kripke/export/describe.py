"""A structure piece by piece, as the text formats write it: edges with their letters and how each is taken."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from llfsm_verify.kripke.steps import Step, Steps
from llfsm_verify.kripke.structure import Structure
from llfsm_verify.kripke.values import Shown

STEPS_UPTO = 100_000
"""In structures of more configurations the edges do not say how they are taken: finding that out takes a while."""


@dataclass(frozen=True, slots=True)
class Edge:
    """One edge: `letter` names the propositions that hold after it, `steps` the ways to take it (none: not known)."""

    source: int
    target: int
    letter: tuple[str, ...]
    steps: tuple[Step, ...]


def edges(structure: Structure) -> Iterator[Edge]:
    """All edges in the order of their sources."""
    known = structure.program.observe == "ringlet" and len(structure) <= STEPS_UPTO
    steps = Steps(structure) if known else None
    letters = [tuple(n for n, x in zip(structure.propositions, row, strict=True) if x) for row in structure.alphabet]
    for source in range(structure.expanded):
        ways = {} if steps is None else steps.of(source)
        for number in range(int(structure.indptr[source]), int(structure.indptr[source + 1])):
            target = int(structure.targets[number])
            yield Edge(source, target, letters[structure.labels[number]], ways.get(number, ()))


def initial_letters(structure: Structure) -> dict[int, tuple[str, ...]]:
    """By initial configuration: the atoms that hold in c0."""
    rows = zip(structure.roots, structure.first, strict=True)
    return {int(r): tuple(n for n, x in zip(structure.atoms, row, strict=True) if x) for r, row in rows}


def text(value: Shown) -> str:
    """A value as properties write it."""
    return str(value).lower() if isinstance(value, bool) else str(value)

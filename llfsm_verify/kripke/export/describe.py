"""The edges of a structure as the text formats write them, in portions: letters, and how each is taken."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from time import monotonic

from llfsm_verify.kripke.export.rows import portions
from llfsm_verify.kripke.steps import Step, Steps
from llfsm_verify.kripke.structure import Structure

STEPS_UPTO = 100_000
"""In structures of more configurations the edges do not say how they are taken: finding that out takes a while."""
SECONDS = 0.1
"""How long steps are found out before they are written."""


@dataclass(frozen=True, slots=True)
class Edges:
    """Some edges, a list item each: configurations, the row of the alphabet, the ways to take it (None: not known)."""

    sources: list[int]
    targets: list[int]
    labels: list[int]
    steps: list[tuple[Step, ...]] | None


def steps_known(structure: Structure) -> bool:
    """Edges say how they are taken."""
    return structure.program.observe == "ringlet" and len(structure) <= STEPS_UPTO


def edges(structure: Structure) -> Iterator[Edges]:
    """All edges in the order of their sources, in portions that are made in a moment each."""
    if steps_known(structure):
        yield from _with_steps(structure)
        return
    import numpy as np

    s = structure
    for start, end in portions(0, len(s.targets)):
        sources = s.indptr.searchsorted(np.arange(start, end), side="right") - 1
        yield Edges(sources.tolist(), s.targets[start:end].tolist(), s.labels[start:end].tolist(), None)


def _with_steps(structure: Structure) -> Iterator[Edges]:
    steps, s = Steps(structure), structure
    sources, targets, labels = list[int](), list[int](), list[int]()
    taken = list[tuple[Step, ...]]()
    began = monotonic()
    for source in range(s.expanded):
        start, end = int(s.indptr[source]), int(s.indptr[source + 1])
        ways = steps.of(source)
        sources += [source] * (end - start)
        targets += s.targets[start:end].tolist()
        labels += s.labels[start:end].tolist()
        taken += [ways.get(number, ()) for number in range(start, end)]
        if monotonic() - began > SECONDS:
            yield Edges(sources, targets, labels, taken)
            sources, targets, labels, taken = [], [], [], []
            began = monotonic()
    if sources:
        yield Edges(sources, targets, labels, taken)


def letters(structure: Structure) -> list[tuple[str, ...]]:
    """The propositions that hold in each letter of the alphabet."""
    return [tuple(n for n, x in zip(structure.propositions, row, strict=True) if x) for row in structure.alphabet]


def initial_letters(structure: Structure, start: int, end: int) -> dict[int, tuple[str, ...]]:
    """The atoms that hold in c0, by initial configuration; of those numbered start … end - 1."""
    first, last = structure.roots.searchsorted([start, end])
    rows = zip(structure.roots[first:last].tolist(), structure.first[first:last], strict=True)
    return {root: tuple(n for n, x in zip(structure.atoms, row, strict=True) if x) for root, row in rows}


def ways(steps: tuple[Step, ...]) -> str:
    """How an edge is taken, in a line."""
    return " or ".join(map(str, steps))

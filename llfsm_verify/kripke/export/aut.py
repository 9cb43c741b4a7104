"""Kripke structures as labelled transition systems in CADP's `.aut` format (Aldébaran)."""

from __future__ import annotations

from collections.abc import Iterator

from llfsm_verify.kripke.export.describe import edges, initial_letters
from llfsm_verify.kripke.structure import Structure

CUT = "CUT SHORT"
"""The label of a step from a configuration whose own steps are missing."""


def aut(structure: Structure) -> Iterator[str]:
    """The lines of the file: ``des (initial, transitions, states)`` and the transitions.

    With atoms a label is the letter after the step, such as ``{ns@GREEN, car}``; without, it says how the step is
    taken. Several initial configurations get a start state in front, whose transitions are labelled ``start``. What
    was not expanded leads to a state of its own with the label `CUT`.
    """
    roots = initial_letters(structure)
    states, initial = len(structure), next(iter(roots), 0)
    several = len(roots) > 1
    missing = range(structure.expanded, states)
    number = len(structure.targets) + (len(roots) if several else 0) + len(missing)
    if several:
        initial, states = states, states + 1
    cut = states
    if missing:
        states += 1
    yield f"des ({initial}, {number}, {states})"
    if several:
        for root, letter in roots.items():
            yield f"({initial}, {_quoted(f'start {_letter(letter)}' if structure.atoms else 'start')}, {root})"
    atoms = frozenset(structure.atoms)
    for edge in edges(structure):
        label = _letter(tuple(n for n in edge.letter if n in atoms)) if atoms else " or ".join(map(str, edge.steps))
        yield f"({edge.source}, {_quoted(label or 'step')}, {edge.target})"
    for node in missing:
        yield f"({node}, {_quoted(CUT)}, {cut})"


def _letter(names: tuple[str, ...]) -> str:
    return f"{{{', '.join(names)}}}"


def _quoted(label: str) -> str:
    """A label in quotes; the format has no escape for quotes inside."""
    return '"' + label.replace('"', "'") + '"'

"""Kripke structures as labelled transition systems in CADP's `.aut` format (Aldébaran)."""

from __future__ import annotations

from collections.abc import Iterator

from llfsm_verify import Structure
from llfsm_verify.plug import edges, initial_letters, letters, portions, ways

CUT = "CUT SHORT"
"""The label of a step from a configuration whose own steps are missing."""


def aut(structure: Structure) -> Iterator[str]:
    """The text, in portions of whole lines: ``des (initial, transitions, states)`` and the transitions.

    With atoms a label is the letter after the step, such as ``{ns@GREEN, car}``; without, it says how the step is
    taken. Several initial configurations get a start state in front, whose transitions are labelled ``start``. What
    was not expanded leads to a state of its own with the label `CUT`.
    """
    roots, states, atoms = len(structure.roots), len(structure), structure.atoms
    initial = int(structure.roots[0]) if roots else 0
    missing = states - structure.expanded
    number = len(structure.targets) + (roots if roots > 1 else 0) + missing
    if roots > 1:
        initial, states = states, states + 1
    cut = states
    if missing:
        states += 1
    yield f"des ({initial}, {number}, {states})\n"
    if roots > 1:
        for start, end in portions(0, len(structure)):
            first = initial_letters(structure, start, end)
            labels = {root: _quoted(f"start {_letter(x)}" if atoms else "start") for root, x in first.items()}
            yield "".join(f"({initial}, {label}, {root})\n" for root, label in labels.items())
    known = set(atoms)
    shown = [_quoted(_letter(tuple(n for n in x if n in known)) if atoms else "step") for x in letters(structure)]
    for some in edges(structure):
        of = [shown[label] for label in some.labels]
        if some.steps is not None and not atoms:
            of = [_quoted(ways(steps) or "step") for steps in some.steps]
        rows = zip(some.sources, of, some.targets, strict=True)
        yield "".join([f"({source}, {label}, {target})\n" for source, label, target in rows])
    for start, end in portions(structure.expanded, len(structure)):
        yield "".join(f"({node}, {_quoted(CUT)}, {cut})\n" for node in range(start, end))


def _letter(names: tuple[str, ...]) -> str:
    return f"{{{', '.join(names)}}}"


def _quoted(label: str) -> str:
    """A label in quotes; the format has no escape for quotes inside."""
    return '"' + label.replace('"', "'") + '"'

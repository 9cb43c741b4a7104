"""Kripke structures as JSON, a line for each configuration and edge."""

from __future__ import annotations

import json as encoder
from collections.abc import Iterable, Iterator

from llfsm_verify.kripke.export.describe import Edge, edges, initial_letters
from llfsm_verify.kripke.structure import Structure

VERSION = 1


def json(structure: Structure) -> Iterator[str]:
    """The lines of one JSON object (docs/kripke.md describes its members)."""
    atoms = structure.atoms
    head: dict[str, object] = {
        "version": VERSION,
        "arrangement": structure.name,
        "complete": structure.complete,
        "stopped": structure.stopped,
        "observe": structure.program.observe,
        "atoms": atoms,
        "fairness": [{"name": f.name, "premise": f.premise, "goal": f.goal} for f in structure.program.fairness],
        "faults": [
            {"code": f.code, "message": f.message, "place": f.place, "configuration": f.configuration}
            for f in structure.faults
        ],
    }
    yield "{"
    for key, value in head.items():
        yield f"  {_encoded(key)}: {_encoded(value)},"
    yield '  "configurations": ['
    yield from _rows(_configurations(structure))
    yield "  ],"
    yield '  "edges": ['
    yield from _rows(_edge(edge) for edge in edges(structure))
    yield "  ]"
    yield "}"


def _configurations(structure: Structure) -> Iterator[dict[str, object]]:
    roots = initial_letters(structure)
    for node in range(len(structure)):
        row: dict[str, object] = {"id": node, "values": structure.values(node)}
        if node in roots:
            row |= {"initial": True, "letter": roots[node]}
        if node >= structure.expanded:
            row["expanded"] = False
        yield row


def _edge(edge: Edge) -> dict[str, object]:
    row: dict[str, object] = {"source": edge.source, "target": edge.target, "letter": edge.letter}
    if edge.steps:
        row["steps"] = [
            {"machine": s.machine, "state": s.state, "fired": s.fired, "inputs": dict(s.inputs)} for s in edge.steps
        ]
    return row


def _rows(rows: Iterable[dict[str, object]]) -> Iterator[str]:
    """One row a line, parted by commas."""
    before = None
    for row in rows:
        if before is not None:
            yield f"    {before},"
        before = _encoded(row)
    if before is not None:
        yield f"    {before}"


def _encoded(value: object) -> str:
    return encoder.dumps(value, ensure_ascii=False)

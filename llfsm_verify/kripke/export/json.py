"""Kripke structures as JSON, a line for each configuration and edge."""

from __future__ import annotations

import json as encoder
from collections.abc import Callable, Iterable, Iterator
from functools import partial

from llfsm_verify.kripke.export.rows import Edges, RowWriter, edges, elements, initial_letters, letters, portions
from llfsm_verify.kripke.steps import Step
from llfsm_verify.kripke.structure import Structure
from llfsm_verify.values import Shown

VERSION = 1


def json(structure: Structure) -> Iterator[str]:
    """The text of one JSON object (docs/kripke.md describes its members), in portions of whole lines."""
    head: dict[str, object] = {
        "version": VERSION,
        "arrangement": structure.name,
        "complete": structure.complete,
        "stopped": structure.stopped,
        "observe": structure.program.observe,
        "atoms": structure.atoms,
        "fairness": [{"name": f.name, "premise": f.premise, "goal": f.goal} for f in structure.program.fairness],
        "faults": [
            {"code": f.code, "message": f.message, "place": f.place, "configuration": f.configuration}
            for f in structure.faults
        ],
    }
    yield "{\n" + "".join(f"  {_encoded(key)}: {_encoded(value)},\n" for key, value in head.items())
    yield '  "configurations": [\n'
    yield from _parted(_configurations(structure))
    yield '  ],\n  "edges": [\n'
    shown = [_encoded(letter) for letter in letters(structure)]
    yield from _parted(_edges(some, shown) for some in edges(structure))
    yield "  ]\n}\n"


def _configurations(structure: Structure) -> Iterator[list[str]]:
    rows = RowWriter(structure, [(e, partial(_value, name)) for name, e in elements(structure).items()], ", ")
    for start, end in portions(0, len(structure)):
        roots = initial_letters(structure, start, end)
        texts = rows.of(start, end)
        if not roots and end <= structure.expanded:
            yield [f'    {{"id": {node}, "values": {{{values}}}}}' for node, values in enumerate(texts, start)]
            continue
        lines = []
        for node, values in enumerate(texts, start):
            more = f', "initial": true, "letter": {_encoded(roots[node])}' if node in roots else ""
            more += "" if node < structure.expanded else ', "expanded": false'
            lines.append(f'    {{"id": {node}, "values": {{{values}}}{more}}}')
        yield lines


def _edges(some: Edges, shown: list[str]) -> list[str]:
    begun = [
        f'    {{"source": {source}, "target": {target}, "letter": {shown[label]}'
        for source, target, label in zip(some.sources, some.targets, some.labels, strict=True)
    ]
    if some.steps is None:
        return [f"{line}}}" for line in begun]
    return [
        f'{line}, "steps": {_encoded([_step(s) for s in steps])}}}' if steps else f"{line}}}"
        for line, steps in zip(begun, some.steps, strict=True)
    ]


def _step(step: Step) -> dict[str, object]:
    taken: dict[str, object] = {"machine": step.machine, "state": step.state, "fired": step.fired}
    taken["inputs"] = dict(step.inputs)
    return taken | {"labels": step.labels} if step.labels else taken


def _value(name: str, value: Shown) -> str:
    return f"{_encoded(name)}: {_encoded(value)}"


def _parted(portions_of_lines: Iterable[list[str]]) -> Iterator[str]:
    """The lines, parted by commas."""
    first = True
    for lines in portions_of_lines:
        yield ("" if first else ",\n") + ",\n".join(lines)
        first = False
    if not first:
        yield "\n"


_encoded: Callable[[object], str] = encoder.JSONEncoder(ensure_ascii=False, default=float).encode

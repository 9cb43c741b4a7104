"""Kripke structures as drawings in Graphviz's DOT language."""

from __future__ import annotations

from collections.abc import Iterator

from llfsm_verify.kripke.export.describe import Edge, edges, initial_letters, text
from llfsm_verify.kripke.structure import Structure

READABLE = 300
"""Configurations that a drawing can still show."""


def dot(structure: Structure) -> Iterator[str]:
    """The lines of a `digraph`. A node shows the states of the machines and the variables that are no control
    variables; an edge shows how it is taken and, after a bar, which atoms hold then. What was not expanded is dashed.
    """
    yield f"digraph {_quoted(structure.name)} {{"
    yield "  graph [rankdir=TB fontname=Helvetica];"
    yield "  node [shape=box style=rounded fontname=Helvetica fontsize=10];"
    yield "  edge [fontname=Helvetica fontsize=9];"
    for node in range(len(structure)):
        dashed = "" if node < structure.expanded else ' style="rounded,dashed"'
        yield f"  c{node} [label={_quoted(_configuration(structure, node))}{dashed}];"
    for root, letter in initial_letters(structure).items():
        yield f"  s{root} [shape=point label={_quoted('')}];"
        yield f"  s{root} -> c{root} [label={_quoted(_letter(structure, letter))}];"
    for edge in edges(structure):
        yield f"  c{edge.source} -> c{edge.target} [label={_quoted(_edge(structure, edge))}];"
    if not structure.complete:
        yield f"  cut [shape=note label={_quoted(f'cut short: {structure.stopped}')}];"
    yield "}"


def _configuration(structure: Structure, node: int) -> str:
    program, values = structure.program, structure.values(node)
    states = [f"{program.machines[s.machine].name}@{values[s.state]}" for s in program.slots]
    own = [f"{name} = {text(value)}" for name, value in values.items() if "$" not in name]
    return "\n".join([f"{node}: {', '.join(states)}", *own])


def _edge(structure: Structure, edge: Edge) -> str:
    ways = "\n".join(str(step) for step in edge.steps)
    return " | ".join(part for part in (ways, _letter(structure, edge.letter)) if part)


def _letter(structure: Structure, letter: tuple[str, ...]) -> str:
    shown = [name for name in letter if name in structure.atoms]
    return ", ".join(shown) or ("none" if structure.atoms else "")


def _quoted(label: str) -> str:
    escaped = label.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'

"""Kripke structures as drawings in Graphviz's DOT language."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from llfsm_verify import Structure
from llfsm_verify.plug import RowWriter, Shown, Step, edges, elements, initial_letters, letters, portions, text

DASHED = ' style="rounded,dashed"'


def dot(structure: Structure) -> Iterator[str]:
    """The text of a `digraph`, in portions of whole lines. A node shows the states of the machines and the variables
    that are no control variables; an edge shows how it is taken and, after a bar, which atoms hold then. What was not
    expanded is dashed.
    """
    yield f"digraph {_quoted(structure.name)} {{\n"
    yield "  graph [rankdir=TB fontname=Helvetica];\n"
    yield "  node [shape=box style=rounded fontname=Helvetica fontsize=10];\n"
    yield "  edge [fontname=Helvetica fontsize=9];\n"
    yield from _configurations(structure)
    for start, end in portions(0, len(structure)):
        first = {
            root: _quoted(_letter(structure, letter)) for root, letter in initial_letters(structure, start, end).items()
        }
        yield "".join(
            f'  s{root} [shape=point label=""];\n  s{root} -> c{root} [label={letter}];\n'
            for root, letter in first.items()
        )
    shown = [_letter(structure, letter) for letter in letters(structure)]
    for some in edges(structure):
        labels = [_quoted(shown[label]) for label in some.labels]
        if some.steps is not None:
            labels = [_quoted(_edge(steps, shown[label])) for steps, label in zip(some.steps, some.labels, strict=True)]
        rows = zip(some.sources, some.targets, labels, strict=True)
        yield "".join([f"  c{source} -> c{target} [label={label}];\n" for source, target, label in rows])
    if not structure.complete:
        yield f"  cut [shape=note label={_quoted(f'cut short: {structure.stopped}')}];\n"
    yield "}\n"


def _configurations(structure: Structure) -> Iterator[str]:
    program, found = structure.program, elements(structure)
    at = [(found[s.state], partial(_state, program.machines[s.machine].name)) for s in program.slots]
    own = [(e, partial(_variable, name)) for name, e in found.items() if "$" not in name]
    states, variables = RowWriter(structure, at, ", "), RowWriter(structure, own, "")
    for start, end in portions(0, len(structure)):
        yield "".join(
            f'  c{node} [label="{node}: {state}{values}"{"" if node < structure.expanded else DASHED}];\n'
            for node, (state, values) in enumerate(
                zip(states.of(start, end), variables.of(start, end), strict=True), start
            )
        )


def _state(machine: str, value: Shown) -> str:
    return _escaped(f"{machine}@{value}")


def _variable(name: str, value: Shown) -> str:
    return _escaped(f"\n{name} = {text(value)}")


def _edge(steps: tuple[Step, ...], letter: str) -> str:
    return " | ".join(part for part in ("\n".join(map(str, steps)), letter) if part)


def _letter(structure: Structure, letter: tuple[str, ...]) -> str:
    shown = [name for name in letter if name in structure.atoms]
    return ", ".join(shown) or ("none" if structure.atoms else "")


def _quoted(label: str) -> str:
    return f'"{_escaped(label)}"'


def _escaped(label: str) -> str:
    return label.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")

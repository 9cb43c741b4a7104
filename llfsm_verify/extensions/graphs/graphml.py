"""Kripke structures as GraphML (Brandes et al., 2001), an element a line."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from xml.sax.saxutils import escape, quoteattr

from llfsm_verify import Structure
from llfsm_verify.plug import (
    BOOL,
    Element,
    Int,
    RowWriter,
    Shown,
    edges,
    elements,
    initial_letters,
    letters,
    portions,
    steps_known,
    text,
    ways,
)

HEAD = """<?xml version="1.0" encoding="UTF-8"?>
<graphml xmlns="http://graphml.graphdrawing.org/xmlns" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" \
xsi:schemaLocation="http://graphml.graphdrawing.org/xmlns http://graphml.graphdrawing.org/xmlns/1.0/graphml.xsd">
"""


def graphml(structure: Structure) -> Iterator[str]:
    """The text, in portions of whole lines. Nodes carry the values of the variables, `initial` and `expanded`; edges
    carry `steps` (where they are known) and, for each atom and fairness condition, whether it holds after the step. In
    c0 the atoms are the nodes' attributes ``c0:ATOM``.
    """
    keys = _Keys()
    whole = [
        keys.data("graph", "name", "string")(structure.name),
        keys.data("graph", "complete", "boolean")(structure.complete),
        keys.data("graph", "stopped", "string")(structure.stopped or ""),
    ]
    columns = [(e, keys.data("node", name, _type(e))) for name, e in elements(structure).items()]
    initial, expanded = keys.data("node", "initial", "boolean"), keys.data("node", "expanded", "boolean")
    first = {name: keys.data("node", f"c0:{name}", "boolean") for name in structure.atoms}
    propositions = {name: keys.data("edge", name, "boolean") for name in structure.propositions}
    steps = keys.data("edge", "steps", "string") if steps_known(structure) else None
    yield f'{HEAD}{"".join(keys.lines)}<graph edgedefault="directed">\n{"".join(whole)}\n'

    rows = RowWriter(structure, columns, "")
    plain = initial(False) + expanded(True)
    for start, end in portions(0, len(structure)):
        roots = initial_letters(structure, start, end)
        texts = rows.of(start, end)
        if roots or end > structure.expanded:
            for node in range(start, end):
                letter = "".join(data(name in roots[node]) for name, data in first.items()) if node in roots else ""
                texts[node - start] += initial(node in roots) + expanded(node < structure.expanded) + letter
        else:
            texts = [values + plain for values in texts]
        yield "".join([f'<node id="{node}">{values}</node>\n' for node, values in enumerate(texts, start)])

    alphabet = map(frozenset, letters(structure))
    shown = ["".join(data(name in letter) for name, data in propositions.items()) for letter in alphabet]
    for some in edges(structure):
        of = [shown[label] for label in some.labels]
        if steps is not None and some.steps is not None:
            of = [letter + steps(ways(taken)) for letter, taken in zip(of, some.steps, strict=True)]
        rows_of = zip(some.sources, some.targets, of, strict=True)
        yield "".join([f'<edge source="{a}" target="{b}">{values}</edge>\n' for a, b, values in rows_of])
    yield "</graph>\n</graphml>\n"


class _Keys:
    """Declares the attributes: `lines` is what stands above the graph."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def data(self, owner: str, name: str, kind: str) -> Callable[[Shown], str]:
        """Declare an attribute; the function that writes a value of it."""
        number = len(self.lines)
        kinds = f'attr.name={quoteattr(name)} attr.type="{kind}"'
        self.lines.append(f'<key id="d{number}" for="{owner}" {kinds}/>\n')
        return partial(_data, f'<data key="d{number}">')


def _data(begin: str, value: Shown) -> str:
    return f"{begin}{escape(text(value))}</data>"


def _type(element: Element) -> str:
    """What GraphML calls the values of an element: enumerators and states are their names."""
    variable = element.variable
    if variable.type == BOOL:
        return "boolean"
    if isinstance(variable.type, Int) and variable.type.digits:
        return "double"
    return "string" if variable.origin.labels else "long"

"""Kripke structures as GraphML, by networkx's writer."""

from __future__ import annotations

from io import BytesIO

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.kripke.export.describe import edges, initial_letters
from llfsm_verify.kripke.structure import Structure


def graphml(structure: Structure) -> bytes:
    """The file. Nodes carry the values of the variables, `initial` and `expanded`; edges carry `steps` and, for each
    atom and fairness condition, whether it holds after the step. In c0 the atoms are the nodes' attributes ``c0:ATOM``.

    Raises DiagnosticError (E423) without the package networkx.
    """
    try:
        import networkx as nx
    except ImportError:
        message = "GraphML needs the package networkx, which is not installed"
        raise DiagnosticError(Diagnostic("E423", message, hint="pip install networkx")) from None
    graph: nx.MultiDiGraph[int] = nx.MultiDiGraph(
        name=structure.name, complete=structure.complete, stopped=structure.stopped or ""
    )
    roots = initial_letters(structure)
    for node in range(len(structure)):
        first = {f"c0:{name}": name in roots[node] for name in structure.atoms} if node in roots else {}
        more = {"initial": node in roots, "expanded": node < structure.expanded}
        graph.add_node(node, **{**structure.values(node), **more, **first})
    for edge in edges(structure):
        letter = {name: name in edge.letter for name in structure.propositions}
        graph.add_edge(edge.source, edge.target, **{**letter, "steps": " or ".join(map(str, edge.steps))})
    file = BytesIO()
    nx.write_graphml_xml(graph, file)
    return file.getvalue()

"""Graphs in the DOT language of Graphviz."""

from __future__ import annotations

from llfsm_verify.report.drawing.graph import Edge, Graph, Node

_NODE_STYLES = {
    "initial": "shape=point width=0.15",
    "state": 'shape=box style="rounded"',
    "suspend": 'shape=box style="rounded,dashed"',
    "machine": 'shape=box style="filled" fillcolor="#e8eef7"',
    "input": 'shape=cds style="filled" fillcolor="#e6f4e6"',
    "output": 'shape=cds style="filled" fillcolor="#fbeedd"',
    "shared": 'shape=ellipse style="filled" fillcolor="#f2f2f2"',
    "note": "shape=note",
}
_EDGE_STYLES = {
    "transition": "",
    "start": "",
    "turn": "color=gray constraint=false arrowhead=open",
    "read": "style=dashed",
    "write": "",
}


def dot(graph: Graph) -> str:
    """The graph as a `digraph`, UTF-8."""
    lines = [
        f"digraph {_quoted(graph.title)} {{",
        f"  graph [label={_quoted(graph.title)} labelloc=t fontname=Helvetica rankdir={_direction(graph)}];",
        "  node [fontname=Helvetica fontsize=11];",
        "  edge [fontname=Helvetica fontsize=10];",
    ]
    groups = dict.fromkeys(node.group for node in graph.nodes)
    for number, group in enumerate(groups):
        inside = [_node(node) for node in graph.nodes if node.group == group]
        if group:
            lines += [f"  subgraph cluster_{number} {{", f"    label={_quoted(group)};"]
            lines += [f"  {line}" for line in inside]
            lines.append("  }")
        else:
            lines += inside
    lines += [_edge(edge) for edge in graph.edges]
    return "\n".join([*lines, "}"]) + "\n"


def _direction(graph: Graph) -> str:
    return "TB" if graph.kind == "machine" else "LR"


def _node(node: Node) -> str:
    style = _NODE_STYLES[node.kind]
    if node.kind == "initial":
        return f'  {node.key} [label="" {style}];'
    # \n centres the title's line, \l sets those below it to the left.
    label = _escaped(node.title) + "\\n" + "".join(_escaped(line) + "\\l" for line in node.lines)
    return f'  {node.key} [label="{label}" {style}];'


def _edge(edge: Edge) -> str:
    attributes = " ".join(filter(None, (f"label={_quoted(edge.label)}" if edge.label else "", _EDGE_STYLES[edge.kind])))
    return f"  {edge.source} -> {edge.target}" + (f" [{attributes}];" if attributes else ";")


def _escaped(text: str) -> str:
    return text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")


def _quoted(text: str) -> str:
    return f'"{_escaped(text)}"'

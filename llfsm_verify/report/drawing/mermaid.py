"""Graphs in Mermaid's text, which many documentation sites draw by themselves."""

from __future__ import annotations

from llfsm_verify.report.drawing.graph import Edge, Graph, Node

_SHAPES = {
    "initial": ("((", "))"),
    "state": ("(", ")"),
    "suspend": ("(", ")"),
    "machine": ("[", "]"),
    "input": ("[/", "/]"),
    "output": ("[/", "/]"),
    "shared": ("([", "])"),
    "note": ("[", "]"),
}
_ARROWS = {"transition": "-->", "start": "-->", "turn": "-.->", "read": "-.->", "write": "-->"}


def mermaid(graph: Graph) -> str:
    """The graph as a flowchart: Mermaid's own state diagrams have no place for the text of several actions."""
    lines = ["---", f"title: {_title(graph.title)}", "---", f"flowchart {'TB' if graph.kind == 'machine' else 'LR'}"]
    groups = dict.fromkeys(node.group for node in graph.nodes)
    for number, group in enumerate(groups):
        inside = [_node(node) for node in graph.nodes if node.group == group]
        if group:
            lines += [f'  subgraph g{number} ["{_escaped(group)}"]', *(f"  {line}" for line in inside), "  end"]
        else:
            lines += inside
    lines += [_edge(edge) for edge in graph.edges]
    dashed = [node.key for node in graph.nodes if node.kind == "suspend"]
    lines += [f"  style {key} stroke-dasharray: 5 5" for key in dashed]
    return "\n".join(lines) + "\n"


def _title(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _node(node: Node) -> str:
    opening, closing = _SHAPES[node.kind]
    title = f"<b>{_escaped(node.title)}</b>" if node.title else " "
    label = "<br/>".join([title, *map(_escaped, node.lines)])
    return f'  {node.key}{opening}"{label}"{closing}'


def _edge(edge: Edge) -> str:
    label = f'|"{_escaped(edge.label)}"|' if edge.label else ""
    return f"  {edge.source} {_ARROWS[edge.kind]}{label} {edge.target}"


def _escaped(text: str) -> str:
    """Mermaid's entities start with `#`; whatever could end a label or start markup becomes one."""
    return "".join(c if c.isalnum() or c in " _.,:=+-@!()/" else f"#{ord(c)};" for c in text)

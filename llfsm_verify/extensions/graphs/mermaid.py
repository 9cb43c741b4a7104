"""Graphs in Mermaid's text, which many documentation sites draw by themselves."""

from __future__ import annotations

from collections.abc import Iterator

from llfsm_verify.plug import DrawnEdge, DrawnNode, Graph, with_legend

_SHAPES = {
    "initial": ("((", "))"),
    "state": ("(", ")"),
    "suspend": ("(", ")"),
    "machine": ("[", "]"),
    "input": ("[/", "/]"),
    "output": ("[/", "/]"),
    "shared": ("([", "])"),
    "note": ("[", "]"),
    "sample": ("[", "]"),
    "caption": ("[", "]"),
}
_ARROWS = {
    "transition": "-->",
    "start": "-->",
    "turn": "-->",
    "read": "-.->",
    "write": "-->",
    "both": "<-->",
    "watch": "-.-o",
    "command": "==>",
    "taken": "==>",
    "untaken": "-->",
    "forever": "==>",
    "violating": "==>",
    "covered": "==>",
    "uncovered": "-.->",
    "unreachable": "-.-x",
    "unknown": "-->",
}
_EDGE_STYLES = {
    "turn": "stroke:#c0c0c0,stroke-width:1px",
    "untaken": "stroke:#a0a0a0,stroke-width:1px,color:#808080",
    "forever": "stroke:#1f4e9c,color:#1f4e9c",
    "violating": "stroke:#a02020,color:#a02020",
    "covered": "stroke:#1b6e3a,color:#1b6e3a",
    "uncovered": "stroke:#a02020,color:#a02020",
    "unreachable": "stroke:#606060,color:#606060",
    "unknown": "stroke:#7a4fa0,color:#7a4fa0",
}
_MARKS = {
    "visited": "stroke-width:3px",
    "unvisited": "stroke:#a0a0a0,color:#808080",
    "forever": "stroke:#1f4e9c,stroke-width:3px",
    "violating": "stroke:#a02020,stroke-width:4px",
    "uncovered": "stroke:#a02020,stroke-width:4px,stroke-dasharray:6 3",
    "unreachable": "stroke:#606060,color:#606060,stroke-dasharray:2 4",
    "unknown": "stroke:#7a4fa0,color:#7a4fa0",
}
_BARE = frozenset({"sample", "caption"})


def mermaid(graph: Graph) -> str:
    """The graph as a flowchart: Mermaid's own state diagrams have no place for the text of several actions."""
    graph = with_legend(graph)
    lines = ["---", f"title: {_title(graph.title)}", "---", f"flowchart {'TB' if graph.kind == 'machine' else 'LR'}"]
    return "\n".join([*lines, *_frames(graph), *map(_edge, graph.edges), *_styles(graph)]) + "\n"


def _frames(graph: Graph) -> Iterator[str]:
    """The nodes, those of a group in a frame."""
    for number, group in enumerate(dict.fromkeys(node.group for node in graph.nodes)):
        inside = [_node(node) for node in graph.nodes if node.group == group]
        if group:
            yield from (f'  subgraph g{number} ["{_escaped(group)}"]', *(f"  {line}" for line in inside), "  end")
        else:
            yield from inside


def _styles(graph: Graph) -> Iterator[str]:
    yield from (f"  style {node.key} stroke-dasharray: 5 5" for node in graph.nodes if node.kind == "suspend")
    yield from _class("bare", "fill:none,stroke:none", [n.key for n in graph.nodes if n.kind in _BARE])
    for mark, style in _MARKS.items():
        yield from _class(mark, style, [node.key for node in graph.nodes if node.mark == mark])
    for kind, style in _EDGE_STYLES.items():
        numbers = [str(number) for number, edge in enumerate(graph.edges) if edge.kind == kind]
        if numbers:
            yield f"  linkStyle {','.join(numbers)} {style}"


def _class(name: str, style: str, keys: list[str]) -> list[str]:
    return [f"  classDef {name} {style}", f"  class {','.join(keys)} {name}"] if keys else []


def _title(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _node(node: DrawnNode) -> str:
    opening, closing = _SHAPES[node.kind]
    name = _escaped(node.title) or " "
    title = f"<b>{name}</b>" if node.title and node.kind not in _BARE else name
    label = "<br/>".join([title, *map(_escaped, node.lines)])
    return f'  {node.key}{opening}"{label}"{closing}'


def _edge(edge: DrawnEdge) -> str:
    text = "<br/>".join(map(_escaped, edge.label.split("\n")))
    label = f'|"{text}"|' if edge.label else ""
    return f"  {edge.source} {_ARROWS[edge.kind]}{label} {edge.target}"


def _escaped(text: str) -> str:
    """Mermaid's entities start with `#`; whatever could end a label or start markup becomes one, as do spaces at the
    beginning, which would be dropped."""
    inner = text.lstrip(" ")
    return "#160;" * (len(text) - len(inner)) + "".join(
        c if c.isalnum() or c in " _.,:=+-@!()/" else f"#{ord(c)};" for c in inner
    )

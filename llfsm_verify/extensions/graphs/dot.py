"""Graphs in the DOT language of Graphviz."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape

from llfsm_verify.plug import LEGEND, Graph, explained, with_legend
from llfsm_verify.plug import DrawnEdge as Edge
from llfsm_verify.plug import DrawnNode as Node

_NODE_STYLES = {
    "initial": "shape=point width=0.15",
    "state": 'style="filled,rounded"',
    "suspend": 'style="filled,rounded,dashed"',
    "machine": 'style="filled" fillcolor="#e8eef7"',
    "input": 'shape=house orientation=270 style="filled" fillcolor="#e6f4e6" margin=0 width=0 height=0',
    "output": 'shape=house orientation=270 style="filled" fillcolor="#fbeedd" margin=0 width=0 height=0',
    "shared": 'shape=ellipse style="filled" fillcolor="#f2f2f2" margin=0.02 width=0 height=0',
    "note": "shape=note",
    "sample": "shape=none width=0.1 height=0.22",
    "caption": 'shape=none width=1.9 height=0.22 margin="0.06,0"',
}
_LINES: dict[str, tuple[int, str]] = {
    "taken": (2, "black"),
    "untaken": (1, "#909090"),
    "forever": (2, "#1f4e9c"),
    "violating": (3, "#a02020"),
    "covered": (2, "#1b6e3a"),
    "uncovered": (3, "#a02020"),
    "unreachable": (1, "#606060"),
    "unknown": (1, "#7a4fa0"),
}
"""Edges that differ in width and colour."""
_BROKEN = {"uncovered": " style=dashed", "unreachable": " style=dotted", "unknown": " style=dashed"}
"""Those of them that are not solid."""
_EDGE_STYLES: dict[str, str] = {
    "transition": "",
    "start": "",
    "turn": 'color="#c0c0c0" penwidth=0.6 arrowhead=open arrowsize=0.5',
    "read": "style=dashed",
    "write": "",
    "both": "dir=both",
    "watch": 'style=dotted arrowhead=onormal color="#1f4e9c" fontcolor="#1f4e9c"',
    "command": 'penwidth=2 color="#a02020" fontcolor="#a02020"',
} | {
    kind: f'penwidth={width} color="{colour}" fontcolor="{colour}"{_BROKEN.get(kind, "")}'
    for kind, (width, colour) in _LINES.items()
}
_MARKS = {
    "": "fillcolor=white",
    "visited": 'penwidth=2 fillcolor="#e8eef7"',
    "unvisited": 'fillcolor=white color="#a0a0a0" fontcolor="#808080"',
    "forever": 'penwidth=2 color="#1f4e9c" fillcolor="#d5e1f5"',
    "violating": 'penwidth=3 color="#a02020" fillcolor="#fbe3e0"',
    "uncovered": 'penwidth=3 color="#a02020" fillcolor=white',
    "unreachable": 'fillcolor="#ececec" color="#606060" fontcolor="#606060"',
    "unknown": 'fillcolor=white color="#7a4fa0" fontcolor="#7a4fa0"',
}
_IN_COMPARTMENTS = frozenset({"state", "suspend", "machine"})
"""The name of these has a compartment of its own."""
_TIGHT = "margin=0 width=0 height=0"
"""A node as large as what is in it."""
_CENTRED = frozenset({"input", "output", "shared"})


def dot(graph: Graph, prefix: str | None = None) -> str:
    """The graph as a `digraph`, UTF-8. With a `prefix`, elements of a picture have ids: that of a node is the prefix
    and its key, that of an edge the prefix and `t0`, `t1`, … in their order, without the start."""
    machine = graph.kind == "machine"
    bars = _bars(graph) if machine else ""
    if not machine:
        graph = with_legend(graph)
    spacing = "rankdir=TB nodesep=0.4 ranksep=0.6" if machine else "rankdir=LR nodesep=0.2 ranksep=0.8"
    lines = [
        f"digraph {_quoted(graph.title)} {{",
        f"  graph [label={_quoted(graph.title)} labelloc=t fontname=Helvetica fontsize=13 {spacing}];",
        "  node [fontname=Helvetica fontsize=11 shape=box];",
        "  edge [fontname=Helvetica fontsize=10];",
    ]
    # A frame does not grow with the labels of the arrows in it, so machines have none: their titles head them.
    nodes = [_with_id(_node(node), prefix, node.key) for node in graph.nodes]
    lines += nodes if machine else _frames(graph)
    keys = {node.key for node in graph.nodes if node.group == LEGEND}
    lines += [bars] if bars else []
    starts = sum(edge.kind == "start" for edge in graph.edges)
    lines += [
        _with_id(_edge(edge, free=edge.kind == "turn" and edge.source not in keys), prefix, f"t{number}")
        for number, edge in enumerate(graph.edges, -starts)
    ]
    lines += _beside(graph) if machine else ()
    return "\n".join([*lines, "}"]) + "\n"


def _with_id(line: str, prefix: str | None, name: str) -> str:
    """The line of a node or an edge, which ends in `;` or in `];`."""
    if prefix is None:
        return line
    return f'{line[:-2]} id="{prefix}{name}"];' if line.endswith("];") else f'{line[:-1]} [id="{prefix}{name}"];'


def _frames(graph: Graph) -> Iterator[str]:
    """The nodes, those of a group in a frame."""
    for number, group in enumerate(dict.fromkeys(node.group for node in graph.nodes)):
        inside = [_node(node) for node in graph.nodes if node.group == group]
        if group == LEGEND:
            inside.reverse()  # what is written last is on top
        if not group:
            yield from inside
            continue
        colour = " color=gray" if group == LEGEND else ""
        yield from (f"  subgraph cluster_{number} {{", f"    graph [label={_quoted(group)} fontsize=11{colour}];")
        yield from (f"  {line}" for line in inside)
        yield "  }"


def _beside(graph: Graph) -> Iterator[str]:
    """Keeps the suspend state of each of several machines below its title, though no arrow leads to it."""
    starts = {node.group: node.key for node in graph.nodes if node.kind == "initial" and node.group}
    for node in graph.nodes:
        if node.kind == "suspend" and node.group in starts:
            yield f"  {starts[node.group]} -> {node.key} [style=invis];"


def _node(node: Node) -> str:
    if node.kind == "initial" and node.group:
        return f"  {node.key} [label=<<b>{_html(node.group)}</b>> shape=plaintext fontsize=13 {_TIGHT}];"
    style = _NODE_STYLES[node.kind]
    if node.kind in ("state", "suspend"):
        style = f"{style} {_MARKS[node.mark]}"
    if node.kind in _IN_COMPARTMENTS:
        return f"  {node.key} [label=<{_compartments(node)}> {style} {_TIGHT}];"
    lines = [_escaped(line) for line in (node.title, *node.lines) if line]
    # \n centres a line, \l sets it to the left.
    label = "\\n".join(lines) if node.kind in _CENTRED else "".join(f"{line}\\l" for line in lines)
    return f'  {node.key} [label="{label}" {style}];'


def _bars(graph: Graph) -> str:
    """The legend of a machine as one node, or "" without an entry. Edges from the top down would pull it apart."""
    rows = "".join(
        f'<tr><td><table border="0" cellspacing="0" cellpadding="0"><tr><td fixedsize="true" width="32" '
        f'height="{_LINES[kind][0]}" bgcolor="{_LINES[kind][1]}"></td></tr></table></td>'
        f'<td align="left">{_html(text)}</td></tr>'
        for kind, text in explained(graph)
    )
    table = f'<table border="1" cellborder="0" color="gray">{rows}</table>'
    return f"  {LEGEND} [label=<{table}> shape=none margin=0];" if rows else ""


def _compartments(node: Node) -> str:
    """The name, a rule and the lines, in Graphviz's HTML."""
    lines = "".join(f'{_html(line)}<br align="left"/>' for line in node.lines)
    below = f'<hr/><tr><td align="left" balign="left">{lines}</td></tr>' if lines else ""
    rows = f'<tr><td width="44"><b>{_html(node.title)}</b></td></tr>{below}'
    return f'<table border="0" cellborder="0" cellspacing="0" cellpadding="4">{rows}</table>'


def _edge(edge: Edge, *, free: bool) -> str:
    """`free`: it does not matter where it ends, so it does not pull at what it connects."""
    text = _html(edge.label).replace("\n", "<br/>")
    # A label covers what it stands on, so that no line runs through its text.
    label = (
        f'label=<<table border="0" cellspacing="3" cellpadding="0"><tr><td bgcolor="white">{text}</td></tr></table>>'
    )
    parts = (label if edge.label else "", _EDGE_STYLES[edge.kind], "constraint=false" if free else "")
    attributes = " ".join(filter(None, parts))
    return f"  {edge.source} -> {edge.target}" + (f" [{attributes}];" if attributes else ";")


def _html(text: str) -> str:
    # Graphviz replaces \N and the like also here.
    return escape(text).replace("\\", "\\\\")


def _escaped(text: str) -> str:
    return text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")


def _quoted(text: str) -> str:
    return f'"{_escaped(text)}"'

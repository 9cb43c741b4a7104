"""The neutral graph between the model and the formats of drawings."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

MAX_NODES = 300
"""A larger graph is summarised instead of drawn, since no reader could follow it."""

NodeKind = Literal["initial", "state", "suspend", "machine", "input", "output", "shared", "note", "sample", "caption"]
EdgeKind = Literal[
    "transition", "start", "turn", "read", "write", "both", "watch", "command",
    "taken", "untaken", "forever", "violating", "covered", "uncovered", "unreachable", "unknown",
]  # fmt: skip
Mark = Literal["", "visited", "unvisited", "forever", "violating", "uncovered", "unreachable", "unknown"]
"""What a run that is drawn does in a state, or what is known of its coverage."""
LEGEND = "legend"
_BREAKS = tuple(map(re.compile, (r"(?<=;) ", r" (?=[?:] )", r" (?=(?:\|\||or) )", r" (?=(?:&&|and) )")))
"""From operators that bind least to those that bind most."""


@dataclass(frozen=True, slots=True)
class Node:
    """`key` is unique in the graph and made of letters, digits and `_` alone; `lines` stand below the title, and may
    begin with spaces."""

    key: str
    title: str
    lines: tuple[str, ...]
    kind: NodeKind
    group: str = ""
    """Nodes of one non-empty group are drawn together under this title, in a frame (in DOT only in an arrangement)."""
    mark: Mark = ""


@dataclass(frozen=True, slots=True)
class Edge:
    source: str
    target: str
    label: str
    kind: EdgeKind


@dataclass(frozen=True, slots=True)
class Graph:
    title: str
    nodes: tuple[Node, ...]
    edges: tuple[Edge, ...]
    kind: Literal["machine", "arrangement"]
    legend: tuple[tuple[EdgeKind, str], ...] = ()
    """What kinds of edges mean; only those that the graph has are explained."""


def explained(graph: Graph) -> tuple[tuple[EdgeKind, str], ...]:
    """Those lines of the legend whose kind of edge the graph has."""
    used = {edge.kind for edge in graph.edges}
    return tuple((kind, text) for kind, text in graph.legend if kind in used)


def with_legend(graph: Graph) -> Graph:
    """The graph with its legend as nodes and edges, in a frame of its own."""
    nodes: list[Node] = []
    edges: list[Edge] = []
    for number, (kind, text) in enumerate(explained(graph)):
        sample, caption = f"legend{number}", f"legend{number}_text"
        nodes += [Node(sample, "", (), "sample", LEGEND), Node(caption, text, (), "caption", LEGEND)]
        edges.append(Edge(sample, caption, "", kind))
    return replace(graph, nodes=(*nodes, *graph.nodes), edges=(*graph.edges, *edges), legend=())


def summarise(graph: Graph) -> tuple[Graph, str | None]:
    """The graph itself, or, when it has more than MAX_NODES nodes, a single node that counts what it has, together
    with the sentence that says so."""
    if len(graph.nodes) <= MAX_NODES:
        return graph, None
    counts: dict[str, int] = {}
    for node in graph.nodes:
        counts[node.kind] = counts.get(node.kind, 0) + 1
    lines = tuple(f"{count:,} × {kind}" for kind, count in counts.items())
    edges = f"{len(graph.edges):,} edges"
    note = Node("summary", graph.title, (*lines, edges, f"not drawn: more than {MAX_NODES} nodes"), "note")
    message = f"{graph.title} has {len(graph.nodes):,} nodes and is summarised: more than {MAX_NODES} cannot be read"
    return Graph(graph.title, (note,), (), graph.kind), message


def shorten(text: str, width: int = 48) -> str:
    """One line of at most `width` characters."""
    folded = " ".join(text.split())
    return folded if len(folded) <= width else folded[: width - 1] + "…"


def wrap(line: str, width: int) -> list[str]:
    """A line as lines of at most `width` characters, broken at spaces alone, where operators bind least; those after
    the first are indented more."""
    inner = line.lstrip()
    indent = line[: len(line) - len(inner)]
    glued = _glue(inner, width - len(indent) - 4, _BREAKS) if len(line) > width else inner
    wrapper = textwrap.TextWrapper(
        width, subsequent_indent=f"{indent}    ", break_long_words=False, break_on_hyphens=False
    )
    return [part.replace("\xa0", " ") for part in wrapper.wrap(indent + glued)]


def _glue(text: str, width: int, breaks: Sequence[re.Pattern[str]]) -> str:
    """The text with no-break spaces where it need not be broken."""
    if len(text) <= width:
        return text.replace(" ", "\xa0")
    return " ".join(_glue(part, width, breaks[1:]) for part in breaks[0].split(text)) if breaks else text

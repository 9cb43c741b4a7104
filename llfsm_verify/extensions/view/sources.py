"""The files, machines and drawings of an arrangement, as a page shows them, and where spans are in the files."""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from llfsm_verify import DiagnosticError
from llfsm_verify.extensions.graphs.dot import dot
from llfsm_verify.extensions.graphs.pictures import laid_out
from llfsm_verify.plug import Arrangement, Machine, Source, Span, arrangement_graph, machine_graph, summarise

MOST_TEXT = 300_000
"""Characters of a file that a page has; more lines are left out, and counted."""
MOST_DRAWN = 40
"""Machines that are drawn; the states of others are listed."""
HEAD = re.compile(r"^.*?(?=<svg)", re.DOTALL)
Place = list[int] | None


class Files:
    """Collects sources, and says where spans are in them."""

    def __init__(self) -> None:
        self._numbers: dict[str, int] = {}
        self.entries: list[dict[str, Any]] = []

    def add(self, source: Source) -> int:
        """The number of a source."""
        number = self._numbers.setdefault(source.name, len(self.entries))
        if number == len(self.entries):
            text, left = source.text, source.text[MOST_TEXT:]
            entry: dict[str, Any] = {"name": source.name, "text": text[:MOST_TEXT]}
            self.entries.append(entry | ({"cut": left.count("\n") + 1} if left else {}))
        return number

    def place(self, span: Span | None) -> Place:
        """Where a span is: the number of its file, line, column, last line, and column after its end. None: nowhere in
        a file, since the arrangement was made of data."""
        if span is None or span.file != span.source.name:
            return None
        return [self.add(span.source), span.line, span.column, *span.end_position]


def machines_of(
    arrangement: Arrangement, files: Files, signals: Mapping[str, int], *, drawn: bool = True
) -> list[dict[str, Any]]:
    """The document's `machines`. `signals`: the number of the signal that is the state of a machine."""
    inside = {name: f"{m.name}@{s.name}" for m in arrangement.texts for s in m.states for name in s.runs}
    return [
        _machine(machine, number, files, drawn=drawn and number < MOST_DRAWN)
        | {"inside": inside.get(machine.name), "signal": signals.get(machine.name)}
        for number, machine in enumerate(arrangement.texts)
    ]


def _machine(machine: Machine, number: int, files: Files, *, drawn: bool) -> dict[str, Any]:
    prefix = f"m{number}-"
    svg = _svg(machine, prefix) if drawn else None
    states = [
        {"name": s.name, "node": f"{prefix}s{i}" if svg else None, "place": files.place(s.span)}
        for i, s in enumerate(machine.states)
    ]
    transitions = [
        {
            "source": source, "target": taken.target, "when": taken.text,
            "edge": f"{prefix}t{edge}" if svg else None, "place": files.place(taken.span),
        }
        for edge, (source, taken) in enumerate((i, t) for i, s in enumerate(machine.states) for t in s.transitions)
    ]  # fmt: skip
    found = {"name": machine.name, "kind": machine.kind, "svg": svg}
    return found | {"states": states, "transitions": transitions}


def _svg(machine: Machine, prefix: str) -> str | None:
    """The drawing of a machine; None: there is no Graphviz, or the machine is too large to be drawn."""
    graph, large = summarise(machine_graph(machine))
    return None if large else drawing(dot(graph, prefix))


def arrangement_svg(arrangement: Arrangement) -> str | None:
    """The drawing of an arrangement; None: as of a machine."""
    graph, large = summarise(arrangement_graph(arrangement))
    return None if large else drawing(dot(graph))


def drawing(text: str) -> str | None:
    """An `<svg>` element of a text in DOT."""
    with suppress(DiagnosticError):
        return HEAD.sub("", laid_out(text, "svg").decode("utf-8"), count=1).strip()
    return None

"""The formats of drawings, by the names that ``--format`` knows; the first is written unless another is meant."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from llfsm_verify.registry import Entry, Registry

if TYPE_CHECKING:
    from llfsm_verify.kripke.structure import Structure
    from llfsm_verify.report.drawing.graph import Graph

DRAWINGS: Registry[Callable[[Graph], str | bytes]] = Registry(
    "format of drawings",
    [
        Entry("dot", "llfsm_verify.report.drawing.dot:dot", "the DOT language of Graphviz", (".dot", ".gv")),
        Entry("mermaid", "llfsm_verify.report.drawing.mermaid:mermaid", "Mermaid's text", (".mmd", ".mermaid")),
        Entry("svg", "llfsm_verify.report.drawing.pictures:svg", "a picture, laid out by Graphviz", (".svg",)),
        Entry("png", "llfsm_verify.report.drawing.pictures:png", "the same picture in pixels", (".png",), binary=True),
    ],
    "llfsm_verify.drawings",
)
PICTURES: Registry[Callable[[Structure], Iterable[bytes]]] = Registry(
    "format of pictures",
    [
        Entry(
            "svg", "llfsm_verify.report.drawing.pictures:structure_svg", "a picture, laid out by Graphviz", (".svg",)
        ),
        Entry(
            "png",
            "llfsm_verify.report.drawing.pictures:structure_png",
            "the same picture in pixels",
            (".png",),
            binary=True,
        ),
    ],
)
"""Of Kripke structures; each gives the portions of a file."""

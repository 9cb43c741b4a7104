"""Kripke structures as pictures, laid out by Graphviz."""

from __future__ import annotations

from collections.abc import Iterator

from llfsm_verify.kripke.export.dot import dot
from llfsm_verify.kripke.structure import Structure
from llfsm_verify.report.drawing.pictures import laid_out


def svg(structure: Structure) -> Iterator[bytes]:
    """The structure as an SVG document; DiagnosticError (E406) when pygraphviz is not installed."""
    yield laid_out("".join(dot(structure)), "svg")


def png(structure: Structure) -> Iterator[bytes]:
    """The structure as a PNG; DiagnosticError (E406) when pygraphviz is not installed."""
    yield laid_out("".join(dot(structure)), "png")

"""Graphs and Kripke structures as pictures, laid out by Graphviz."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.graphs.dot import dot
from llfsm_verify.plug import NO_GRAPHVIZ, Graph

if TYPE_CHECKING:
    from llfsm_verify import Structure

PIXELS = 144
"""Of a PNG, to the inch: twice what letters need on most screens."""


def svg(graph: Graph) -> str:
    """The graph as an SVG document; DiagnosticError (E406) when pygraphviz is not installed."""
    return laid_out(dot(graph), "svg").decode("utf-8")


def png(graph: Graph) -> bytes:
    """The graph as a PNG; DiagnosticError (E406) when pygraphviz is not installed."""
    return laid_out(dot(graph), "png")


def _structure(structure: Structure, wanted: str) -> Iterator[bytes]:
    """A Kripke structure as an ``svg`` or ``png``. Errors as for `laid_out`."""
    from llfsm_verify.extensions.graphs.structure_dot import dot as structure_dot  # numba

    yield laid_out("".join(structure_dot(structure)), wanted)


structure_svg, structure_png = partial(_structure, wanted="svg"), partial(_structure, wanted="png")


def laid_out(text: str, wanted: str) -> bytes:
    """A text in the DOT language as an ``svg`` or ``png``; DiagnosticError (E406) when pygraphviz is not installed."""
    try:
        import pygraphviz
    except ImportError:
        hint = "install it with `pip install pygraphviz`, or in our folder with `pip install -e '.[draw]'`; or choose "
        hint += "--format dot"
        message = f"{wanted.upper()} drawings need the package pygraphviz"
        raise DiagnosticError(Diagnostic(NO_GRAPHVIZ, message, hint=hint)) from None
    drawing = pygraphviz.AGraph(string=text)
    if wanted == "png":
        drawing.graph_attr["dpi"] = str(PIXELS)
    return bytes(drawing.draw(format=wanted, prog="dot"))

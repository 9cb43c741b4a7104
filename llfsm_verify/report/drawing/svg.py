"""Graphs as SVG, laid out by Graphviz."""

from __future__ import annotations

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.report.drawing.codes import NO_LIBRARY
from llfsm_verify.report.drawing.dot import dot
from llfsm_verify.report.drawing.graph import Graph


def svg(graph: Graph) -> str:
    """The graph as an SVG document; DiagnosticError (E406) when pygraphviz is not installed."""
    try:
        import pygraphviz
    except ImportError:
        hint = "install it with `pip install 'llfsm-verify[draw]'`, or choose --format dot or mermaid"
        raise DiagnosticError(Diagnostic(NO_LIBRARY, "SVG drawings need the package pygraphviz", hint=hint)) from None
    drawing = pygraphviz.AGraph(string=dot(graph))
    return bytes(drawing.draw(format="svg", prog="dot")).decode("utf-8")

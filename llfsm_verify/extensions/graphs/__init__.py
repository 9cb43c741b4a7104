"""Graphs for other programs: DOT and pictures by Graphviz, Mermaid, GraphML, CADP's `.aut`, and arrays of NumPy."""

from __future__ import annotations

from llfsm_verify.plug import CommandEntry, Entry

SVG, PNG = "a picture, laid out by Graphviz", "the same picture in pixels"
ENTRIES = {
    "llfsm_verify.commands": (
        CommandEntry(
            name="draw",
            place=f"{__name__}.command:arguments",
            about="draw a machine or the arrangement",
            group="exchange",
            runs=f"{__name__}.command:run",
        ),
    ),
    "llfsm_verify.drawings": (
        Entry("dot", f"{__name__}.dot:dot", "the DOT language of Graphviz", (".dot", ".gv")),
        Entry("mermaid", f"{__name__}.mermaid:mermaid", "Mermaid's text", (".mmd", ".mermaid")),
        Entry("svg", f"{__name__}.pictures:svg", SVG, (".svg",)),
        Entry("png", f"{__name__}.pictures:png", PNG, (".png",), binary=True),
    ),
    "llfsm_verify.graphs": (
        Entry("run", f"{__name__}.traced:run_graph", "a run on its machines"),
        Entry("replayed", f"{__name__}.traced:replayed_graph", "a saved run on its machines"),
        Entry("coverage", f"{__name__}.covered:coverage_graph", "what runs cover"),
    ),
    "llfsm_verify.structures": (
        Entry("dot", f"{__name__}.structure_dot:dot", "a drawing", (".dot", ".gv")),
        Entry("graphml", f"{__name__}.graphml:graphml", "GraphML", (".graphml",)),
        Entry("aut", f"{__name__}.aut:aut", "CADP's Aldébaran format", (".aut",)),
        Entry("npz", f"{__name__}.npz:npz", "arrays of NumPy", (".npz",), binary=True),
        Entry("svg", f"{__name__}.pictures:structure_svg", SVG, (".svg",)),
        Entry("png", f"{__name__}.pictures:structure_png", PNG, (".png",), binary=True),
    ),
}

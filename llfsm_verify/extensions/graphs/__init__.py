"""Kripke structures for other programs: CADP's `.aut`, GraphML, and arrays of NumPy."""

from __future__ import annotations

from llfsm_verify.plug import Entry

ENTRIES = {
    "llfsm_verify.structures": (
        Entry("graphml", f"{__name__}.graphml:graphml", "GraphML", (".graphml",)),
        Entry("aut", f"{__name__}.aut:aut", "CADP's Aldébaran format", (".aut",)),
        Entry("npz", f"{__name__}.npz:npz", "arrays of NumPy", (".npz",), binary=True),
    ),
}

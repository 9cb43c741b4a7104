"""Timelines for other programs: viewers of waveforms and of traces, and pictures."""

from __future__ import annotations

from llfsm_verify.plug import Entry, Package

ENTRIES = {
    "llfsm_verify.timelines": (
        Entry(
            "vcd",
            f"{__name__}.vcd:write_vcd",
            "for GTKWave and other viewers",
            (".vcd",),
            package=Package("vcd", "pyvcd", "trace"),
        ),
        Entry("svg", f"{__name__}.diagram:write_svg", "a timing diagram", (".svg",)),
        Entry("itf", f"{__name__}.itf:write_itf", "for Apalache and Quint", (".itf.json",)),
    ),
}

"""The debugger as panes in a terminal, and the panel of a run there."""

from __future__ import annotations

from llfsm_verify.plug import Entry, Package

ENTRIES = {
    "llfsm_verify.debuggers": (
        Entry(
            "terminal",
            f"{__name__}.panes:run_panes",
            "panes in a terminal",
            package=Package("textual", "textual", "debug"),
        ),
    ),
    "llfsm_verify.panels": (Entry("terminal", f"{__name__}.panel:Pictures", "a picture ten times a second"),),
}

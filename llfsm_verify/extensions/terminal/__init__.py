"""The debugger as panes in a terminal."""

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
}

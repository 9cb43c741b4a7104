"""Guards: a monitor and a switch between machines and their outputs, and the proof of what they warrant."""

from __future__ import annotations

from llfsm_verify.plug import CommandEntry, Entry

ENTRIES = {
    "llfsm_verify.codes": (Entry("guards", f"{__name__}.codes:CODES", "Guards"),),
    "llfsm_verify.commands": (
        CommandEntry(
            name="guard",
            place=f"{__name__}.arguments:arguments",
            about="put a monitor and a switch before outputs, and prove what they keep",
            group="build",
            runs=f"{__name__}.run:run",
        ),
    ),
}

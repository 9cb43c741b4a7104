"""New projects: a small arrangement with its properties, and tests for pytest, written by `llfsm init`.

What a user writes, and what that prints:

    $ llfsm init crossing
    written: crossing/arrangement.yaml
    …

Mistakes:

    crossing: error[E460]: this would overwrite arrangement.yaml, cars.machine.yaml, …
    --name: error[E461]: `my crossing` is not a valid name for an arrangement
    a.yaml/crossing: error[E462]: the project cannot be written there: Not a directory
"""

from __future__ import annotations

from llfsm_verify.plug import CommandEntry, Entry

ENTRIES = {
    "llfsm_verify.codes": (Entry("projects", f"{__name__}.codes:CODES", "New projects"),),
    "llfsm_verify.commands": (
        CommandEntry(
            name="init",
            place=f"{__name__}.command:arguments",
            about="write a small arrangement with properties and tests",
            group="build",
            runs=f"{__name__}.command:run",
        ),
    ),
}

"""The debugger: runs that one walks forwards and backwards, by ringlets, cycles and break points; why guards were true.

What a user writes, and what that prints:

    $ llfsm debug arrangement.yaml --command 'until ew@GREEN' --command why
    (debug) until ew@GREEN
    …

Mistakes:

    error: --hold and --draw say how --seed draws inputs
    error[E486]: there is no file `lights`, and no arrangement runs with a whiteboard of that name
    there is no command `jump`; `help` lists them
"""

from __future__ import annotations

from llfsm_verify.plug import CommandEntry

MOST_STEPS = 1_000_000
"""Steps that are kept to go back to, by default; each takes a few hundred bytes."""

ENTRIES = {
    "llfsm_verify.commands": (
        CommandEntry(
            name="debug",
            place=f"{__name__}.arguments:arguments",
            about="walk a run forwards and backwards, and see why transitions fire",
            group="run",
            runs=f"{__name__}.run:run",
        ),
    ),
}

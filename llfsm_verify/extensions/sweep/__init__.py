"""Sweeps: many checks of one file, arrangements × values × property files, each a row of a table.

What a user writes, and what that prints:

    $ cat SWEEP.yaml
    arrangements: [arrangement.yaml, "faulty_*.yaml"]
    constants: {MINUTES: {from: 1, to: 60}}
    $ llfsm sweep SWEEP.yaml
    row  arrangement       MINUTES  verdict   extra_minute  seconds  MiB
      1  arrangement.yaml        1  holds     holds            0.25  105
    …

Mistakes:

    SWEEP.yaml:2:13: error[E591]: no machine of arrangement.yaml has a constant `MINUTE`
    SWEEP.yaml:2:11: error[E592]: this is 1,000,000 combinations (1,000,000 of `n`), and a sweep has at most 100,000
    SWEEP.yaml:2:18: error[E593]: `0x1` is a value of `n` that was there before: two combinations would be one
"""

from __future__ import annotations

from llfsm_verify.plug import CommandEntry, Entry

ENTRIES = {
    "llfsm_verify.codes": (Entry("sweep", f"{__name__}.codes:CODES", "Sweeps"),),
    "llfsm_verify.commands": (
        CommandEntry(
            name="sweep",
            place=f"{__name__}.command:arguments",
            about="check every combination of arrangements, values and property files",
            group="check",
            runs=f"{__name__}.command:run",
        ),
    ),
    "llfsm_verify.schemas": (Entry("sweep", f"{__name__}.reading:schema", "sweeps, `llfsm sweep`"),),
    "llfsm_verify.sweeps": (Entry("sweep", f"{__name__}.sweeping:rows_of", "combinations of a sweep file"),),
    "llfsm_verify.schedulers": (Entry("processes", f"{__name__}.local:Processes", "processes of this machine"),),
}

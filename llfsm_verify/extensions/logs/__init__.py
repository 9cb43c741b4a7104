"""Logs that others wrote: their columns become slots of an arrangement, and each row is a letter.

What a user writes, and what that prints:

    $ llfsm check-recording log.csv --arrangement lamp.yaml --mapping lamp.mapping.yaml -p 'F m@ON'
    satisfied  P1  F m@ON  at row 2, at time 0.1

Mistakes:

    lamp.mapping.yaml:4:3: error[E496]: there is no slot `stop`
    log.csv: error[E497]: line 2, column `button` (`go`): `1` is not one of yes, no
    <command line>:1:3: error[E498]: `m.ran` asks what happened in a step, or whether a machine is loaded, and a row …
"""

from __future__ import annotations

from llfsm_verify.plug import Entry

ENTRIES = {
    "llfsm_verify.codes": (Entry("logs", f"{__name__}.codes:CODES", "Logs of other programs"),),
    "llfsm_verify.logs": (Entry("csv", f"{__name__}.csv:read_csv", "a header, and a line for each row", (".csv",)),),
    "llfsm_verify.readings": (Entry("mapping", f"{__name__}.check:LogReading", "columns that a mapping names"),),
    "llfsm_verify.schemas": (
        Entry("mapping", f"{__name__}.mapping:schema", "mappings of logs, `check-recording --mapping`"),
    ),
}

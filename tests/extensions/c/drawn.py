"""Random arrangements as one image can run them, and what there is in them."""

from __future__ import annotations

import re
from collections import Counter

from llfsm_verify.program.program import Int, Program
from llfsm_verify.program.terms import is_wide
from llfsm_verify.testing.arrangements import Document

TOLD = ("unload", "refused", "suspend", "resume", "restart")
WRITTEN = {
    "bits": r"<<|>>|[^&]&[^&]|\^|~", "table": r"\b(list|curve)\[", "nested": r"'runs'", "operators": r"\boperators\b",
}  # fmt: skip
KINDS = (*TOLD, *WRITTEN, "decimal", "array", "record", "wide", "a fault", "end", "done")
"""What some random arrangement has, or some step of it does."""


def adapted(document: Document, *, unloads: bool) -> Document:
    """The same without what has no meaning in one image: several processes, single reads, untimed clocks."""
    found = {k: v for k, v in document.items() if k not in ("environment", "timing", "processes")}
    found.setdefault("cycle_ms", "10")
    processes = document.get("processes")
    if isinstance(processes, dict):
        found["schedule"] = [m for schedule in processes.values() for m in schedule]
        pool = document.get("pool")
        if isinstance(pool, dict):
            found["pool"] = [m for machines in pool.values() for m in machines]
    machines = found["machines"]
    assert isinstance(machines, dict)
    for machine in machines.values():
        machine["on_fault"] = "unload" if unloads else "end"
    profile = document.get("profile")
    given = dict(profile) if isinstance(profile, dict) else {"base": profile or "llfsm"}
    if given.get("snapshot", "none" if given["base"] == "clfsm" else "") == "none":
        given["snapshot"] = "ringlet"
    return found | {"profile": given}


def tally_of(program: Program, text: str) -> Counter[str]:
    """What there is of `KINDS` in a program, and in the text of its arrangement."""
    found = Counter(kind for kind, pattern in WRITTEN.items() if re.search(pattern, text))
    for var in program.vars:
        found["decimal"] += isinstance(var.type, Int) and var.type.digits > 0
        found["array"] += var.length is not None
        found["record"] += re.search(r"\.[xf]\Z", var.name) is not None
        found["wide"] += is_wide(var.type)
    return found

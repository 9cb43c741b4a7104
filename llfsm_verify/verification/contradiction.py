"""What holds only because no run satisfies the assumptions is unknown (docs/decisions/0016-vacuity.md).

An engine says *holds* of it, which is true of no runs; certificates and the conformance suite want that answer. Users
get it when they ask for it (``--allow-contradiction``).
"""

from __future__ import annotations

from dataclasses import replace

from llfsm_verify.checking.vacuity import NO_RUN
from llfsm_verify.checking.verdict import PropertyResult, Result, Verdict


def without_contradicted(result: Result) -> Result:
    """The same, with the verdict *unknown* for each property that holds only since no run satisfies the assumptions."""
    return replace(result, properties=tuple(map(_judged, result.properties)))


def _judged(item: PropertyResult) -> PropertyResult:
    if item.verdict is not Verdict.HOLDS or NO_RUN not in item.notes:
        return item
    said = (finding.message for finding in item.vacuity.findings if finding.kind == "assumptions")
    notes = tuple(note for note in item.notes if note != NO_RUN)
    return replace(item, verdict=Verdict.UNKNOWN, reason=next(said, NO_RUN), notes=notes, proofs=())

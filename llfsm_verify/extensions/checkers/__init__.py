"""Whole arrangements as models for other checkers: NuSMV, nuXmv and SPIN."""

from __future__ import annotations

from llfsm_verify.plug import Entry

ENTRIES = {
    "llfsm_verify.codes": (Entry("checkers", f"{__name__}.codes:CODES", "Models for other checkers"),),
    "llfsm_verify.models": (
        Entry("smv", f"{__name__}.smv:smv", "for NuSMV and nuXmv", (".smv",)),
        Entry("promela", f"{__name__}.promela.model:promela", "for SPIN", (".pml", ".promela")),
    ),
}

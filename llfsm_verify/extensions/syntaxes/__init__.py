"""Formulas in the syntaxes of Spot, SPIN and NuSMV, read and written."""

from __future__ import annotations

from llfsm_verify.plug import Entry

ENTRIES = {
    "llfsm_verify.syntaxes": (
        Entry("spot", f"{__name__}.syntax:OF_SPOT", "Spot: temporal logic and PSL"),
        Entry("spin", f"{__name__}.syntax:OF_SPIN", "SPIN: `ltl name { … }`"),
        Entry("nusmv", f"{__name__}.syntax:OF_NUSMV", "NuSMV and nuXmv: `LTLSPEC`"),
    ),
}

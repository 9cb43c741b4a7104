"""The syntaxes of formulas, by the names that ``--syntax`` knows them by."""

from __future__ import annotations

from typing import TYPE_CHECKING

from llfsm_verify.registry import Entry, Registry

if TYPE_CHECKING:
    from llfsm_verify.logic.syntaxes.table import SyntaxTable

OURS = "llfsm"
"""The syntax of property files, which has a grammar of its own."""
TABLES: Registry[SyntaxTable] = Registry(
    "syntax",
    [
        Entry("spot", "llfsm_verify.logic.syntaxes.spot:SPOT", "Spot: temporal logic and PSL"),
        Entry("spin", "llfsm_verify.logic.syntaxes.spin:SPIN", "SPIN: `ltl name { … }`"),
        Entry("nusmv", "llfsm_verify.logic.syntaxes.nusmv:NUSMV", "NuSMV and nuXmv: `LTLSPEC`"),
    ],
)
"""The words and operators of the syntaxes of other tools."""
SYNTAXES = (OURS, *TABLES)

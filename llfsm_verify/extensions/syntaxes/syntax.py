"""Each syntax as a whole: its reader, and how it writes."""

from __future__ import annotations

from dataclasses import dataclass

from llfsm_verify.extensions.syntaxes.nusmv import NUSMV
from llfsm_verify.extensions.syntaxes.reading import read_formula, unwrap
from llfsm_verify.extensions.syntaxes.spellings import SPELLINGS
from llfsm_verify.extensions.syntaxes.spin import SPIN
from llfsm_verify.extensions.syntaxes.spot import SPOT
from llfsm_verify.extensions.syntaxes.table import SyntaxTable
from llfsm_verify.plug import Fragment, Parsed, Spelling, refuse_delays


@dataclass(frozen=True, slots=True)
class Foreign:
    """See `Syntax`."""

    table: SyntaxTable
    spelling: Spelling

    def read(self, fragment: Fragment) -> Parsed:
        """See `Syntax`."""
        if self.table is SPOT:
            refuse_delays(fragment)
        return read_formula(self.table, fragment)

    def name_in(self, text: str) -> str | None:
        """See `Syntax`."""
        return unwrap(self.table, text)[2]


OF_SPOT = Foreign(SPOT, SPELLINGS["spot"])
OF_SPIN = Foreign(SPIN, SPELLINGS["spin"])
OF_NUSMV = Foreign(NUSMV, SPELLINGS["nusmv"])

"""The syntaxes of formulas, by the names that ``--syntax`` knows them by."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from llfsm_verify.registry import Registry

if TYPE_CHECKING:
    from llfsm_verify.diagnostics import Fragment
    from llfsm_verify.logic.parsing.formulas import Parsed
    from llfsm_verify.logic.syntaxes.writing import Spelling


class Syntax(Protocol):
    """The syntax of another tool."""

    @property
    def spelling(self) -> Spelling: ...

    def read(self, fragment: Fragment) -> Parsed:
        """The formula that a text is. DiagnosticError: it is none."""
        ...

    def name_in(self, text: str) -> str | None:
        """The name that the words around a formula give it: `ltl name { … }`."""
        ...


OURS = "llfsm"
"""The syntax of property files, which has a grammar of its own."""
TABLES: Registry[Syntax] = Registry("syntax", (), "llfsm_verify.syntaxes")
"""The syntaxes of other tools."""
SYNTAXES = (OURS, *TABLES)

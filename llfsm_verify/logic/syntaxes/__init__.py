"""Formulas in the syntaxes of several tools: one reader and one printer for each, found by name."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, cast

from llfsm_verify.diagnostics import Fragment
from llfsm_verify.logic.formula import Formula
from llfsm_verify.logic.parsing.formulas import Parsed, refuse_many_steps
from llfsm_verify.logic.syntax_names import OURS, SYNTAXES, TABLES

if TYPE_CHECKING:
    from llfsm_verify.logic.syntaxes.writing import Spelling

__all__ = ["SYNTAXES", "Syntax", "foreign", "parse_in", "print_in"]


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


def foreign(syntax: str) -> Syntax:
    """The syntax of another tool."""
    return cast(Syntax, TABLES.load(syntax))


def parse_in(syntax: str, fragment: Fragment) -> Parsed:
    """The formula that `fragment` is in `syntax`, one of `SYNTAXES`; DiagnosticError when it is no formula."""
    if syntax == OURS:
        from llfsm_verify.logic.parsing.formulas import parse_formula

        return parse_formula(fragment)
    parsed = foreign(syntax).read(fragment)
    refuse_many_steps(parsed, fragment.span(0, len(fragment.text)))
    return parsed


def print_in(syntax: str, formula: Formula) -> str:
    """`formula` in `syntax`, fully parenthesised, with quotes around atoms that need them.

    DiagnosticError (E352): the syntax has no way to say it. LimitReached: the text is too long.
    """
    from llfsm_verify.logic.syntaxes.writing import write_formula

    return write_formula(syntax, formula)

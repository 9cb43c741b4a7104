"""Formulas in the syntaxes of several tools: one reader and one printer for each, found by name."""

from __future__ import annotations

from llfsm_verify.diagnostics import Fragment
from llfsm_verify.logic.formula import Formula
from llfsm_verify.logic.parsing.formulas import Parsed, refuse_many_steps
from llfsm_verify.logic.syntax_names import OURS, SYNTAXES, TABLES

__all__ = ["SYNTAXES", "parse_in", "print_in"]


def parse_in(syntax: str, fragment: Fragment) -> Parsed:
    """The formula that `fragment` is in `syntax`, one of `SYNTAXES`; DiagnosticError when it is no formula."""
    if syntax == OURS:
        from llfsm_verify.logic.parsing.formulas import parse_formula

        return parse_formula(fragment)
    parsed = TABLES.load(syntax).read(fragment)
    refuse_many_steps(parsed, fragment.span(0, len(fragment.text)))
    return parsed


def print_in(syntax: str, formula: Formula) -> str:
    """`formula` in `syntax`, fully parenthesised, with quotes around atoms that need them.

    DiagnosticError (E352): the syntax has no way to say it. LimitReached: the text is too long.
    """
    from llfsm_verify.logic.syntaxes.writing import write_formula

    return write_formula(syntax, formula)

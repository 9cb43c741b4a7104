"""The syntaxes of formulas, by the names that ``--syntax`` knows them by."""

from __future__ import annotations

from llfsm_verify.registry import Registry

OURS = "llfsm"
"""The syntax of property files, which has a grammar of its own."""
TABLES: Registry[object] = Registry("syntax", (), "llfsm_verify.syntaxes")
"""The syntaxes of other tools: each is a `logic.syntaxes.Syntax`."""
SYNTAXES = (OURS, *TABLES)

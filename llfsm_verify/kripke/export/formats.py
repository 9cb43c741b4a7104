"""The formats of Kripke structures and of models for other checkers, by the names that ``--format`` knows them by."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

from llfsm_verify.registry import Entry, Registry

if TYPE_CHECKING:
    from llfsm_verify.kripke.export.specification import Specification
    from llfsm_verify.kripke.structure import Structure


STRUCTURES: Registry[Callable[[Structure], Iterable[str | bytes]]] = Registry(
    "format of structures",
    [
        Entry("json", "llfsm_verify.kripke.export.json:json", "a line for each configuration and edge", (".json",)),
    ],
    "llfsm_verify.structures",
)
"""Each gives the portions of a file."""
READABLE = 300
"""Configurations that a drawing can still show."""
MODELS: Registry[Callable[[Specification], str]] = Registry("format of models", (), "llfsm_verify.models")
"""Each gives the text of a model, or raises DiagnosticError."""


CODES: dict[str, str] = {
    "E422": "A structure or model cannot be written there.",
    "E423": "A graph of networkx needs the package networkx.",
}

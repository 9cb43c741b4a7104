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
        Entry("dot", "llfsm_verify.kripke.export.dot:dot", "a drawing", (".dot", ".gv")),
    ],
    "llfsm_verify.structures",
)
"""Each gives the portions of a file."""
MODELS: Registry[Callable[[Specification], str]] = Registry("format of models", (), "llfsm_verify.models")
"""Each gives the text of a model, or raises DiagnosticError (E420, E421, E424)."""


CODES: dict[str, str] = {
    "E420": "A value of type `int` in a model for a checker that has no such integers.",
    "E421": "A value that a model for another checker cannot hold in 32 bits.",
    "E422": "A structure or model cannot be written there.",
    "E423": "A graph of networkx needs the package networkx.",
    "E424": "A property is too large for a model of SPIN (its automaton) or SMV (its text).",
}

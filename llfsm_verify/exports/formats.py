"""The models for other checkers, by the names that ``--format`` knows them by."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from llfsm_verify.registry import Entry, Registry

if TYPE_CHECKING:
    from llfsm_verify.exports.flat import Specification

MODELS: Registry[Callable[[Specification], str]] = Registry(
    "format of models",
    [
        Entry("smv", "llfsm_verify.exports.smv:smv", "for NuSMV and nuXmv", (".smv",)),
        Entry("promela", "llfsm_verify.exports.promela.model:promela", "for SPIN", (".pml", ".promela")),
    ],
)

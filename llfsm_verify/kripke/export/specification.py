"""What a model for another checker is written from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from llfsm_verify.diagnostics import Span
from llfsm_verify.logic.formula import Formula
from llfsm_verify.program.program import Program


@dataclass(frozen=True, slots=True)
class Specification:
    """An arrangement, lowered, with the formulas to be checked of it; names are those of the properties."""

    program: Program
    goals: tuple[tuple[str, Formula], ...] = ()
    assumptions: tuple[tuple[str, Formula], ...] = ()
    declared: Mapping[str, Span] = field(default_factory=dict)
    """Where the variables are declared, by their names."""
    numbers: Mapping[int, Span] = field(default_factory=dict)
    """Where the numbers are written."""

    @property
    def observed(self) -> bool:
        """There is something to check, so letters are computed."""
        return bool(self.goals)

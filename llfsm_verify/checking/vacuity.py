"""What makes a pass say less than it seems to: docs/decisions/0016-vacuity.md."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from llfsm_verify.checking.trace import Trace

NO_RUN = "no run satisfies the assumptions, so this says nothing"
"""What is said of every property then."""
PERHAPS_NO_RUN = "whether any run satisfies the assumptions is not known"
OPEN = frozenset({NO_RUN, PERHAPS_NO_RUN})
"""A pass with one of these notes may say nothing."""
FindingKind = Literal[
    "antecedent", "subformula", "valid", "unsatisfiable", "letter", "assumptions", "escape", "initial"
]

Looked = Literal["no", "antecedents", "all"]


@dataclass(frozen=True, slots=True)
class VacuityFinding:
    """`antecedent`: of an implication, never true. `subformula`: it does not matter. `valid`, `unsatisfiable`: by
    itself, whatever the arrangement. `letter`: one that never holds. `assumptions`: no run satisfies them. `escape`:
    some run comes to where no continuation does. `initial`: a part of it is about the initial configuration only."""

    kind: FindingKind
    message: str
    """In a sentence without its full stop."""
    subject: str
    """The subformula, letter or names of assumptions that it is about."""
    witness: str | None = None
    """A stronger formula that also holds, as it would be written in a property file."""


@dataclass(frozen=True, slots=True)
class Escape:
    """A run to where the arrangement escapes its assumptions (docs/semantics.md), where there is one."""

    trace: Trace | None = None
    reason: str | None = None
    """Why it is not known whether there is one, as a sentence without its full stop."""


@dataclass(frozen=True, slots=True)
class Vacuity:
    """How far a property that holds was looked at, and what was found.

    `looked`: not at all, at antecedents (and what is as cheap), at every subformula. `never` and `always` are the
    property's atoms that no, or every, configuration reached shows.
    """

    findings: tuple[VacuityFinding, ...] = ()
    looked: Looked = "no"
    reason: str | None = None
    """Why it was not looked at as far as it was asked for, in a sentence."""
    never: tuple[str, ...] = ()
    always: tuple[str, ...] = ()
    accepted: bool = False
    """The findings are said to be known."""

    @property
    def fails(self) -> bool:
        """With ``--strict`` a pass like this is none."""
        return bool(self.findings) and not self.accepted

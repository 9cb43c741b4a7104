"""Findings of lint as values: what is wrong, where, how that is known, and values that show it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from llfsm_verify.checking.trace import Trace
from llfsm_verify.diagnostics import Span
from llfsm_verify.kripke.labels.sizes import InputNote

Level = Literal["warning", "note"]
Proof = Literal["local", "reachable", "run", "ranges", "text"]
"""How a finding is known: by a proof over one turn from any values inside the declared ranges; by all reachable
configurations; by a run that shows it; by values inside the ranges, which are not known to be reachable; by reading the
text alone."""


@dataclass(frozen=True, slots=True)
class Witness:
    """Values that show a finding: variables before the turn, and the inputs that it samples, with their texts.

    `trace`: the run there, which the executor performed; None: not known to be reachable.
    """

    variables: tuple[tuple[str, str], ...]
    inputs: tuple[tuple[str, str], ...]
    trace: Trace | None


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that is wrong, or worth a look (a note). `machines` are the instances in which it is so."""

    code: str
    level: Level
    message: str
    span: Span
    machines: tuple[str, ...]
    proof: Proof
    notes: tuple[str, ...] = ()
    hint: str | None = None
    witness: Witness | None = None
    suppressed: str | None = None
    """Why the file accepts it."""


@dataclass(frozen=True, slots=True)
class OpenQuestion:
    """Whether there is a finding `code` at a place: neither proved nor shown."""

    code: str
    message: str
    span: Span
    hint: str | None = None
    """What may decide it."""


@dataclass(frozen=True, slots=True)
class LintResult:
    """All findings in the order of their places, those that are suppressed among them, and what is not known."""

    arrangement: str
    path: str
    findings: tuple[Finding, ...]
    open: tuple[OpenQuestion, ...]
    explored: bool
    """The reachable configurations were looked at, not only single turns."""
    complete: bool
    """All of them."""
    reason: str | None
    """Why not all of them."""
    configurations: int
    left_out: tuple[str, ...]
    """What these are counted without, because nothing that was asked depends on it."""
    inputs: tuple[InputNote, ...]
    """Into how many classes wide inputs were split, or why they were not."""
    seconds: float

    @property
    def shown(self) -> tuple[Finding, ...]:
        """The findings that no file accepts."""
        return tuple(f for f in self.findings if f.suppressed is None)

    @property
    def exit_code(self) -> int:
        """1 warnings, 4 open questions, 0 neither."""
        if any(f.level == "warning" for f in self.shown):
            return 1
        return 4 if self.open else 0

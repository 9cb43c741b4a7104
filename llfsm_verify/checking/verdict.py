"""The one protocol of all engines: from an arrangement, properties and limits to verdicts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Literal, Protocol

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.trace import Trace
from llfsm_verify.diagnostics import Span
from llfsm_verify.semantics.program import FaultSite

if TYPE_CHECKING:
    from llfsm_verify.checking.binding import Bound


class Verdict(Enum):
    HOLDS = "holds"
    VIOLATED = "violated"
    UNKNOWN = "unknown"


GoalKind = Literal["ltl", "enforce", "forbid", "forbid initially", "automaton", "automaton never"]
"""What a line of a property file asks for; the text of the automaton kinds is the name of a file."""


@dataclass(frozen=True, slots=True)
class PropertyResult:
    name: str
    kind: GoalKind
    text: str
    span: Span
    verdict: Verdict
    engine: str
    trace: Trace | None
    reason: str | None = None
    """Why the verdict is unknown, in a sentence."""
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class FaultFinding:
    site: FaultSite
    trace: Trace


@dataclass(frozen=True, slots=True)
class FaultResult:
    verdict: Verdict
    """HOLDS: no fault is reachable."""
    findings: tuple[FaultFinding, ...]
    reason: str | None = None


@dataclass(frozen=True, slots=True)
class Result:
    arrangement: str
    path: str
    engine: str
    complete: bool
    """The whole state space was explored."""
    states: int
    """Configurations found."""
    transitions: int
    """Distinct pairs of a configuration and a successor."""
    seconds: float
    assumptions: tuple[str, ...]
    """Names of the `assume` lines."""
    properties: tuple[PropertyResult, ...]
    faults: FaultResult
    interrupted: bool = False
    """Ended by Ctrl-C."""
    left_out: tuple[str, ...] = ()
    """What the search left out because no property depends on it; `states` and `transitions` then count without it."""
    stored: int | None = None
    """Of the configurations, those that were stored; None: all, because chains were not passed over."""
    counted: bool = True
    """`states` and `transitions` count all that were found; False: only those stored, and perhaps some more."""

    @property
    def exit_code(self) -> int:
        """130 interrupted, 1 violated or a fault, 4 unknown, 0 all hold (formats, Command line)."""
        verdicts = [p.verdict for p in self.properties] + [self.faults.verdict]
        if self.interrupted:
            return 130
        if Verdict.VIOLATED in verdicts:
            return 1
        return 4 if Verdict.UNKNOWN in verdicts else 0


@dataclass(frozen=True, slots=True)
class Limits:
    """None: no limit. `memory` is of the whole process, in bytes; `timeout` in seconds."""

    max_states: int | None = None
    memory: int | None = None
    timeout: float | None = None


@dataclass(frozen=True, slots=True)
class Progress:
    """What an engine reports now and then: configurations found; nodes expanded and found (configurations, unless the
    middle of cycles is searched too); depth; seconds so far; bytes in use; what else than exploring it is doing."""

    states: int
    expanded: int
    found: int
    depth: int
    seconds: float
    memory: int
    doing: str = ""


@dataclass(frozen=True, slots=True)
class Checkpointing:
    """``--checkpoint``: where to save, how often (seconds), and whether to go on from what is there."""

    path: Path
    every: float = 60.0
    resume: bool = False


@dataclass(frozen=True, slots=True)
class Options:
    limits: Limits = Limits()
    keep_all_bits: bool = False
    cone: Literal["auto", "on", "off"] = "auto"
    """Leave out what no property depends on: always, never, or when the space is large."""
    chains: Literal["auto", "on", "off"] = "auto"
    """Do not store configurations with one step only: always, never, or when the space is large and has many."""
    progress: Callable[[Progress], None] | None = None
    checkpoint: Checkpointing | None = None
    """Save the search now and then, and go on from what was saved."""
    tell: Callable[[str], None] | None = None
    """Takes sentences that the user should see before the search ends."""


class Engine(Protocol):
    """A way of checking."""

    name: str

    def check(self, arrangement: Arrangement, properties: Bound, options: Options) -> Result: ...

"""What a check is told, and what comes of it: options, verdicts, results.

With them what proves a pass (`Proof`), and what makes it say less than it seems to (`Vacuity`:
docs/decisions/0016-vacuity.md).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Literal, TypeVar

from llfsm_verify.checking.trace import Trace
from llfsm_verify.diagnostics import Diagnostic, Span
from llfsm_verify.kripke.labels.sizes import InputNote
from llfsm_verify.limits import Limits
from llfsm_verify.program.program import FaultSite

T = TypeVar("T")


class Verdict(StrEnum):
    HOLDS = "holds"
    VIOLATED = "violated"
    UNKNOWN = "unknown"


GoalKind = Literal["ltl", "enforce", "forbid", "forbid initially", "automaton", "automaton never"]
"""What a line of a property file asks for; the text of the automaton kinds is the name of a file."""


@dataclass(frozen=True, slots=True)
class Proof:
    """A certified inductive invariant. A property may take two: one for bad prefixes, one for other violations.

    `invariant` are the conjuncts in the user's names (none: what the types say is enough), `legend` says what the other
    names in them mean.
    """

    shows: Literal["faults", "prefixes", "rounds", "loops"]
    """What is never reached: a fault; a bad prefix; more rounds of a violation than `bound`; a loop that violates."""
    sentence: str
    """The same in a clause."""
    bound: int | None
    unit: Literal["cycle", "step"]
    """After which the invariant holds."""
    invariant: tuple[str, ...]
    legend: tuple[tuple[str, str], ...]
    k: int
    """0: the invariant is inductive and implies the property. Else: with it, k-induction over so many units does."""
    checked_by: tuple[str, ...]
    """The solvers, with their versions, that have checked initiation, consecution and implication."""
    smt: str
    """The invariant as a term of SMT-LIB 2 over integers and Booleans."""


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
        """With ``--strict`` such a pass does not count."""
        return bool(self.findings) and not self.accepted


@dataclass(frozen=True, slots=True)
class PropertyResult:
    """What a check says of one property."""

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
    vacuity: Vacuity = field(default_factory=Vacuity)
    """What makes a pass say less than it seems to."""
    witness: Trace | None = None
    """Of a property that holds: a run in which something happens."""
    more: tuple[Trace, ...] = ()
    """Of a property that is violated: other counterexamples, each different from all before."""
    only: str | None = None
    """Why there are no more of them than these, when more were asked for."""
    proofs: tuple[Proof, ...] = ()
    """Of a property that an inductive engine found to hold: why."""


@dataclass(frozen=True, slots=True)
class FaultFinding:
    """A fault, and a run that ends in it."""

    site: FaultSite
    trace: Trace


@dataclass(frozen=True, slots=True)
class FaultResult:
    """What a check says of faults."""

    verdict: Verdict
    """HOLDS: no fault is reachable."""
    findings: tuple[FaultFinding, ...]
    reason: str | None = None
    proofs: tuple[Proof, ...] = ()
    """By an inductive engine: why no fault is reachable."""


FAULTS = "faults"
"""What stands for them among the names of properties."""


@dataclass(frozen=True, slots=True)
class EarlyVerdict:
    """A verdict, *holds* or *violated*, that is known before the check ends: of the property `name`, or of FAULTS.
    A pass is one on fault-free runs until FAULTS is known to hold."""

    name: str
    verdict: Verdict
    engine: str


@dataclass(frozen=True, slots=True)
class Attempt:
    """What one of several engines did: the names of what it decided ("faults" for those), and why not the rest."""

    engine: str
    seconds: float
    decided: tuple[str, ...]
    reasons: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Exploration:
    """What an engine explored."""

    complete: bool | None = None
    """The whole state space; None: the engine explores none, and what it decides is decided."""
    states: int = 0
    """Configurations found."""
    transitions: int = 0
    """Distinct pairs of a configuration and a successor."""
    depth: int | None = None
    """Steps of the longest runs that a bounded engine looked at; `states` and `transitions` are then 0."""
    left_out: tuple[str, ...] = ()
    """What the search left out because no property depends on it; `states` and `transitions` then count without it."""
    stored: int | None = None
    """Of the configurations, those that were stored; None: all, because chains were not passed over."""
    counted: bool = True
    """`states` and `transitions` count all that were found; False: only those stored, and perhaps some more."""
    inputs: tuple[InputNote, ...] = ()
    """What was made of wide inputs: classes of their values, or all values."""
    longest: int | None = None
    """Every run ends, the longest after so many steps; None: some run goes on, or it was not looked at."""
    resumed_from: str | None = None
    """The checkpoint from which the search went on that decided what holds: what it says was not searched again."""


@dataclass(frozen=True, slots=True)
class Result:
    """What a check says of an arrangement: of every property, and of faults."""

    arrangement: str
    path: str
    engine: str
    complete: bool
    """The whole state space was explored, or everything decided by proofs and confirmed runs."""
    exploration: Exploration
    seconds: float
    assumptions: tuple[str, ...]
    """Names of the `assume` lines."""
    properties: tuple[PropertyResult, ...]
    faults: FaultResult
    interrupted: bool = False
    """Ended by Ctrl-C."""
    attempts: tuple[Attempt, ...] = ()
    """What each engine did, where several were asked."""
    strict: bool = False
    """A property that holds vacuously fails the check, and one that could not be looked at leaves it unknown."""
    asked_vacuity: bool = False
    """All that makes passes empty was asked for."""
    notes: tuple[str, ...] = ()
    """What may be meant otherwise in the arrangement, whatever is asked."""
    warnings: tuple[Diagnostic, ...] = ()
    """What may be meant otherwise in the properties, assumptions among them."""
    escape: Trace | None = None
    """A run to where the arrangement escapes the assumptions; the vacuity of what holds has the finding."""

    @property
    def exit_code(self) -> int:
        """130 interrupted, 1 violated or a fault, 4 unknown, 0 all hold (formats, Command line).

        `strict`: 1 also for a pass that is empty or rests on a checkpoint, 4 also for one that could not be looked at.
        """
        verdicts = [p.verdict for p in self.properties] + [self.faults.verdict]
        if self.interrupted:
            return 130
        if (
            Verdict.VIOLATED in verdicts
            or any(map(self.is_empty, self.properties))
            or any(map(self.is_claimed, verdicts))
        ):
            return 1
        return 4 if Verdict.UNKNOWN in verdicts or any(map(self.is_unseen, self.properties)) else 0

    def is_claimed(self, verdict: Verdict) -> bool:
        """Whether a verdict is a pass that rests on a checkpoint, and `strict` makes that a failure."""
        return self.strict and verdict is Verdict.HOLDS and self.exploration.resumed_from is not None

    def is_empty(self, item: PropertyResult) -> bool:
        """Whether a property holds, and `strict` makes that a failure."""
        return self.strict and item.verdict is Verdict.HOLDS and item.vacuity.fails

    def known(self) -> Iterator[EarlyVerdict]:
        """The verdicts that stay, whatever else is asked."""
        if self.faults.verdict is not Verdict.UNKNOWN and not self.is_claimed(self.faults.verdict):
            yield EarlyVerdict(FAULTS, self.faults.verdict, self.engine)
        for item in self.properties:
            passes = item.verdict is Verdict.HOLDS
            doubtful = not OPEN.isdisjoint(item.notes) or self.is_empty(item) or self.is_unseen(item)
            if item.verdict is Verdict.VIOLATED or (passes and not doubtful and not self.is_claimed(item.verdict)):
                yield EarlyVerdict(item.name, item.verdict, item.engine)

    def escape_of(self, item: PropertyResult) -> Trace | None:
        """The run that escapes the assumptions, where it is a finding about this property."""
        return self.escape if any(finding.kind == "escape" for finding in item.vacuity.findings) else None

    def is_unseen(self, item: PropertyResult) -> bool:
        """Whether a property holds, and `strict` wants to know more of that than is known."""
        unseen = item.vacuity.looked != "all" and not item.vacuity.accepted
        return self.strict and item.verdict is Verdict.HOLDS and unseen


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
class Options:
    """What a check is told beside the arrangement and its properties."""

    limits: Limits = Limits()
    keep_all_bits: bool = False
    faults: bool = True
    """Look for faults until they are decided; False: only as far as the properties need."""
    effort: int | None = None
    """Units of work (Z3's resource units) that the solvers of one engine may spend on finding something; None: as the
    engines say. Those of proofs then try once, and look for no runs but very short ones; what they find is certified
    beside that."""
    progress: Callable[[Progress], None] | None = None
    vacuity: Literal["antecedents", "all"] = "antecedents"
    """How far to look at properties that hold: for little time, or at every subformula."""
    strict: bool = False
    """A property that holds vacuously is a failure; `vacuity` is then "all"."""
    accepted: frozenset[str] = frozenset()
    """Properties that may hold vacuously."""
    allow_contradiction: bool = False
    """A property holds where no run satisfies the assumptions; otherwise it is unknown."""
    witnesses: bool = False
    """Show for every property that holds a run in which something happens."""
    traces: int = 1
    """Different counterexamples wanted of each violated property."""
    decided: Callable[[EarlyVerdict], None] | None = None
    """Takes each verdict when it is known, once. What is never told is unknown, or a pass about which more is to be
    found out first: how empty it is under `strict`, or whether any run satisfies the assumptions."""
    tell: Callable[[str], None] | None = None
    """Takes sentences that the user should see before the search ends."""
    quiet: bool = False
    """Do not tell that the search kernels are compiled first."""
    own: tuple[object, ...] = ()
    """What single engines are told: at most one value of each class of their options."""

    def of(self, kind: type[T]) -> T:
        """What the engines with these options are told; where nothing is, what is usual: ``kind()``."""
        return next((each for each in self.own if isinstance(each, kind)), None) or kind()

"""Results of checks: verdicts by the names of properties, with their traces."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from llfsm_verify.api.traces import Readable, TraceView, text_of
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.trace import Trace
from llfsm_verify.checking.verdict import FaultFinding, Proof, PropertyResult, Result, Vacuity, Verdict
from llfsm_verify.diagnostics import Diagnostic
from llfsm_verify.jsonvalue import Json
from llfsm_verify.logic.properties import PropertySet, asked_text
from llfsm_verify.program.program import FaultSite
from llfsm_verify.report.formats import REPORTS, Style, Written
from llfsm_verify.report.json import result_json, result_object
from llfsm_verify.report.wording import vacuity_texts, verdict_text

if TYPE_CHECKING:
    from rich.console import RenderableType


@dataclass(frozen=True, slots=True, repr=False)
class CheckResult(Readable):
    """The verdicts of a check, in the order of the properties: ``result["name"]``, or one after the other.

    ``print(result)`` shows what the command line does. `wrapped` is the value inside, which is private.
    """

    wrapped: Result
    _arrangement: Arrangement
    _properties: PropertySet

    def __getitem__(self, name: str) -> PropertyOutcome:
        """The property of this name. KeyError: the message says which there are."""
        for item in self.wrapped.properties:
            if item.name == name:
                return PropertyOutcome(item, self)
        known = ", ".join(f"`{item.name}`" for item in self.wrapped.properties) or "none at all"
        raise KeyError(f"there is no property `{name}`, only {known}")

    def __contains__(self, name: object) -> bool:
        return any(item.name == name for item in self.wrapped.properties)

    def __iter__(self) -> Iterator[PropertyOutcome]:
        return (PropertyOutcome(item, self) for item in self.wrapped.properties)

    def __len__(self) -> int:
        """The number of properties."""
        return len(self.wrapped.properties)

    def __bool__(self) -> bool:
        """TypeError: a result is not a yes or no, and *unknown* would be taken for one of them."""
        raise TypeError("a result is neither true nor false: ask for its verdict or exit_code")

    def __repr__(self) -> str:
        said = "".join(f", {item.name} {item.verdict}" for item in self.wrapped.properties)
        return f"<CheckResult of {self.wrapped.arrangement}{said}, faults {self.wrapped.faults.verdict}>"

    def _shown(self) -> Iterator[RenderableType]:
        from llfsm_verify.report.text import result_text

        return result_text(self.wrapped)

    def _pictures(self) -> Iterator[str]:
        for item in self:
            for trace in item.traces[:1]:
                yield from trace._pictures()

    @property
    def verdict(self) -> Verdict:
        """Of the whole check, faults included: violated if anything is, else unknown if anything is, else holds."""
        verdicts = {item.verdict for item in self.wrapped.properties} | {self.wrapped.faults.verdict}
        return next((v for v in (Verdict.VIOLATED, Verdict.UNKNOWN) if v in verdicts), Verdict.HOLDS)

    @property
    def exit_code(self) -> int:
        """As the command line's: 0 all hold, 1 something is violated, or holds vacuously and the check was `strict`,
        4 something is unknown, 130 interrupted."""
        return self.wrapped.exit_code

    @property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """What may be meant otherwise in the properties, such as a formula that lacks `G`."""
        return self.wrapped.warnings

    @property
    def escape(self) -> TraceView | None:
        """A run to where the arrangement escapes the assumptions; what holds then has a finding in its `vacuity`."""
        item, trace = next(filter(self.wrapped.escape_of, self.wrapped.properties), None), self.wrapped.escape
        return None if trace is None or item is None else _trace_view(trace, self, item)

    @property
    def faults(self) -> FaultsOutcome:
        """Whether a run can end in a fault."""
        return FaultsOutcome(self)

    @property
    def complete(self) -> bool:
        """All reachable configurations were explored."""
        return self.wrapped.complete

    @property
    def states(self) -> int:
        """Configurations found."""
        return self.wrapped.exploration.states

    @property
    def transitions(self) -> int:
        """Distinct pairs of a configuration and a successor that were found."""
        return self.wrapped.exploration.transitions

    @property
    def engine(self) -> str:
        """The engine that decided, or ``auto`` where several were asked."""
        return self.wrapped.engine

    @property
    def seconds(self) -> float:
        """How long the check took."""
        return self.wrapped.seconds

    @property
    def interrupted(self) -> bool:
        """Ctrl-C ended the search, and this is what it had found."""
        return self.wrapped.interrupted

    def to_dict(self) -> dict[str, Json]:
        """The JSON report (schema `result`) as dictionaries and lists."""
        return result_object(self.wrapped)

    def to_json(self) -> str:
        """The JSON report as text."""
        return result_json(self.wrapped)

    def report(self, name: str) -> str:
        """The report in a format of the command line, such as json or html. ValueError: it is not one of these."""
        written: Written = REPORTS.result.load(name)(self.wrapped, self._arrangement, Style())
        return written if isinstance(written, str) else text_of(written)


@dataclass(frozen=True, slots=True, repr=False)
class PropertyOutcome:
    """What was found about one property. `wrapped` is the value inside, which is private."""

    wrapped: PropertyResult
    result: CheckResult

    def __repr__(self) -> str:
        return f"<PropertyOutcome {self}>"

    def __str__(self) -> str:
        return f"{verdict_text(self.result.wrapped, self.wrapped)} {self.name}: {asked_text(self.kind, self.text)}"

    def __bool__(self) -> bool:
        """TypeError: as of the whole result."""
        raise TypeError("an outcome is neither true nor false: ask for its verdict")

    @property
    def name(self) -> str:
        """What it is called; a formula without a name is named after its line, such as ``L1``."""
        return self.wrapped.name

    @property
    def kind(self) -> str:
        """``ltl``, ``enforce``, ``forbid``, ``forbid initially``, ``automaton`` or ``automaton never``."""
        return self.wrapped.kind

    @property
    def text(self) -> str:
        """The formula, the regular expression, or the name of the automaton's file."""
        return self.wrapped.text

    @property
    def verdict(self) -> Verdict:
        """``holds``, ``violated`` or ``unknown``; it is also a str."""
        return self.wrapped.verdict

    @property
    def engine(self) -> str:
        """The engine that decided it, or those that were asked."""
        return self.wrapped.engine

    @property
    def reason(self) -> str | None:
        """Why the verdict is unknown, in a sentence."""
        return self.wrapped.reason

    @property
    def notes(self) -> tuple[str, ...]:
        """What else is to be said, each in a sentence."""
        return self.wrapped.notes

    @property
    def trace(self) -> TraceView | None:
        """A run that violates it."""
        return self._view(self.wrapped.trace)

    @property
    def traces(self) -> tuple[TraceView, ...]:
        """All counterexamples: the first one, and others that the option `traces` asked for."""
        first = () if self.wrapped.trace is None else (self.wrapped.trace,)
        return tuple(_trace_view(trace, self.result, self.wrapped) for trace in (*first, *self.wrapped.more))

    @property
    def witness(self) -> TraceView | None:
        """Of a property that holds, where the option `witnesses` asked for it: a run in which something happens."""
        return self._view(self.wrapped.witness)

    @property
    def vacuity(self) -> Vacuity:
        """What makes a pass say less than it seems to."""
        return self.wrapped.vacuity

    @property
    def vacuity_texts(self) -> tuple[str, ...]:
        """The same in sentences."""
        return tuple(vacuity_texts(self.result.wrapped, self.wrapped))

    @property
    def proofs(self) -> tuple[Proof, ...]:
        """Of a property that `induction` or `pdr` found to hold: why."""
        return self.wrapped.proofs

    def _view(self, trace: Trace | None) -> TraceView | None:
        return None if trace is None else _trace_view(trace, self.result, self.wrapped)


@dataclass(frozen=True, slots=True, repr=False)
class FaultsOutcome:
    """Whether a run can end in a fault, and each fault that was found, one after the other."""

    result: CheckResult

    def __repr__(self) -> str:
        return f"<FaultsOutcome {self.verdict}, {len(self)} found>"

    def __iter__(self) -> Iterator[FaultOutcome]:
        return (FaultOutcome(found, self.result) for found in self.result.wrapped.faults.findings)

    def __len__(self) -> int:
        """The number of faults that were found."""
        return len(self.result.wrapped.faults.findings)

    def __bool__(self) -> bool:
        """TypeError: none that was found is not none that there is."""
        raise TypeError("an outcome is neither true nor false: ask for its verdict")

    @property
    def verdict(self) -> Verdict:
        """``holds``: no run ends in a fault."""
        return self.result.wrapped.faults.verdict

    @property
    def reason(self) -> str | None:
        """Why the verdict is unknown, in a sentence."""
        return self.result.wrapped.faults.reason

    @property
    def proofs(self) -> tuple[Proof, ...]:
        """Why no run ends in a fault, where `induction` or `pdr` found that."""
        return self.result.wrapped.faults.proofs


@dataclass(frozen=True, slots=True, repr=False)
class FaultOutcome:
    """A place that faults, with a run to it. `wrapped` is the value inside, which is private."""

    wrapped: FaultFinding
    result: CheckResult

    def __repr__(self) -> str:
        return f"<FaultOutcome {self.code}: {self.message}>"

    def __str__(self) -> str:
        from llfsm_verify.report.text import fault_place

        return fault_place(self.wrapped.site)

    @property
    def code(self) -> str:
        """The code of the fault, such as ``F001``."""
        return self.wrapped.site.code

    @property
    def message(self) -> str:
        """What is wrong, in a sentence."""
        return self.wrapped.site.message

    @property
    def trace(self) -> TraceView:
        """A run that ends in it."""
        return _trace_view(self.wrapped.trace, self.result, self.wrapped.site)


def _trace_view(trace: Trace, result: CheckResult, shows: PropertyResult | FaultSite) -> TraceView:
    return TraceView(trace, result._arrangement, result._properties, shows)

"""The settings of a run, and what is made by them: for the first run, and for those that go on with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from types import MappingProxyType
from typing import Literal

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.arrangement.replacing import Change, Replacement
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Source
from llfsm_verify.jsonvalue import Json
from llfsm_verify.kripke.observing import AtomOverflow
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.program.program import Int
from llfsm_verify.runtime.live import IMPOSSIBLE
from llfsm_verify.runtime.live.loop import LiveCode, Loop, Prescribed
from llfsm_verify.runtime.live.pace import Pace
from llfsm_verify.runtime.live.plan import NONE, Plan, plan
from llfsm_verify.runtime.live.run import Run, Running
from llfsm_verify.runtime.live.supervised import Supervised
from llfsm_verify.runtime.recording.file import Recorder
from llfsm_verify.runtime.recording.origin import header_of
from llfsm_verify.runtime.stepping.drawing import ANEW, drawing_of, free_values
from llfsm_verify.runtime.swapping import DEFAULT
from llfsm_verify.runtime.whiteboard.shared import Shared

Processes = Literal["thread", "separate", "together"]


@dataclass(frozen=True, slots=True)
class Loaded:
    """A machine or a policy that was loaded into a run."""

    change: Change
    unchecked: bool
    """Whether the properties still hold was not checked."""

    @property
    def machine(self) -> str | None:
        """The instance that is replaced; None: a policy was loaded."""
        return self.change.machine if isinstance(self.change, Replacement) else None


@dataclass(frozen=True, slots=True)
class RunSettings:
    """The choices of whoever starts a run."""

    simulated: bool = False
    cycle_ms: Fraction | None = None
    held: Mapping[str, str] = field(default_factory=dict)
    """Inputs that keep a value, as users write it."""
    properties: PropertySet = NONE
    """What is monitored."""
    property_texts: Sequence[Source] = ()
    syntax: str = "llfsm"
    rate: Fraction = Fraction(1)
    seed: int | None = None
    """Inputs that nothing gives are drawn."""
    hold: str | None = "none"
    """For how long they keep their values, as users write it; None: by default."""
    draw: Mapping[str, str] = field(default_factory=dict)
    """How likely their values are."""
    jitter: Fraction | None = None
    strict: bool = False
    stops_on_violation: bool = False
    fed: frozenset[str] = frozenset()
    """Inputs that come from ports."""
    shown: frozenset[str] = frozenset()
    """Slots that ports read."""
    pace: Pace | None = None
    """With a clock outside; `rate` is 0 then."""
    record: str | Path | None = None
    sources: tuple[Source, ...] = ()
    """The texts of the first arrangement."""
    digest: str = ""
    """Of these."""
    limits: Limits = DEFAULT
    """Of the check before something is loaded."""
    whiteboard: str | None = None
    """The name under which other processes find it."""
    priority: int | None = None
    processes: Processes = "separate"
    """Each process of the arrangement is one of the system, one runs them all, or a thread of this one does."""

    def plan(self, given: Arrangement) -> Plan:
        """How it runs. Errors as for `plan`."""
        return plan(given, simulated=self.simulated, cycle_ms=self.cycle_ms, held=self.held, properties=self.properties)

    def first(
        self, how: Plan, code: LiveCode, *, rounds: int, free: Mapping[str, int] = MappingProxyType({}),
        script: Sequence[Prescribed] = (),
    ) -> Loop:  # fmt: skip
        """The loop of the first run. ValueError: see `Plan.period`, and `drawing_of`. DiagnosticError (E483): what a
        property reads leaves 64 bits before the first turn."""
        law = ANEW if self.seed is None else drawing_of(how.program, self.hold, self.draw, self.held)
        free = {**free_values(how.program, self.held, law, self.seed), **free}
        try:
            return how.loop(
                code, period=how.period(self.rate), rounds=rounds, seed=self.seed, law=law, jitter=self.jitter,
                strict=self.strict, stops_on_violation=self.stops_on_violation, free=free, fed=self.fed, script=script,
            )  # fmt: skip
        except AtomOverflow as overflow:
            atom = next((line.atoms[overflow.atom] for line in self.properties if overflow.atom in line.atoms), None)
            span = None if atom is None else atom.span(0, len(atom.text))
            message = f"{overflow} in the initial configuration, so a run cannot monitor it"
            hint = "leave out the property; `llfsm verify` also says that it is unknown"
            raise DiagnosticError(Diagnostic(IMPOSSIBLE, message, span, hint=hint)) from None

    def loop(self, arrangement: Arrangement) -> tuple[Arrangement, Loop]:
        """The arrangement as it runs, and a loop at its beginning. DiagnosticError, ValueError: it cannot run so."""
        how = self.plan(arrangement)
        return how.arrangement, self.first(how, how.code(), rounds=-1)

    def recorder(self, arrangement: Arrangement, loop: Loop, loaded: Sequence[Loaded]) -> Recorder | None:
        """A recording of it, if there is one. The first has the name that was given, those that go on with it numbers.

        DiagnosticError: it cannot be written.
        """
        if self.record is None:
            return None
        path = Path(self.record)
        free = {
            v.name: loop.code.layout.get(loop.record, v.name)
            for v in loop.code.program.vars
            if v.free and isinstance(v.type, Int)
        }
        header = self.header(arrangement, loaded, free, simulated=self.simulated)
        return Recorder(path if not loaded else path.with_name(f"{path.name}.{len(loaded) + 1}"), header, loop)

    def running(self, arrangement: Arrangement, shared: Shared, loaded: Sequence[Loaded] = ()) -> Running:
        """The processes, or the thread, of a run that goes on when it is started. DiagnosticError: see `recorder`."""
        loop, recorder = shared.loop, self.recorder(arrangement, shared.loop, loaded)
        if self.processes == "thread":
            return Run(loop, recorder, shared=shared, priority=self.priority, pace=self.pace)
        together = self.processes == "together"
        return Supervised(loop, shared, recorder, priority=self.priority, together=together, pace=self.pace)

    def header(
        self, arrangement: Arrangement, loaded: Sequence[Loaded], free: Mapping[str, int], *, simulated: bool
    ) -> dict[str, Json]:
        """What a recording says of a run of it."""
        return header_of(
            self.sources, arrangement, simulated=simulated, seed=self.seed, free=free,
            properties=self.property_texts, syntax=self.syntax, digest=self.digest,
            loaded=[[*one.change, one.unchecked] for one in loaded], external=self.pace is not None,
        )  # fmt: skip

"""A run of an arrangement in stretches, whose monitors are asked after every ringlet."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, NoReturn

from llfsm_verify.checking.replay.confirm import Schedule
from llfsm_verify.diagnostics import Disagreement
from llfsm_verify.logic.properties import Property
from llfsm_verify.monitoring.states import MonitorVerdict
from llfsm_verify.program.program import FaultSite
from llfsm_verify.runtime.stepping.monitored import FOR_EVER
from llfsm_verify.runtime.stepping.simulation import SimulationFault, SimulationOverflow
from llfsm_verify.values import Shown

if TYPE_CHECKING:
    from llfsm_verify.checking.trace import Trace
    from llfsm_verify.testing.failure import Finding
    from llfsm_verify.testing.subject import Subject


@dataclass(frozen=True, slots=True, repr=False)
class Stretch:
    """Some inputs change, then all keep their values for a number of ringlets or of cycles.

    Exactly one of `ringlets` and `cycles` is given. `changes`: inputs, and ages of untimed states, by name. `reads`: in
    the first ringlet, single reads of inputs (`snapshot: none`) by the names of their choices. `process`: it alone
    takes the turns; otherwise the processes go round. A stretch ends with its process, or behind the first
    stuttering step of an arrangement that ends meanwhile.
    """

    changes: Mapping[str, Shown] = field(default_factory=dict)
    ringlets: int | None = None
    cycles: int | None = None
    process: str | None = None
    reads: Mapping[str, Shown] = field(default_factory=dict)

    def __post_init__(self) -> None:
        count = self.cycles if self.ringlets is None else self.ringlets
        if count is None or (self.ringlets is not None and self.cycles is not None) or count < 0:
            raise ValueError("a stretch has a number of ringlets, or of cycles, and not both")

    @property
    def arguments(self) -> str:
        """What `Run.ringlets` and `Run.cycles` take, as Python text: the number first."""
        words = [str(self.turns)]
        words += [repr(dict(self.changes))] if self.changes else []
        words += [f"process={self.process!r}"] if self.process is not None else []
        words += [f"reads={dict(self.reads)!r}"] if self.reads else []
        return ", ".join(words)

    @property
    def turns(self) -> int:
        """Its number of ringlets or cycles."""
        return (self.cycles or 0) if self.ringlets is None else self.ringlets

    def of(self, turns: int) -> Stretch:
        """The same for another number of ringlets or cycles."""
        return replace(self, cycles=turns) if self.ringlets is None else replace(self, ringlets=turns)

    @property
    def unit(self) -> str:
        return "cycles" if self.ringlets is None else "ringlets"

    def __repr__(self) -> str:
        words = [repr(dict(self.changes))] if self.changes else []
        words.append(f"{self.unit}={self.turns}")
        words += [f"process={self.process!r}"] if self.process is not None else []
        words += [f"reads={dict(self.reads)!r}"] if self.reads else []
        return f"Stretch({', '.join(words)})"


@dataclass(frozen=True, slots=True)
class Taken:
    """A stretch as far as it was performed: in how many ringlets (one that faulted included), with which inputs."""

    stretch: Stretch
    ringlets: int
    inputs: Mapping[str, Shown]


@dataclass(frozen=True, slots=True)
class Failure:
    """Why a run failed: properties whose monitors are certain, or a fault, or (neither) a value that left 64 bits."""

    violated: tuple[Property, ...]
    fault: FaultSite | None

    @property
    def names(self) -> tuple[str, ...]:
        """The violated properties."""
        return tuple(line.name for line in self.violated)

    @property
    def text(self) -> str:
        if self.violated:
            return f"{', '.join(self.names)} violated"
        return "an integer left 64 bits: what holds is unknown" if self.fault is None else self.fault.message


class RunFailed(AssertionError):
    """A run violates a property or ends in a fault; as text: the table of its steps, and a program that repeats it."""

    def __init__(self, run: Run, failure: Failure) -> None:
        super().__init__(failure.text)
        self.run = run
        self.failure = failure

    def __str__(self) -> str:
        # While Hypothesis shrinks, many of these are raised, and few are read.
        try:
            return self.run.report()
        except Disagreement as problem:
            return f"{self.failure.text}\ninternal error: {problem}; please report it with the arrangement"


class Run:
    """A run that goes on stretch by stretch, and fails in the ringlet that violates a property or faults.

    `simulation` is where it stands (`simulation.values`, `simulation.state("m")`); step it by this object only. A run
    that has failed goes no further.
    """

    def __init__(self, subject: Subject, free: Mapping[str, Shown]) -> None:
        """Raises RunFailed when the first configuration violates a property; ValueError: wrong `free`."""
        self.subject = subject
        self.free = dict(free)
        self.simulation = subject.simulation.anew(free=free)
        self.inputs: dict[str, Shown] = {name: knob.shown(knob.start) for name, knob in subject.knobs.items()}
        """The inputs and ages as they are held."""
        self.taken: list[Taken] = []
        self.failure: Failure | None = None
        self._findings: tuple[Finding, ...] | None = None
        self._look()

    @property
    def steps(self) -> int:
        """Ringlets so far."""
        return sum(taken.ringlets for taken in self.taken)

    @property
    def changes(self) -> int:
        """Changes of inputs and ages so far, single reads included."""
        return sum(len(stretch.changes) + len(stretch.reads) for stretch in self.stretches)

    @property
    def stretches(self) -> tuple[Stretch, ...]:
        """The run in as few stretches as possible, each with the inputs that it really changes."""
        from llfsm_verify.testing.reproducing import plainly

        return tuple(plainly(self))

    # ------------------------------------------------------------ going on

    def ringlets(
        self,
        count: int,
        changes: Mapping[str, Shown] = MappingProxyType({}),
        *,
        process: str | None = None,
        reads: Mapping[str, Shown] = MappingProxyType({}),
    ) -> None:
        """Change some inputs and go on for `count` ringlets. Errors as for `take`."""
        self.take(Stretch(changes, ringlets=count, process=process, reads=reads))

    def cycles(
        self,
        count: int,
        changes: Mapping[str, Shown] = MappingProxyType({}),
        *,
        process: str | None = None,
        reads: Mapping[str, Shown] = MappingProxyType({}),
    ) -> None:
        """Change some inputs and go on until `count` cycles are complete. Errors as for `take`."""
        self.take(Stretch(changes, cycles=count, process=process, reads=reads))

    def take(self, stretch: Stretch, after_each: Callable[[], None] | None = None) -> None:
        """Go on for a stretch; `after_each` is called after every ringlet.

        Raises RunFailed in the ringlet that violates a property or faults; ValueError for a name or value that the
        arrangement does not have, RuntimeError when the run has failed before.
        """
        __tracebackhide__ = True
        if self.failure is not None:
            raise RuntimeError(f"the run has ended: {self.failure.text}")
        self._check(stretch)
        self.inputs.update(stretch.changes)
        simulation, begin = self.simulation, self.simulation.steps
        left = FOR_EVER if stretch.ringlets is None else stretch.ringlets
        cycles = -1 if stretch.cycles is None else stretch.cycles
        faulted, over = False, simulation.ended
        try:
            first = True
            while left and cycles:
                before = simulation.steps
                if stretch.process is not None and stretch.process not in simulation.enabled:
                    break
                if stretch.process is not None or after_each is not None or (first and stretch.reads):
                    simulation.ringlet({**self.inputs, **(stretch.reads if first else {})}, stretch.process)
                    completed = int(simulation.cycle_complete)
                else:
                    _, completed = simulation.hold(self.inputs, ringlets=left, cycles=None if cycles < 0 else cycles)
                first = False
                cycles -= completed + simulation.stuttered
                left -= simulation.steps - before
                self._look()
                if after_each is not None:
                    after_each()
                if simulation.stuttered and not over:
                    break
        except SimulationFault as fault:
            faulted = True
            self._fail(Failure((), fault.site))
        except SimulationOverflow:
            faulted = True
            self._fail(Failure((), None))
        finally:
            done = simulation.steps - begin + faulted
            self.taken.append(Taken(self._performed(stretch, done, cycles), done, dict(self.inputs)))

    def _check(self, stretch: Stretch) -> None:
        """ValueError: the stretch names what is not there."""
        for name in stretch.changes:
            if name not in self.subject.knobs:
                known = ", ".join(self.subject.knobs) or "none at all"
                raise ValueError(f"there is no input {name!r} that can change, only {known}")
        names = [p.name for p in self.subject.program.processes]
        if stretch.process is not None and stretch.process not in names:
            raise ValueError(f"there is no process {stretch.process!r}, only {', '.join(names)}")

    def _look(self) -> None:
        """RunFailed when a monitor says that its property is violated."""
        __tracebackhide__ = True
        states = self.simulation.monitor_states
        tested, monitors = self.subject.tested, self.subject.monitors
        violated = [
            line for name, line in tested.items() if monitors[name].verdicts[states[name]] is MonitorVerdict.FALSE
        ]
        if violated:
            self._fail(Failure(tuple(violated), None))

    def _fail(self, failure: Failure) -> NoReturn:
        __tracebackhide__ = True
        self.failure = failure
        raise RunFailed(self, failure) from None

    def _performed(self, stretch: Stretch, ringlets: int, left: int) -> Stretch:
        """The stretch as far as it went. A fault does not tell in which of its cycles it was."""
        if stretch.cycles is None:
            return replace(stretch, ringlets=ringlets)
        if self.failure is not None and not self.failure.violated:
            return stretch
        complete = not ringlets or self.simulation.cycle_complete or self.simulation.stuttered
        return replace(stretch, cycles=stretch.cycles - left + (not complete))

    # ------------------------------------------------------------ telling

    @property
    def schedule(self) -> Schedule:
        """The whole run as the executor is told it: each ringlet's process, and a value for every choice."""
        from llfsm_verify.testing.reproducing import schedule_of

        return schedule_of(self)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """The failure, property by property: performed again, and confirmed. Empty when there is none.

        Raises Disagreement when the second evaluation does not confirm what the monitor says.
        """
        if self._findings is None:
            from llfsm_verify.testing.failure import findings

            self._findings = findings(self)
        return self._findings

    def trace(self) -> Trace:
        """The run as a value; of one that failed, with the atoms of the first violated property."""
        from llfsm_verify.testing.failure import trace_of

        return trace_of(self)

    def table(self) -> str:
        """The steps as `llfsm verify` shows them."""
        from llfsm_verify.report.plain import plain_text
        from llfsm_verify.report.steptable import StepTable

        return plain_text([StepTable(self.trace())])

    def program(self) -> str:
        """Python text that repeats the run by itself."""
        from llfsm_verify.testing.reproducing import program_of

        return program_of(self)

    def report(self) -> str:
        """What failed, the table of the steps, and the program. Raises Disagreement as `findings`."""
        from llfsm_verify.testing.failure import report_of

        return report_of(self)

    def save(self, directory: str | Path, name: str | None = None) -> list[Path]:
        """Write the run as trace files, each with `expect: holds`; returns them.

        One that failed: a file for each violated property (`NAME.trace.yaml`), or for the fault; none is written
        where one of that name shows the failure already, and where it shows another, the name gets a number. Otherwise
        `name` says which tested property the file is about. DiagnosticError (E405) when they cannot be written;
        ValueError when there is nothing to write.
        """
        from llfsm_verify.testing.failure import save

        return save(self, Path(directory), name)

    def __repr__(self) -> str:
        return f"<run of {self.subject.arrangement.name}: {self.steps} steps, {self.changes} changes>"

"""Runs of an arrangement in stretches, whose monitors are asked after every ringlet; told again to the executor, and to
people as a program to paste. `load` makes the arrangement of a test, from files or from values.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, NoReturn

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.goals.kinds import CHECKED
from llfsm_verify.checking.replay.confirm import Schedule
from llfsm_verify.diagnostics import Disagreement, Source, counted
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.logic.reading import names_file, read_source
from llfsm_verify.monitoring.states import MonitorVerdict
from llfsm_verify.program.moves import Move
from llfsm_verify.runtime.stepping.monitored import FOR_EVER
from llfsm_verify.runtime.stepping.simulation import SimulationFault, SimulationOverflow
from llfsm_verify.testing.stretches import Failure, Performed, Stretch, Wrapper, unwrap
from llfsm_verify.testing.tested import Tested
from llfsm_verify.values import Shown

if TYPE_CHECKING:
    from llfsm_verify.checking.trace import Trace
    from llfsm_verify.testing.failure import Finding


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
        self.inputs: dict[str, Shown] = {name: each.shown(each.start) for name, each in subject.stimuli.items()}
        """The inputs and ages as they are held."""
        self.performed: list[Performed] = []
        self.failure: Failure | None = None
        self._findings: tuple[Finding, ...] | None = None
        self._look()

    @property
    def steps(self) -> int:
        """Ringlets so far."""
        return sum(taken.ringlets for taken in self.performed)

    @property
    def changes(self) -> int:
        """Changes of inputs and ages so far, single reads included."""
        return sum(len(stretch.changes) + len(stretch.reads) for stretch in self.stretches)

    @property
    def stretches(self) -> tuple[Stretch, ...]:
        """The run in as few stretches as possible, each with the inputs that it really changes."""
        return tuple(plainly(self.subject, self.performed))

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
            self.performed.append(Performed(self._performed(stretch, done, cycles), done, dict(self.inputs)))

    def _check(self, stretch: Stretch) -> None:
        """ValueError: the stretch names what is not there."""
        for name in stretch.changes:
            if name not in self.subject.stimuli:
                known = ", ".join(self.subject.stimuli) or "none at all"
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
        return schedule_of(self.subject, self.free, self.performed, self.simulation.record)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """The failure, property by property: performed again, and confirmed. Empty when there is none.

        Raises Disagreement when the second evaluation does not confirm what the monitor says.
        """
        if self.failure is None:
            return ()
        if self._findings is None:
            from llfsm_verify.testing.failure import findings

            self._findings = findings(self.subject, self.failure, self.schedule)
        return self._findings

    def trace(self) -> Trace:
        """The run as a value; of one that failed, with the atoms of the first violated property."""
        from llfsm_verify.testing.failure import trace_of

        if self.findings:
            return self.findings[0].trace
        return trace_of(self.subject, self.schedule)

    def table(self) -> str:
        """The steps as `llfsm verify` shows them."""
        from llfsm_verify.report.plain import plain_text
        from llfsm_verify.report.steptable import StepTable

        return plain_text([StepTable(self.trace())])

    def program(self) -> str:
        """Python text that repeats the run by itself."""
        return program_of(self.subject, self.free, self.stretches)

    def report(self) -> str:
        """What failed, the table of the steps, and the program. Raises Disagreement as `findings`."""
        from llfsm_verify.testing.failure import failure_text

        size = f"{counted(self.steps, 'step')}, {counted(self.changes, 'change')} of inputs"
        shown = failure_text(self.subject, self.failure, self.findings)
        return "\n".join([shown, f"{size}. The same run again:\n", self.program()])

    def save(self, directory: str | Path, name: str | None = None) -> list[Path]:
        """Write the run as trace files, each with `expect: holds`; returns them.

        One that failed: a file for each violated property (`NAME.trace.yaml`), or for the fault; none is written
        where one of that name shows the failure already, and where it shows another, the name gets a number. Otherwise
        `name` says which tested property the file is about. DiagnosticError (E405) when they cannot be written;
        ValueError when there is nothing to write.
        """
        from llfsm_verify.testing.failure import save_failure, save_passed

        if self.failure is not None:
            return save_failure(self.subject, self.findings, Path(directory))
        return save_passed(self.subject, self.schedule, Path(directory), name)

    def __repr__(self) -> str:
        return f"<run of {self.subject.arrangement.name}: {self.steps} steps, {self.changes} changes>"


class Subject(Tested):
    """An arrangement to be run at random, with monitors of its properties; compiled once, when it is first run."""

    def start(self, free: Mapping[str, Shown] | None = None) -> Run:
        """A new run, at the beginning. `free` gives values to inputs that never change and have no `init`.

        Raises RunFailed when the first configuration already violates a property, ValueError for wrong `free`.
        """
        return Run(self, dict(free or {}))


def schedule_of(subject: Tested, free: Mapping[str, Shown], performed: Sequence[Performed], end: bytes) -> Schedule:
    """The run that ends in the configuration `end` as a schedule, made by stepping it once more."""
    simulation = subject.simulation.anew(free=free)
    chosen = subject.execution.free(simulation.record)
    moves: list[Move] = []
    turn = 0
    count = len(subject.program.processes)
    names = [p.name for p in subject.program.processes]
    record = simulation.record
    for part in performed:
        for number in range(part.ringlets):
            values = {**part.inputs, **(part.stretch.reads if number == 0 else {})}
            choices = simulation.choices(values)
            enabled = subject.execution.enabled(record)
            process = None
            if enabled and part.stretch.process is not None:
                process = names.index(part.stretch.process)
            elif enabled:
                process = min(enabled, key=lambda p: (p - turn) % count)
            moves.append(Move(process, choices))
            result = subject.execution.step(record, moves[-1])
            record = result.record
            if process is not None and not result.status:
                turn = (process + 1) % count
    assert record == end, "the run is told as it was"
    return Schedule(chosen, tuple(moves), None)


def plainly(subject: Tested, performed: Sequence[Performed]) -> list[Stretch]:
    """The same run in as few stretches as possible, each with the inputs that it really changes."""
    now: dict[str, Shown] = {name: each.shown(each.start) for name, each in subject.stimuli.items()}
    found: list[Stretch] = []
    for part in performed:
        if not part.ringlets:
            continue
        one = replace(part.stretch, changes={name: value for name, value in part.inputs.items() if now[name] != value})
        now = dict(part.inputs)
        last = found[-1] if found else None
        if last is not None and not (one.changes or one.reads) and (last.unit, last.process) == (one.unit, one.process):
            found[-1] = last.of(last.turns + one.turns)
        else:
            found.append(one)
    return found


def program_of(subject: Tested, free: Mapping[str, Shown], stretches: Sequence[Stretch]) -> str:
    """Python text that makes the run anew and, when it failed, fails again."""
    properties = _properties_text(subject)
    lines: list[str] = []
    given = f", {properties}" if properties else ""
    lines.append(f"subject = load({subject.arrangement.path!r}{given})")
    lines.append(f"run = subject.start({dict(free)!r})" if free else "run = subject.start()")
    lines += [f"run.{stretch.unit}({stretch.arguments})" for stretch in stretches]
    imports = ["from decimal import Decimal", ""] if any("Decimal(" in line for line in lines) else []
    return "\n".join([*imports, "from llfsm_verify.testing import load", "", *lines]) + "\n"


def _properties_text(subject: Tested) -> str:
    """The properties as an argument of `load`: their files, or their lines."""
    given = subject.given
    words = [repr(Path(p).as_posix()) if names_file(p) else _quoted(str(p)) for p in given]
    if not words:
        return ""
    return words[0] if len(words) == 1 else f"[{', '.join(words)}]"


def _quoted(text: str) -> str:
    """A text as Python writes it: over several lines where it has some."""
    plain = "\n" in text and '"""' not in text and "\\" not in text and not text.endswith('"')
    return f'"""{text}"""' if plain else repr(text)


Asked = str | Path | Sequence[str | Path]
"""Properties: the text of a property file, the path of one (a Path, or a str that ends in `.ltl`), or several."""


def load(arrangement: str | Path | Arrangement | Wrapper, properties: Asked = ()) -> Subject:
    """The arrangement of a file, or what `lv.load` or `lv.build` gives, with properties.

    Raises DiagnosticError: one of them is wrong.
    """
    if isinstance(arrangement, str | Path):
        from llfsm_verify.arrangement import load_arrangement

        found = load_arrangement(arrangement)
    else:
        found = unwrap(arrangement)
    given = [properties] if isinstance(properties, (str, Path)) else list(properties)
    sources = [read_source(p) if names_file(p) else Source("properties", str(p)) for p in given]
    return Subject(found, parse_properties(sources, features=CHECKED), given)


def found_beside(path: str | Path, folder: Path) -> str:
    """`path` as seen from here, when it is relative to `folder`; absolute paths stay."""
    whole = os.path.normpath(folder / path)
    here = os.path.relpath(whole)
    return whole if here.startswith(os.pardir) else Path(here).as_posix()

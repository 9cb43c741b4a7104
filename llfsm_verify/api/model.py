"""An arrangement to check, ask, lint, run, monitor and draw."""

from __future__ import annotations

import os
import random
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Literal, Unpack, cast, overload

from llfsm_verify.api.answers import CoverageReport, LintReport, QueryAnswer, RecordingOutcome, ReplayOutcome
from llfsm_verify.api.monitors import MonitorSet, monitors_of
from llfsm_verify.api.options import (
    CheckOptions,
    Draw,
    ExploreOptions,
    LimitOptions,
    QueryOptions,
    by_input,
    check_options,
    checked,
    laws_of,
    limits_of,
    query_options,
    value_text,
)
from llfsm_verify.api.properties import Properties, check_syntax, property_sources, read_properties
from llfsm_verify.api.results import CheckResult
from llfsm_verify.api.traces import Ending, RunView, SimulatedRun, TraceView, Value
from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.engine_option import is_count
from llfsm_verify.checking.goals.kinds import CHECKED
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.checking.trace import Trace
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Span
from llfsm_verify.files import refuse_special, replacing
from llfsm_verify.kripke.structure import Structure, structure
from llfsm_verify.limits import Budget
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.program.program import Program
from llfsm_verify.report.drawing import NO_LIBRARY
from llfsm_verify.report.drawing.extract import arrangement_graph, machine_graph
from llfsm_verify.report.drawing.formats import DRAWINGS, GRAPHS
from llfsm_verify.report.drawing.graph import Graph, summarise
from llfsm_verify.report.simulation import ending
from llfsm_verify.runtime.stepping.drawing import drawing_of
from llfsm_verify.runtime.stepping.random_run import RandomRun, Script, input_problem
from llfsm_verify.runtime.stepping.simulation import Simulation
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.verification.engines import DEFAULT_ENGINE
from llfsm_verify.verification.query import ask, parse_query
from llfsm_verify.verification.replay import replay_file
from llfsm_verify.verification.verify import verify

if TYPE_CHECKING:
    from llfsm_verify.api.running import LiveRun
    from llfsm_verify.runtime.ports.port import PortSpec
    from llfsm_verify.runtime.swapping.settings import Processes
    from llfsm_verify.runtime.whiteboard.client import Whiteboard

QUERY = "<query>"
"""The name of a query in diagnostics."""


def load(path: str | Path) -> Model:
    """The arrangement in a file, with the machine files that it names (``"-"`` reads standard input).

    Raises `DiagnosticError` with everything that is wrong in the files.
    """
    return Model(load_arrangement(path))


def replay(path: str | Path, model: Model | None = None) -> ReplayOutcome | RecordingOutcome:
    """Run a saved trace or a recording again, on the arrangement that it names or has, or on `model`.

    Raises `DiagnosticError`: what is wrong with the file, or that the arrangement has not got what it names.
    """

    from llfsm_verify.runtime.recording.file import is_recording
    from llfsm_verify.runtime.recording.repeating import replay_recording

    def found(path: str, /, *, named_at: Span | None = None) -> Arrangement:
        return load_arrangement(path, named_at=named_at) if model is None else model.wrapped

    instead = None if model is None else model.path
    if is_recording(path):
        return RecordingOutcome(replay_recording(path, instead, found))
    return ReplayOutcome(replay_file(str(path), instead, found))


def with_files(document: Mapping[str, object], name: Callable[[str], str]) -> dict[str, object]:
    """An arrangement in the shape of a file, in which the files that it names have other names."""

    def named(entry: object) -> object:
        if not isinstance(entry, Mapping):
            return entry
        found = dict(entry)
        if isinstance(found.get("file"), str | Path):
            found["file"] = name(str(found["file"]))
        for key in {"inline", "access"} & found.keys():
            found[key] = named(found[key])
        for key in {"machines", "knowledge", "environment"} & found.keys():
            inner = found[key]
            one = not isinstance(inner, Mapping) or not {"file", "inline"}.isdisjoint(inner)
            found[key] = named(inner) if one else {each: named(value) for each, value in inner.items()}
        return found

    found = named(document)
    assert isinstance(found, dict)
    return found


@dataclass(frozen=True, slots=True, repr=False)
class Model:
    """An arrangement: what `load` and `build` give. `wrapped` is the value inside, which is private."""

    wrapped: Arrangement
    _document: Mapping[str, object] | None = field(default=None, compare=False)
    """What `build` made it of, with absolute paths."""

    def write(self, path: str | Path) -> None:
        """Write an arrangement of `build` as a file in the format that its ending stands for, or else YAML.

        Machine files are named from where it lies.

        ValueError: it comes from a file already, or the format can only be read. OSError: the file cannot be
        written, or is a device or a pipe.
        """
        if self._document is None:
            raise ValueError(f"`{self.name}` comes from {self.path} already: copy that file")
        from llfsm_verify.arrangement.formats import writer_of

        folder = Path(path).resolve().parent
        document = with_files(self._document, lambda file: os.path.relpath(file, folder))
        text = writer_of(str(path)).arrangement(document)
        target = Path(path).resolve()  # a link stays one
        with suppress(FileNotFoundError):
            refuse_special(target.stat())
        with replacing(target) as file:
            file.write(text.encode())

    def __repr__(self) -> str:
        return f"<Model {self.name}: {', '.join(self.machines)}>"

    def _repr_svg_(self) -> str | None:
        """The drawing, for notebooks; None where pygraphviz, which makes it, is not installed."""
        try:
            return self.draw(format="svg")
        except DiagnosticError as error:
            if error.diagnostics[0].code != NO_LIBRARY:
                raise
            return None

    @property
    def name(self) -> str:
        """What the arrangement is called."""
        return self.wrapped.name

    @property
    def path(self) -> str:
        """The file that it comes from."""
        return self.wrapped.path

    @property
    def machines(self) -> dict[str, tuple[str, ...]]:
        """The machines in the order of their turns, each with the names of its states."""
        return {m.name: tuple(state.name for state in m.states) for m in self.wrapped.machines}

    @property
    def warnings(self) -> tuple[Diagnostic, ...]:
        """What is not wrong in the files, but worth a look."""
        return self.wrapped.warnings

    def check(
        self,
        properties: Properties = (),
        engine: str = DEFAULT_ENGINE,
        *,
        syntax: str = "llfsm",
        **options: Unpack[CheckOptions],
    ) -> CheckResult:
        """Decide the properties (see `Properties`) and whether a run can end in a fault.

        `engine` and `syntax` are those of the command line, the options are those of `CheckOptions`. What a limit or
        Ctrl-C ends is *unknown*. Raises `DiagnosticError` for wrong properties, TypeError for an option that there is
        not, ValueError for a wrong value, an unknown engine or options that do not go together, and `Disagreement`
        when a check of a result fails.
        """
        given = checked("check", options, CheckOptions, engine)
        asked = read_properties(properties, syntax)
        wanted = check_options(given, engine)
        unknown = sorted(wanted.accepted - {p.name for p in asked.goals})
        if unknown:
            raise ValueError(f"the option `accept_vacuity` names no property: {', '.join(unknown)}")
        return CheckResult(verify(self.wrapped, asked, wanted, engine), self.wrapped, asked)

    def query(
        self, formula: str, engine: str = DEFAULT_ENGINE, *, syntax: str = "llfsm", **options: Unpack[QueryOptions]
    ) -> QueryAnswer:
        """Find a shortest run to a step after which the state formula is true, or that no run reaches one.

        Raises as `check` does.
        """
        wanted = query_options(checked("query", options, QueryOptions, engine), engine)
        check_syntax(syntax)
        return QueryAnswer(ask(self.wrapped, parse_query(formula, QUERY, syntax), wanted, engine), self.wrapped)

    def lint(
        self,
        properties: Properties = (),
        *,
        syntax: str = "llfsm",
        local: bool = False,
        **options: Unpack[LimitOptions],
    ) -> LintReport:
        """What is wrong with the arrangement, whatever its properties are. What `properties` read counts as read.

        Without `max_states`, the reachable configurations are explored up to a million.

        `local`: only what single turns and the text tell, without the reachable configurations. Raises as `check` does.
        """
        from llfsm_verify.analysis.lint.run import lint  # Z3

        given = checked("lint", options, LimitOptions)
        if local and "max_states" in given:
            raise ValueError("the option `max_states` is for the reachable configurations, which `local` leaves alone")
        atoms = bind(self.wrapped, read_properties(properties, syntax)).atoms
        return LintReport(lint(self.wrapped, limits_of(given), local=local, atoms=atoms))

    def coverage(self, *traces: str | Path, **options: Unpack[LimitOptions]) -> CoverageReport:
        """What the runs in these saved traces and recordings cover: states, transitions, branches and conditions
        (masking MC/DC), and which of the others no run can.

        Without `max_states`, a million configurations are explored. Raises as `check` does, and `DiagnosticError` for
        runs of another arrangement.
        """
        from llfsm_verify.analysis.coverage.measure import coverage
        from llfsm_verify.runtime.recording.covering import covered_by

        limits = limits_of(checked("coverage", options, LimitOptions))
        covered = covered_by(self.wrapped, [str(path) for path in traces])
        return CoverageReport(coverage(self.wrapped, covered.seen, covered.runs, limits))

    def simulate(
        self,
        steps: int | None = None,
        *,
        cycles: int | None = None,
        seed: int | None = None,
        inputs: Mapping[str, Value] | None = None,
        script: Mapping[int, Mapping[str, Value]] | None = None,
        hold: str | None = None,
        draw: Draw | None = None,
    ) -> SimulatedRun:
        """A run of so many `steps` (ringlets; 20 unless something else is said) or whole `cycles`.

        What the inputs are, and which process steps, is drawn at random from `seed` (a new one, which the run has, when
        it is None). `inputs` have values throughout, those of `script` from a step on, which counts from 1. A drawn
        input keeps its value for about `hold` (``"5s"``, ``"20cycles"``, or ``"none"``); `draw` has the probability
        that an input is true, or those of its values by value. ValueError: there is no such input or value.
        """
        for what, number in (("steps", steps), ("cycles", cycles)):
            if number is not None and not is_count(number):
                raise ValueError(f"`{what}` is a whole number from 1, not {number!r}")
        if steps is not None and cycles is not None:
            raise ValueError("a run has so many `steps` or so many `cycles`, not both")
        program = lower(self.wrapped, keep_all_bits=True)
        texts = _input_texts(program, inputs, script)
        seed = random.SystemRandom().randrange(1 << 32) if seed is None else seed
        law = drawing_of(program, hold, laws_of(draw), texts[0])
        source = random.Random(seed)  # noqa: S311 - no secrets
        run = RandomRun(Execution(program), Script(texts), source, law=law, seed=seed)
        done = tuple(run.steps(steps, cycles))
        trace = Trace(run.initial, run.free, (), done, None, run.fault, period=program.period)
        return SimulatedRun(trace, self.wrapped, seed, cast(Ending, ending(run)), run.visits.never)

    def run(
        self,
        properties: Properties = (),
        *,
        syntax: str = "llfsm",
        inputs: Mapping[str, Value] | None = None,
        simulate: bool = False,
        seed: int | None = None,
        hold: str | None = None,
        draw: Draw | None = None,
        cycles: int | None = None,
        cycle_ms: float | None = None,
        rate: float = 1,
        whiteboard: str | None = None,
        record: str | Path | None = None,
        priority: int | None = None,
        stop_on: Sequence[Literal["overrun", "violation"]] = (),
        processes: Processes = "thread",
        ports: str | Path | Sequence[PortSpec] = (),
    ) -> LiveRun:
        """Let the arrangement run in the machine code that was verified, and monitor `properties` meanwhile.

        A cycle takes `cycle_ms` (of an untimed arrangement), `rate` times as fast; 0: without waiting. It ends after so
        many `cycles`, by itself, by `LiveRun.stop`, or where it is to `stop_on` something. `inputs` hold values; with
        `simulate`, the model of the surroundings also runs, and other inputs are drawn from `seed` as `Model.simulate`
        draws them, with `hold` and `draw`. Others read and post on the `whiteboard` of that name (`Whiteboard`), and
        `record` names a new file for a recording. `ports` is a file of ports, or has them. The loop is on a thread
        without the interpreter's lock; `processes` other than ``"thread"`` forks it, as `llfsm run` does.

        DiagnosticError: it cannot run, a property is wrong, or the recording cannot be written. ValueError: an option
        wants another value. WhiteboardError: the whiteboard cannot be served.
        """
        from llfsm_verify.api.running import start
        from llfsm_verify.runtime.swapping.settings import RunSettings

        check_syntax(syntax)
        for what, number in (("cycles", cycles), ("priority", priority)):
            if number is not None and not is_count(number):
                raise ValueError(f"`{what}` is a whole number from 1, not {number!r}")
        if priority is not None and priority > 99:
            raise ValueError(f"`priority` is at most 99, not {priority}")
        if not 0 <= rate <= 10**6 or (cycle_ms is not None and not 0 < cycle_ms <= 10**12):
            raise ValueError("`rate` is from 0 to 1000000, and `cycle_ms` is a positive number")
        if set(stop_on) - {"overrun", "violation"} or processes not in ("thread", "separate", "together"):
            raise ValueError("`stop_on` has overrun and violation, and `processes` is thread, separate or together")
        texts = property_sources(properties)
        settings = RunSettings(
            simulated=simulate, cycle_ms=None if cycle_ms is None else Fraction(str(cycle_ms)),
            held={name: value_text(value) for name, value in by_input("inputs", inputs).items()},
            properties=parse_properties(texts, syntax, CHECKED), property_texts=texts, syntax=syntax,
            rate=Fraction(str(rate)), seed=seed, hold=hold, draw=laws_of(draw), strict="overrun" in stop_on,
            stops_on_violation="violation" in stop_on, record=record, whiteboard=whiteboard, priority=priority,
            processes=processes,
        )  # fmt: skip
        return start(self.wrapped, settings, cycles, ports)

    def start(self, seed: int | None = None, *, hold: str | None = None, draw: Draw | None = None) -> Simulation:
        """A simulation to step through, by ringlets, cycles or millions of ringlets; see `Simulation`.

        With a `seed`, inputs are drawn as `simulate` draws them. ValueError: wrong `hold` or `draw`.
        """
        program = lower(self.wrapped, keep_all_bits=True)
        return Simulation(program, seed, drawing_of(program, hold, laws_of(draw)))

    def monitor(self, properties: Properties, *, syntax: str = "llfsm") -> MonitorSet:
        """The monitors of properties. Raises `DiagnosticError`: wrong properties, or a monitor that is too large."""
        return monitors_of(self.wrapped, read_properties(properties, syntax))

    def watch(
        self, whiteboard: Whiteboard, properties: Properties, *, syntax: str = "llfsm"
    ) -> Iterator[tuple[str, str, int | None]]:
        """Decide properties on the frames of this arrangement where it runs, from outside (docs/monitors.md).

        Gives the name of each property with ``"violated"`` or ``"satisfied"`` and the number of the frame as soon as
        that is known, and where the run has ended the others, with None: also ``"undecided"``. DiagnosticError: a
        property is wrong, or frames do not show what it needs; WhiteboardError: there are too many subscribers.
        """
        from llfsm_verify.runtime.deciding.frames import FrameMonitors

        monitors = FrameMonitors(self.wrapped, read_properties(properties, syntax), whiteboard.slots)
        frames = whiteboard.frames()

        def decided() -> Iterator[tuple[str, str, int | None]]:
            with frames:
                for frame in frames:
                    yield from ((d.line.name, d.verdict, d.frame) for d in monitors.read(frame))
            yield from ((d.line.name, d.verdict, None) for d in monitors.results if d.frame is None)

        return decided()

    def explore(
        self, properties: Properties = (), *, syntax: str = "llfsm", **options: Unpack[ExploreOptions]
    ) -> Structure:
        """The Kripke structure (docs/kripke.md), whose letters show the atoms of `properties`.

        One that a limit cuts short says so in `complete` and `stopped`. Raises as `check` does, and `LimitReached`
        where what was found cannot be put together within the limits.
        """
        given = checked("explore", options, ExploreOptions)
        problem = bind(self.wrapped, read_properties(properties, syntax))
        return structure(self.wrapped, problem, budget=Budget(limits_of(given)), jobs=options.get("jobs"))

    @overload
    def draw(
        self, machine: str | None = None, *, trace: RunView | str | Path | None = None, format: Literal["png"]
    ) -> bytes: ...

    @overload
    def draw(
        self,
        machine: str | None = None,
        *,
        trace: RunView | str | Path | None = None,
        format: Literal["dot", "mermaid", "svg"] = "dot",
    ) -> str: ...

    @overload
    def draw(
        self, machine: str | None = None, *, trace: RunView | str | Path | None = None, format: str
    ) -> str | bytes: ...

    def draw(
        self,
        machine: str | None = None,
        *,
        trace: RunView | str | Path | None = None,
        format: str = "dot",  # noqa: A002 - the option's name
    ) -> str | bytes:
        """The arrangement, or one of its machines, as ``dot``, ``mermaid``, ``svg`` or ``png`` (which is bytes).

        `trace` is drawn on the machine, or on all: a run of this model, or the path of a saved trace, which is
        performed again first.
        ValueError: there is no such machine or format, or the run is of another arrangement. `DiagnosticError`:
        ``svg`` and ``png`` need pygraphviz (E406), or the saved trace is wrong or does not fit (E411).
        """
        write = DRAWINGS.load(format)
        names = [m.name for m in self.wrapped.texts]
        if machine is not None and machine not in names:
            raise ValueError(f"there is no machine `{machine}`; there are: {', '.join(names)}")
        if trace is not None:
            graph = self._traced(machine, trace)
        else:
            graph = arrangement_graph(self.wrapped) if machine is None else machine_graph(self.wrapped.machine(machine))
        return write(summarise(graph)[0])

    def _traced(self, machine: str | None, trace: RunView | str | Path) -> Graph:
        if isinstance(trace, RunView):
            if trace._arrangement.digest != self.wrapped.digest:
                raise ValueError(f"the run is of another arrangement than this one, `{self.name}`")
            reaches = isinstance(trace, TraceView) and trace._of_query
            return GRAPHS.load("run")(self.wrapped, machine, trace.wrapped, trace._of(), reaches=reaches)
        done = replay_file(str(trace), self.path, lambda _path, /, *, named_at=None: self.wrapped)  # noqa: ARG005
        graph = GRAPHS.load("replayed")(self.wrapped, machine, done)
        if graph is None:
            raise DiagnosticError(Diagnostic("E411", f"the run {done.sentence}", file=str(trace)))
        return graph


def _input_texts(
    program: Program, inputs: Mapping[str, Value] | None, script: Mapping[int, Mapping[str, Value]] | None
) -> dict[int, dict[str, str]]:
    """The values of inputs as users write them, by the step from which they hold; 0: from the beginning. TypeError,
    ValueError."""
    if not isinstance(script or {}, Mapping) or not all(isinstance(step, int) for step in script or {}):
        raise TypeError(f"`script` is a mapping from the numbers of steps, not {script!r:.80}")
    held = {0: by_input("inputs", inputs), **{k: by_input(f"script[{k}]", v) for k, v in (script or {}).items()}}
    texts = {step: {name: value_text(value) for name, value in given.items()} for step, given in held.items()}
    for step, given in texts.items():
        problem = input_problem(program, given, later=step != 0)
        if problem is not None:
            raise ValueError(problem if step == 0 else f"step {step}: {problem}")
    return texts

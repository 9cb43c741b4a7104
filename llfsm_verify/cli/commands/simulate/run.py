"""`llfsm simulate`: run an arrangement with chosen or random inputs and show each step."""

from __future__ import annotations

import random
from argparse import Namespace
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from textwrap import wrap
from typing import TYPE_CHECKING

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.replay.confirm import Misfit
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.checking.trace import TraceStep
from llfsm_verify.cli.arguments import DRAWN, assignments
from llfsm_verify.cli.commands.simulate.arguments import JSON, TABLE
from llfsm_verify.cli.commands.simulate.scripts import extent_of, read_script
from llfsm_verify.cli.io.files import ready, write_whole
from llfsm_verify.cli.io.output import Output, tell
from llfsm_verify.cli.opening import open_arrangement
from llfsm_verify.cli.parser import UsageError, wrong_usage
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.report.cycles import Cycles
from llfsm_verify.report.simulation import exit_code, run_json, sentences, summary
from llfsm_verify.report.timeline.formats import TIMELINES
from llfsm_verify.report.wording import event_text
from llfsm_verify.runtime.stepping.drawing import Drawing, DrawingError, drawing_of, free_inputs
from llfsm_verify.runtime.stepping.random_run import RandomRun, Script, input_problem
from llfsm_verify.runtime.stepping.visited import never_visited
from llfsm_verify.semantics.lowering import lower

if TYPE_CHECKING:
    from llfsm_verify.checking.replay.confirm import Schedule
    from llfsm_verify.logic.formula import Formula
    from llfsm_verify.program.moves import Move
    from llfsm_verify.program.program import FaultSite, Program
    from llfsm_verify.report.runtable import RunTable

MISFIT = "E411"


@dataclass(frozen=True, slots=True)
class _Job:
    """A run and how far it goes."""

    arrangement: Arrangement
    program: Program
    run: RandomRun
    seed: int
    begin: Schedule | None
    sought: str | None
    steps: int | None
    cycles: int | None

    def taken(self) -> Iterator[TraceStep]:
        return self.run.steps(self.steps, self.cycles)


def run(options: Namespace) -> int:
    """Returns the exit code (see `report.simulation`); raises DiagnosticError for wrong files."""
    wanted = options.format or TIMELINES.named_by(options.output or "") or TABLE
    _refuse_misuse(options, wanted)
    arrangement = open_arrangement(options.arrangement)
    ready(arrangement, None, options.output, ("E487", "E487"), "the run")
    held = assignments("--set", options.set)
    job = _job(options, arrangement, held)
    if options.quiet:
        return _summed(job, Output(options.color, options.width))
    if wanted == TABLE:
        return _shown(job, held if options.inputs is None else {}, Output(options.color, options.width))
    return _written(job, wanted, options.output)


def _job(options: Namespace, arrangement: Arrangement, held: dict[str, str]) -> _Job:
    """The run that the options ask for. UsageError."""
    base = lower(arrangement, keep_all_bits=True)
    program, until, sought = _sought(arrangement, base, options.until)
    problem = input_problem(program, held)
    if problem is not None:
        raise UsageError(f"--set {problem}")
    extent = extent_of(options, program)
    script = Script({0: held}) if options.inputs is None else read_script(options.inputs, program, held)
    law = _law(options, program, held)
    seed = options.seed if options.seed is not None else random.SystemRandom().randrange(1 << 32)
    if options.seed is None:
        tell(f"seed {seed}")
    drawn = [choice.name for choice in base.choices]
    source = random.Random(seed)  # noqa: S311 - no secrets
    simulated = RandomRun(Execution(program), script, source, until=until, drawn=drawn, law=law, seed=seed)
    kept = [name for name in free_inputs(program) if name in script.steps.get(0, {})]
    if options.begin is not None and kept:
        raise UsageError(f"--set `{kept[0]}` never changes while it runs, and --from goes on with its value")
    begin = None if options.begin is None else _follow(simulated, options.begin, arrangement)
    return _Job(arrangement, program, simulated, seed, begin, sought, *extent)


def _refuse_misuse(options: Namespace, wanted: str) -> None:
    """UsageError: options that do not go together."""
    if wanted in TIMELINES.binary and options.output in (None, "-"):
        raise UsageError(f"{wanted} is not text: name a file with -o")
    if wanted == TABLE and options.output is not None:
        raise UsageError(f"-o is for --format {JSON}, {', '.join(TIMELINES)}")
    if options.quiet and (wanted != TABLE or options.output is not None):
        raise UsageError("-q prints only how the run ended, so no other format goes with it")
    if options.begin == "-":
        raise UsageError("--from needs the file of a saved trace")


def _law(options: Namespace, program: Program, held: Mapping[str, str]) -> Drawing:
    """How inputs are drawn. UsageError."""
    with wrong_usage(DrawingError, "--"):
        return drawing_of(program, options.hold, assignments("--draw", options.draw, DRAWN), held)


def _sought(arrangement: Arrangement, base: Program, text: str | None) -> tuple[Program, Formula | None, str | None]:
    """The program that shows whether what is looked for is true."""
    if text is None:
        return base, None, None
    from llfsm_verify.checking.problem import bind
    from llfsm_verify.cli.opening import COMMAND_LINE
    from llfsm_verify.logic.formula import apply
    from llfsm_verify.verification.query import parse_query

    query = parse_query(text, COMMAND_LINE)
    program = bind(arrangement, query.properties).program(keep_all_bits=True)
    never = query.properties.goals[0].formula
    assert never is not None, "a query is a formula"
    return program, apply("not", never.args[0]), query.text


def _follow(simulated: RandomRun, path: str, arrangement: Arrangement) -> Schedule:
    """Begin at the end of a saved trace. DiagnosticError (E411): the arrangement cannot follow it."""
    from llfsm_verify.verification.replay import schedule_of
    from llfsm_verify.verification.tracefile import read_trace_file

    schedule = schedule_of(read_trace_file(path), arrangement)
    try:
        simulated.follow(schedule)
    except Misfit as misfit:
        message = f"{arrangement.path} cannot follow this run: {misfit}"
        raise DiagnosticError(Diagnostic(MISFIT, message, file=path)) from None
    return schedule


def _shown(job: _Job, held: dict[str, str], output: Output) -> int:
    """Print each step as soon as it is done. A reader who has seen enough ends the run."""
    from rich.text import Text

    first, cycles = len(job.run.before), Cycles()
    for step in job.run.before:
        cycles.moment(step)
    table = _table(job, held, output.width)
    output.rich(table.head())
    number = first
    told: set[FaultSite] = set()
    for number, step in enumerate(job.taken(), first + 1):
        output.rich(table.step(number, step, cycles, faulted=job.run.fault is not None))
        for event in step.events:
            if event.site not in told:
                told.add(event.site)
                output.rich([Text(f"I{event_text(number, step, event)[1:]}.")])
        if output.closed:
            return 0
    output.rich(map(Text, _said(job, number - first, states=False)))
    if not job.run.reached:
        output.rich(map(Text, wrap(never_visited(job.run.visits.never), output.width, subsequent_indent="  ")))
    return exit_code(job.run, job.sought)


def _table(job: _Job, held: dict[str, str], width: int) -> RunTable:
    from llfsm_verify.report.runtable import RunTable

    first = len(job.run.before)
    last = first + (job.steps or (job.cycles or 1) * len(job.program.slots))
    return RunTable(job.program, job.run.initial, held, None if job.begin is None else first, last, width)


def _said(job: _Job, taken: int, *, states: bool = True) -> list[str]:
    """How it ended, and (with `states`) which ones were never visited, unless it ended where it was to."""
    from llfsm_verify.report.text import fault_place

    said = sentences(job.run, taken, job.sought)
    said += [] if job.run.fault is None else [fault_place(job.run.fault)]
    return [*said, never_visited(job.run.visits.never)] if states and not job.run.reached else said


def _summed(job: _Job, output: Output) -> int:
    """Only how long the run was and how it ended."""
    number = cycles = 0
    for step in job.taken():
        number += 1
        cycles += step.cycle
    period = job.program.period if len(job.program.processes) == 1 else None
    output.plain(f"{summary(number, cycles, period)}\n")
    output.plain("".join(f"{sentence}\n" for sentence in _said(job, number)))
    return exit_code(job.run, job.sought)


def _written(job: _Job, wanted: str, name: str | None) -> int:
    """In a format for other tools; how it ended is said on standard error."""
    from llfsm_verify.runtime.recording.timeline import stepped

    number = 0
    if wanted == JSON:
        steps = list(job.taken())
        number = len(steps)
        text = run_json(job.arrangement, job.run, steps, job.seed, job.sought, job.program.period)
        write_whole(f"{text}\n", name or "-", "E487", "the run")
    else:
        first = len(job.run.before)

        def moves() -> Iterator[Move]:
            nonlocal number
            if job.begin is not None:
                yield from job.begin.ringlets[:first]
            for _ in job.taken():
                number += 1
                assert job.run.move is not None
                yield job.run.move

        timeline = stepped(job.arrangement, job.run.free, moves())
        write = partial(TIMELINES.load(wanted), timeline.part(first + 1, None))
        write_whole(write, name, "E487", "the timeline")
    for sentence in _said(job, number, states=wanted != JSON):
        tell(sentence)
    return exit_code(job.run, job.sought)

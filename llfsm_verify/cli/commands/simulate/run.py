"""`llfsm simulate`: run an arrangement with chosen or random inputs and show each step."""

from __future__ import annotations

import random
from argparse import Namespace
from collections.abc import Iterator, Mapping
from fractions import Fraction
from functools import partial
from math import ceil
from typing import TYPE_CHECKING

from llfsm_verify.arrangement.files import read_source
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.replay.confirm import Misfit
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.cli.arguments import DRAWN, assignments
from llfsm_verify.cli.commands.simulate.arguments import LOOKED, TABLE
from llfsm_verify.cli.io.files import ready, write_whole
from llfsm_verify.cli.io.output import Output, tell
from llfsm_verify.cli.opening import open_arrangement
from llfsm_verify.cli.parser import UsageError, wrong_usage
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.limits import DEFAULT_STEPS
from llfsm_verify.program.program import Program
from llfsm_verify.registry import Choices
from llfsm_verify.report.formats import REPORTS, Style
from llfsm_verify.report.simulation import exit_code, said, summary
from llfsm_verify.report.timeline.formats import TIMELINES
from llfsm_verify.runtime.stepping.drawing import Drawing, DrawingError, drawing_of, free_inputs
from llfsm_verify.runtime.stepping.random_run import RandomRun, Script, Simulated, input_problem
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.yaml.compose import compose
from llfsm_verify.yaml.duration import duration_ms
from llfsm_verify.yaml.fields import Report
from llfsm_verify.yaml.nodes import Node, Scalar, mark

if TYPE_CHECKING:
    from llfsm_verify.checking.replay.confirm import Schedule
    from llfsm_verify.logic.formula import Formula
    from llfsm_verify.program.moves import Move
    from llfsm_verify.program.program import Program


MISFIT = "E411"


def run(options: Namespace) -> int:
    """Returns the exit code (see `report.simulation`); raises DiagnosticError for wrong files."""
    wanted = options.format or TIMELINES.named_by(options.output or "") or TABLE
    _refuse_misuse(options, wanted)
    arrangement = open_arrangement(options.arrangement)
    ready(arrangement, None, options.output, ("E487", "E487"), "the run")
    held = assignments("--set", options.set)
    made, begin = _made(options, arrangement, held)
    output = Output(options.color, options.width)
    if options.quiet:
        return _summed(made, output)
    if wanted in TIMELINES:
        _timeline(made, begin, wanted, options.output)
    else:
        written = REPORTS.simulation.load(wanted)(made, Style(width=output.width))
        if not isinstance(written, str):
            output.stream(written)
            return 0 if output.closed else exit_code(made)
        write_whole(f"{written}\n", options.output or "-", "E487", "the run")
    tell(*said(made, states=wanted in TIMELINES))
    return exit_code(made)


def _made(options: Namespace, arrangement: Arrangement, held: dict[str, str]) -> tuple[Simulated, Schedule | None]:
    """The run that the options ask for, and what it goes on with. UsageError."""
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
    shown = held if options.inputs is None else {}
    return Simulated(arrangement, program, simulated, seed, begin is not None, shown, sought, *extent), begin


def _refuse_misuse(options: Namespace, wanted: str) -> None:
    """UsageError: options that do not go together."""
    if wanted in TIMELINES.binary and options.output in (None, "-"):
        raise UsageError(f"{wanted} is not text: name a file with -o")
    if wanted == TABLE and options.output is not None:
        others = (name for name in Choices(REPORTS.simulation, TIMELINES) if name != TABLE)
        raise UsageError(f"-o is for --format {', '.join(others)}")
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


def _summed(made: Simulated, output: Output) -> int:
    """Only how long the run was and how it ended."""
    cycles = sum(step.cycle for step in made.turns())
    period = made.program.period if len(made.program.processes) == 1 else None
    output.plain(f"{summary(made.taken, cycles, period)}\n")
    output.plain("".join(f"{sentence}\n" for sentence in said(made)))
    return exit_code(made)


def _timeline(made: Simulated, begin: Schedule | None, wanted: str, name: str | None) -> None:
    """Over time, from where it goes on."""
    from llfsm_verify.runtime.recording.timeline import stepped

    first = len(made.run.before)

    def moves() -> Iterator[Move]:
        if begin is not None:
            yield from begin.ringlets[:first]
        for _ in made.turns():
            assert made.run.move is not None
            yield made.run.move

    timeline = stepped(made.arrangement, made.run.free, moves())
    write_whole(partial(TIMELINES.load(wanted), timeline.part(first + 1, None)), name, "E487", "the timeline")


# ---------------- how far a run goes, and the file of its inputs

START = ("0ms", "0s", "0min", "0h")


def extent_of(options: Namespace, program: Program) -> tuple[int | None, int | None]:
    """So many steps or so many cycles. UsageError: the arrangement has no such clock."""
    if options.span is not None:
        if program.period is None:
            raise UsageError("--for needs an arrangement with `cycle_ms`")
        if len(program.processes) > 1:
            why = "each of several processes has its own: say --steps or --cycles"
            raise UsageError(f"--for needs one clock, and {why}")
        return None, ceil(options.span / program.period)
    if options.steps is None and options.cycles is None:
        return (DEFAULT_STEPS if options.until is None else LOOKED), None
    return options.steps, options.cycles


def read_script(path: str, program: Program, held: Mapping[str, str]) -> Script:
    """The file of --inputs, beside the inputs of --set. DiagnosticError: it is not a YAML mapping of that shape (E030
    to E032), a key is no step number and no time, or a time in an untimed arrangement (E408), an input or value that
    the arrangement does not have (E409)."""
    source, _ = read_source(path)
    report = Report()
    root = report.mapping(compose(source, report.diagnostics), "a file of inputs")
    steps: dict[int, dict[str, str]] = {0: dict(held)}
    times: dict[Fraction, dict[str, str]] = {}
    for key, value in root.items if root is not None else ():
        time = _time(key)
        if time is None and not (key.text.isascii() and key.text.isdigit() and len(key.text) < 16):
            hint = "steps count from 1, and a time has its unit: `1.5s`"
            report.error("E408", f"`{key.text[:40]}` is not a valid step number or time", mark(key), hint)
            continue
        if time is not None and program.period is None:
            report.error("E408", f"`{key.text}` is a time, and the arrangement has none", mark(key), "count steps")
            continue
        values = _values(report, program, value, later=key.text != "0" and time != 0)
        if time is None:
            steps.setdefault(int(key.text), {}).update(values)
        else:
            times.setdefault(time, {}).update(values)
    if report.diagnostics:
        raise DiagnosticError(report.diagnostics)
    return Script(steps, times)


def _time(key: Scalar) -> Fraction | None:
    if key.text in START:
        return Fraction(0)
    return duration_ms(key.text) if key.text[-1:].isalpha() else None


def _values(report: Report, program: Program, node: Node, *, later: bool) -> dict[str, str]:
    found: dict[str, str] = {}
    inputs = report.mapping(node, "the inputs of a step")
    for name, value in inputs.items if inputs is not None else ():
        scalar = report.scalar(value, f"the value of `{name.text}`")
        if scalar is None:
            continue
        problem = input_problem(program, {name.text: scalar.text}, later=later)
        if problem is not None:
            report.diagnostics.append(Diagnostic("E409", problem, mark(name)))
        found[name.text] = scalar.text
    return found

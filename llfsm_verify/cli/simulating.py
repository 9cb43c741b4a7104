"""What `llfsm simulate` is asked for: its options, and the file of inputs."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Mapping
from fractions import Fraction
from math import ceil

from llfsm_verify.arrangement.fields import Report
from llfsm_verify.arrangement.files import read_source
from llfsm_verify.arrangement.formats.yaml.compose import compose
from llfsm_verify.arrangement.nodes import Node, Scalar, mark
from llfsm_verify.cli.argument_types import colour, milliseconds, positive
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.program.program import Program
from llfsm_verify.report.timeline.formats import TIMELINES
from llfsm_verify.runtime.duration import duration_ms
from llfsm_verify.runtime.random_run import DEFAULT_STEPS, Script, input_problem

TABLE, JSON = "table", "json"
START = ("0ms", "0s", "0min", "0h")
LOOKED = 10_000
"""Steps in which `--until` is looked for where nothing else is said."""


def simulate_arguments(parser: ArgumentParser) -> None:
    """The options of `llfsm simulate`."""
    parser.description = "Run an arrangement and print the table of its steps."
    parser.epilog = (
        "exit codes: 0 done, 1 a fault, 2 wrong usage, 3 files wrong or unreadable, 4 what --until says was not "
        "reached, or a value left 64 bits, 70 internal error, 130 interrupted. "
        "example: llfsm simulate lights.yaml --seed 1 --until 'ns@GREEN && car' --for 30s"
    )
    add = parser.add_argument
    add("arrangement", metavar="ARRANGEMENT", help="the arrangement's file; - reads standard input")
    extent = parser.add_mutually_exclusive_group()
    extent.add_argument(
        "--steps", metavar="N", type=positive,
        help=f"so many ringlets (default: {DEFAULT_STEPS}, with --until {LOOKED:,})",
    )  # fmt: skip
    extent.add_argument("--cycles", metavar="N", type=positive, help="so many whole cycles")
    extent.add_argument(
        "--for", metavar="TIME", dest="span", type=milliseconds, help="so much logical time: 90s, 500ms, 5min"
    )
    add("--until", metavar="FORMULA", help="end where this state formula is true, as in `llfsm query`")
    add("--from", metavar="TRACE", dest="begin", help="go on where the run of this saved trace ends")
    add(
        "--seed", metavar="N", type=int,
        help="makes the random choices repeatable (default: a new one, which is printed)",
    )  # fmt: skip
    add(
        "--inputs", metavar="FILE",
        help="YAML: step number or time (`1.5s`): {input: value, …}, each valid until the next",
    )  # fmt: skip
    add("--set", metavar="INPUT=VALUE", action="append", default=[], help="hold an input at a value; may be repeated")
    formats = "; ".join(f"{name}: {entry.about}" for name, entry in TIMELINES.items())
    add(
        "--format", choices=(TABLE, JSON, *TIMELINES),
        help=f"default: what the name of FILE ends in, else {TABLE}; {JSON}: schema `simulation`; {formats}",
    )  # fmt: skip
    add("-o", "--output", metavar="FILE", help="write there instead of to standard output")
    add("-q", "--quiet", action="store_true", help="print only how the run ended")
    colour(parser)


def extent_of(options: Namespace, program: Program) -> tuple[int | None, int | None] | str:
    """So many steps or so many cycles; a text says what is wrong with the options."""
    if options.span is not None:
        if program.period is None:
            return "--for needs an arrangement with `cycle_ms`"
        if len(program.processes) > 1:
            return "--for needs one clock, and each of several processes has its own: say --steps or --cycles"
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
            report.error("E408", f"`{key.text[:40]}` is no step number and no time", mark(key), hint)
            continue
        if time is not None and program.period is None:
            report.error("E408", f"`{key.text}` is a time, and the arrangement has none", mark(key), "count steps")
            continue
        values = _values(report, program, value)
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


def _values(report: Report, program: Program, node: Node) -> dict[str, str]:
    found: dict[str, str] = {}
    inputs = report.mapping(node, "the inputs of a step")
    for name, value in inputs.items if inputs is not None else ():
        scalar = report.scalar(value, f"the value of `{name.text}`")
        if scalar is None:
            continue
        problem = input_problem(program, {name.text: scalar.text})
        if problem is not None:
            report.diagnostics.append(Diagnostic("E409", problem, mark(name)))
        found[name.text] = scalar.text
    return found

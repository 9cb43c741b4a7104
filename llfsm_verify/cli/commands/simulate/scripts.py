"""How far a simulated run goes, and the file of its inputs."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Mapping
from fractions import Fraction
from math import ceil

from llfsm_verify.arrangement.files import read_source
from llfsm_verify.cli.commands.simulate.arguments import LOOKED
from llfsm_verify.cli.parser import UsageError
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.limits import DEFAULT_STEPS
from llfsm_verify.program.program import Program
from llfsm_verify.runtime.stepping.duration import duration_ms
from llfsm_verify.runtime.stepping.random_run import Script, input_problem
from llfsm_verify.yaml.compose import compose
from llfsm_verify.yaml.fields import Report
from llfsm_verify.yaml.nodes import Node, Scalar, mark

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

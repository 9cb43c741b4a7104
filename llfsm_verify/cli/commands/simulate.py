"""`llfsm simulate`: run an arrangement with chosen or random inputs and show each step."""

from __future__ import annotations

import random
import sys
from argparse import Namespace
from collections.abc import Iterator

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.arrangement.fields import Report
from llfsm_verify.arrangement.files import read_source
from llfsm_verify.arrangement.formats.yaml.compose import compose
from llfsm_verify.arrangement.nodes import mark
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.checking.trace import TraceStep
from llfsm_verify.cli.argument_types import assignments
from llfsm_verify.cli.io.output import Output, usage
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.program.program import FaultSite, Program
from llfsm_verify.report.cycles import Cycles
from llfsm_verify.report.runtable import RunTable
from llfsm_verify.report.tracewords import event_text
from llfsm_verify.runtime.random_run import DEFAULT_STEPS, RandomRun, input_problem
from llfsm_verify.semantics.lowering import lower


def run(options: Namespace) -> int:
    """Returns 0, or 1 when the run ends in a fault; raises DiagnosticError for wrong files."""
    arrangement = load_arrangement(options.arrangement)
    for warning in arrangement.warnings:
        print(warning.render(), file=sys.stderr)
    program = lower(arrangement, keep_all_bits=True)
    script = _read_script(options.inputs, program) if options.inputs is not None else {}
    try:
        held = assignments("--set", options.set)
    except ValueError as wrong:
        return usage(str(wrong))
    problem = input_problem(program, held)
    if problem is not None:
        return usage(f"--set {problem}")
    seed = options.seed if options.seed is not None else random.SystemRandom().randrange(1 << 32)
    if options.seed is None:
        print(f"seed {seed}", file=sys.stderr)
    simulated = RandomRun(Execution(program), {0: held, **script}, random.Random(seed))  # noqa: S311 - no secrets
    last = options.steps or (options.cycles * len(program.slots) if options.cycles else DEFAULT_STEPS)
    output = Output(options.color, options.width)
    table = RunTable(program, simulated.initial, held if not script else {}, last, output.width)
    return _show(simulated, simulated.steps(options.steps, options.cycles), table, output)


def _show(simulated: RandomRun, steps: Iterator[TraceStep], table: RunTable, output: Output) -> int:
    """Print each step as soon as it is done; the exit code. A reader who has seen enough ends the run."""
    from rich.text import Text

    from llfsm_verify.report.text import fault_place

    output.rich(table.head(0))
    number, cycles = 0, Cycles()
    told: set[FaultSite] = set()
    for number, step in enumerate(steps, 1):
        output.rich(table.step(number, step, cycles, faulted=simulated.fault is not None))
        for event in step.events:
            if event.site not in told:
                told.add(event.site)
                output.rich([Text(f"I{event_text(number, step, event)[1:]}.")])
        if output.closed:
            return 0
    if simulated.ended:
        output.rich([Text(f"The arrangement ended after {number} step{'s' if number != 1 else ''}.")])
    if simulated.overflowed:
        output.rich([Text("A value left 64 bits: the executor cannot go on.")])
        return 4
    if simulated.fault is None:
        return 0
    output.rich([Text(fault_place(simulated.fault))])
    return 1


def _read_script(path: str, program: Program) -> dict[int, dict[str, str]]:
    """The file of --inputs. Raises DiagnosticError: not a YAML mapping of that shape (E030 to E032), a key that is no
    step number (E408), an input or value that the arrangement does not have (E409)."""
    source, _ = read_source(path)
    report = Report()
    root = report.mapping(compose(source, report.diagnostics), "a file of inputs")
    script: dict[int, dict[str, str]] = {}
    for key, value in root.items if root is not None else ():
        if not (key.text.isascii() and key.text.isdigit() and len(key.text) < 16):
            report.error("E408", f"`{key.text[:40]}` is no step number", mark(key), "steps count from 1")
            continue
        inputs = report.mapping(value, "the inputs of a step")
        for name, node in inputs.items if inputs is not None else ():
            scalar = report.scalar(node, f"the value of `{name.text}`")
            if scalar is None:
                continue
            problem = input_problem(program, {name.text: scalar.text})
            if problem is not None:
                report.diagnostics.append(Diagnostic("E409", problem, mark(name)))
            script.setdefault(int(key.text), {})[name.text] = scalar.text
    if report.diagnostics:
        raise DiagnosticError(report.diagnostics)
    return script

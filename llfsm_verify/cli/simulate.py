"""`llfsm simulate`: run an arrangement with chosen or random inputs and show each step."""

from __future__ import annotations

import random
import sys
from argparse import Namespace
from collections.abc import Iterator, Mapping

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.arrangement.fields import Report, mark
from llfsm_verify.arrangement.files import read_source
from llfsm_verify.arrangement.nodes import compose
from llfsm_verify.checking.execution import Execution
from llfsm_verify.checking.trace import Trace, TraceStep
from llfsm_verify.cli.output import Output, usage
from llfsm_verify.cli.values import ValueProblem, choice_value
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.kripke.explore import Move
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.semantics.program import Choice, FaultSite, Program

DEFAULT_STEPS = 20

Script = Mapping[int, Mapping[str, str]]
"""From step (from 1) to the inputs that hold from then on, as text."""


def run(options: Namespace) -> int:
    """Returns 0, or 1 when the run ends in a fault; raises DiagnosticError for wrong files."""
    arrangement = load_arrangement(options.arrangement)
    program = lower(arrangement, keep_all_bits=True)
    script = _read_script(options.inputs, program) if options.inputs is not None else {}
    held: dict[str, str] = {}
    for item in options.set:
        name, equals, text = item.partition("=")
        if not equals:
            return usage(f"--set needs INPUT=VALUE, not `{item}`")
        held[name.strip()] = text.strip()
    problem = _problem(program, held)
    if problem is not None:
        return usage(f"--set {problem}")
    seed = options.seed if options.seed is not None else random.SystemRandom().randrange(1 << 32)
    if options.seed is None:
        print(f"seed {seed}", file=sys.stderr)
    simulated = _Simulated(Execution(program), {0: held, **script}, random.Random(seed))  # noqa: S311 - no secrets
    steps = tuple(simulated.steps(options.steps, options.cycles))
    trace = Trace(simulated.initial, (), (), steps, None, simulated.fault)
    return _show(trace, simulated, options.color)


def _show(trace: Trace, simulated: _Simulated, colour: str) -> int:
    from rich.text import Text

    from llfsm_verify.report.text import fault_place, step_table

    output = Output(colour)
    output.rich([step_table(trace, fold=False)])
    if simulated.ended:
        output.rich([Text(f"The arrangement ended after {len(trace.steps)} steps.")])
    if simulated.overflowed:
        output.rich([Text("A value left 64 bits: the executor cannot go on.")])
        return 4
    if trace.fault is None:
        return 0
    output.rich([Text(fault_place(trace.fault))])
    return 1


class _Simulated:
    """One run: which process steps and every choice that nobody made is random."""

    def __init__(self, execution: Execution, script: Script, source: random.Random) -> None:
        self._execution = execution
        self._script = script
        self._random = source
        self._record = execution.start()
        self._inputs: dict[str, str] = {}
        self.initial = execution.shown(self._record)
        self.fault: FaultSite | None = None
        self.overflowed = False
        self.ended = False

    def steps(self, steps: int | None, cycles: int | None) -> Iterator[TraceStep]:
        """Until there were `steps` ringlets or `cycles` cycles, or the run ended."""
        number = done = 0
        self._inputs.update(self._script.get(0, {}))
        limit = steps if steps is not None or cycles is not None else DEFAULT_STEPS
        while (limit is None or number < limit) and (cycles is None or done < cycles):
            enabled = self._execution.enabled(self._record)
            if not enabled:
                self.ended = True
                return
            number += 1
            self._inputs.update(self._script.get(number, {}))
            step = self._step(self._random.choice(enabled))
            yield step
            if self.fault is not None or self.overflowed:
                return
            done += step.cycle

    def _step(self, process: int) -> TraceStep:
        program = self._execution.program
        move = Move(process, {choice.name: self._choose(choice) for choice in program.choices})
        result = self._execution.step(self._record, move)
        step = self._execution.describe(self._record, move, result, ())
        if result.status > 0:
            self.fault = program.faults[result.status - 1]
        elif result.status < 0:
            self.overflowed = True
        else:
            self._record = result.record
        return step

    def _choose(self, choice: Choice) -> int:
        text = self._inputs.get(choice.input) if choice.input else None
        if text is not None:
            return choice_value(choice, text)
        return self._random.randint(choice.type.low, choice.type.high)


def _problem(program: Program, inputs: Mapping[str, str]) -> str | None:
    """Why these inputs cannot be given, or None."""
    choices = {choice.input: choice for choice in program.choices if choice.input}
    for name, text in inputs.items():
        if name not in choices:
            known = ", ".join(choices) or "none that a step reads"
            return f"`{name}` is no input of the arrangement; inputs: {known}"
        try:
            choice_value(choices[name], text)
        except ValueProblem as problem:
            return f"{name}: {problem}"
    return None


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
            problem = _problem(program, {name.text: scalar.text})
            if problem is not None:
                report.diagnostics.append(Diagnostic("E409", problem, mark(name)))
            script.setdefault(int(key.text), {})[name.text] = scalar.text
    if report.diagnostics:
        raise DiagnosticError(report.diagnostics)
    return script

"""From an arrangement to a program that can run: what simulation has and the world has not is left out, or refused."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.program.program import Program
from llfsm_verify.runtime.live.codes import IMPOSSIBLE, UNREPEATABLE
from llfsm_verify.runtime.live.loop import Prescribed
from llfsm_verify.semantics.operators import OPERATOR
from llfsm_verify.semantics.storage import leaf_values, leaves
from llfsm_verify.values import Value


def runnable(arrangement: Arrangement, *, simulated: bool, cycle_ms: Fraction | None = None) -> Arrangement:
    """The arrangement as it runs: in the real surroundings without the model of them.

    `cycle_ms`: how long a cycle takes where the arrangement is untimed, which is one of the timings that it is verified
    for. DiagnosticError (E483): a machine stands for something else, or nothing says how long a cycle takes.
    """
    if not simulated:
        arrangement = replace(arrangement, environment=None)
        for machine in arrangement.machines:
            if machine.model:
                message = (
                    f"machine `{machine.name}` is a model of something else (`model: true`), and can only be simulated"
                )
                raise DiagnosticError(
                    Diagnostic(IMPOSSIBLE, message, machine.span, hint="write --simulate, or the machine that runs")
                )
    if arrangement.timing == "timed" and arrangement.cycle_ms is not None:
        if cycle_ms is not None and cycle_ms != arrangement.cycle_ms:
            message = (
                f"a cycle of this arrangement takes {float(arrangement.cycle_ms):g} ms, not {float(cycle_ms):g} ms"
            )
            raise DiagnosticError(
                Diagnostic(IMPOSSIBLE, message, arrangement.span, hint="leave out --cycle-ms, or change `cycle_ms:`")
            )
        return arrangement
    if cycle_ms is None:
        message = "nothing says how long a cycle of this arrangement takes"
        raise DiagnosticError(
            Diagnostic(IMPOSSIBLE, message, arrangement.span, hint="give it, for example with --cycle-ms 100")
        )
    return replace(arrangement, timing="timed", cycle_ms=cycle_ms)


def safe_values(arrangement: Arrangement) -> dict[str, Value]:
    """What the outputs that have safe values get in the last frame, by the names of the program's variables."""
    found: dict[str, Value] = {}
    for entry in arrangement.whiteboard:
        if entry.safe is not None:
            variable = entry.variable
            values = leaf_values(variable.type, entry.safe)
            found |= {variable.name + leaf.suffix: v for leaf, v in zip(leaves(variable.type), values, strict=True)}
    return found


def starting_values(program: Program) -> dict[str, int]:
    """What each choice is at first: an input what it is at first, and operators do nothing."""
    first: dict[str, int] = {i.name: i.init for i in program.inputs}
    first |= {v.name: v.init for v in program.vars if v.origin.kind == "input" and isinstance(v.init, int)}
    return {c.name: first[c.input] for c in program.choices if c.input in first}


def drawn_choices(program: Program, held: Mapping[str, int], fed: Container[str] = ()) -> list[str]:
    """The choices that a simulation draws: those of models, and of inputs that are neither held nor `fed`."""
    return [
        c.name
        for c in program.choices
        if c.name not in held and not c.name.startswith(OPERATOR) and not (c.input and c.input in fed)
    ]


def script_of(program: Program, steps: Sequence[Mapping[str, int]]) -> list[Prescribed]:
    """What choices get before the ringlets of a run, given the choices by name for each of its steps.

    A run takes whole cycles of a process. DiagnosticError (E484): the steps take turns in another way.
    """
    if len(program.processes) > 1:
        message = "the trace is of an arrangement with several processes, whose ringlets it interleaves"
        raise DiagnosticError(
            Diagnostic(UNREPEATABLE, message, hint="a run takes whole cycles; `llfsm replay` repeats such a trace")
        )
    numbers = {choice.name: i for i, choice in enumerate(program.choices)}
    return [
        Prescribed(step, numbers[name], value)
        for step, choices in enumerate(steps)
        for name, value in choices.items()
        if name in numbers
    ]

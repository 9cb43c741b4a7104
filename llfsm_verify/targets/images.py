"""What one image can run, and what has no meaning in it."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Span
from llfsm_verify.runtime.live.plan import runnable
from llfsm_verify.targets import IMPOSSIBLE


def image_of(arrangement: Arrangement, cycle_ms: Fraction | None = None) -> Arrangement:
    """The arrangement as one image runs it, as a run in the world does.

    DiagnosticError with all that has no meaning in an image (E503), or nothing says how long a cycle takes (E483).
    """
    problems = list(_problems(arrangement))
    if problems:
        raise DiagnosticError(problems)
    return runnable(arrangement, simulated=False, cycle_ms=cycle_ms)


def _problems(arrangement: Arrangement) -> Iterator[Diagnostic]:
    def refused(message: str, span: Span, hint: str) -> Diagnostic:
        return Diagnostic(IMPOSSIBLE, message, span, hint=hint)

    for process in arrangement.processes[1:]:
        others = f"`{process.name}` is one of {len(arrangement.processes)} processes, and an image has one schedule"
        yield refused(others, process.span, "write an arrangement with one `schedule` for each image")
    for machine in arrangement.machines:
        if machine.model:
            message = f"`{machine.name}` is a model of something else (`model: true`), and can only be simulated"
            yield refused(message, machine.span, "write the machine that runs in its place, or leave it out")
    if arrangement.profile.snapshot == "none":
        base = arrangement.profile.base
        message = "with `snapshot: none` each read of an input is a sample of its own, and an image holds its inputs"
        yield refused(message, arrangement.span, f"write `profile: {{base: {base}, snapshot: ringlet}}`")
    for operator in (*arrangement.replaceable, *arrangement.policy_users):
        message = f"an image cannot be changed while it runs (`{operator.kind}` of `{operator.target}`)"
        yield refused(message, operator.span, f"leave out `{operator.kind}` of `operators`")

"""Where machines finish although they look as if they were to go on."""

from __future__ import annotations

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.diagnostics import Span

CODE = "L015"
"""The finding of `llfsm lint` that says it."""


def running_once(arrangement: Arrangement) -> list[tuple[Span, str, list[str]]]:
    """The states whose `internal` action runs once, because machines finish there: place, name and the machines."""
    if arrangement.finished == "keep":
        return []
    machines: dict[tuple[Span, str], list[str]] = {}
    for machine in arrangement.machines:
        for number, state in enumerate(machine.states):
            if state.internal and state.finishes and number != machine.suspend:
                machines.setdefault((state.span, state.name), []).append(machine.name)
    return [(span, name, names) for (span, name), names in machines.items()]


def ending_notes(arrangement: Arrangement) -> tuple[str, ...]:
    """The same in sentences without their full stops, but for those that the files accept."""
    return tuple(
        f"{_machines(names)} in `{name}` for good, and the `internal` action there runs once; "
        "with `stays: true` it goes on"
        for span, name, names in running_once(arrangement)
        if not any(s.covers(CODE, span) for s in arrangement.suppressions)
    )


def _machines(names: list[str]) -> str:
    quoted = [f"`{name}`" for name in names[:3]]
    listed = ", ".join(quoted) if len(names) <= 3 else f"{', '.join(quoted)} and {len(names) - 3} more machines"
    return f"{listed} finish{'es' if len(names) == 1 else ''}"

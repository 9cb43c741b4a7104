"""What is said of a trace in sentences: events, where it ends or repeats, why the property fails."""

from __future__ import annotations

from collections.abc import Iterator

from llfsm_verify.checking.trace import Event, Trace, TraceStep
from llfsm_verify.program.program import FaultSite


def loop_text(trace: Trace) -> str:
    """Where the trace ends or what repeats, in a sentence."""
    if trace.loop is not None:
        first, last = trace.loop + 1, len(trace.steps)
        what = f"step {first} repeats" if first == last else f"steps {first} to {last} repeat"
        return f"{what} forever"
    if trace.fault is not None:
        return f"step {len(trace.steps)} ends the run in a fault"
    if trace.escape and trace.steps:
        return (
            f"the last chance is lost in step {len(trace.steps)}: no run goes on from there and meets the assumptions"
        )
    if trace.escape:
        return "no run goes on from the initial configuration and meets the assumptions"
    if not trace.steps and trace.witness:
        return "already shown in the initial configuration"
    if not trace.steps:
        return "already violated in the initial configuration"
    if trace.witness:
        return f"shown by step {len(trace.steps)}, however the run goes on"
    return f"violated after step {len(trace.steps)}, however the run goes on"


def sentences(trace: Trace) -> list[str]:
    """What is said below the table, without full stops: events, how the trace ends, why the property fails."""
    because = because_text(trace)
    return [*_event_texts(trace), *(text for text in (loop_text(trace), because) if text is not None)]


def _event_texts(trace: Trace) -> Iterator[str]:
    """Each place where something was refused, or a fault unloaded a machine, when it is come to first."""
    told: set[FaultSite] = set()
    for number, step in enumerate(trace.steps, 1):
        for event in step.events:
            if event.site not in told:
                told.add(event.site)
                yield event_text(number, step, event)


def event_text(number: int, step: TraceStep, event: Event) -> str:
    """What was refused in step `number`, or which fault unloaded its machine."""
    what = "something is refused" if event.kind == "refused" else f"a fault unloads `{step.machine}`"
    place = "" if event.site.span is None else f" ({event.site.span})"
    return f"in step {number} {what}: {event.site.message}{place}"


def because_text(trace: Trace) -> str | None:
    """Why the property fails, in a sentence without its full stop; None: the trace does not say."""
    return None if trace.because is None else f"it fails because {trace.because}"

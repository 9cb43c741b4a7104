"""How a run went, in lines for people."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from signal import Signals

from llfsm_verify.diagnostics import counted
from llfsm_verify.runtime.live.run import Lateness, RunReport
from llfsm_verify.runtime.ports.ports import Counts
from llfsm_verify.runtime.stepping.visited import never_visited

ENDINGS = {
    "ended": "the arrangement has ended",
    "stopped": "stopped",
    "overflow": "a value left 64 bits",
    "overrun": "stopped, because a cycle began a whole cycle late",
    "died": "a process died",
    "replaced": "another run goes on",
    "violated": "stopped, because a property was violated",
}

EXPECTED = (0, Signals.SIGINT, Signals.SIGTERM)
"""Signals that stop a run (0: none did) of which nothing is said."""


def report_lines(
    report: RunReport, cycle_ms: Fraction, recordings: Sequence[str | Path], failure: str | None = None
) -> Iterator[str]:
    """What ran and for how long, how late, why it ended (`failure`: what stopped it), and what is recorded."""
    logical = float(report.cycles * cycle_ms / 1000)
    yield (
        f"{counted(report.cycles, 'cycle')} ({counted(report.ringlets, 'ringlet')}), {logical:g} s of logical time, "
        f"in {report.seconds:.2f} s: {_why(report, failure)}"
    )
    if report.priority is not None:
        yield report.priority
    if report.external:
        yield "the clock was external: a port began each cycle"
    if report.lateness is not None and report.lateness.turns:
        yield _lateness(report.lateness)
    if report.refused:
        yield f"{counted(report.refused, 'value')} from outside did not fit the type of an input and left it as it was"
    for name, verdict, frame in report.monitored:
        yield f"{verdict}: {name}" + (f" (in frame {frame:,})" if frame else "")
    if report.never_visited is not None:
        yield never_visited(report.never_visited)
    if recordings:
        yield f"recorded: {', '.join(map(str, recordings))} ({counted(report.recorded, 'frame')})"
    if report.unrecorded is not None:
        yield f"the recording ended before the run: {report.unrecorded}"


def _why(report: RunReport, failure: str | None) -> str:
    """Why a run ended."""
    if report.fault is not None:
        where = f"{report.fault.span}: " if report.fault.span is not None else ""
        return f"fault[{report.fault.code}]: {where}{report.fault.message}"
    why = ENDINGS[report.ending]
    if report.ending == "stopped" and report.detail not in EXPECTED:
        named = report.detail in set(Signals)
        why = f"stopped by {Signals(report.detail).name if named else f'signal {report.detail}'}"
    return f"{why}: {failure}" if failure is not None and report.ending == "stopped" else why


def _lateness(late: Lateness) -> str:
    told = ", ".join(f"{percent:g} % within {duration(value)}" for percent, value in late.percentiles)
    moved = f", which moved the schedule by {duration(late.moved)}" if late.overruns else ""
    return f"lateness: {told}, worst {duration(late.worst)}; {counted(late.overruns, 'overrun')}{moved}"


def port_lines(counts: Mapping[str, Counts]) -> Iterator[str]:
    """What each port has done, by name."""
    for name, of in counts.items():
        parts = (
            (of.taken, counted(of.taken, "message") + " in"), (of.refused, counted(of.refused, "value") + " refused"),
            (of.malformed, f"{of.malformed:,} malformed"), (of.failures, counted(of.failures, "failure")),
            (of.sent, counted(of.sent, "message") + " out"), (of.unsent, f"{of.unsent:,} not sent"),
        )  # fmt: skip
        told = [text for number, text in parts if number]
        silent = "; no message came for " + ", ".join(f"`{name}`" for name in sorted(of.silent)) if of.silent else ""
        yield f"port {name}: {', '.join(told) or 'nothing came and nothing was sent'}{silent}"


def duration(nanoseconds: int) -> str:
    """A time with three digits and a unit."""
    for unit, size in (("s", 10**9), ("ms", 10**6), ("µs", 10**3)):
        if nanoseconds >= size:
            return f"{nanoseconds / size:.3g} {unit}"
    return f"{nanoseconds} ns"

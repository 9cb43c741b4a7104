"""The words in which all formats speak of verdicts."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from llfsm_verify.checking.trace import Event, Trace, TraceStep
from llfsm_verify.checking.verdict import NO_RUN, Attempt, PropertyResult, Result, Verdict
from llfsm_verify.diagnostics import counted
from llfsm_verify.kripke.labels.sizes import InputNote
from llfsm_verify.program.program import FaultSite

MOST_NAME = 60
"""Characters of a name in a table."""


def verdict_text(result: Result, item: PropertyResult) -> str:
    """`holds`, `violated`, `unknown`, or `holds on fault-free runs` while faults are violated or unknown; what holds by
    a search that went on from a checkpoint says so. `holds vacuously` where no run satisfies the assumptions."""
    if is_vacuous(item):
        return f"holds vacuously{resumed_text(result)}"
    if item.verdict is Verdict.HOLDS and result.faults.verdict is not Verdict.HOLDS:
        return f"holds on fault-free runs{resumed_text(result)}"
    return verdict_word(result, item.verdict)


def is_vacuous(item: PropertyResult) -> bool:
    """Whether it holds since no run satisfies the assumptions."""
    return item.verdict is Verdict.HOLDS and any(note.startswith(NO_RUN) for note in item.notes)


def is_contradicted(item: PropertyResult) -> bool:
    """Whether it is unknown since no run satisfies the assumptions."""
    return item.verdict is Verdict.UNKNOWN and item.reason is not None and item.reason.startswith(NO_RUN)


CONTRADICTED = "correct the assumptions; with `llfsm verify --allow-contradiction` this holds vacuously"
"""What to do about a verdict that `is_contradicted`, in a sentence without its full stop."""


def verdict_word(result: Result, verdict: Verdict) -> str:
    """The same for a verdict alone, such as that on faults."""
    return f"{verdict.value}{resumed_text(result)}" if verdict is Verdict.HOLDS else verdict.value


def resumed_text(result: Result) -> str:
    """` (resumed from FILE)`, or nothing."""
    return "" if result.exploration.resumed_from is None else f" (resumed from {result.exploration.resumed_from})"


CLAIMED = (
    "fails --strict: what the checkpoint says was not searched again, so this is not a pass; search without --resume"
)
"""What is said of a verdict that `Result.is_claimed`, in a sentence without its full stop."""


def name_cell(name: str) -> str:
    """A name in a table. The middle of a long one is left out, since all rows would be as wide; formats that programs
    read have all of it."""
    return name if len(name) <= MOST_NAME else f"{name[: MOST_NAME // 2]}…{name[1 - MOST_NAME // 2 :]}"


def fault_text(result: Result) -> str:
    """What the search says about faults, in a sentence without its full stop."""
    faults = result.faults
    if faults.verdict is Verdict.HOLDS:
        return "no run ends in a fault"
    if faults.verdict is Verdict.UNKNOWN:
        return faults.reason or "the search did not reach every configuration"
    return f"{counted(len(faults.findings), 'place')} where a run ends in a fault"


def summary_text(result: Result, whole: float | None = None) -> str:
    """How much was explored, by which engine, how long it took; `whole`: seconds of the whole command."""
    extent = ("complete" if result.complete else "not complete") + resumed_text(result)
    if result.interrupted:
        extent = "interrupted"
    proofs = any((*(p.proofs for p in result.properties), result.faults.proofs))
    every = ", and proofs for runs of every length" if proofs else ""
    took = f"{result.seconds:.2f} s" + ("" if whole is None else f" of search, {whole:.2f} s in all")
    seen, end = result.exploration, f"{took}, engine {result.engine}"
    if seen.depth is not None:
        return f"runs of up to {counted(seen.depth, 'step')}{every}, {extent}, {end}"
    if seen.complete is None:
        return f"{extent}{every}, {end}"
    found = f"{counted(seen.states, 'configuration')}, {counted(seen.transitions, 'transition')}"
    if seen.stored is not None:
        least, stored = "" if seen.counted else "at least ", f"({seen.stored:,} stored)"
        found = f"{least}{counted(seen.states, 'configuration')} {stored}, {counted(seen.transitions, 'transition')}"
    return f"{found}, {extent}{every}, {end}"


def attempt_texts(attempts: Iterable[Attempt]) -> list[str]:
    """What each engine did, where several were asked, in sentences without a full stop."""
    texts = []
    for attempt in attempts:
        done = f"{attempt.engine} decided {', '.join(attempt.decided) or 'nothing'}"
        rest = "; ".join(attempt.reasons)
        left = "" if not rest else f": {rest}" if not attempt.decided else f"; not the rest: {rest}"
        texts.append(done + left)
    return texts


MOST_FINDINGS = 3
"""What is said of one property as text."""


def vacuity_texts(result: Result, item: PropertyResult) -> list[str]:
    """What makes a pass say less than it seems to, in sentences without a full stop; `strict` says that they fail."""
    if is_contradicted(item):
        return [f"hint: {CONTRADICTED}"]
    empty = result.is_empty(item)
    label = "fails --strict: " if empty else "accepted: " if item.vacuity.accepted else "note: "
    found = item.vacuity.findings
    texts = [CLAIMED] if result.is_claimed(item.verdict) else []
    texts += [f"{label}{finding.message}" for finding in found[:MOST_FINDINGS]]
    if len(found) > MOST_FINDINGS:
        texts.append(f"{label}and {len(found) - MOST_FINDINGS} more like this (--format json has all)")
    if result.is_unseen(item):
        texts.append(f"unknown to --strict: {item.vacuity.reason or 'not checked for vacuity'}")
    elif item.vacuity.reason is not None and result.asked_vacuity:
        texts.append(f"note: {item.vacuity.reason}")
    return texts


def input_text(note: InputNote) -> str:
    """Into how many classes an input was split: ``distance: 4 classes of 65,536 values``."""
    if note.classes is None:
        return f"{', '.join(note.inputs)}: all {note.values:,} values, because {note.reason}"
    plural = "" if note.classes == 1 else "es"
    what = "values" if len(note.inputs) == 1 else "combinations of values"
    return f"{', '.join(note.inputs)}: {note.classes:,} class{plural} of {note.values:,} {what}"


def left_out_text(result: Result) -> str:
    """What the counts do not count, or nothing."""
    if not result.exploration.left_out:
        return ""
    return f"counted without what no property depends on: {', '.join(result.exploration.left_out)}"


def ending_text(longest: int) -> str:
    """That every run ends, the longest after so many steps."""
    end = "then every machine that is loaded is in a state without transitions"
    return f"every run ends, after at most {counted(longest, 'step')}: {end}"


def under_assumptions(result: Result) -> str:
    """`assuming a, b`, or nothing."""
    return f"assuming {', '.join(result.assumptions)}" if result.assumptions else ""


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

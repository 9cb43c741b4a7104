"""What a failed run shows: performed again by the checker's replay, confirmed, as a table, and as trace files."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.checking.replay.confirm import first_letter, perform
from llfsm_verify.checking.trace import Trace
from llfsm_verify.diagnostics import Disagreement, counted
from llfsm_verify.logic.properties import Property, PropertySet, asked_text
from llfsm_verify.program.program import FaultSite
from llfsm_verify.report.saving import SUFFIX, document_of, saved_text, write_traces
from llfsm_verify.testing.saving import keep_trace
from llfsm_verify.verification.replaying import Replay, replay
from llfsm_verify.verification.tracefile import SavedProperty

if TYPE_CHECKING:
    from rich.console import RenderableType

    from llfsm_verify.testing.run import Run


@dataclass(frozen=True, slots=True)
class Finding:
    """One failure of a run, as it was performed again. `note`: why it cannot be saved as a trace that replays."""

    what: Property | FaultSite
    trace: Trace
    note: str | None = None

    @property
    def name(self) -> str:
        """The name of the trace file, without what follows the first full stop."""
        return self.what.name if isinstance(self.what, Property) else f"fault-{self.what.code}"


def findings(run: Run) -> tuple[Finding, ...]:
    """Every failure of the run, confirmed by `checking.replay.saved`. Disagreement: that does not confirm it."""
    failure = run.failure
    if failure is None:
        return ()
    if failure.fault is not None:
        site = failure.fault
        again = replay(run.subject.arrangement, PropertySet(), run.schedule, (site.code, site.message))
        if again.outcome != "fails" or again.trace is None:
            raise Disagreement(f"the fault {site.code} of a run does not happen again: {again.reason}")
        return (Finding(site, again.trace),)
    return tuple(_violation(run, line) for line in failure.violated)


def _violation(run: Run, line: Property) -> Finding:
    assumptions = run.subject.properties.assumptions
    again = replay(run.subject.arrangement, PropertySet((*assumptions, line)), run.schedule)
    if again.trace is None:
        raise Disagreement(f"the run that violates {line.name} cannot be performed again: {again.reason}")
    return Finding(line, again.trace, _note(again, line, bool(assumptions)))


def _note(again: Replay, line: Property, assumed: bool) -> str | None:
    if again.outcome == "fails":
        return None
    if again.outcome == "misfit":
        return f"not confirmed by a second evaluation: {again.reason}"
    if not assumed:
        raise Disagreement(f"a monitor says that the run violates {line.name}, and its second evaluation does not")
    return "no run that goes on like this satisfies the property and the assumptions; without these one may"


def trace_of(run: Run) -> Trace:
    """The run's trace: of its first failure, or with every atom."""
    if run.findings:
        return run.findings[0].trace
    execution, schedule = run.subject.execution, run.schedule
    return perform(execution, schedule, first_letter(execution, schedule)).trace


def report_of(run: Run) -> str:
    """The failure in words, its steps, and a program that repeats it."""
    from llfsm_verify.report.plain import plain_text

    size = f"{counted(run.steps, 'step')}, {counted(run.changes, 'change')} of inputs"
    return "\n".join([plain_text(_shown(run)), f"{size}. The same run again:\n", run.program()])


def _shown(run: Run) -> Iterator[RenderableType]:
    from rich.text import Text

    from llfsm_verify.report.text import fault_place, trace_text

    for finding in run.findings:
        if isinstance(finding.what, Property):
            line = finding.what
            assuming = ", ".join(p.name for p in run.subject.properties.assumptions)
            given = f" (assuming {assuming})" if assuming else ""
            asked = asked_text(line.kind, line.text)
            yield Text(f"{line.name} is violated{given}: {asked}")
        else:
            yield Text(fault_place(finding.what))
        yield from trace_text(finding.trace)
        if finding.note is not None:
            yield Text(f"Note: {finding.note}.")
    if run.failure is not None and not run.findings:
        yield Text(run.failure.text)


def save(run: Run, directory: Path, name: str | None) -> list[Path]:
    """See `Run.save`."""
    subject = run.subject
    if run.failure is not None:
        found = [finding for finding in run.findings if finding.note is None]
    elif name in subject.tested:
        line = subject.tested[name]
        again = replay(subject.arrangement, PropertySet((*subject.properties.assumptions, line)), run.schedule)
        if again.outcome != "passes" or again.trace is None:
            raise Disagreement(f"a monitor says that the run does not violate {name}, and replay: {again.reason}")
        found = [Finding(line, again.trace)]
    else:
        raise ValueError(f"a run that has not failed is saved for one of: {', '.join(subject.tested) or 'none'}")
    documents = []
    for finding in found:
        what = finding.what
        saved: SavedProperty | FaultSite = what if isinstance(what, FaultSite) else _saved(what, directory)
        text = document_of(finding.trace, subject.arrangement, saved, subject.properties, directory, "holds")
        documents.append((finding.name, saved, text))
    arrangement = subject.arrangement
    if run.failure is not None and Path(arrangement.path).is_file():
        kept = [keep_trace(directory, *document, arrangement, load_arrangement) for document in documents]
        return [path for path, _ in kept]
    return write_traces([(directory / f"{name}{SUFFIX}", text) for name, _, text in documents], directory)


def _saved(line: Property, directory: Path) -> SavedProperty:
    assert line.kind != "assume", "only what is tested can fail"
    return SavedProperty(line.name, line.kind, saved_text(line, directory))

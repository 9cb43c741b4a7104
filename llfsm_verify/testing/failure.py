"""What a failed run shows: performed again by the checker's replay, confirmed, as a table, and as trace files."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.replay.confirm import Schedule, first_letter, perform
from llfsm_verify.checking.trace import Trace
from llfsm_verify.diagnostics import DiagnosticError, Disagreement
from llfsm_verify.files import publish, unfinished
from llfsm_verify.logic.properties import Property, PropertySet, asked_text
from llfsm_verify.program.program import FaultSite
from llfsm_verify.report.saving import SUFFIX, unsaved, write_traces
from llfsm_verify.testing.stretches import Failure
from llfsm_verify.testing.tested import Tested
from llfsm_verify.verification.replay import Load, Replay, replay, replay_file
from llfsm_verify.verification.tracefile import SavedProperty, document_of, saved_text

if TYPE_CHECKING:
    from rich.console import RenderableType


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


def findings(subject: Tested, failure: Failure, schedule: Schedule) -> tuple[Finding, ...]:
    """Every failure of a run, confirmed by `verification.replay`. Disagreement: that does not confirm it."""
    if failure.fault is not None:
        site = failure.fault
        again = replay(subject.arrangement, PropertySet(), schedule, (site.code, site.message))
        if again.outcome != "fails" or again.trace is None:
            raise Disagreement(f"the fault {site.code} of a run does not happen again: {again.reason}")
        return (Finding(site, again.trace),)
    return tuple(_violation(subject, schedule, line) for line in failure.violated)


def _violation(subject: Tested, schedule: Schedule, line: Property) -> Finding:
    assumptions = subject.properties.assumptions
    again = replay(subject.arrangement, PropertySet((*assumptions, line)), schedule)
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


def trace_of(subject: Tested, schedule: Schedule) -> Trace:
    """The trace of a run that has not failed, with every atom."""
    return perform(subject.execution, schedule, first_letter(subject.execution, schedule)).trace


def failure_text(subject: Tested, failure: Failure | None, found: Sequence[Finding]) -> str:
    """The failure of a run in words, with the steps that lead to it."""
    from llfsm_verify.report.plain import plain_text

    return plain_text(_shown(subject, failure, found))


def _shown(subject: Tested, failure: Failure | None, found: Sequence[Finding]) -> Iterator[RenderableType]:
    from rich.text import Text

    from llfsm_verify.report.text import fault_place, trace_text

    for finding in found:
        if isinstance(finding.what, Property):
            line = finding.what
            assuming = ", ".join(p.name for p in subject.properties.assumptions)
            given = f" (assuming {assuming})" if assuming else ""
            asked = asked_text(line.kind, line.text)
            yield Text(f"{line.name} is violated{given}: {asked}")
        else:
            yield Text(fault_place(finding.what))
        yield from trace_text(finding.trace)
        if finding.note is not None:
            yield Text(f"Note: {finding.note}.")
    if failure is not None and not found:
        yield Text(failure.text)


def save_failure(subject: Tested, found: Sequence[Finding], directory: Path) -> list[Path]:
    """The trace files of a run that failed (`Run.save`)."""
    arrangement = subject.arrangement
    documents = [_document(subject, finding, directory) for finding in found if finding.note is None]
    if Path(arrangement.path).is_file():
        return [keep_trace(directory, *document, arrangement, load_arrangement)[0] for document in documents]
    return write_traces([(directory / f"{name}{SUFFIX}", text) for name, _, text in documents], directory)


def save_passed(subject: Tested, schedule: Schedule, directory: Path, name: str | None) -> list[Path]:
    """The trace file of a run that has not failed, about the tested property of that name (`Run.save`)."""
    if name not in subject.tested:
        raise ValueError(f"a run that has not failed is saved for one of: {', '.join(subject.tested) or 'none'}")
    line = subject.tested[name]
    again = replay(subject.arrangement, PropertySet((*subject.properties.assumptions, line)), schedule)
    if again.outcome != "passes" or again.trace is None:
        raise Disagreement(f"a monitor says that the run does not violate {name}, and replay: {again.reason}")
    _, _, text = _document(subject, Finding(line, again.trace), directory)
    return write_traces([(directory / f"{name}{SUFFIX}", text)], directory)


def _document(subject: Tested, finding: Finding, directory: Path) -> tuple[str, SavedProperty | FaultSite, str]:
    what = finding.what
    saved: SavedProperty | FaultSite = what if isinstance(what, FaultSite) else _saved(what, directory)
    text = document_of(finding.trace, subject.arrangement, saved, subject.properties, directory, "holds")
    return finding.name, saved, text


def _saved(line: Property, directory: Path) -> SavedProperty:
    assert line.kind != "assume", "only what is tested can fail"
    return SavedProperty(line.name, line.kind, saved_text(line, directory))


# ---------------- kept as a trace file, once, and never over a file that shows something else


def keep_trace(
    directory: Path, name: str, what: SavedProperty | FaultSite, text: str, arrangement: Arrangement, load: Load
) -> tuple[Path, bool]:
    """Write `text` as ``NAME.trace.yaml`` or, where that is taken, as ``NAME-2.trace.yaml`` and so on.

    Nothing is written when one of these files shows the same failure already, and still does when it is run again;
    `load` loads its arrangement. Returns the file that shows the failure, and whether it is a new one. Raises
    DiagnosticError (E405) when it cannot be written.
    """
    try:
        directory.mkdir(parents=True, exist_ok=True)
        for path in _names(directory, name):
            if _create(path, text):
                return path, True
            if _shows(path, what, arrangement, load):
                return path, False
    except OSError as error:
        raise unsaved(error, directory) from None
    raise AssertionError("names do not end")


def _names(directory: Path, name: str) -> Iterator[Path]:
    for number in count(1):
        yield directory / f"{name}{f'-{number}' if number > 1 else ''}{SUFFIX}"


def _create(path: Path, text: str) -> bool:
    """Make a file that no process sees unfinished; False: there is one already, also when another process made it."""
    with unfinished(path) as (file, name):
        file.write(text.encode())
        file.close()
        return publish(name, path)


def _shows(path: Path, what: SavedProperty | FaultSite, arrangement: Arrangement, load: Load) -> bool:
    """Whether the file is a trace of the same arrangement in which the same thing still fails."""
    try:
        done = replay_file(os.fspath(path), None, load, chosen=True)
    except DiagnosticError:
        return False
    file = done.file
    if isinstance(what, FaultSite):
        same = file.fault is not None and file.fault == (what.code, what.message)
    else:
        same = file.goal is not None and (file.goal.kind, file.goal.text) == (what.kind, what.text)
    return same and Path(done.arrangement.path).samefile(arrangement.path) and done.found == "violated"

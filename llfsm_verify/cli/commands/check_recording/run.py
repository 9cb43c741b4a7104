"""`llfsm check-recording`: properties decided on what happened in a run."""

from __future__ import annotations

from argparse import Namespace

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.cli.io.decided import say_decided, when_decided
from llfsm_verify.cli.io.output import tell
from llfsm_verify.cli.opening import read_properties, told
from llfsm_verify.cli.parser import UsageError
from llfsm_verify.runtime.deciding.logs.check import DecidedOnLog, check_log
from llfsm_verify.runtime.deciding.logs.formats import LOGS
from llfsm_verify.runtime.deciding.recordings import check
from llfsm_verify.runtime.recording.file import Recording
from llfsm_verify.runtime.recording.origin import arrangement_of
from llfsm_verify.runtime.recording.replay import compared


def run(options: Namespace) -> int:
    """1 where a property is violated, else 4 where one is undecided (with ``--allow-undecided`` only if the recording
    is damaged), else 0. Raises DiagnosticError."""
    if not options.properties and not options.property:
        raise UsageError("no property to decide: name a property file, or write -p TEXT")
    if options.mapping is not None:
        return _decide_log(options)
    if options.format is not None:
        raise UsageError("--from says what a log is, and a log needs --mapping FILE")
    with Recording(options.recording) as recording:
        return _decide(recording, options)


def _decide(recording: Recording, options: Namespace) -> int:
    lines = read_properties(options)
    arrangement = arrangement_of(recording, load_arrangement, options.arrangement)
    told(lines, arrangement)
    with compared(recording):
        found = check(arrangement, lines, recording)
    tell(*(f"note: {note}" for note in recording.notes))
    allowed = options.allow_undecided and recording.damaged is None
    return say_decided([(d, when_decided(d)) for d in found], allow_undecided=allowed)


def _decide_log(options: Namespace) -> int:
    wanted = options.format or LOGS.named_by(options.recording)
    if wanted is None:
        raise UsageError(f"say which format the log has: --from {', '.join(LOGS)}")
    if options.arrangement is None:
        raise UsageError("a log does not say of which arrangement it is: name it with --arrangement FILE")
    lines = read_properties(options)
    arrangement = load_arrangement(options.arrangement)
    told(lines, arrangement)
    found = check_log(arrangement, lines, options.recording, options.mapping, wanted)
    return say_decided([(d.decided, _where(d)) for d in found], allow_undecided=options.allow_undecided)


def _where(found: DecidedOnLog) -> str:
    """The row of a log."""
    decided = found.decided
    if decided.step is None:
        return f"because {decided.reason}" if decided.reason else ""
    return f"at row {decided.step:,}" + ("" if found.time is None else f", at time {found.time}")

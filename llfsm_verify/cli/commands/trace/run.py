"""`llfsm trace`: a recording or a saved trace over time, for other tools and as a picture."""

from __future__ import annotations

from argparse import Namespace
from contextlib import ExitStack
from functools import partial
from pathlib import Path

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.cli.io.files import announce, ready, write_whole
from llfsm_verify.cli.io.output import tell
from llfsm_verify.cli.opening import read_properties
from llfsm_verify.cli.parser import UsageError
from llfsm_verify.report.saving import SUFFIX, refuse_others
from llfsm_verify.report.timeline.formats import TIMELINES
from llfsm_verify.runtime.recording.file import Recording, is_recording
from llfsm_verify.runtime.recording.origin import arrangement_of, code_of
from llfsm_verify.runtime.recording.replay import compared, performed
from llfsm_verify.runtime.recording.timeline import Timeline, recorded, traced
from llfsm_verify.verification.replay import replay_file, schedule_of

DAMAGED = 3
TRACE = "trace"
"""A saved trace, which is no timeline."""


def run(options: Namespace) -> int:
    """Returns 0, 2 for wrong usage, 3 for a recording that is damaged after what is written. DiagnosticError: what is
    wrong with the file, or the output cannot be written (E487).
    """
    meant = TRACE if (options.output or "").endswith(SUFFIX) else TIMELINES.named_by(options.output or "")
    wanted = options.to or meant
    if wanted is None:
        raise UsageError(f"say which format: --to {', '.join((*TIMELINES, TRACE))}, or an output that ends like one")
    if meant not in (None, wanted):
        raise UsageError(f"`{options.output}` ends like {meant}, and --to says {wanted}")
    if wanted in TIMELINES.binary and options.output in (None, "-"):
        raise UsageError(f"{wanted} is not text: name a file with -o")
    if wanted == TRACE:
        return _saved(options)
    if options.property:
        raise UsageError("-p says what a saved trace shows: it is for --to trace")
    first, last = options.steps
    with ExitStack() as left:
        recording = None
        if options.file != "-" and is_recording(options.file):
            recording = left.enter_context(Recording(options.file))
            left.enter_context(compared(recording))
            timeline = _recorded(recording, options)
        else:
            timeline = _traced(options)
        write = partial(TIMELINES.load(wanted), timeline.part(first, last))
        write_whole(write, options.output, "E487", "the timeline")
    return 0 if recording is None else _told(recording)


def _told(recording: Recording) -> int:
    """Say what is to be said of a recording that was read; the exit code."""
    tell(*(f"note: {note}" for note in recording.notes))
    if recording.damaged:
        tell(f"{recording.path}: damaged after what was written: {recording.damaged}")
        return DAMAGED
    return 0


def _saved(options: Namespace) -> int:
    """A piece of a recording as a saved trace. DiagnosticError: there is no such piece (E488), or it cannot be written
    there (E405)."""
    from llfsm_verify.runtime.deciding.piece import piece_of

    first, last = options.steps
    name = options.output if options.output not in (None, "") else "-"
    if options.file == "-" or not is_recording(options.file):
        raise UsageError(f"`{options.file}` is not a recording; `--to trace` needs a recording of `llfsm run`")
    if first:
        raise UsageError(f"a saved trace begins where the run begins: --steps :{'' if last is None else last}")
    if options.arrangement is None:
        raise UsageError("a saved trace names the file of its arrangement: --arrangement FILE")
    lines = read_properties(options)
    if len(lines.goals) > 1:
        raise UsageError("a saved trace has one property, besides assumptions")
    arrangement = load_arrangement(options.arrangement)
    if name != "-":
        ready(arrangement, lines, name, ("E405", "E405"), "the trace")
        refuse_others([Path(name)])
    with Recording(options.file) as recording, compared(recording):
        piece = piece_of(recording, arrangement, lines, Path(name).parent, last)
    write_whole(piece.text, name, "E405", "the trace")
    if name != "-":
        announce(Path(name))
    tell(piece.sentence)
    return _told(recording)


def _traced(options: Namespace) -> Timeline:
    done = replay_file(options.file, options.arrangement, load_arrangement)
    goal, fault, trace = done.file.goal, done.file.fault, done.replay.trace
    shows = goal.name if goal is not None else fault[1] if fault is not None else ""
    failed = None if trace is None else trace.failed_at
    return traced(done.arrangement, schedule_of(done.file, done.arrangement), shows, failed)


def _recorded(recording: Recording, options: Namespace) -> Timeline:
    arrangement = arrangement_of(recording, load_arrangement, options.arrangement)
    code = code_of(recording, arrangement)
    return recorded(arrangement, code, performed(recording, code))

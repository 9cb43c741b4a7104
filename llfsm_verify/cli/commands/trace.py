"""`llfsm trace`: a recording or a saved trace over time, for other tools and as a picture."""

from __future__ import annotations

import io
import sys
from argparse import Namespace
from contextlib import ExitStack
from pathlib import Path

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.cli.io.output import Output, usage
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.files import replacing
from llfsm_verify.report.replaying import replay_file, schedule_of
from llfsm_verify.report.timeline.codes import UNWRITABLE
from llfsm_verify.report.timeline.formats import TIMELINES
from llfsm_verify.report.timeline.reading import recorded, traced
from llfsm_verify.report.timeline.timeline import Timeline
from llfsm_verify.runtime.recording.codes import OTHER
from llfsm_verify.runtime.recording.file import Recording, is_recording
from llfsm_verify.runtime.recording.origin import arrangement_of, code_of, free_of
from llfsm_verify.runtime.recording.replay import Differs, replay

DAMAGED = 3
BINARY = frozenset({"mcap"})


def run(options: Namespace) -> int:
    """Returns 0, 2 for wrong usage, 3 for a recording that is damaged after what is written. DiagnosticError: what is
    wrong with the file, or the output cannot be written (E487).
    """
    meant = TIMELINES.named_by(options.output or "")
    wanted = options.to or meant
    if wanted is None:
        return usage(f"say which format: --to {', '.join(TIMELINES)}, or an output that ends like one")
    if meant not in (None, wanted):
        return usage(f"`{options.output}` ends like {meant}, and --to says {wanted}")
    if wanted in BINARY and options.output in (None, "-"):
        return usage(f"{wanted} is not text: name a file with -o")
    first, last = options.steps
    with ExitStack() as left:
        recording = None
        if _records(options.file):
            recording = left.enter_context(Recording(options.file))
            timeline = _recorded(recording, options)
        else:
            done = replay_file(options.file, options.arrangement, load_arrangement)
            timeline = traced(done.arrangement, schedule_of(done.file, done.arrangement))
        try:
            _write(timeline.part(first, last), wanted, options.output)
        except Differs as differs:
            message = f"this is no recording of this arrangement: {differs}"
            raise DiagnosticError([Diagnostic(OTHER, message, file=options.file)]) from None
        if recording is not None and recording.damaged:
            print(f"{options.file}: the recording is damaged after what was written", file=sys.stderr)
            return DAMAGED
    return 0


def _records(path: str) -> bool:
    try:
        return path != "-" and is_recording(path)
    except OSError:
        return False  # what is wrong with it is said where traces are read


def _recorded(recording: Recording, options: Namespace) -> Timeline:
    arrangement = arrangement_of(recording, load_arrangement, options.arrangement)
    code = code_of(recording, arrangement)
    return recorded(
        arrangement, code, replay(code, recording, free_of(recording, code.program), goes_on=recording.goes_on)
    )


def _write(timeline: Timeline, wanted: str, output: str | None) -> None:
    """To a file as a whole, or to standard output."""
    write = TIMELINES.load(wanted)
    try:
        if output is None or output == "-":
            buffer = io.BytesIO()
            write(timeline, buffer)
            Output().plain(buffer.getvalue().decode("utf-8"))
        elif Path(output).exists() and not Path(output).is_file():
            with Path(output).open("wb") as device:
                write(timeline, device)
        else:
            with replacing(Path(output).resolve()) as file:
                write(timeline, file)
    except (OSError, ValueError) as error:
        why = (error.strerror if isinstance(error, OSError) else None) or "input/output error"
        message = f"the timeline cannot be written there: {why}"
        raise DiagnosticError(Diagnostic(UNWRITABLE, message, file=output)) from None

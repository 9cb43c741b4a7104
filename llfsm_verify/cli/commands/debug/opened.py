"""What `llfsm debug` debugs: an arrangement, a saved trace, a recording, or what runs under a name."""

from __future__ import annotations

import os
import re
from argparse import Namespace
from contextlib import ExitStack
from pathlib import Path

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.runtime.debugging.debugger import Debugger
from llfsm_verify.runtime.debugging.paths import Free, Recorded, Start, Traced
from llfsm_verify.runtime.debugging.paths import Path as Walked
from llfsm_verify.runtime.debugging.session import Driven, Session
from llfsm_verify.runtime.live import ABSENT
from llfsm_verify.runtime.stepping.drawing import drawing_of, free_values
from llfsm_verify.semantics.lowering import lower

_TRACE = re.compile(rb"^trace[ \t]*:", re.MULTILINE)
_HEAD_BYTES = 1 << 16


def opened(options: Namespace, left: ExitStack) -> Driven:
    """What is debugged, ready to be driven; `left` closes what it holds. DiagnosticError: it cannot be read."""
    from llfsm_verify.runtime.recording.file import is_recording

    path = options.what
    if path != "-" and not os.path.exists(path):  # noqa: PTH110 - also a text that is no name of a file
        running = _attached(path, left)
        if running is not None:
            return running
        if path.isidentifier():
            message = f"there is no file `{path}`, and no arrangement runs with a whiteboard of that name"
            hint = "check the path; `llfsm whiteboard list` says what runs"
            raise DiagnosticError([Diagnostic(ABSENT, message, hint=hint)])
    if path != "-" and is_recording(path):
        return _recorded(options, left)
    if path != "-" and _is_trace(path):
        return _traced(options)
    arrangement = load_arrangement(path)

    program = lower(arrangement, keep_all_bits=True)
    law = drawing_of(program, options.hold, options.draw)

    def free(execution: Execution) -> Walked:
        return Free(execution, options.seed, law)

    start = Start(tuple(free_values(program, {}, law, options.seed).items()))
    return Session(Debugger(arrangement, free, start, options.history))


def _is_trace(path: str) -> bool:
    """Whether a regular file begins as a saved trace."""
    try:
        if not Path(path).is_file():
            return False
        with Path(path).open("rb") as file:
            return _TRACE.search(file.read(_HEAD_BYTES)) is not None
    except (OSError, ValueError):
        return False


def _attached(name: str, left: ExitStack) -> Driven | None:
    """A look at what runs; None: nothing of this name runs."""
    from llfsm_verify.runtime.debugging.attached import Attached
    from llfsm_verify.runtime.whiteboard.client import Whiteboard, WhiteboardError
    from llfsm_verify.runtime.whiteboard.places import NoPlace, names

    try:
        if name not in names():
            return None
        board = left.enter_context(Whiteboard(name))
        return Attached(board, left.enter_context(board.subscribe()))
    except NoPlace:
        return None
    except WhiteboardError as error:
        raise DiagnosticError(
            [Diagnostic(ABSENT, str(error), hint="`llfsm whiteboard list` says what there is")]
        ) from None


def _recorded(options: Namespace, left: ExitStack) -> Driven:
    from llfsm_verify.runtime.recording.file import Recording
    from llfsm_verify.runtime.recording.origin import arrangement_of, code_of

    recording = left.enter_context(Recording(options.what))
    arrangement: Arrangement = arrangement_of(recording, load_arrangement, options.arrangement)
    walked = Recorded(recording, code_of(recording, arrangement))
    return Session(Debugger(arrangement, lambda _: walked, walked.start, options.history))


def _traced(options: Namespace) -> Driven:
    from llfsm_verify.verification.replay import saved_run

    file, arrangement, schedule = saved_run(options.what, options.arrangement, load_arrangement)
    path = Traced(schedule, fails=file.fault is not None)
    return Session(Debugger(arrangement, lambda _: path, Start(schedule.free), options.history))

"""`llfsm debug`: walk a run forwards and backwards, and see why."""

from __future__ import annotations

import os
import re
import sys
from argparse import Namespace
from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from itertools import chain
from pathlib import Path

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.debugger.debugger import Debugger
from llfsm_verify.extensions.debugger.paths import Free, StepPath, Traced
from llfsm_verify.extensions.debugger.session import Driven, Session
from llfsm_verify.plug import (
    DRAWN_VALUES,
    FRONT_ENDS,
    NO_WHITEBOARD,
    Arrangement,
    DebugError,
    DrawingError,
    Execution,
    Output,
    PathStart,
    Recorded,
    UsageError,
    assignments,
    do_more_tasks,
    drawing_of,
    free_values,
    load_arrangement,
    lower,
    read_source,
    wrong_usage,
)  # fmt: skip

UNEXPECTED, IMPOSSIBLE = 1, 2
PROMPT = "(debug) "


def run(options: Namespace) -> int:
    """1 where what `expect` asked for is not so, 2 where a command cannot be done. DiagnosticError: wrong files."""
    do_more_tasks()
    _refuse_misuse(options)
    options.draw = assignments("--draw", options.draw, DRAWN_VALUES)
    given: list[str] = list(options.commands)
    if options.script is not None and options.script != "-":
        given += read_source(options.script)[0].text.splitlines()
    reads = options.script == "-" or (not given and options.script is None and options.what != "-")
    asks = reads and options.script is None and sys.stdin.isatty() and sys.stdout.isatty()
    with ExitStack() as left:
        with wrong_usage(DrawingError, "--"):
            driven = opened(options, left)
        if not asks:
            return _scripted(driven, chain(given, _standard_input() if reads else ()), Output())
        if not options.plain and isinstance(driven, Session) and FRONT_ENDS:
            return FRONT_ENDS.load(next(iter(FRONT_ENDS)))(driven)
        return _asked(driven, Output())


def _refuse_misuse(options: Namespace) -> None:
    """UsageError: options that do not go together."""
    if options.what == "-" and options.script == "-":
        raise UsageError("the arrangement and the commands cannot both come from standard input")
    if options.seed is None and (options.hold is not None or options.draw):
        raise UsageError("--hold and --draw say how --seed draws inputs")


def _standard_input() -> Iterator[str]:
    for line in sys.stdin:
        yield line.rstrip("\n")


def _scripted(driven: Driven, lines: Iterable[str], output: Output) -> int:
    """Each command with its answer; the first one that cannot be done ends the session."""
    code = 0
    for line in lines:
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        output.plain(f"{PROMPT}{line.strip()}\n")
        try:
            answer = driven.do(line)
        except DebugError as error:
            output.plain(f"{error}\n")
            return IMPOSSIBLE
        _tell(answer.parts, output)
        if answer.expected is False:
            code = UNEXPECTED
        if answer.quits or output.closed:
            break
    return code


def _asked(driven: Driven, output: Output) -> int:
    """Commands as the user types them. A mistake does not end the session, and Ctrl-C only what is under way."""
    import readline  # noqa: F401 - `input` then has a history and can be edited

    code = 0
    output.plain("`help` lists the commands; an empty line repeats the last one\n")
    _tell(driven.do("where").parts, output)
    last = ""
    while True:
        try:
            line = input(PROMPT).strip() or last
        except EOFError:
            output.plain("\n")
            return code
        except KeyboardInterrupt:
            output.plain("\n")
            continue
        last = line
        try:
            answer = driven.do(line)
        except DebugError as error:
            output.plain(f"{error}\n")
            continue
        except KeyboardInterrupt:
            output.plain("interrupted\n")
            _tell(driven.do("where").parts, output)
            continue
        _tell(answer.parts, output)
        if answer.expected is False:
            code = UNEXPECTED
        if answer.quits or output.closed:
            return code


def _tell(parts: Iterable[object], output: Output) -> None:
    from llfsm_verify.plug import lines_of

    output.rich(lines_of(parts, output.width))  # type: ignore[arg-type]


# ---------------- what is debugged: an arrangement, a saved trace, a recording, or what runs under a name

_TRACE = re.compile(rb"^trace[ \t]*:", re.MULTILINE)
_HEAD_BYTES = 1 << 16


def opened(options: Namespace, left: ExitStack) -> Driven:
    """What is debugged, ready to be driven; `left` closes what it holds. DiagnosticError: it cannot be read."""
    from llfsm_verify.plug import is_recording

    path = options.what
    if path != "-" and not os.path.exists(path):  # noqa: PTH110 - also a text that is no name of a file
        running = _attached(path, left)
        if running is not None:
            return running
        if path.isidentifier():
            message = f"there is no file `{path}`, and no arrangement runs with a whiteboard of that name"
            hint = "check the path; `llfsm whiteboard list` says what runs"
            raise DiagnosticError([Diagnostic(NO_WHITEBOARD, message, hint=hint)])
    if path != "-" and is_recording(path):
        return _recorded(options, left)
    if path != "-" and _is_trace(path):
        return _traced(options)
    arrangement = load_arrangement(path)

    program = lower(arrangement, keep_all_bits=True)
    law = drawing_of(program, options.hold, options.draw)

    def free(execution: Execution) -> StepPath:
        return Free(execution, options.seed, law)

    start = PathStart(tuple(free_values(program, {}, law, options.seed).items()))
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
    from llfsm_verify import Whiteboard, WhiteboardError
    from llfsm_verify.extensions.debugger.attached import Attached
    from llfsm_verify.plug import NoPlace, whiteboard_names

    try:
        if name not in whiteboard_names():
            return None
        board = left.enter_context(Whiteboard(name))
        return Attached(board, left.enter_context(board.subscribe()))
    except NoPlace:
        return None
    except WhiteboardError as error:
        raise DiagnosticError(
            [Diagnostic(NO_WHITEBOARD, str(error), hint="`llfsm whiteboard list` says what there is")]
        ) from None


def _recorded(options: Namespace, left: ExitStack) -> Driven:
    from llfsm_verify.plug import Recording, arrangement_of, code_of

    recording = left.enter_context(Recording(options.what))
    arrangement: Arrangement = arrangement_of(recording, load_arrangement, options.arrangement)
    walked = Recorded(recording, code_of(recording, arrangement))
    return Session(Debugger(arrangement, lambda _: walked, walked.start, options.history))


def _traced(options: Namespace) -> Driven:
    from llfsm_verify.plug import saved_run

    file, arrangement, schedule = saved_run(options.what, options.arrangement, load_arrangement)
    path = Traced(schedule, fails=file.fault is not None)
    return Session(Debugger(arrangement, lambda _: path, PathStart(schedule.free), options.history))

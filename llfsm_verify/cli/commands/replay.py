"""`llfsm replay`: run saved traces again and say whether what they show still happens."""

from __future__ import annotations

from argparse import Namespace
from typing import TYPE_CHECKING

from llfsm_verify.cli.arguments import colour, other_arrangement
from llfsm_verify.cli.io.output import Output
from llfsm_verify.cli.parser import Parser

if TYPE_CHECKING:
    from llfsm_verify.verification.replay import Replayed

MISFIT = 3


def arguments(parser: Parser) -> None:
    """Add the arguments of `llfsm replay`."""
    parser.about(
        "Run saved traces again and say whether what they show still happens; perform recordings of `llfsm run` again "
        "and compare each frame, bit for bit.",
        "llfsm replay traces/never_both.trace.yaml --arrangement mended.yaml",
        "exit codes: 0 it still happens (or, with `expect: holds`, does not), 1 otherwise, 2 wrong usage, 3 the trace "
        "no longer fits",
    )
    add = parser.add_argument
    add("traces", metavar="TRACE", nargs="+", help="files that --save-traces or `llfsm run --record` wrote")
    other_arrangement(parser, "the trace names")
    add("-q", "--quiet", action="store_true", help="do not print the table of steps")
    colour(parser)


def run(options: Namespace) -> int:
    """The worst code over all traces: 3 when one no longer fits or is no trace file, then 1, then 0."""
    from llfsm_verify.arrangement import load_arrangement
    from llfsm_verify.runtime.recording.file import is_recording
    from llfsm_verify.runtime.recording.repeating import replay_recording
    from llfsm_verify.verification.replay import replay_file

    worst = 0
    output = Output(options.color, options.width)
    for path in options.traces:
        if is_recording(path):
            again = replay_recording(path, options.arrangement, load_arrangement)
            output.plain("".join(f"note: {note}\n" for note in again.notes) + f"{path}: {again.sentence}\n")
            worst = max(worst, {True: 0, False: 1, None: MISFIT}[again.same])
            continue
        done = replay_file(path, options.arrangement, load_arrangement)
        if not options.quiet:
            _show(done, output)
        output.plain(f"{path}: {done.sentence}\n")
        worst = max(worst, _code(done))
    return worst


def _code(done: Replayed) -> int:
    if done.found is None:
        return MISFIT
    return 0 if done.found == done.file.expect else 1


def _show(done: Replayed, output: Output) -> None:
    from llfsm_verify.report.steptable import StepTable
    from llfsm_verify.report.wording import because_text

    if done.file.goal is not None:
        output.plain(f"{done.title}\n")
    for note in done.notes:
        output.plain(f"note: {note}\n")
    if done.replay.trace is not None:
        output.rich([StepTable(done.replay.trace)])
        because = because_text(done.replay.trace)
        if because is not None and done.asked is None:
            output.plain(f"{because[0].upper()}{because[1:]}.\n")

"""`llfsm replay`: run saved traces again and say whether what they show still happens."""

from __future__ import annotations

from argparse import Namespace

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.cli.io.output import Output
from llfsm_verify.report.replaying import Replayed, replay_file

MISFIT = 3


def run(options: Namespace) -> int:
    """The worst code over all traces: 3 when one no longer fits or is no trace file, then 1, then 0."""
    worst = 0
    output = Output(options.color, options.width)
    for path in options.traces:
        if _is_recording(path):
            worst = max(worst, _perform(path, options, output))
            continue
        done = replay_file(path, options.arrangement, load_arrangement)
        if not options.quiet:
            _show(done, output)
        output.plain(f"{path}: {done.sentence}\n")
        worst = max(worst, _code(done))
    return worst


def _is_recording(path: str) -> bool:
    from llfsm_verify.runtime.recording.file import is_recording

    try:
        return is_recording(path)
    except OSError:
        return False  # what is wrong with it is said where traces are read


def _perform(path: str, options: Namespace, output: Output) -> int:
    """Perform a recording again; 1 where a frame differs."""
    from llfsm_verify.runtime.live.frame import ENDING, ENDINGS
    from llfsm_verify.runtime.recording.file import Recording
    from llfsm_verify.runtime.recording.origin import arrangement_of, code_of
    from llfsm_verify.runtime.recording.replay import Differs, performed

    frames, ending = 0, 0
    with Recording(path) as recording:
        arrangement = arrangement_of(recording, load_arrangement, options.arrangement)
        code = code_of(recording, arrangement)
        try:
            for turn in performed(recording, code):
                frames, ending = frames + 1, turn.frame[ENDING]
        except Differs as differs:
            output.plain(f"{path}: differs: {differs}\n")
            return 1
    over = f"and then {ENDINGS[ending]}" if ending else "and then nothing: the process was killed"
    if recording.damaged:
        output.plain(f"{path}: damaged after frame {frames:,}, and the same until then\n")
        return MISFIT
    output.plain(f"{path}: {frames:,} frames, the same bit for bit, {over}\n")
    return 0


def _code(done: Replayed) -> int:
    if done.found is None:
        return MISFIT
    return 0 if done.found == done.file.expect else 1


def _show(done: Replayed, output: Output) -> None:
    from llfsm_verify.report.steptable import StepTable
    from llfsm_verify.report.tracewords import because_text

    if done.file.goal is not None:
        output.plain(f"{done.title}\n")
    for note in done.notes:
        output.plain(f"note: {note}\n")
    if done.replay.trace is not None:
        output.rich([StepTable(done.replay.trace)])
        because = because_text(done.replay.trace)
        if because is not None and done.asked is None:
            output.plain(f"{because[0].upper()}{because[1:]}.\n")

"""`llfsm check-recording`: properties decided on what happened in a run."""

from __future__ import annotations

from argparse import Namespace
from typing import TYPE_CHECKING

from llfsm_verify.cli.arguments import other_arrangement, property_files, property_lines
from llfsm_verify.cli.io.output import tell
from llfsm_verify.cli.opening import read_properties, told
from llfsm_verify.cli.parser import Parser, UsageError
from llfsm_verify.runtime.deciding.logs import LOGS

if TYPE_CHECKING:
    from llfsm_verify.runtime.deciding.recordings import Decided
    from llfsm_verify.runtime.recording.file import Recording


NOTHING = "no property to decide: name a property file, or write -p TEXT"


def arguments(parser: Parser) -> None:
    """Add the arguments of `llfsm check-recording`."""
    parser.about(
        "Decide properties on a recording of `llfsm run`, or on a log that others wrote: violated or satisfied by what "
        "happened, whatever comes after, or undecided at its end. Without properties: whether the surroundings did "
        "what `environment` allows.",
        "llfsm check-recording run.rec properties.ltl",
        "exit codes: 0 no property is violated, 1 one is, 2 wrong usage, 3 files wrong or unreadable, 4 undecided",
    )
    add = parser.add_argument
    add("recording", metavar="RECORDING", help="a file that `llfsm run --record` wrote; with --mapping, a log")
    property_files(parser)
    property_lines(parser)
    other_arrangement(parser, "the recording has")
    add(
        "--allow-undecided",
        action="store_true",
        help="exit code 0 where nothing is violated, also if something is undecided; a damaged recording is still 4",
    )
    add("--mapping", metavar="FILE", help="read a log; FILE says which column gives which slot; needs --arrangement")
    formats = "; ".join(f"{name}: {entry.about}" for name, entry in LOGS.items())
    add("--from", dest="format", choices=LOGS, help=f"the log's format (default: by its name): {formats}")


def run(options: Namespace) -> int:
    """1 where a property is violated, else 4 where one is undecided (with ``--allow-undecided`` only if the recording
    is damaged), else 0. Raises DiagnosticError."""
    from llfsm_verify.runtime.recording.file import Recording

    asked = bool(options.properties or options.property)
    if options.mapping is not None and asked:
        return _decide_log(options)
    if options.mapping is not None:
        raise UsageError(NOTHING)
    if options.format is not None:
        raise UsageError("--from says what a log is, and a log needs --mapping FILE")
    with Recording(options.recording) as recording:
        return _decide(recording, options) if asked else _follow(recording, options)


def _follow(recording: Recording, options: Namespace) -> int:
    """Without properties: whether the surroundings kept to their models."""
    from llfsm_verify.arrangement import load_arrangement
    from llfsm_verify.cli.io.decided import say_followed
    from llfsm_verify.runtime.deciding.surroundings import check_surroundings
    from llfsm_verify.runtime.recording.replay import compared

    with compared(recording):
        followed = check_surroundings(recording, load_arrangement, options.arrangement)
    if followed is None:
        raise UsageError(f"{NOTHING}; without one, a run in the world is compared with the `environment` that it has")
    tell(*(f"note: {note}" for note in recording.notes))
    return say_followed(followed, allow_undecided=options.allow_undecided and recording.damaged is None)


def _decide(recording: Recording, options: Namespace) -> int:
    from llfsm_verify.arrangement import load_arrangement
    from llfsm_verify.cli.io.decided import say_decided, when_decided
    from llfsm_verify.runtime.deciding.recordings import check
    from llfsm_verify.runtime.recording.origin import arrangement_of
    from llfsm_verify.runtime.recording.replay import compared

    lines = read_properties(options)
    arrangement = arrangement_of(recording, load_arrangement, options.arrangement)
    told(lines, arrangement)
    with compared(recording):
        found = check(arrangement, lines, recording)
    tell(*(f"note: {note}" for note in recording.notes))
    if recording.damaged is not None:
        tell(f"{recording.path}: damaged after what was decided on: {recording.damaged}")
    allowed = options.allow_undecided and recording.damaged is None
    return say_decided([(d, when_decided(d)) for d in found], allow_undecided=allowed)


def _decide_log(options: Namespace) -> int:
    from llfsm_verify.arrangement import load_arrangement
    from llfsm_verify.cli.io.decided import say_decided
    from llfsm_verify.runtime.deciding.logs import READINGS

    wanted = options.format or LOGS.named_by(options.recording)
    if wanted is None:
        raise UsageError(f"say which format the log has: --from {', '.join(LOGS)}")
    if options.arrangement is None:
        raise UsageError("a log does not say of which arrangement it is: name it with --arrangement FILE")
    lines = read_properties(options)
    arrangement = load_arrangement(options.arrangement)
    told(lines, arrangement, stamped=True)
    found = READINGS.load("mapping")(arrangement, lines, options.mapping, options.recording).check(wanted)
    return say_decided([(d, _where(d)) for d in found], allow_undecided=options.allow_undecided)


def _where(decided: Decided) -> str:
    """The row of a log."""
    if decided.step is None:
        return f"because {decided.reason}" if decided.reason else ""
    when = "" if decided.time is None else f", at time {decided.time}"
    return f"at row {decided.step:,}{when}" + (
        "" if decided.deadline is None else f": its time was up at {decided.deadline}"
    )

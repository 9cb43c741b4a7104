"""The arguments of `llfsm check-recording`."""

from __future__ import annotations

from llfsm_verify.cli.arguments import other_arrangement, property_files, property_lines
from llfsm_verify.cli.parser import Parser
from llfsm_verify.runtime.deciding.logs.formats import LOGS


def arguments(parser: Parser) -> None:
    """Of `llfsm check-recording`."""
    parser.about(
        "Decide properties on a recording of `llfsm run`, or on a log that others wrote: violated or satisfied by what "
        "happened, whatever comes after, or undecided at its end.",
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

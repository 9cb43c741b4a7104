"""The arguments of `llfsm debug`."""

from __future__ import annotations

from llfsm_verify.extensions.debugger import MOST_STEPS
from llfsm_verify.plug import CommandParser, drawn_inputs, other_arrangement, positive_number, repeatable


def arguments(parser: CommandParser) -> None:
    """Add the arguments of `llfsm debug`."""
    parser.about(
        "Walk a run forwards and backwards, by ringlets, cycles and break points, and see why transitions fired. "
        "On a saved trace or a recording it walks through what happened; on a running arrangement it only looks.",
        "llfsm debug arrangement.yaml --command 'until north@GREEN' --command why",
        "exit codes: 0 done, 1 an `expect` was not met, 2 wrong usage, or a command that cannot be done, 3 "
        "files wrong or unreadable",
    )
    add = parser.add_argument
    add(
        "what",
        metavar="ARRANGEMENT|TRACE|RECORDING|NAME",
        help="the file, or the name of a whiteboard of an arrangement that runs",
    )
    repeatable(parser, "--command", metavar="COMMAND", dest="commands", text="do this")
    add("--script", metavar="FILE", help="do the commands of this file, one per line; - reads standard input")
    add("--plain", action="store_true", help="on a terminal: a prompt in place of panes")
    add(
        "--seed",
        metavar="N",
        type=int,
        help="draw inputs that are not set, and turns, at random (default: inputs stay)",
    )
    drawn_inputs(parser)
    other_arrangement(parser, "the file names or has")
    add(
        "--history",
        metavar="N",
        type=positive_number,
        default=MOST_STEPS,
        help=f"how many steps are kept to go back to (default: {MOST_STEPS:,})",
    )

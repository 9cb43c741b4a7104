"""The arguments of `llfsm replay`."""

from __future__ import annotations

from llfsm_verify.cli.arguments import colour, other_arrangement
from llfsm_verify.cli.parser import Parser


def arguments(parser: Parser) -> None:
    """Of `llfsm replay`."""
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

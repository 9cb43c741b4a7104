"""`llfsm access`: who may do what in an arrangement, and who does."""

from __future__ import annotations

from argparse import Namespace

from llfsm_verify.cli.arguments import ARRANGEMENT
from llfsm_verify.cli.drawing_format import drawing_format
from llfsm_verify.cli.io.files import ready, write_whole
from llfsm_verify.cli.io.output import Output
from llfsm_verify.cli.parser import Parser
from llfsm_verify.report.drawing import UNWRITABLE
from llfsm_verify.report.drawing.formats import DRAWINGS
from llfsm_verify.report.formats import REPORTS


def arguments(parser: Parser) -> None:
    """Add the arguments of `llfsm access`."""
    parser.about(
        "List what each machine writes and commands, what else it may do, and what users may do: "
        "by the keys `access` and `operators`.",
        "llfsm access arrangement.yaml --draw access.svg",
        "exit codes: 0 listed, 2 wrong usage, 3 files wrong or unreadable, or the drawing cannot be written",
    )
    parser.add_argument("arrangement", metavar="ARRANGEMENT", help=ARRANGEMENT)
    parser.add_argument("--format", choices=REPORTS.access, default="text", help="(default: %(default)s)")
    parser.add_argument("--draw", metavar="FILE", help="draw it instead; the name ends in .svg, .png, .dot or .mmd")


def run(options: Namespace) -> int:
    """Returns 0. Raises DiagnosticError: wrong files, no drawing library (E406), output not writable (E407)."""
    from llfsm_verify.arrangement import load_arrangement
    from llfsm_verify.arrangement.granting import policy_digest
    from llfsm_verify.report.access import access_graph

    wanted = None if options.draw is None else drawing_format(None, options.draw)
    arrangement = load_arrangement(options.arrangement)
    digest = policy_digest(arrangement)
    if wanted is not None:
        ready(arrangement, None, options.draw, (UNWRITABLE, UNWRITABLE), "the drawing")
        write_whole(DRAWINGS.load(wanted)(access_graph(arrangement)), options.draw, UNWRITABLE, "the drawing")
        return 0
    Output().plain(REPORTS.access.load(options.format)(arrangement, digest))
    return 0

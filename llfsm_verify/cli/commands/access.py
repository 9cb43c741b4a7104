"""`llfsm access`: who may do what in an arrangement, and who does."""

from __future__ import annotations

from argparse import Namespace

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.arrangement.granting import policy_digest
from llfsm_verify.cli.drawing_format import WrongEnding, drawing_format
from llfsm_verify.cli.io.output import Output
from llfsm_verify.cli.io.outputs import ready
from llfsm_verify.cli.io.whole_file import write_whole
from llfsm_verify.cli.usage import usage
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.report.access import access_graph
from llfsm_verify.report.drawing import UNWRITABLE
from llfsm_verify.report.drawing.formats import DRAWINGS
from llfsm_verify.report.formats import REPORTS


def run(options: Namespace) -> int:
    """Returns 0. Raises DiagnosticError: wrong files, no drawing library (E406), output not writable (E407)."""
    wanted = None
    if options.draw is not None:
        try:
            wanted = drawing_format(None, options.draw)
        except WrongEnding as wrong:
            return usage(str(wrong))
    arrangement = load_arrangement(options.arrangement)
    digest = policy_digest(arrangement)
    if wanted is not None:
        ready(arrangement, PropertySet(()), options.draw, (UNWRITABLE, UNWRITABLE), "the drawing")
        write_whole(DRAWINGS.load(wanted)(access_graph(arrangement)), options.draw, UNWRITABLE, "the drawing")
        return 0
    Output().plain(REPORTS.access.load(options.format)(arrangement, digest))
    return 0

"""`llfsm draw`: a machine or the arrangement as DOT, Mermaid, SVG or PNG."""

from __future__ import annotations

import sys
from argparse import Namespace

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.cli.drawing_format import WrongEnding, drawing_format
from llfsm_verify.cli.io.output import usage
from llfsm_verify.cli.io.outputs import ready
from llfsm_verify.cli.io.whole_file import write_whole
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.report.drawing.codes import UNWRITABLE
from llfsm_verify.report.drawing.extract import arrangement_graph, machine_graph
from llfsm_verify.report.drawing.formats import DRAWINGS
from llfsm_verify.report.drawing.graph import summarise


def run(options: Namespace) -> int:
    """Returns 0; raises DiagnosticError: wrong files, no drawing library (E406), output not writable (E407)."""
    try:
        wanted = drawing_format(options.format, options.output)
    except WrongEnding as wrong:
        return usage(str(wrong))
    arrangement = load_arrangement(options.arrangement)
    if options.machine is None:
        graph = arrangement_graph(arrangement)
    else:
        names = [machine.name for machine in arrangement.texts]
        if options.machine not in names:
            return usage(f"there is no machine `{options.machine}`; there are {', '.join(names)}")
        graph = machine_graph(arrangement.machine(options.machine))
    graph, note = summarise(graph)
    if note is not None:
        print(note, file=sys.stderr)
    ready(arrangement, PropertySet(()), options.output, (UNWRITABLE, UNWRITABLE), "the drawing")
    text = DRAWINGS.load(wanted)(graph)
    write_whole(text, options.output, UNWRITABLE, "the drawing")
    return 0

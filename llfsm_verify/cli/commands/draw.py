"""`llfsm draw`: a machine or the arrangement, or a run on its machines, as DOT, Mermaid, SVG or PNG."""

from __future__ import annotations

import sys
from argparse import Namespace

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.cli.drawing_format import WrongEnding, drawing_format
from llfsm_verify.cli.io.outputs import ready, ready_beside
from llfsm_verify.cli.io.whole_file import write_whole
from llfsm_verify.cli.usage import usage
from llfsm_verify.diagnostics import Span
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.report.drawing import UNWRITABLE
from llfsm_verify.report.drawing.extract import arrangement_graph, machine_graph
from llfsm_verify.report.drawing.formats import DRAWINGS
from llfsm_verify.report.drawing.graph import Graph, summarise

MISFIT = 3


def run(options: Namespace) -> int:
    """Returns 0, 2 for wrong usage, 3 for a trace that does not fit; raises DiagnosticError: wrong files, no drawing
    library (E406), output not writable (E407)."""
    try:
        wanted = drawing_format(options.format, options.output)
    except WrongEnding as wrong:
        return usage(str(wrong))
    arrangement = load_arrangement(options.arrangement)
    names = [machine.name for machine in arrangement.texts]
    if options.machine is not None and options.machine not in names:
        return usage(f"there is no machine `{options.machine}`; there are {', '.join(names)}")
    graph = _graph(arrangement, options)
    if graph is None:
        return MISFIT
    graph, note = summarise(graph)
    if note is not None:
        print(note, file=sys.stderr)
    ready(arrangement, PropertySet(()), options.output, (UNWRITABLE, UNWRITABLE), "the drawing")
    text = DRAWINGS.load(wanted)(graph)
    write_whole(text, options.output, UNWRITABLE, "the drawing")
    return 0


def _graph(arrangement: Arrangement, options: Namespace) -> Graph | None:
    """What is to be drawn; None, which standard error explains, when the trace does not fit."""
    if options.trace is not None:
        return _traced(arrangement, options)
    if options.machine is None:
        return arrangement_graph(arrangement)
    return machine_graph(arrangement.machine(options.machine))


def _traced(arrangement: Arrangement, options: Namespace) -> Graph | None:
    from llfsm_verify.report.drawing.traced import replayed_graph
    from llfsm_verify.verification.replay import replay_file

    ready_beside([options.trace], options.output, UNWRITABLE, "the drawing")

    def load(_: str, *, named_at: Span | None = None) -> Arrangement:
        del named_at  # the command line says which arrangement it is
        return arrangement

    done = replay_file(options.trace, options.arrangement, load)
    for line in (*done.notes, *([done.sentence] if done.found != done.file.expect else [])):
        print(f"{options.trace}: {line}", file=sys.stderr)
    return replayed_graph(arrangement, options.machine, done)

"""`llfsm draw`: a machine or the arrangement, or a run on its machines, as DOT, Mermaid, SVG or PNG."""

from __future__ import annotations

from argparse import Namespace
from typing import TYPE_CHECKING

from llfsm_verify.plug import (
    DRAWINGS,
    NOT_DRAWN,
    CommandParser,
    UsageError,
    arrangement_argument,
    drawing_format,
    output_argument,
    ready,
    ready_beside,
    tell,
    write_whole,
)  # fmt: skip

if TYPE_CHECKING:
    from llfsm_verify.plug import Arrangement, Graph, Span

MISFIT = 3


def arguments(parser: CommandParser) -> None:
    """Add the arguments of `llfsm draw`."""
    parser.about(
        "Draw the arrangement (machines, whiteboard, schedule), one of its machines, or a saved trace on its machines.",
        "llfsm draw arrangement.yaml --machine north -o north.svg",
        "exit codes: 0 drawn, 2 wrong usage, 3 input files wrong or unreadable, the trace does not fit, or the drawing "
        "cannot be written",
    )
    add = parser.add_argument
    arrangement_argument(parser)
    add("--machine", metavar="M", help="draw the states of this machine instance")
    add("--trace", metavar="FILE", help="mark on the machine, or on all, where this saved trace goes and how it ends")
    add("--format", choices=DRAWINGS, help="default: by the ending of FILE, else dot")
    output_argument(parser)


def run(options: Namespace) -> int:
    """Returns 0, 2 for wrong usage, 3 for a trace that does not fit; raises DiagnosticError: wrong files, no drawing
    library (E406), output not writable (E407)."""
    from llfsm_verify.plug import load_arrangement, summarise

    wanted = drawing_format(options.format, options.output)
    arrangement = load_arrangement(options.arrangement)
    names = [machine.name for machine in arrangement.texts]
    if options.machine is not None and options.machine not in names:
        raise UsageError(f"there is no machine `{options.machine}`; there are {', '.join(names)}")
    graph = _graph(arrangement, options)
    if graph is None:
        return MISFIT
    graph, note = summarise(graph)
    if note is not None:
        tell(note)
    ready(arrangement, None, options.output, (NOT_DRAWN, NOT_DRAWN), "the drawing")
    text = DRAWINGS.load(wanted)(graph)
    write_whole(text, options.output, NOT_DRAWN, "the drawing")
    return 0


def _graph(arrangement: Arrangement, options: Namespace) -> Graph | None:
    """What is to be drawn; None, which standard error explains, when the trace does not fit."""
    from llfsm_verify.plug import arrangement_graph, machine_graph

    if options.trace is not None:
        return _traced(arrangement, options)
    if options.machine is None:
        return arrangement_graph(arrangement)
    return machine_graph(arrangement.machine(options.machine))


def _traced(arrangement: Arrangement, options: Namespace) -> Graph | None:
    from llfsm_verify.extensions.graphs.traced import replayed_graph
    from llfsm_verify.plug import replay_file

    ready_beside([options.trace], options.output, NOT_DRAWN, "the drawing")

    def load(_: str, *, named_at: Span | None = None) -> Arrangement:
        del named_at  # the command line says which arrangement it is
        return arrangement

    done = replay_file(options.trace, options.arrangement, load)
    for line in (*done.notes, *([done.sentence] if done.found != done.file.expect else [])):
        tell(f"{options.trace}: {line}")
    return replayed_graph(arrangement, options.machine, done)

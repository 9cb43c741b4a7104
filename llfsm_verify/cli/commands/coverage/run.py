"""`llfsm coverage`: what runs cover of an arrangement, and what no run can."""

from __future__ import annotations

from argparse import Namespace
from fractions import Fraction

from llfsm_verify.analysis.coverage import UNWRITABLE
from llfsm_verify.analysis.coverage.measure import coverage
from llfsm_verify.analysis.coverage.result import Run
from llfsm_verify.analysis.coverage.search import Found, find_vectors
from llfsm_verify.analysis.coverage.vectorfile import may_be_replaced, vectors_text
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.cli.drawing_format import drawing_format
from llfsm_verify.cli.io.files import ready, ready_beside, write_whole
from llfsm_verify.cli.io.output import Output, tell
from llfsm_verify.cli.opening import limits_of, open_arrangement
from llfsm_verify.cli.parser import UsageError
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.limits import Limits
from llfsm_verify.report.drawing import UNWRITABLE as NOT_DRAWN
from llfsm_verify.report.drawing.formats import DRAWINGS, GRAPHS
from llfsm_verify.report.drawing.graph import summarise
from llfsm_verify.report.formats import REPORTS, Style
from llfsm_verify.runtime.live.plan import runnable, starting_values
from llfsm_verify.runtime.recording.covering import covered_by
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.targets.images import image_of

WHAT = "the file of vectors"


def run(options: Namespace) -> int:
    """Returns the exit code of the result; raises DiagnosticError: wrong files, runs that are not of the arrangement
    (E520, E521), vectors of what no image can run (E503), or that cannot be written (E523)."""
    if options.vectors is None and options.unit != "ringlet":
        raise UsageError("--unit is for --vectors")
    given, limits = open_arrangement(options.arrangement), limits_of(options)
    arrangement = given
    if options.vectors is not None:
        ready(given, None, options.vectors, (UNWRITABLE, UNWRITABLE), WHAT)
        ready_beside(options.traces, options.vectors, UNWRITABLE, WHAT)
        _refuse_others(options.vectors)
    drawing = drawing_format(None, options.draw)
    ready(given, None, options.draw, (NOT_DRAWN, NOT_DRAWN), "the drawing")
    ready_beside(options.traces, options.draw, NOT_DRAWN, "the drawing")
    covered = covered_by(given, options.traces, options.cycle_ms)
    seen, runs = covered.seen, covered.runs
    if options.vectors is not None:
        arrangement = runnable(given, simulated=True, cycle_ms=options.cycle_ms)
        vectors = _vectors(given, arrangement, options.cycle_ms, options.unit, limits)
        seen, runs = seen | vectors.seen, (*runs, Run(options.vectors, vectors.steps))
        write_whole(vectors_text(vectors.vectors), options.vectors, UNWRITABLE, WHAT)
    found = coverage(arrangement, seen, runs, limits)
    if options.draw is not None:
        graph, note = summarise(GRAPHS.load("coverage")(arrangement, found))
        tell(*([] if note is None else [note]))
        write_whole(DRAWINGS.load(drawing)(graph), options.draw, NOT_DRAWN, "the drawing")
    output = Output(options.color, options.width)
    output.write(REPORTS.coverage.load(options.format)(found, arrangement, Style()))
    return found.exit_code


def _refuse_others(output: str) -> None:
    """DiagnosticError (E523): a file is there that is not one of vectors."""
    if output != "-" and not may_be_replaced(output):
        message = f"this file is not one of test vectors, and {WHAT} would replace it"
        raise DiagnosticError(Diagnostic(UNWRITABLE, message, hint="name another file, or remove it", file=output))


def _vectors(given: Arrangement, timed: Arrangement, cycle_ms: Fraction | None, unit: str, limits: Limits) -> Found:
    image = image_of(given, cycle_ms)
    first = starting_values(lower(image, keep_all_bits=True))
    return find_vectors(timed, image, first, "cycle" if unit == "cycle" else "ringlet", limits)

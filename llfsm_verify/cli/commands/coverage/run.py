"""`llfsm coverage`: what runs cover of an arrangement, and what no run can."""

from __future__ import annotations

from argparse import Namespace

from llfsm_verify.analysis.coverage.measure import coverage
from llfsm_verify.cli.io.output import Output
from llfsm_verify.cli.opening import limits_of, open_arrangement
from llfsm_verify.report.formats import REPORTS, Style
from llfsm_verify.runtime.recording.covering import covered_by


def run(options: Namespace) -> int:
    """Returns the exit code of the result; raises DiagnosticError: wrong files, or runs that are not of the arrangement
    (E520, E521)."""
    arrangement = open_arrangement(options.arrangement)
    covered = covered_by(arrangement, options.traces)
    found = coverage(arrangement, covered.seen, covered.runs, limits_of(options))
    output = Output(options.color, options.width)
    output.write(REPORTS.coverage.load(options.format)(found, arrangement, Style()))
    return found.exit_code

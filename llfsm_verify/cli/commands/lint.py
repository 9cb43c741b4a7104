"""`llfsm lint`: what is wrong with an arrangement whatever its properties."""

from __future__ import annotations

from argparse import Namespace

from llfsm_verify.cli.io.output import Output
from llfsm_verify.cli.opening import open_arrangement, refuse_two_inputs
from llfsm_verify.cli.properties import read_properties
from llfsm_verify.cli.usage import usage
from llfsm_verify.limits import Limits
from llfsm_verify.report.formats import REPORTS, Style


def run(options: Namespace) -> int:
    """Returns the exit code of the result; raises DiagnosticError for wrong files."""
    from llfsm_verify.analysis.lint.run import lint
    from llfsm_verify.checking.goals.kinds import CHECKED
    from llfsm_verify.checking.problem import bind

    refuse_two_inputs([options.arrangement, *options.properties])
    if options.local and options.max_states is not None:
        return usage("--max-states is for the reachable configurations, which --local leaves alone")
    arrangement = open_arrangement(options.arrangement)
    atoms = bind(arrangement, read_properties(options, CHECKED)).atoms
    limits = Limits(options.max_states, options.memory, options.timeout)
    result = lint(arrangement, limits, local=options.local, atoms=atoms)
    output = Output(options.color, options.width)
    style = Style(traces=options.runs, suppressed=options.suppressed)
    output.write(REPORTS.lint.load(options.format)(result, arrangement, style))
    return result.exit_code

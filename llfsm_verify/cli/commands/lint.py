"""`llfsm lint`: what is wrong with an arrangement whatever its properties."""

from __future__ import annotations

from argparse import Namespace

from llfsm_verify.cli import arguments as shared
from llfsm_verify.cli.io.output import Output
from llfsm_verify.cli.opening import limits_of, open_arrangement, read_properties
from llfsm_verify.cli.parser import Parser, UsageError
from llfsm_verify.report.formats import REPORTS, Style


def arguments(parser: Parser) -> None:
    """Add the arguments of `llfsm lint`."""
    parser.about(
        "Find what is wrong with an arrangement whatever its properties: transitions that never fire, conditions that "
        "are always true, values that leave their range, writes never read, machines that starve. Each finding is "
        "proved, or shown by a run.",
        "llfsm lint arrangement.yaml properties.ltl --traces",
        "exit codes: 0 no warnings (notes do not count), 1 warnings, 2 wrong usage, 3 input files wrong or unreadable, "
        "4 something is unknown, 5 a check of a result failed, 70 internal error, 130 interrupted",
    )
    add = parser.add_argument
    shared.arrangement(parser)
    shared.property_files(parser, "property files: variables that they read count as read")
    shared.property_lines(parser)
    shared.choice(parser, "--format", REPORTS.lint, "how to report")
    add("--local", action="store_true", help="use only proofs about single turns, and do not explore configurations")
    shared.max_states(parser, "end the exploration after N configurations (default: 10^6)")
    shared.memory_and_timeout(parser)
    add("--traces", dest="runs", action="store_true", help="show the run of each finding that has one")
    add("--suppressed", "--silenced", action="store_true", help="also show the findings that the files accept")
    shared.colour(parser)


def run(options: Namespace) -> int:
    """Returns the exit code of the result; raises DiagnosticError for wrong files."""
    from llfsm_verify.analysis.lint.run import lint
    from llfsm_verify.checking.problem import bind

    if options.local and options.max_states is not None:
        raise UsageError("--max-states is for the reachable configurations, which --local leaves alone")
    arrangement = open_arrangement(options.arrangement)
    atoms = bind(arrangement, read_properties(options)).atoms
    result = lint(arrangement, limits_of(options), local=options.local, atoms=atoms)
    output = Output(options.color, options.width)
    style = Style(traces=options.runs, suppressed=options.suppressed)
    output.write(REPORTS.lint.load(options.format)(result, arrangement, style))
    return result.exit_code

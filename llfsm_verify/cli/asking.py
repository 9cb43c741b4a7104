"""The arguments of the commands that ask without property files: `llfsm lint` and `llfsm query`."""

from __future__ import annotations

from llfsm_verify.cli.common_arguments import (
    all_steps,
    arrangement,
    colour,
    engine,
    max_states,
    memory_and_timeout,
    property_files,
    property_lines,
    syntax,
)
from llfsm_verify.cli.engine_options import engine_options
from llfsm_verify.cli.parser import Parser
from llfsm_verify.engines.unrolled.options import UnrolledOptions
from llfsm_verify.report.formats import REPORTS

LINT_EXIT_CODES = (
    "exit codes: 0 no warnings (notes do not count), 1 warnings, 2 wrong usage, 3 input files wrong or unreadable, "
    "4 something is unknown, 5 a check of a result failed, 70 internal error, 130 interrupted"
)
QUERY_EXIT_CODES = (
    "exit codes: 0 a run reaches it, 1 proved that none does, 2 wrong usage, 3 input wrong or unreadable, 4 unknown, "
    "5 a check of a result failed, 70 internal error, 130 interrupted"
)


def lint_arguments(parser: Parser) -> None:
    """Of `llfsm lint`."""
    parser.about(
        "Find what is wrong with an arrangement whatever its properties: transitions that never fire, conditions that "
        "are always true, values that leave their range, writes never read, machines that starve. Each finding is "
        "proved, or shown by a run.",
        "llfsm lint arrangement.yaml properties.ltl --traces",
        LINT_EXIT_CODES,
    )
    add = parser.add_argument
    arrangement(parser)
    property_files(parser, "property files: variables that they read count as read")
    property_lines(parser)
    add("--format", choices=REPORTS.lint, default="text", help="how to report (default: %(default)s)")
    add("--local", action="store_true", help="use only proofs about single turns, and do not explore configurations")
    max_states(parser, "end the exploration after N configurations (default: 10^6)")
    memory_and_timeout(parser)
    add("--traces", dest="runs", action="store_true", help="show the run of each finding that has one")
    add("--suppressed", "--silenced", action="store_true", help="also show the findings that the files accept")
    colour(parser)


def query_arguments(parser: Parser) -> None:
    """Of `llfsm query`."""
    parser.about(
        "Find a shortest run that reaches a configuration or step, or prove that no run does.",
        "llfsm query arrangement.yaml 'north@GREEN && count > 3' --save run.trace.yaml",
        QUERY_EXIT_CODES,
    )
    add = parser.add_argument
    arrangement(parser)
    add("formula", metavar="FORMULA", help="a state formula, such as 'ns@GREEN && count > 3'")
    syntax(parser)
    engine(parser)
    engine_options(parser, parser, UnrolledOptions.OPTIONS)
    add("--format", choices=REPORTS.query, default="text", help="how to report (default: %(default)s)")
    add("--save", metavar="FILE", help="save the run there, for llfsm replay")
    max_states(parser)
    memory_and_timeout(parser)
    all_steps(parser)
    colour(parser)

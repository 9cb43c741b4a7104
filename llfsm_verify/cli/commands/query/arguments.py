"""The arguments of `llfsm query`."""

from __future__ import annotations

from llfsm_verify.cli.arguments import all_steps, arrangement, colour, engine, max_states, memory_and_timeout, syntax
from llfsm_verify.cli.engine_options import engine_options
from llfsm_verify.cli.parser import Parser
from llfsm_verify.engines.unrolled.options import UnrolledOptions
from llfsm_verify.report.formats import REPORTS

QUERY_EXIT_CODES = (
    "exit codes: 0 a run reaches it, 1 proved that none does, 2 wrong usage, 3 input wrong or unreadable, 4 unknown, "
    "5 a check of a result failed, 70 internal error, 130 interrupted"
)


def arguments(parser: Parser) -> None:
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

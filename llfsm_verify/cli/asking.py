"""The arguments of the commands that ask without property files: `llfsm lint` and `llfsm query`."""

from __future__ import annotations

from argparse import ArgumentParser

from llfsm_verify.cli.argument_types import all_steps, colour, engine, positive, seconds, size
from llfsm_verify.logic.syntax_names import SYNTAXES
from llfsm_verify.report.formats import LINT, QUERIES

LINT_EXIT_CODES = (
    "exit codes: 0 no warnings (notes do not count), 1 warnings, 2 wrong usage, 3 input files wrong or unreadable, "
    "4 something is unknown, 5 a check of a result failed, 70 internal error, 130 interrupted"
)
QUERY_EXIT_CODES = (
    "exit codes: 0 a run reaches it, 1 proved that none does, 2 wrong usage, 3 input wrong or unreadable, 4 unknown, "
    "5 a check of a result failed, 70 internal error, 130 interrupted"
)


def lint_arguments(parser: ArgumentParser) -> None:
    """Of `llfsm lint`."""
    parser.description = (
        "Find what is wrong with an arrangement whatever its properties: transitions that never fire, conditions that "
        "are always true, values that leave their range, writes never read, machines that starve. Each finding is "
        "proved, or shown by a run."
    )
    parser.epilog = LINT_EXIT_CODES
    add = parser.add_argument
    add("arrangement", metavar="ARRANGEMENT", help="the arrangement's file; - reads standard input")
    add("properties", metavar="PROPERTIES", nargs="*", default=[], help="property files: what they read is read")
    add("-p", "--property", metavar="TEXT", action="append", default=[], help="one line of a property file; repeatable")
    add("--syntax", choices=SYNTAXES, default="llfsm", help="how formulas are written (default: %(default)s)")
    add("--format", choices=LINT, default="text", help="how to report (default: %(default)s)")
    add("--local", action="store_true", help="prove what single turns tell, and leave the reachable states alone")
    add("--max-states", metavar="N", type=positive, help="end the exploration after N configurations (default: 10^6)")
    _limits(parser)
    add("--traces", dest="runs", action="store_true", help="show the run of each finding that has one")
    add("--suppressed", "--silenced", action="store_true", help="show the findings that the files accept, too")
    colour(parser)


def query_arguments(parser: ArgumentParser) -> None:
    """Of `llfsm query`."""
    parser.description = "Find a shortest run that reaches a configuration or step, or prove that no run does."
    parser.epilog = QUERY_EXIT_CODES
    add = parser.add_argument
    add("arrangement", metavar="ARRANGEMENT", help="the arrangement's file; - reads standard input")
    add("formula", metavar="FORMULA", help="a state formula, such as 'ns@GREEN && count > 3'")
    add("--syntax", choices=SYNTAXES, default="llfsm", help="how it is written (default: %(default)s)")
    engine(parser)
    add("--depth", metavar="N", type=positive, help="how far bmc (60 steps), induction (k 30) and pdr (1000 frames) go")
    add("--format", choices=QUERIES, default="text", help="how to report (default: %(default)s)")
    add("--save", metavar="FILE", help="save the run there, for llfsm replay")
    add("--max-states", metavar="N", type=positive, help="end the search after N configurations")
    _limits(parser)
    all_steps(parser)
    colour(parser)


def _limits(parser: ArgumentParser) -> None:
    add = parser.add_argument
    add("--memory", metavar="SIZE", type=size, help="end the search when it needs more memory, such as 500M or 2G")
    add("--timeout", metavar="SECONDS", type=seconds, help="end the search after so many seconds")

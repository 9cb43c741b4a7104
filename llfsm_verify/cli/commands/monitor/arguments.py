"""The arguments of `llfsm monitor`."""

from __future__ import annotations

from llfsm_verify.cli.arguments import choice, only, output, repeatable, syntax
from llfsm_verify.cli.parser import Parser
from llfsm_verify.report.formats import REPORTS
from llfsm_verify.runtime.deciding.logs import ORACLES

LOOPBACK = "127.0.0.1"


def arguments(parser: Parser) -> None:
    """Add the arguments of `llfsm monitor`."""
    parser.about(
        "Say whether properties can be decided at run time, or write a property's monitor: the minimal automaton that "
        "tells after every word whether all, no or some continuations satisfy the property.",
        "llfsm monitor 'G (car -> F[<=5] green)'\n"
        "llfsm monitor properties.ltl --only never_both --as machine --arrangement arrangement.yaml --set alarm",
        "exit codes: 0 all are monitorable, at least in part, 1 some are not, 2 wrong usage, 3 input files wrong or "
        "unreadable, or no machine can be such a monitor, 4 a limit was reached, 70 internal error, 130 interrupted",
    )
    add = parser.add_argument
    add(
        "properties",
        metavar="PROPERTY",
        nargs="*",
        default=[],
        help="a formula, a line of a property file (`enforce` and `forbid` also without a name), a property file, or -",
    )
    add(
        "--from-machine",
        metavar="MACHINE",
        help="write the rules that follow from the text of this machine of the --arrangement, as a property file",
    )
    text = "a sentence or two, a machine file, a JSON table, a drawing"
    choice(parser, "--as", REPORTS.monitor, text, dest="shape")
    only(parser)
    syntax(parser)
    add("--arrangement", metavar="FILE", help="the arrangement: the types for a machine, and what the machine can miss")
    repeatable(
        parser,
        "--set",
        metavar="VARIABLE",
        text="with --as machine: a whiteboard variable that becomes true on a violation",
    )
    repeatable(parser, "--suspend", metavar="MACHINE", text="with --as machine: a machine to suspend on a violation")
    output(parser)
    add(
        "--serve",
        metavar="PORT",
        type=int,
        help="answer ROSMonitoring's monitors there, a message at a time; needs --arrangement and --mapping",
    )
    add("--mapping", metavar="FILE", help="serve: which field of a message gives which slot, as for check-recording")
    add("--host", metavar="ADDRESS", default=LOOPBACK, help="serve: where to listen (default: %(default)s)")
    add("--oracle", choices=ORACLES, default="rosmonitoring", help="serve: whose monitors (default: %(default)s)")
    add("--filter", action="store_true", help="serve: refuse messages that violate a property, and go on without them")

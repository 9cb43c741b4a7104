"""The arguments of `llfsm coverage`."""

from __future__ import annotations

from llfsm_verify.cli import arguments as shared
from llfsm_verify.cli.parser import Parser
from llfsm_verify.report.formats import REPORTS


def arguments(parser: Parser) -> None:
    """Add the arguments of `llfsm coverage`."""
    parser.about(
        "Say which states, transitions, branches and conditions (masking MC/DC) runs cover, and which of the others no "
        "run can, by proof.",
        "llfsm coverage arrangement.yaml door.trace.yaml oven.rec",
        "exit codes: 0 all that is reachable is covered (without runs, nothing has to be), 1 something is not, 2 wrong "
        "usage, 3 input files wrong or unreadable, 4 something is unknown, 70 internal error, 130 interrupted",
    )
    shared.arrangement(parser)
    parser.add_argument(
        "traces", metavar="TRACE", nargs="*", default=[],
        help="files that --save-traces, `llfsm run --record` or --vectors wrote; together",
    )  # fmt: skip
    add = parser.add_argument
    add("--vectors", metavar="FILE", help="find short runs that cover all that is reachable, and write them as tests")
    shared.choice(parser, "--unit", ("ringlet", "cycle"), "a step of --vectors; in a cycle inputs are held")
    add("--cycle-ms", metavar="MS", type=shared.milliseconds, help="how long a cycle of an untimed arrangement takes")
    add("--draw", metavar="FILE", help="also draw the machines with it, as SVG, PNG, DOT or Mermaid by FILE's ending")
    shared.choice(parser, "--format", REPORTS.coverage, "how to report")
    shared.max_states(parser, "end the exploration after N configurations (default: 10^6)")
    shared.memory_and_timeout(parser, "end the exploration")
    shared.colour(parser)

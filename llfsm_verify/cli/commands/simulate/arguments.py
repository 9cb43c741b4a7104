"""The options of `llfsm simulate`."""

from __future__ import annotations

from llfsm_verify.cli.arguments import arrangement, colour, drawn_inputs, held_inputs, milliseconds, output, positive
from llfsm_verify.cli.parser import Parser
from llfsm_verify.limits import DEFAULT_STEPS
from llfsm_verify.registry import Choices
from llfsm_verify.report.formats import REPORTS
from llfsm_verify.report.timeline.formats import TIMELINES

TABLE = "table"
LOOKED = 10_000
"""Steps in which `--until` is looked for where nothing else is said."""


def arguments(parser: Parser) -> None:
    """The options of `llfsm simulate`."""
    parser.about(
        "Run an arrangement and print the table of its steps.",
        "llfsm simulate arrangement.yaml --seed 1 --until 'north@GREEN && car' --for 30s",
        "exit codes: 0 done, 1 a fault, 2 wrong usage, 3 files wrong or unreadable, 4 what --until says was not "
        "reached, or a value left 64 bits, 70 internal error, 130 interrupted",
    )
    add = parser.add_argument
    arrangement(parser)
    extent = parser.add_mutually_exclusive_group()
    extent.add_argument(
        "--steps", metavar="N", type=positive,
        help=f"N ringlets (default: {DEFAULT_STEPS}, with --until {LOOKED:,})",
    )  # fmt: skip
    extent.add_argument("--cycles", metavar="N", type=positive, help="N whole cycles")
    extent.add_argument(
        "--for", metavar="TIME", dest="span", type=milliseconds, help="this much logical time: 90s, 500ms, 5min"
    )
    add("--until", metavar="FORMULA", help="end where this state formula is true, as in `llfsm query`")
    add("--from", metavar="TRACE", dest="begin", help="continue where the run of this saved trace ends")
    add(
        "--seed", metavar="N", type=int,
        help="makes the random choices repeatable (default: a new one, which is printed)",
    )  # fmt: skip
    add(
        "--inputs", metavar="FILE",
        help="YAML: step number or time (`1.5s`): {input: value, …}, each valid until the next",
    )  # fmt: skip
    held_inputs(parser)
    drawn_inputs(parser)
    others = (entry for entry in (*REPORTS.simulation.values(), *TIMELINES.values()) if entry.name != TABLE)
    formats = "; ".join(f"{entry.name}: {entry.about}" for entry in others)
    add(
        "--format", choices=Choices(REPORTS.simulation, TIMELINES),
        help=f"default: by the ending of FILE, else {TABLE}; {formats}",
    )  # fmt: skip
    output(parser)
    add("-q", "--quiet", action="store_true", help="print only how the run ended")
    colour(parser)

"""The arguments of `llfsm guard`."""

from __future__ import annotations

import re
from argparse import ArgumentTypeError

from llfsm_verify.plug import (
    CommandParser,
    arrangement_argument,
    colour_argument,
    engine_argument,
    limit_arguments,
    only_argument,
    positive_number,
    property_lines,
    repeatable,
    states_argument,
)

_TIME = re.compile(r"(\d+)(ms|s)", re.ASCII)


def arguments(parser: CommandParser) -> None:
    """Add the arguments of `llfsm guard`."""
    parser.about(
        "Put a monitor and a switch between machines and their outputs, write the new arrangement as files, and prove "
        "that it keeps the properties whatever the guarded machines do.",
        "llfsm guard arrangement.yaml -p 'calm: G speed <= 3' --fallback speed=0 -o guarded",
        "exit codes: 0 proved (with --list: all can be guarded), 1 violated (some cannot), 2 wrong usage, 3 input "
        "files wrong or unreadable, or what cannot be guarded, 4 unknown, 5 a check of a result failed, 70 internal "
        "error, 130 interrupted",
    )
    add = parser.add_argument
    arrangement_argument(parser)
    property_lines(parser, "what to keep: one line of a property file; each gets a monitor")
    repeatable(parser, "--properties", metavar="FILE", text="a property file")
    only_argument(parser)
    add("--list", action="store_true", help="say of each property whether a guard can keep it, and why not")
    repeatable(
        parser,
        "--fallback",
        metavar="OUTPUT=VALUE",
        text="route this output, and write this value instead of the requested one once a property is violated: an "
        "expression, in which OUTPUT is the requested value",
    )
    repeatable(
        parser,
        "--guard",
        metavar="MACHINE",
        text="a machine about which nothing is assumed (default: all that write a routed output)",
    )
    repeatable(
        parser,
        "--react",
        metavar="COMMAND",
        text="what the switch does to another machine once a property is violated: 'suspend M', 'resume M', "
        "'restart M', 'load M' or 'unload M'; --for and --until take it back",
    )
    add("--monitor", dest="own", metavar="FILE", help="your own machine, in place of monitors made from the properties")
    add(
        "--for", dest="hold", metavar="TIME", type=_time, help="requested values count again after this time: 2s, 500ms"
    )
    add("--until", metavar="GUARD", help="requested values count again when this guard holds")
    _outside(parser)
    add("-o", "--output", metavar="FOLDER", help="write the files of the guarded arrangement there")
    add("--no-proof", action="store_true", help="write the files without a proof")
    engine_argument(parser)
    states_argument(parser, "end a search after N configurations (default: 10^6)")
    limit_arguments(parser, "end a search")
    add("-q", "--quiet", action="store_true", help="verdicts only, without traces")
    colour_argument(parser)


def _outside(parser: CommandParser) -> None:
    """Of a guard outside."""
    add = parser.add_argument
    repeatable(
        parser,
        "--outside",
        metavar="COMMAND",
        text="in place of --fallback: a guard outside, such as `llfsm whiteboard watch --command`, that gives this "
        "command when a property is violated; say how late it is at worst, and prove it",
    )
    add(
        "--every",
        metavar="N",
        type=positive_number,
        help="for a guard outside: it looks once in any N cycles (default: 1)",
    )
    add(
        "--looks",
        metavar="N",
        type=positive_number,
        help="for a guard outside: it commands in its Nth look at the violation (default: 1)",
    )


def _time(text: str) -> str:
    """A time as the guard of a machine that waits so long."""
    found = _TIME.fullmatch(text)
    if found is None:
        raise ArgumentTypeError(f"`{text[:40]}` is not a valid time: write 2s or 500ms")
    return f"after_ms({int(found[1]) * (1000 if found[2] == 's' else 1)})"

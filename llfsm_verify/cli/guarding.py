"""The arguments of `llfsm guard`."""

from __future__ import annotations

import re
from argparse import ArgumentParser, ArgumentTypeError

from llfsm_verify.cli.argument_types import colour, engine, positive, seconds, size
from llfsm_verify.logic.syntax_names import SYNTAXES

_TIME = re.compile(r"(\d+)(ms|s)", re.ASCII)


def guard_arguments(parser: ArgumentParser) -> None:
    """Of `llfsm guard`."""
    parser.description = (
        "Put a monitor and a switch between machines and their outputs, write the new arrangement as files, and prove "
        "that it keeps the properties whatever the guarded machines do."
    )
    parser.epilog = (
        "exit codes: 0 proved (with --list: all can be guarded), 1 violated (some cannot), 2 wrong usage, 3 input "
        "files wrong or unreadable, or what cannot be guarded, 4 unknown, 5 a check of a result failed, 70 internal "
        "error, 130 interrupted"
    )
    add = parser.add_argument
    add("arrangement", metavar="ARRANGEMENT", help="the arrangement's file; - reads standard input")
    add(
        "-p",
        "--property",
        metavar="TEXT",
        action="append",
        default=[],
        help="what to keep: one line of a property file; may be repeated, and each gets a monitor",
    )
    add("--properties", metavar="FILE", action="append", default=[], help="a property file; may be repeated")
    add("--only", metavar="NAME", action="append", default=[], help="this property of those given; may be repeated")
    add("--syntax", choices=SYNTAXES, default="llfsm", help="how formulas are written (default: %(default)s)")
    add("--list", action="store_true", help="say of each property whether a guard can keep it, and why not")
    add(
        "--fallback",
        metavar="OUTPUT=VALUE",
        action="append",
        default=[],
        help="route this output, and what takes the place of what was wished once a property is violated: an "
        "expression, in which OUTPUT is what was wished; may be repeated",
    )
    add(
        "--guard",
        metavar="MACHINE",
        action="append",
        default=[],
        help="a machine of which nothing is assumed (default: all that write a routed output); may be repeated",
    )
    add("--monitor", metavar="FILE", help="a machine of yours, in place of monitors made from the properties")
    add(
        "--for", dest="hold", metavar="TIME", type=_time, help="what was wished counts again after this time: 2s, 500ms"
    )
    add("--until", metavar="GUARD", help="it counts again when this guard holds")
    add(
        "--outside",
        metavar="COMMAND",
        action="append",
        default=[],
        help="instead: a guard outside, as `llfsm whiteboard watch --command` is one, that gives this command when a "
        "property is violated; say how late it is at worst, and prove it; may be repeated",
    )
    add("--every", metavar="N", type=positive, help="of a guard outside: it looks once in any N cycles (default: 1)")
    add(
        "--looks",
        metavar="N",
        type=positive,
        help="of a guard outside: it commands in its Nth look at the violation (default: 1)",
    )
    add("-o", "--output", metavar="FOLDER", help="write the files of the guarded arrangement there")
    add("--no-proof", action="store_true", help="write the files, and prove nothing")
    engine(parser)
    add("--max-states", metavar="N", type=positive, help="end a search after N configurations (default: 10^6)")
    add("--timeout", metavar="SECONDS", type=seconds, help="what is not decided after so many seconds is unknown")
    add("--memory", metavar="SIZE", type=size, help="the same for so much memory: 500M, 2G")
    add("-q", "--quiet", action="store_true", help="verdicts only, without traces")
    colour(parser)


def _time(text: str) -> str:
    """A time as the guard of a machine that waits so long."""
    found = _TIME.fullmatch(text)
    if found is None:
        raise ArgumentTypeError(f"`{text[:40]}` is no time: write 2s or 500ms")
    return f"after_ms({int(found[1]) * (1000 if found[2] == 's' else 1)})"

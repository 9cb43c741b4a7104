"""The arguments of `llfsm trace`."""

from __future__ import annotations

from argparse import ArgumentTypeError

from llfsm_verify.cli.arguments import other_arrangement, output, property_lines
from llfsm_verify.cli.parser import Parser
from llfsm_verify.registry import Choices
from llfsm_verify.report.timeline.formats import TIMELINES


def arguments(parser: Parser) -> None:
    """Add the arguments of `llfsm trace`."""
    parser.about(
        "Write a recording or a saved trace over time: for other tools, or as a picture; or a recording as a saved "
        "trace, which tests perform again.",
        "llfsm trace run.rec --to vcd -o run.vcd",
        "exit codes: 0 written, 2 wrong usage, 3 files wrong or unreadable, or the recording is damaged",
    )
    add = parser.add_argument
    add("file", metavar="FILE", help="a recording of `llfsm run`, or a saved trace")
    formats = "; ".join(f"{name}: {entry.about}" for name, entry in TIMELINES.items())
    formats += "; trace: a recording, from its beginning, as a saved trace (NAME.trace.yaml)"
    add(
        "--to",
        choices=Choices(TIMELINES, ("trace",)),
        help=f"the format (default: by the ending of the output's name): {formats}",
    )
    about = "for --to trace: the property that the trace is about, or an assumption (default: the fault at its end)"
    property_lines(parser, about)
    parser.set_defaults(properties=[])
    output(parser)
    add("--steps", metavar="A:B", type=steps, default=(0, None), help="only steps A to B; each may be left out")
    other_arrangement(parser, "the file names or has")


def steps(text: str) -> tuple[int, int | None]:
    """From and to, both included."""
    first, colon, last = text.partition(":")
    if not colon or any(part and not (part.isascii() and part.isdigit() and len(part) < 19) for part in (first, last)):
        raise ArgumentTypeError(f"{text[:40]!r} is not a range of steps such as 10:50")
    if last and int(last) < int(first or 0):
        raise ArgumentTypeError(f"{text[:40]!r} ends before it begins")
    return int(first or 0), int(last) if last else None

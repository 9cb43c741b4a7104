"""The arguments of `llfsm check`."""

from __future__ import annotations

from llfsm_verify.checking.engine_option import JOBS, word
from llfsm_verify.cli.arguments import colour
from llfsm_verify.cli.parser import Parser


def arguments(parser: Parser) -> None:
    """Add the arguments of `llfsm check`."""
    parser.about(
        "Check every arrangement that a file belongs to, with the properties beside it: X.ltl of X.yaml, and "
        "properties.ltl of arrangement.yaml. This is what the hook for pre-commit calls.",
        "llfsm check models",
    )
    add = parser.add_argument
    add(
        "paths",
        metavar="PATH",
        nargs="*",
        default=["."],
        help="files, or folders and all that is below (default: this folder)",
    )
    text = "check N arrangements at a time, or one with N threads (default: all processors)"
    add("--jobs", metavar="N", type=word(JOBS.read or str), help=text)
    add("-q", "--quiet", action="store_true", help="print only what fails")
    colour(parser)

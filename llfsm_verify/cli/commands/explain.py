"""`llfsm explain`: what a diagnostic means, with an example of it."""

from __future__ import annotations

from argparse import Namespace

from llfsm_verify.cli.io.output import Output, tell
from llfsm_verify.cli.parser import Parser, UsageError
from llfsm_verify.registry import meant


def arguments(parser: Parser) -> None:
    """Add the arguments of `llfsm explain`."""
    parser.about(
        "Say what a diagnostic means, with an example and how to correct it.",
        "llfsm explain E110",
        "exit codes: 0 explained, 2 wrong usage, or there is no such code",
    )
    parser.add_argument(
        "code", metavar="CODE", nargs="*", help="such as E110 (default: list all codes with their meaning)"
    )


def run(options: Namespace) -> int:
    """Explains each code of `options.code`, or lists all; returns 2 when one of them is not a code."""
    from llfsm_verify.report.codes import everyone, explained, meanings, sentence

    sections, broken = everyone()
    codes = meanings(sections)
    tell(*(f"note: {each}" for each in broken))
    wanted = [code.upper() for code in options.code]
    for code in wanted:
        if code not in codes:
            listed = "; `llfsm explain` lists them"
            raise UsageError(f"there is no diagnostic `{code[:100]}`{meant(code, codes) or listed}")
    if wanted:
        text = "\n".join(explained(code, sections) + "\n" for code in wanted)
    else:
        text = "\n".join(
            "\n".join([s.title, *(f"  {code}  {sentence(meaning)}" for code, meaning in s.codes.items()), ""])
            for s in sections
        )
    Output().plain(text)
    return 0

"""The arguments of `llfsm report`."""

from __future__ import annotations

from llfsm_verify.cli.arguments import arrangement, engine, memory_and_timeout, output, property_files, property_lines
from llfsm_verify.cli.parser import Parser


def arguments(parser: Parser) -> None:
    """Of `llfsm report`."""
    parser.about(
        "Check an arrangement as `llfsm verify --strict` does, and write a page about it for a safety case (Markdown).",
        "llfsm report --assurance arrangement.yaml properties.ltl --certificate proof.cert -o assurance.md",
    )
    add = parser.add_argument
    arrangement(parser)
    property_files(parser)
    property_lines(parser)
    add("--assurance", action="store_true", help="the page has claims, hashes, assumptions, and what is open")
    engine(parser)
    memory_and_timeout(parser)
    add("--certificate", metavar="FILE", help="write what proves the verdicts, and name it on the page")
    output(parser)

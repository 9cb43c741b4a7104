"""`llfsm schema`: the published JSON Schemas."""

from __future__ import annotations

import json
from argparse import Namespace

from llfsm_verify.cli.io.output import Output
from llfsm_verify.cli.parser import Parser
from llfsm_verify.report.schema import SCHEMAS


def arguments(parser: Parser) -> None:
    """Add the arguments of `llfsm schema`."""
    parser.about(
        "Print the JSON Schema (draft 2020-12) of a file format.",
        "llfsm schema arrangement",
        "exit codes: 0 printed, 2 wrong usage",
    )
    parser.add_argument("name", metavar="SCHEMA", choices=SCHEMAS, help=", ".join(SCHEMAS))


def run(options: Namespace) -> int:
    """Prints the schema called `options.name`; returns 0."""
    schema = SCHEMAS.load(options.name)(options.name)
    Output().plain(json.dumps(schema, indent=2, ensure_ascii=False) + "\n")
    return 0

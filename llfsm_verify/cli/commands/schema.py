"""`llfsm schema`: the published JSON Schemas."""

from __future__ import annotations

import json
from argparse import Namespace

from llfsm_verify.cli.io.output import Output
from llfsm_verify.report.schema import SCHEMAS


def run(options: Namespace) -> int:
    """Prints the schema called `options.name`; returns 0."""
    schema = SCHEMAS.load(options.name)(options.name)
    Output().plain(json.dumps(schema, indent=2, ensure_ascii=False) + "\n")
    return 0

"""`llfsm schema`: the published JSON Schemas."""

from __future__ import annotations

import json
from argparse import Namespace

from llfsm_verify.cli.io.output import Output


def run(options: Namespace) -> int:
    """Prints the schema called `options.name`; returns 0."""
    if options.name in ("arrangement", "machine"):
        from llfsm_verify.arrangement.schema import load
    else:
        from llfsm_verify.report.schema import load
    Output().plain(json.dumps(load(options.name), indent=2, ensure_ascii=False) + "\n")
    return 0

"""`llfsm audit`: whether a log of what was asked of a run is as it was written."""

from __future__ import annotations

import sys
from argparse import Namespace

from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.runtime.whiteboard.audit import CHANGED, verify


def run(options: Namespace) -> int:
    """0 when each line is the one that was written, and the last one is the expected one; 1 when not.

    DiagnosticError (E500): the log cannot be read.
    """
    try:
        found = verify(options.log)
    except DiagnosticError as error:
        if any(d.code != CHANGED for d in error.diagnostics):
            raise
        for d in error.diagnostics:
            print(d.render(), file=sys.stderr)
        return 1
    entries = f"{found.entries:,} {'entry' if found.entries == 1 else 'entries'}, the last one {found.last}"
    if options.last is not None and options.last.lower() != found.last:
        print(f"{options.log}: changed: it has {entries}, and not {options.last[:80]}")
        return 1
    state = "; the last run in it has no end" if found.open else ""
    print(f"{options.log}: as it was written, {entries}{state}")
    return 0

"""What is said of a trace that was saved."""

from __future__ import annotations

import sys
from pathlib import Path

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError


def announce(path: Path) -> None:
    """Say where a trace is; one that is too long to be read again is said to be so."""
    from llfsm_verify.verification.tracefile import read_trace_file

    print(f"trace saved: {path}", file=sys.stderr)
    try:
        read_trace_file(path)
    except DiagnosticError as error:
        first = error.diagnostics[0]
        print(Diagnostic("W401", f"it cannot be replayed: {first.message}", file=str(path)).render(), file=sys.stderr)

"""Wrong usage: what is said of it, and its exit code."""

from __future__ import annotations

import sys


class UsageError(Exception):
    """The command line is wrong; the message says how. Its exit code is 2."""


def usage(message: str) -> int:
    """Say what is wrong with the command line; the exit code for that."""
    from llfsm_verify.diagnostics import without_controls

    print(f"error: {without_controls(message)}", file=sys.stderr)
    return 2

"""`llfsm audit`: whether a log of what was asked of a run is as it was written."""

from __future__ import annotations

from argparse import ArgumentTypeError, Namespace

from llfsm_verify.cli.io.output import tell
from llfsm_verify.cli.parser import Parser
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.runtime.whiteboard.audit import CHANGED, verify


def arguments(parser: Parser) -> None:
    """Add the arguments of `llfsm audit`."""
    parser.about(
        "Tell whether each line of an audit log of `llfsm run --audit` is as it was written.",
        "llfsm audit verify run.audit",
        "exit codes: 0 it is as it was written, 1 it was changed, 2 wrong usage, 3 it cannot be read",
    )
    parser.add_argument("asked", choices=("verify",), metavar="verify", help="compare the hashes of all lines")
    parser.add_argument("log", metavar="LOG", help="the file")
    parser.add_argument("--last", metavar="HASH", type=hashed, help="what the run printed for the last line")


def hashed(text: str) -> str:
    """A hash as a run prints it."""
    if len(text) != 64 or set(text) - set("0123456789abcdefABCDEF"):
        raise ArgumentTypeError(f"{text[:40]!r} is not a hash: those have 64 hexadecimal digits")
    return text


def run(options: Namespace) -> int:
    """0 when each line is the one that was written, and the last one is the expected one; 1 when not.

    DiagnosticError (E500): the log cannot be read.
    """
    try:
        found = verify(options.log)
    except DiagnosticError as error:
        if any(d.code != CHANGED for d in error.diagnostics):
            raise
        tell(*error.diagnostics)
        return 1
    entries = f"{found.entries:,} {'entry' if found.entries == 1 else 'entries'}, the last one {found.last}"
    if options.last is not None and options.last.lower() != found.last:
        print(f"{options.log}: changed: it has {entries}, and not {options.last[:80]}")
        return 1
    state = "; the last run in it has no end" if found.open else ""
    print(f"{options.log}: as it was written, {entries}{state}")
    return 0

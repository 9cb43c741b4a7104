"""The arguments of `llfsm send`."""

from __future__ import annotations

from llfsm_verify.cli.parser import Parser

KINDS = ("suspend", "resume", "restart", "load", "load_suspended", "unload", "write", "replace", "policy")
"""Of commands."""


def arguments(parser: Parser) -> None:
    """Of `llfsm send`."""
    parser.about(
        "Give a command that `operators:` declares to an arrangement that runs on this machine; it is taken at the "
        "beginning of a cycle.",
        "llfsm send crossing suspend north",
        "exit codes: 0 taken, 2 wrong usage, 3 there is no such whiteboard, or the command is refused",
    )
    parser.add_argument("name", metavar="NAME", help="the whiteboard, as `llfsm run --whiteboard` names it")
    parser.add_argument("what", choices=KINDS, metavar="COMMAND", help=", ".join(KINDS))
    parser.add_argument(
        "target", metavar="MACHINE|SLOT|FILE", help="the machine or slot; for policy: the file of the new policy"
    )
    parser.add_argument(
        "value", metavar="VALUE|FILE", nargs="?", help="for write: the value; for replace: the file of the new machine"
    )
    parser.add_argument("--unchecked", action="store_true", help="for replace: load the machine without a check")

"""`llfsm send`: an operator's command to an arrangement that runs."""

from __future__ import annotations

from argparse import Namespace
from typing import TYPE_CHECKING

from llfsm_verify.cli.parser import Parser, UsageError
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError

if TYPE_CHECKING:
    from llfsm_verify.runtime.whiteboard.client import Replaced

KINDS = ("suspend", "resume", "restart", "enter", "load", "load_suspended", "unload", "write", "replace", "policy")
"""Of commands."""


def arguments(parser: Parser) -> None:
    """Add the arguments of `llfsm send`."""
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
        "value", metavar="STATE|VALUE|FILE", nargs="?",
        help="for enter: the state; for write: the value; for replace: the file of the new machine",
    )  # fmt: skip
    parser.add_argument("--unchecked", action="store_true", help="for replace: load the machine without a check")


def run(options: Namespace) -> int:
    """Returns 0 after the command was taken, 2 for wrong usage. DiagnosticError (E486): no such whiteboard, or the
    command is refused.
    """
    from llfsm_verify.arrangement.model import POLICY, REPLACE
    from llfsm_verify.runtime.live import ABSENT
    from llfsm_verify.runtime.whiteboard.client import PostRefused, Whiteboard, WhiteboardError
    from llfsm_verify.runtime.whiteboard.places import NoPlace
    from llfsm_verify.semantics.operators import ARGUMENTS

    valued = options.what in {*ARGUMENTS, REPLACE}
    if valued != (options.value is not None):
        raise UsageError(
            "write `llfsm send NAME enter MACHINE STATE`, `llfsm send NAME write SLOT VALUE`, "
            "`llfsm send NAME replace MACHINE FILE`, `llfsm send NAME policy FILE`, or another command without a value"
        )
    if options.unchecked and options.what != REPLACE:
        raise UsageError("--unchecked is for `replace`")
    try:
        with Whiteboard(options.name) as board:
            if options.what == REPLACE:
                done = board.replace(options.target, options.value, unchecked=options.unchecked)
                return _said(done, f"`{options.target}` is the machine in {options.value}")
            if options.what == POLICY:
                return _said(board.policy(options.target), f"the policy is the one in {options.target}")
            frame = board.command(options.what, options.target, options.value)
    except (OSError, UnicodeDecodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "it is not UTF-8"
        raise DiagnosticError(
            [Diagnostic("E002", f"the file cannot be read: {why}", file=options.value or options.target)]
        ) from None
    except PostRefused as refused:
        raise DiagnosticError([Diagnostic(ABSENT, str(refused))]) from None
    except (WhiteboardError, NoPlace) as error:
        hint = "`llfsm whiteboard list` says what there is"
        raise DiagnosticError([Diagnostic(ABSENT, str(error), hint=hint)]) from None
    print(f"taken in the cycle before frame {frame:,}")
    return 0


def _said(done: Replaced, what: str) -> int:
    for note in done.notes:
        print(f"note: {note}")
    print(f"{what} from frame {done.frame:,} on")
    return 0

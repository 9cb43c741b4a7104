"""`llfsm send`: an operator's command to an arrangement that runs."""

from __future__ import annotations

from argparse import Namespace

from llfsm_verify.arrangement.model import POLICY, REPLACE
from llfsm_verify.cli.parser import UsageError
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.runtime.live import ABSENT
from llfsm_verify.runtime.whiteboard.client import PostRefused, Replaced, Whiteboard, WhiteboardError
from llfsm_verify.runtime.whiteboard.places import NoPlace
from llfsm_verify.runtime.whiteboard.posts import WRITE


def run(options: Namespace) -> int:
    """Returns 0 after the command was taken, 2 for wrong usage. DiagnosticError (E486): no such whiteboard, or the
    command is refused.
    """
    valued = options.what in {WRITE, REPLACE}
    if valued != (options.value is not None):
        raise UsageError(
            "write `llfsm send NAME write SLOT VALUE`, `llfsm send NAME replace MACHINE FILE`, "
            "`llfsm send NAME policy FILE`, or another command without a value"
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

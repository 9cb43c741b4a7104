"""`llfsm send`: an operator's command to an arrangement that runs."""

from __future__ import annotations

from argparse import Namespace

from llfsm_verify.cli.io.output import usage
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.runtime.live.codes import ABSENT
from llfsm_verify.runtime.whiteboard.board import PostRefused, Whiteboard, WhiteboardError
from llfsm_verify.runtime.whiteboard.places import NoPlace
from llfsm_verify.runtime.whiteboard.posts import WRITE


def run(options: Namespace) -> int:
    """Returns 0 after the command was taken, 2 for wrong usage. DiagnosticError (E486): no such whiteboard, or the
    command is refused.
    """
    if (options.what == WRITE) != (options.value is not None):
        return usage("write `llfsm send NAME write SLOT VALUE`, or another command without a value")
    try:
        with Whiteboard(options.name) as board:
            frame = board.command(options.what, options.target, options.value)
    except PostRefused as refused:
        raise DiagnosticError([Diagnostic(ABSENT, str(refused))]) from None
    except (WhiteboardError, NoPlace) as error:
        hint = "`llfsm whiteboard list` says what there is"
        raise DiagnosticError([Diagnostic(ABSENT, str(error), hint=hint)]) from None
    print(f"taken in the cycle before frame {frame:,}")
    return 0

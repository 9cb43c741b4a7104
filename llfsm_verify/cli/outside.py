"""Outside guards on the command line: `llfsm whiteboard watch` with commands."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Sequence
from contextlib import suppress

from llfsm_verify.arrangement.keys import OPERATORS
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.problem import bind
from llfsm_verify.cli.arguments import assignments
from llfsm_verify.cli.io.decided import UNDECIDED, say_results
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, counted
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.runtime.deciding.frames import FrameMonitors
from llfsm_verify.runtime.deciding.recordings import Decided
from llfsm_verify.runtime.live import ABSENT
from llfsm_verify.runtime.outside.guard import Acted, OutsideGuard, Sent, refusals
from llfsm_verify.runtime.outside.reaction_time import Order, Pace, reaction_time
from llfsm_verify.runtime.whiteboard.client import Whiteboard
from llfsm_verify.runtime.whiteboard.subscription import most_missed
from llfsm_verify.semantics.operators import ARGUMENTS

GIVEN = tuple(kind for kind in OPERATORS.keys if kind not in ("replace", "policy"))
"""The commands that a guard may give: those that need no file."""


def orders_of(options: Namespace) -> list[Order]:
    """What `--command` and `--post` say, commands first. ValueError: one is not written so."""
    orders = [command(text) for text in options.commands]
    orders += [Order(None, name, value) for name, value in assignments("--post", options.posts).items()]
    if options.every and not orders:
        raise ValueError("--every is for commands: give one with --command or --post")
    return orders


def command(text: str) -> Order:
    """An operator's command as `llfsm send` has it. ValueError: it is not one."""
    words = text.split()
    if not words or words[0] not in GIVEN or len(words) != (3 if words[0] in ARGUMENTS else 2):
        others = ", ".join(f"`{kind}`" for kind in GIVEN[1:] if kind not in ARGUMENTS)
        raise ValueError(
            f"`{text[:60]}` is not a command of a guard: write `suspend MACHINE` (or {others}), `enter MACHINE STATE` "
            "or `write SLOT VALUE`"
        )
    return Order(*words)


def refuse_undeclared(orders: Sequence[Order], arrangement: Arrangement) -> None:
    """DiagnosticError (E486): a run of the arrangement would refuse one of these."""
    program = bind(arrangement, PropertySet(())).program(keep_all_bits=True)
    hint = "`operators` and `access` of the arrangement allow commands"
    found = [
        Diagnostic(ABSENT, f"`{text}` would be refused: {why}", hint=hint)
        for text, why in refusals(orders, arrangement, program).items()
    ]
    if found:
        raise DiagnosticError(found)


def guard_run(
    board: Whiteboard, monitors: FrameMonitors, orders: Sequence[Order], arrangement: Arrangement, every: int | None
) -> int:
    """Watches, and gives the orders when a property is violated. Returns the exit code of the properties, or 4 when all
    is well but `every` was not kept.

    PostRefused, WhiteboardError: see `OutsideGuard.watch`; DiagnosticError (E486): the run would refuse an order.
    """
    refuse_undeclared(orders, arrangement)
    pace, processes = None if every is None else Pace(every), len(arrangement.processes)
    guard = OutsideGuard(board, monitors, orders, pace, processes)
    for line in _beforehand(orders, pace, processes, board.period):
        print(line, flush=True)
    with suppress(KeyboardInterrupt):
        for happened in guard.watch():
            print(_said(happened), flush=True)
    code = say_results(monitors)
    if guard.widest:
        promised = ""
        if every is not None:
            promised = f", and {counted(every, 'cycle')} promised" if guard.widest > every else " as promised"
        print(f"each frame was looked at within {counted(guard.widest, 'cycle')}{promised}")
    return UNDECIDED if not code and every is not None and guard.widest > every else code


def _beforehand(orders: Sequence[Order], pace: Pace | None, processes: int, period: float) -> list[str]:
    named = ", ".join(f"`{order.text}`" for order in orders)
    if pace is None:
        return [f"when a property is violated: {named}"]
    commands = sum(order.kind is not None for order in orders)
    worst = reaction_time(pace, max(1, commands), processes).cycles
    time = f" ({worst * period:g} s)" if period else ""
    looks = f"if each frame is looked at within {counted(pace.every, 'cycle')}"
    after = f"at most {counted(worst, 'cycle')}{time} after the frame that violates it"
    lines = [f"when a property is violated: {named}, {after}, {looks}"]
    missed = most_missed(pace.every)
    if missed:
        lines.append(f"up to {missed:,} frames at once may be missed then; what only these show is not seen")
    return lines


def _said(happened: Decided | Sent | Acted) -> str:
    match happened:
        case Sent(decided, orders):
            return f"{decided.frame}: {decided.line.name} is violated; sent: {', '.join(orders)}"
        case Acted(order, seen, frame, most):
            late = f", and at most {most} promised" if happened.late else ""
            return f"{frame}: {order} is in force, {counted(frame - seen, 'cycle')} after frame {seen}{late}"
    return f"{happened.frame}: {happened.line.name} is {happened.verdict}"

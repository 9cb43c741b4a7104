"""`llfsm whiteboard`: what is on the whiteboards of arrangements that run on this machine."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Mapping
from contextlib import suppress

from llfsm_verify.cli.arguments import assignments
from llfsm_verify.cli.io.decided import say_results
from llfsm_verify.cli.io.output import tell
from llfsm_verify.cli.parser import UsageError, wrong_usage
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.runtime.live import ABSENT
from llfsm_verify.runtime.whiteboard.client import PostRefused, Whiteboard, WhiteboardError
from llfsm_verify.runtime.whiteboard.places import NoPlace, names
from llfsm_verify.values import Shown, text


def run(options: Namespace) -> int:
    """Returns 0; of properties 1 and 4, as `check-recording` does. UsageError.

    DiagnosticError (E486): no such whiteboard or slot, or a value is refused.
    """
    try:
        if options.asked == "list":
            _list()
            return 0
        with Whiteboard(options.name) as board:
            return _asked(board, options)
    except PostRefused as refused:
        raise _absent(str(refused)) from None
    except (WhiteboardError, NoPlace) as error:
        raise _absent(str(error), "`llfsm whiteboard list` says what there is") from None


def _asked(board: Whiteboard, options: Namespace) -> int:
    """What is asked of one whiteboard; UsageError."""
    if options.asked == "post":
        board.post(**assignments("post", options.values))
        return 0
    known = [slot.name for slot in board.slots]
    wanted = options.slots or known
    unknown = next((name for name in wanted if name not in known), None)
    if unknown is not None:
        raise _absent(f"there is no slot `{unknown}` on `{options.name}`", f"there are {', '.join(sorted(known))}")
    if options.asked == "get":
        values = board.view().values
        _print({name: values[name] for name in wanted})
        return 0
    if options.monitor or options.property:
        return _monitor(board, options)
    if options.commands or options.posts or options.every:
        raise UsageError("--command, --post and --every are for properties: give one with -p or --monitor")
    return _watch(board, wanted)


def _list() -> None:
    found = names()
    if not found:
        tell("no run has a whiteboard")
    for name in found:
        try:
            with Whiteboard(name) as board:
                view = board.view()
                print(f"{name}: frame {view.number:,}, {view.age:.3f} s old, {view.ending}, {len(board.slots)} slots")
        except WhiteboardError as error:
            print(f"{name}: {error}")


def _watch(board: Whiteboard, wanted: list[str]) -> int:
    """Each change of what is wanted, up to the last frame."""
    before: Mapping[str, Shown] = {}
    with board.subscribe(*wanted) as updates:
        for update in updates:
            missed = f"({update.missed:,} frames missed) " if update.missed else ""
            changed = {name: value for name, value in update.values.items() if value != before.get(name)}
            _print(changed, f"{update.number}: {missed}")
            before = update.values
    view = board.view()
    print(f"{view.number}: {view.ending}", flush=True)
    return 0


def _monitor(board: Whiteboard, options: Namespace) -> int:
    """Decides properties on the frames, up to the last one; Ctrl-C is where the watching ends."""
    from llfsm_verify.arrangement import load_arrangement
    from llfsm_verify.cli.opening import read_properties, told
    from llfsm_verify.cli.outside import guard_run, orders_of
    from llfsm_verify.runtime.deciding.frames import FrameMonitors

    if options.arrangement is None:
        raise UsageError("properties speak of an arrangement: name the one that runs with --arrangement FILE")
    if options.slots:
        raise UsageError("properties are decided on whole frames: leave out the slots")
    with wrong_usage(ValueError):
        orders = orders_of(options)
    lines = read_properties(Namespace(**{**vars(options), "properties": options.monitor}))
    arrangement = load_arrangement(options.arrangement)
    monitors = FrameMonitors(arrangement, told(lines, arrangement), board.slots)
    if orders:
        return guard_run(board, monitors, orders, arrangement, options.every)
    with board.frames() as frames, suppress(KeyboardInterrupt):
        for frame in frames:
            for decided in monitors.read(frame):
                print(f"{decided.frame}: {decided.line.name} is {decided.verdict}", flush=True)
    return say_results(monitors)


def _print(values: Mapping[str, Shown], head: str | None = None) -> None:
    shown = [f"{name} = {text(value)}" for name, value in values.items()]
    print("\n".join(shown) if head is None else head + ", ".join(shown), flush=True)


def _absent(message: str, hint: str | None = None) -> DiagnosticError:
    return DiagnosticError([Diagnostic(ABSENT, message, hint=hint)])

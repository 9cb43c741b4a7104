"""`llfsm guard --outside`: how late the reaction of an outside guard is at worst, computed and proved."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Mapping
from pathlib import Path

from llfsm_verify import Verdict
from llfsm_verify.extensions.guards.outside import PROPERTIES, Watch, with_outside_guard
from llfsm_verify.extensions.guards.transform import Task
from llfsm_verify.plug import (
    Arrangement,
    Draft,
    Options,
    Order,
    Output,
    Pace,
    Result,
    Source,
    UsageError,
    counted,
    limits_of,
    order_of,
    parse_properties,
    reaction_time,
    refuse_undeclared,
    verify,
    wrong_usage,
)

NOT_KEPT, UNKNOWN = 1, 4
WORDS = {Verdict.HOLDS: "proved", Verdict.VIOLATED: "violated"}


def outside(
    options: Namespace,
    draft: Draft,
    arrangement: Arrangement,
    task: Task,
    write: Callable[[Mapping[str, str], Path], None],
    folder: str,
) -> int:
    """Returns 0 when the bound is proved, 1 when it is violated, 4 when that is not known. DiagnosticError: something
    does not go with an outside guard."""
    orders = _orders(options)
    refuse_undeclared(orders, arrangement)
    pace = Pace(options.every or 1, options.looks or 1)
    made = with_outside_guard(draft, orders, pace, task, Path(options.output or folder))
    if options.output is not None:
        write(made.files, Path(options.output))
    worst = reaction_time(pace, len(orders))
    named = ", ".join(f"`{order.text}`" for order in orders)
    _say(f"when the guard looks once in {_pace(pace)}:")
    _say(f"{named}: at most {counted(worst.cycles, 'cycle')} after the frame that violates a property")
    if arrangement.plants:
        _say("note: the proof is without the model of the surroundings, so inputs have any values")
    return 0 if options.no_proof else _prove(options, made, worst.cycles)


def _say(line: str) -> None:
    Output().plain(f"{line}\n")


def _orders(options: Namespace) -> list[Order]:
    """UsageError: one is not a command, or options of another guard are given."""
    if options.fallback or options.guard or options.own or options.hold or options.until or options.react:
        raise UsageError(
            "an outside guard gives commands: leave out --fallback, --react, --guard, --monitor, --for and --until"
        )
    with wrong_usage(ValueError):
        return [order_of(text) for text in options.outside]


def _pace(pace: Pace) -> str:
    spoken = "each cycle" if pace.every == 1 else f"any {counted(pace.every, 'cycle')}"
    later = pace.looks - 1
    wait = f", and commands {counted(later, 'look')} after the one that sees it" if later else ""
    return f"{spoken} of the arrangement{wait}"


def _prove(options: Namespace, made: Watch, worst: int) -> int:
    properties = parse_properties([Source(PROPERTIES, made.properties)])
    result = verify(made.arrangement, properties, Options(limits_of(options)), options.engine)
    verdicts = [found.verdict for found in result.properties]
    for number, verdict in zip((worst, worst - 1), verdicts, strict=True):
        _say(f"{WORDS.get(verdict, 'unknown'):8}  at most {counted(number, 'cycle')}")
    if verdicts[1] is Verdict.HOLDS:
        _say("no run is as late as the first bound allows: perhaps no frame violates the property")
    for reason in _unknown(result):
        _say(reason)
    return {Verdict.HOLDS: 0, Verdict.VIOLATED: NOT_KEPT}.get(verdicts[0], UNKNOWN)


def _unknown(result: Result) -> list[str]:
    """Why something is not known."""
    return list(dict.fromkeys(found.reason for found in result.properties if found.reason))

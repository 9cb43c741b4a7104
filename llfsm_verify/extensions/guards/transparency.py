"""Whether a guard changes nothing before its alarm: the guarded arrangement beside the original, step by step."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass, replace

from llfsm_verify import DiagnosticError, Disagreement, LimitReached, TraceStep
from llfsm_verify.extensions.guards.lockstep import MARK, Lockstep, Unlike, lockstep
from llfsm_verify.extensions.guards.wanted import Names
from llfsm_verify.plug import (
    MAX_ROOTS,
    Arrangement,
    Budget,
    Execution,
    FaultRun,
    Layout,
    Reachable,
    Value,
    is_wide,
    labels_of,
    lower,
)

MOST_STEPS = 100_000_000
"""Steps after which it is not known: an input with many values has as many from each configuration."""


@dataclass(frozen=True, slots=True)
class Transparent:
    """Until the alarm is set, outputs, variables and states at the end of each cycle are those of the original."""

    configurations: int


@dataclass(frozen=True, slots=True)
class Different:
    """They are not: a run of the guarded arrangement, and what differs at its end."""

    steps: tuple[TraceStep, ...]
    found: tuple[tuple[str, str, str], ...]
    """The variable, its value in the original, and in the guarded arrangement. Empty: a fault of the guard's own."""
    fault: str = ""


@dataclass(frozen=True, slots=True)
class Unproved:
    """It is not known; `reason` is a sentence without its full stop."""

    reason: str


def transparency(
    original: Arrangement, guarded: Arrangement, names: Names, budget: Budget
) -> Transparent | Different | Unproved:
    """Explore both together, as they are observed at the ends of cycles."""
    if len(original.processes) > 1:
        return Unproved("there are several processes")
    try:
        with budget:
            before, after = (lower(replace(a, observe="cycle"), (), keep_all_bits=True) for a in (original, guarded))
            return _explored(lockstep(before, after, names.alarm, names.requests), budget)
    except (Unlike, LimitReached) as why:
        return Unproved(str(why))
    except MemoryError:
        return Unproved("the memory ran out")
    except DiagnosticError as error:
        return Unproved(error.diagnostics[0].message)


def _explored(both: Lockstep, budget: Budget) -> Transparent | Different | Unproved:
    layout = Layout.of(both.program)

    def roots() -> Iterator[bytes]:
        inner = Layout.of(both.guarded)
        return (layout.encode(both.start(inner.decode(record))) for record in inner.initial(MAX_ROOTS))

    # Classes of values belong to one place where an input is read, and here both read it.
    wide = any(is_wide(choice) and choice.name in both.resampled for choice in both.program.choices)
    labels = None if wide else labels_of(both.program, budget)
    with closing(Reachable(both.program, budget, roots=roots(), labels=labels)) as space:
        graph = space.graph
        found = space.fault({both.differs, *both.own}, most_steps=MOST_STEPS)
        if found is not None:
            return _performed(both, layout.decode(graph.key(found.path[0])), found)
        return Unproved(graph.unfinished) if graph.unfinished is not None else Transparent(graph.configurations)


def _performed(both: Lockstep, values: Mapping[str, Value], run: FaultRun) -> Different:
    """The run in both arrangements, each by itself. Disagreement: one ends in a fault that was not found, or they do
    not differ at the end."""
    guarded, original = Execution(both.guarded), Execution(both.original)
    of_original = {name.removeprefix(MARK): value for name, value in values.items() if name.startswith(MARK)}
    after, before = (
        each.layout.encode_record({**values, **extra, **each.layout.initial_outputs()})
        for each, extra in ((guarded, {}), (original, of_original))
    )
    names = {info.name for info in both.original.machines}
    steps: list[TraceStep] = []
    for move in run.moves:
        step = guarded.step(after, move)
        shown = guarded.describe(after, move, step, ())
        steps.append(shown)
        if step.status:
            if step.status - 1 != run.fault:
                raise Disagreement("the executor ends in another fault than the run that was found")
            return Different(tuple(steps), (), both.guarded.faults[step.status - 1].message)
        after = step.record
        if shown.machine in names and original.enabled(before):
            same = {name: move.choices[other] for name, other in both.named.items() if other in move.choices}
            taken = original.step(before, replace(move, choices=move.choices | same))
            if taken.status:
                raise Disagreement("the original ends in a fault in the run that was found")
            before = taken.record
    old, new = dict(original.shown(before)), dict(guarded.shown(after))
    found = tuple((name, text, new[name]) for name, text in old.items() if name in new and new[name] != text)
    if not found:
        raise Disagreement("the executor finds no difference to the original in the run that was found")
    return Different(tuple(steps), found)

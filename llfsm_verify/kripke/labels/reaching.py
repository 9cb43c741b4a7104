"""Classes that depend on variables, by reachable valuation: explored with those known, until no new one is met."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from llfsm_verify.backends.smt.solver import GaveUp
from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.kripke.labels.planning import MOST_VALUATIONS, Decided, Planner, Split, most_classes
from llfsm_verify.limits import Budget
from llfsm_verify.program.labelling import label_program
from llfsm_verify.program.program import Const, Get, Set
from llfsm_verify.program.trees import statements

MOST_NODES = 50_000
"""Configurations up to which valuations are looked for."""
MOST_STEPS = 1 << 22
"""Steps up to which valuations are looked for."""
MOST_ROUNDS = 64
TOO_MANY = "its classes depend on {}, of which too many values can be reached"


def decide_reachable(planner: Planner, decided: Decided, budget: Budget) -> None:
    """Find the classes of the groups that are left open in `decided`, or refuse them.

    Raises LimitReached and KeyboardInterrupt.
    """
    for split in list(decided.open):
        if split in decided.open and not _can_be_met(planner, split):
            planner.refuse(split, decided, TOO_MANY.format(_names(split)))
    met: dict[Split, set[tuple[int, ...]]] = {s: set() for s in decided.open}
    for split in list(met):
        _learn(planner, decided, split, met, {_first(planner, split)})
    for _ in range(MOST_ROUNDS):
        waiting = [s for s in met if s in decided.classes]
        if not waiting:
            return
        explorer = _explored(planner, decided, budget)
        try:
            graph = explorer.graph
            if not graph.exhausted:
                budget.check()
                break
            more = False
            for split in waiting:
                more = _learn(planner, decided, split, met, set(_valuations(explorer, split))) or more
            if not more:
                return
        finally:
            explorer.close()
    for split in met:
        if split in decided.classes:
            planner.refuse(split, decided, TOO_MANY.format(_names(split)))


def _can_be_met(planner: Planner, split: Split) -> bool:
    """The keys are variables of configurations, and what a prologue does to them is nothing."""
    outputs = {v.name for v in planner.program.vars if v.output}
    changed: set[str] = set()
    if split.place.slot is not None:
        changed = {s.var for s in statements(planner.program.slots[split.place.slot].prologue) if isinstance(s, Set)}
    free = {v.name for v in planner.program.vars if v.free}
    return not any(k.var in outputs | changed | free for k in split.keys)


def _first(planner: Planner, split: Split) -> tuple[int, ...]:
    return planner.valuation(split.keys, {v.name: v.init for v in planner.program.vars})


def _learn(
    planner: Planner,
    decided: Decided,
    split: Split,
    met: dict[Split, set[tuple[int, ...]]],
    valuations: set[tuple[int, ...]],
) -> bool:
    """Make the classes of valuations that were met; whether there are new ones."""
    new = valuations - met[split]
    if not new:
        return False
    met[split] |= new
    if split in decided.open:
        decided.open.remove(split)
    why = TOO_MANY.format(_names(split))
    if len(met[split]) <= MOST_VALUATIONS:
        try:
            found = planner.table(split, sorted(met[split]), partial=True)
            if found is not None:
                decided.classes[split] = found
                return True
            why = f"more than {most_classes(split.choices):,} classes are told apart"
        except GaveUp as gave_up:
            why = str(gave_up)
    planner.refuse(split, decided, why)
    return True


def _explored(planner: Planner, decided: Decided, budget: Budget) -> Explorer:
    """An exploration with the classes known: a valuation without classes ends a step."""
    # What a letter shows does not change where a step leads: an unknown valuation there need not end it.
    plan = {
        place: {name: replace(c, partial=c.partial and place.slot is not None) for name, c in classes.items()}
        for place, classes in decided.plan().items()
    }
    program = label_program(planner.program, plan)
    explorer = Explorer(program, budget.narrowed(max_states=MOST_NODES, max_steps=MOST_STEPS), with_edges=False)
    explorer.explore(None)
    return explorer


def _valuations(explorer: Explorer, split: Split) -> Iterator[tuple[int, ...]]:
    """The valuations of the keys in all configurations found."""
    readers = [explorer.layout.reader(k.var, _index(k)) for k in split.keys]
    for node in range(len(explorer.graph)):
        record = explorer.graph.record(node)
        yield tuple(read(record) for read in readers)


def _index(key: Get) -> int | None:
    if key.index is None:
        return None
    assert isinstance(key.index, Const)
    return key.index.value


def _names(split: Split) -> str:
    return ", ".join(f"`{name}`" for name in dict.fromkeys(k.var for k in split.keys))

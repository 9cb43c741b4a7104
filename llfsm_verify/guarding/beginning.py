"""The initial letter of a run, which no monitor in the schedule reads: it has a turn only after it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.backends.native.layout import Layout, TooManyInitial
from llfsm_verify.checking.problem import bind
from llfsm_verify.kripke.observing import Observer
from llfsm_verify.logic.properties import Property, PropertySet
from llfsm_verify.monitoring.properties import Monitored
from llfsm_verify.monitoring.states import Monitor, MonitorVerdict

MOST_INITIAL = 1024
"""Initial configurations that are looked at."""


def begun(made: Monitored, arrangement: Arrangement, lines: Sequence[Property]) -> Monitored:
    """The monitor that has read the initial letter of the arrangement, where all initial configurations show the same
    one, and it decides nothing; else the monitor as it is. `lines`: the property and the assumptions.
    """
    letter = _initial_letter(made.monitor.atoms, arrangement, lines)
    if letter is None:
        return made
    state = made.monitor.step(0, letter)
    after = _from(made.monitor, state)
    if after.verdicts[0] is not MonitorVerdict.NOT_YET or MonitorVerdict.FALSE not in after.verdicts:
        return made
    return replace(made, monitor=after)


def _initial_letter(atoms: Sequence[str], arrangement: Arrangement, lines: Sequence[Property]) -> int | None:
    """The mask of the atoms that hold; None: that is not the same in all initial configurations, or unknown."""
    program = bind(arrangement, PropertySet(tuple(lines))).program()
    layout = Layout.of(program)
    observer = Observer(program, layout)
    places = {name: place for place, name in enumerate(observer.names)}
    if not set(atoms) <= set(places):
        return None
    try:
        masks = {observer.first_letter(record) for record in layout.initial(MOST_INITIAL)}
    except (TooManyInitial, OverflowError):
        return None
    letters = {sum(1 << i for i, atom in enumerate(atoms) if mask >> places[atom] & 1) for mask in masks}
    return letters.pop() if len(letters) == 1 else None


def _from(monitor: Monitor, state: int) -> Monitor:
    """The monitor that begins in another state: what is reachable from there."""
    order = [state]
    for known in order:
        order += [target for target in dict.fromkeys(e.target for e in monitor.edges[known]) if target not in order]
    numbers = {old: new for new, old in enumerate(order)}
    return Monitor(
        monitor.atoms,
        tuple(monitor.verdicts[old] for old in order),
        tuple(tuple(replace(e, target=numbers[e.target]) for e in monitor.edges[old]) for old in order),
        tuple(monitor.hopeless[old] for old in order),
    )

"""Bad prefixes of formulas with bounds in time: the subset construction over an automaton with counters."""

from __future__ import annotations

from llfsm_verify.automata.boolean import Guard
from llfsm_verify.automata.ltl.counting import Counting, Step
from llfsm_verify.automata.omega.components import components
from llfsm_verify.limits import tick

MAX_LOOKED = 3_000
"""States among which those without an accepted word are looked for."""
MAX_WORK = 60_000
"""Transitions that are taken for that."""


class CountingMonitor:
    """Reads a word letter by letter and tells when no run of an automaton with counters is left.

    `safety.Monitor` is the protocol. States from which no word is accepted are left out when the automaton is small:
    bad prefixes are then found at their shortest. Otherwise some are found later, those of a safety property all the
    same: a word without a run of an automaton without acceptance sets has a prefix without one (König's lemma).
    """

    def __init__(self, counting: Counting) -> None:
        self._counting = counting
        live = None if counting.is_empty else live_states(counting)
        self.exact = counting.is_empty or live is not None
        """Whether every bad prefix is found at its shortest."""
        self._live = live
        self._sets: list[frozenset[int]] = []
        self._numbers: dict[frozenset[int], int] = {}
        self._steps: dict[tuple[int, int], int | None] = {}

    def initial(self) -> int | None:
        """The state before the first letter; None: the empty word is a bad prefix."""
        if self._counting.is_empty or (self._live is not None and 0 not in self._live):
            return None
        return self._number(frozenset((0,)))

    def step(self, state: int, letter: int) -> int | None:
        """The state after `letter` (the mask of the atoms that hold); None: the word read so far is a bad prefix."""
        key = (state, letter & self._counting.relevant)
        if key not in self._steps:
            targets = {target for q in self._sets[state] for _, target in self._counting(q, letter)}
            if self._live is not None:
                targets &= self._live
            self._steps[key] = self._number(self._counting.least(targets)) if targets else None
        return self._steps[key]

    def _number(self, states: frozenset[int]) -> int:
        number = self._numbers.setdefault(states, len(self._sets))
        if number == len(self._sets):
            self._sets.append(states)
        return number


def live_states(counting: Counting) -> set[int] | None:
    """The states from which some word in which time passes forever is accepted; None: there are too many to tell.

    All that can be reached from the initial state by any letters are looked at.
    """
    first = 0
    forever = 1 << counting.acceptance_sets
    full = (forever << 1) - 1
    order = [first]
    seen = {first}
    rows: dict[int, list[tuple[int, int]]] = {}
    parts: dict[tuple[Step, int], list[int]] = {}
    work = 0
    for number in order:
        tick()
        here, levels = counting.states[number]
        row: dict[tuple[int, int], None] = {}
        for step in counting.steps[here]:
            active = step.starts | sum(1 << i for i, level in enumerate(levels) if level)
            key = (step, active)
            if key not in parts:
                parts[key] = _examples(counting, *key)
            for letter in parts[key]:
                for passes in (0, counting.tick_bit):
                    after = counting.after(levels, step, letter | passes)
                    if after is not None:
                        target = counting.number(step.target, after)
                        row[target, step.acceptance | (forever if passes else 0)] = None
                work += 2
        rows[number] = list(row)
        for target, _ in row:
            if target not in seen:
                seen.add(target)
                order.append(target)
        if len(order) > MAX_LOOKED or work > MAX_WORK:
            return None
    return _live(order, rows, full)


def _examples(counting: Counting, step: Step, active: int) -> list[int]:
    """A letter of `step` for each combination of operands of the `active` counters that letters can show."""
    guards = counting.guards
    label: Guard = guards.cube(step.positive, step.negative)
    watched = [guard for i in range(len(counting.counters)) if active >> i & 1 for guard in counting.watched(i)]
    return [guards.example(part) & ~counting.tick_bit for part in guards.partition(watched, label)]


def _live(order: list[int], rows: dict[int, list[tuple[int, int]]], full: int) -> set[int]:
    """The states that reach a component which shows all acceptance sets inside."""
    place = {number: i for i, number in enumerate(order)}
    component = components([[place[target] for target, _ in rows[number]] for number in order])
    shown: dict[int, int] = {}
    for i, number in enumerate(order):
        for target, acceptance in rows[number]:
            if component[place[target]] == component[i]:
                shown[component[i]] = shown.get(component[i], 0) | acceptance
    good = {c for c, acceptance in shown.items() if acceptance == full}
    # Transitions never lead to a component of a higher number, so those reached are known before.
    for i in sorted(range(len(order)), key=component.__getitem__):
        if any(component[place[target]] in good for target, _ in rows[order[i]]):
            good.add(component[i])
    return {number for i, number in enumerate(order) if component[i] in good}

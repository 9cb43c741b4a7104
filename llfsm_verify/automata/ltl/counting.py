"""An automaton with saturating counters of time beside it: its states are made when they are asked for."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from llfsm_verify.automata.automaton import Automaton, AutomatonTooLarge
from llfsm_verify.automata.boolean import Guard, Guards
from llfsm_verify.automata.ltl.timed import Counter
from llfsm_verify.automata.omega.components import components
from llfsm_verify.automata.safety import SubsetReader
from llfsm_verify.limits import tick
from llfsm_verify.logic.bounds import TICK
from llfsm_verify.logic.formula import Formula, atoms

MAX_STATES = 4_000_000
MAX_BITS = 1 << 32
"""The bits of the levels of delays in all states."""

Levels = tuple[int, ...]
"""How much each counter still demands: 0 nothing, and more the higher it is.

That of a counter `within` is 1 plus the periods since the oldest start that is not served; it must not pass 1 plus its
ticks. That of a counter `throughout` is 1 plus the periods left for the newest start. In that of a `delay` bit i says
that there is a start for which i more periods have to pass.
"""


@dataclass(frozen=True, slots=True)
class Step:
    """A transition of the automaton with what it chooses: masks of visible atoms, and masks of counters."""

    positive: int
    negative: int
    target: int
    acceptance: int
    starts: int
    keep_denied: int
    """Counters whose `keep` is a hidden atom that does not hold."""
    goal_denied: int


class Counting:
    """The words that `automaton` accepts for some choice of its hidden atoms that meets the demands of `counters`.

    A state is one of the automaton with the levels of the counters; it simulates those of the same state with higher
    levels, which are therefore left out where both can be reached. Time has to pass forever: words in which TICK holds
    finitely often may be accepted wrongly. A row costs the transitions of the automaton's state times the counters.
    `Lazy` is the protocol.
    """

    def __init__(self, automaton: Automaton, counters: Sequence[Counter], visible: Sequence[str]) -> None:
        """The first atoms of `automaton` are `visible`, the bits of letters. ValueError: TICK is not among them."""
        if TICK not in visible:
            raise ValueError("counters need the atom that tells whether time passes")
        self.counters = tuple(counters)
        self._delays = tuple(i for i, c in enumerate(counters) if c.sort == "delay")
        self._bits = 0
        self.acceptance_sets = automaton.acceptance_sets
        self.is_empty = automaton.is_empty
        self.guards = Guards(visible)
        self._tick = 1 << tuple(visible).index(TICK)
        bits = {key: 1 << i for i, key in enumerate(automaton.atoms)}
        shown = (1 << len(visible)) - 1
        starts = [bits[c.start] for c in counters]
        keep_bits = [_hidden_bit(c.keep, bits, shown) for c in counters]
        goal_bits = [_hidden_bit(c.goal, bits, shown) for c in counters]
        always = self.guards.always
        self._keep = [always if h else self.guards.of(c.keep) for h, c in zip(keep_bits, counters, strict=True)]
        self._goal = [always if h else self.guards.of(c.goal) for h, c in zip(goal_bits, counters, strict=True)]

        def counters_of(bits: Sequence[int], mask: int) -> int:
            return sum(1 << i for i, bit in enumerate(bits) if mask & bit)

        self.steps = tuple(
            tuple(
                Step(
                    e.positive & shown,
                    e.negative & shown,
                    e.target,
                    e.acceptance,
                    counters_of(starts, e.positive),
                    counters_of(keep_bits, e.negative),
                    counters_of(goal_bits, e.negative),
                )
                for e in row
            )
            for row in automaton.edges
        )
        """The transitions by the automaton's state."""
        self.relevant = self._tick
        for key in atoms(*(f for c in counters for f in (c.keep, c.goal))):
            self.relevant |= bits[key] & shown
        for row in self.steps:
            for step in row:
                self.relevant |= step.positive | step.negative
        self._facts: dict[int, tuple[int, int]] = {}
        self._known: dict[tuple[int, int], tuple[tuple[int, int], ...]] = {}
        self.states: list[tuple[int, Levels]] = [(0, (0,) * len(counters))]
        """The automaton's state and the levels, by state."""
        self._numbers = {self.states[0]: 0}

    def __call__(self, state: int, letter: int) -> tuple[tuple[int, int], ...]:
        """(acceptance, target) of each move from `state`. AutomatonTooLarge: there are too many states."""
        key = (state, letter & self.relevant)
        moves = self._known.get(key)
        if moves is None:
            moves = self._known[key] = self._moves(*key)
        return moves

    def _moves(self, state: int, letter: int) -> tuple[tuple[int, int], ...]:
        here, levels = self.states[state]
        best: dict[int, list[tuple[int, Levels]]] = {}
        for step in self.steps[here]:
            if not (step.positive & ~letter or step.negative & letter):
                after = self.after(levels, step, letter)
                if after is not None:
                    self._keep_best(best.setdefault(step.target, []), (step.acceptance, after))
        return tuple((mask, self.number(target, after)) for target, found in best.items() for mask, after in found)

    def number(self, state: int, levels: Levels) -> int:
        """The number of a state."""
        pair = (state, levels)
        number = self._numbers.setdefault(pair, len(self.states))
        if number == len(self.states):
            if number >= MAX_STATES:
                raise AutomatonTooLarge("states", MAX_STATES)
            self._bits += sum(levels[i].bit_length() for i in self._delays)
            if self._bits > MAX_BITS:
                raise AutomatonTooLarge("bits of times that it remembers", MAX_BITS)
            self.states.append(pair)
        return number

    def after(self, levels: Levels, step: Step, letter: int) -> Levels | None:
        """The levels after `letter`; None: a demand is not met."""
        keep, goal = self._facts_of(letter)
        keep &= ~step.keep_denied
        goal &= ~step.goal_denied
        ticks = bool(letter & self._tick)
        after: list[int] = []
        for i, (level, counter) in enumerate(zip(levels, self.counters, strict=True)):
            bit = 1 << i
            if step.starts & bit:
                match counter.sort:
                    case "within":
                        level = level or 1
                    case "throughout":
                        level = counter.ticks + 1
                    case "delay":
                        level |= 1 << counter.ticks
            if counter.sort == "delay":
                if level & 1 and not goal & bit:
                    return None
                level = level >> 1 if ticks else level & ~1
            elif level:
                if counter.sort == "within":
                    if goal & bit:
                        level = 0
                    elif not keep & bit or (ticks and level > counter.ticks):
                        return None
                    else:
                        level += ticks
                elif not keep & bit:
                    return None
                else:
                    level = 0 if goal & bit else level - ticks
            after.append(level)
        return tuple(after)

    def _facts_of(self, letter: int) -> tuple[int, int]:
        """The counters whose `keep`, and those whose `goal`, holds in a letter (the hidden ones are all there)."""
        facts = self._facts.get(letter)
        if facts is None:
            holds = self.guards.holds
            keep = sum(1 << i for i, guard in enumerate(self._keep) if holds(guard, letter))
            goal = sum(1 << i for i, guard in enumerate(self._goal) if holds(guard, letter))
            facts = self._facts[letter] = (keep, goal)
        return facts

    def watched(self, i: int) -> tuple[Guard, Guard]:
        """The letters in which the operands of counter `i` hold, as far as these show it: `keep` and `goal`."""
        return self._keep[i], self._goal[i]

    @property
    def tick_bit(self) -> int:
        """The bit of TICK in letters."""
        return self._tick

    def least(self, states: Collection[int]) -> frozenset[int]:
        """`states` without those that another one simulates."""
        by_state: dict[int, list[tuple[int, Levels]]] = {}
        for number in states:
            here, levels = self.states[number]
            self._keep_best(by_state.setdefault(here, []), (0, levels))
        return frozenset(self._numbers[here, levels] for here, found in by_state.items() for _, levels in found)

    def _keep_best(self, found: list[tuple[int, Levels]], new: tuple[int, Levels]) -> None:
        """Add an (acceptance, levels) to others that lead to the same state, unless one of them is as good."""
        if not any(self._as_good(old, new) for old in found):
            found[:] = [old for old in found if not self._as_good(new, old)]
            found.append(new)

    def _as_good(self, a: tuple[int, Levels], b: tuple[int, Levels]) -> bool:
        """`a` demands no more than `b`, and has what `b` has of acceptance."""
        lower = b[0] & ~a[0] == 0 and all(x <= y for x, y in zip(a[1], b[1], strict=True))
        return lower and not any(a[1][i] & ~b[1][i] for i in self._delays)


def _hidden_bit(operand: Formula, bits: Mapping[str, int], shown: int) -> int:
    """The bit of an operand that is a hidden atom; 0: it is a state formula over the visible ones."""
    return bits[operand.key] & ~shown if operand.op == "atom" else 0


MAX_LOOKED = 3_000
"""States among which those without an accepted word are looked for."""
MAX_WORK = 60_000
"""Transitions that are taken for that."""


class CountingMonitor(SubsetReader):
    """The reader of an automaton with counters.

    States from which no word is accepted are left out when the automaton is small: bad prefixes are then found at their
    shortest. Otherwise some are found later, those of a safety property all the same: a word without a run of an
    automaton without acceptance sets has a prefix without one (König's lemma).
    """

    def __init__(self, counting: Counting) -> None:
        super().__init__(counting)
        self._counting = counting
        self._live = None if counting.is_empty else live_states(counting)
        self.exact = counting.is_empty or self._live is not None
        """Whether every bad prefix is found at its shortest."""

    def _left(self, states: set[int]) -> frozenset[int]:
        return self._counting.least(states if self._live is None else states & self._live)


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

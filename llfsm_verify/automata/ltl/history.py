"""The past of state formulas, remembered beside an automaton of the future: in one bit for each operator, and for those
with a bound in a counter, and in as many bits as there are steps or cycles before the bound begins."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

from llfsm_verify.automata.automaton import Automaton, AutomatonTooLarge
from llfsm_verify.automata.boolean import Guard, Guards
from llfsm_verify.automata.omega.moves import Moves
from llfsm_verify.automata.omega.products import explore
from llfsm_verify.logic.bounds import HIDDEN, TICK, Clock, rebuilt, step_bound, time_bound
from llfsm_verify.logic.formula import (
    BOOLEAN,
    BOUNDED_PAST,
    FALSE,
    PAST,
    PAST_STEPS,
    TRUE,
    Formula,
    apply,
    atom,
    atoms,
    conjunction,
    disjunction,
    is_boolean,
    mapped,
    negation,
    postorder,
)

MAX_STATES = 4_000
MAX_EDGES = 100_000
"""Of an automaton with what is remembered written out, besides the states of counters."""
MAX_TICKS = 12_000
"""The largest sum of the bounds of counters that are written out."""
MAX_MADE = 4_000_000
"""States that are made when they are asked for."""

Remembered = tuple[int, ...]
"""What is remembered, by memory."""
Cases = list[tuple[Formula, int]]
"""Letters of which one of the state formulas holds, and what is remembered after them."""


@dataclass(frozen=True, slots=True)
class Memory:
    """A past operator over state formulas, whose atoms are visible ones and those of memories before it.

    It is remembered whether it held (`Y`, `Z`: whether the operand did) in the letter before.
    """

    atom: Formula
    node: Formula

    @property
    def first(self) -> int:
        """What is remembered before the first letter."""
        return int(self.node.op in ("Z", "H", "T"))

    @property
    def last(self) -> int:
        """The bit that `Y` and `Z` tell."""
        return 0

    def now(self, before: int, args: Sequence[Formula]) -> Formula:
        """Whether it holds in a letter: a state formula, given what is remembered and what the operands are."""
        a, b = args[0], args[-1]
        match self.node.op:
            case "Y" | "Z":
                return TRUE if before >> self.last & 1 else FALSE
            case "O":
                return TRUE if before else a
            case "H":
                return a if before else FALSE
            case "S":
                return disjunction((b, a)) if before else b
            case _:
                return b if before else conjunction((b, a))

    def after(self, before: int, args: Sequence[Formula]) -> Cases:
        """What is remembered after a letter, given the same."""
        holds = args[0] if self.node.op in ("Y", "Z") else self.now(before, args)
        return [(holds, 1), (negation(holds), 0)]


@dataclass(frozen=True, slots=True)
class Since(Memory):
    """`node`, `keep S goal`, with at most `ticks` steps or periods since the goal: `passes` holds where one ends.

    It is remembered how many had ended before the next letter, and one more; 0: too many, or there was no goal.
    """

    ticks: int
    passes: Formula

    def after(self, before: int, args: Sequence[Formula]) -> Cases:
        keep, goal = args
        no_goal = negation(goal)
        cases = [(goal, 1), (conjunction((no_goal, keep)), before), (conjunction((no_goal, negation(keep))), 0)]
        ended = [(case, level + 1 if 0 < level <= self.ticks else 0) for case, level in cases]
        stays = [] if self.passes is TRUE else [(conjunction((c, negation(self.passes))), n) for c, n in cases]
        return [*stays, *((conjunction((case, self.passes)), level) for case, level in ended)]


@dataclass(frozen=True, slots=True)
class Delay(Memory):
    """Whether the operand of `node` held in the last letter of the step or period that lies `ticks` back.

    Bit i remembers it of the one that ended i steps or periods before.
    """

    ticks: int
    passes: Formula

    @property
    def last(self) -> int:
        return self.ticks - 1

    def after(self, before: int, args: Sequence[Formula]) -> Cases:
        shifted = before << 1 & (1 << self.ticks) - 1
        ended = [(conjunction((self.passes, args[0])), shifted | 1)]
        ended.append((conjunction((self.passes, negation(args[0]))), shifted))
        return [*ended, *([] if self.passes is TRUE else [(negation(self.passes), before)])]


def memories_of(
    formula: Formula, visible: Collection[str], clock: Clock | None = None
) -> tuple[Formula, tuple[Memory, ...]]:
    """`formula` with atoms in place of its past operators over state formulas of `visible` atoms, and these.

    Past operators over formulas of the future stay. `clock`: what bounds in time mean, whose TICK is then visible.
    """
    done: dict[Formula, Formula] = {}
    found = _Found(visible)
    for node in postorder(formula):
        args = tuple(done[a] for a in node.args)
        same = negation(args[0]) if node.op == "not" else rebuilt(node, args)
        if node.op in PAST and found.knows(args):
            done[node] = found.add(same) if node.op not in BOUNDED_PAST else found.add_bounded(same, clock)
        else:
            done[node] = same
    return done[formula], tuple(found.memories.values())


class _Found:
    def __init__(self, visible: Collection[str]) -> None:
        self._known = set(visible)
        self.memories: dict[tuple[Formula, tuple[int, Formula] | None], Memory] = {}

    def knows(self, args: Sequence[Formula]) -> bool:
        """These are state formulas over what letters, or memories before, show."""
        return all(is_boolean(a) and self._known.issuperset(atoms(a)) for a in args)

    def add(self, node: Formula, count: tuple[int, Formula] | None = None) -> Formula:
        """The atom of the memory of `node`. `count`: of `S` with at most so many ticks, of `Y` with so many, and what
        holds where a tick ends."""
        if (node, count) not in self.memories:
            now = atom(f"{HIDDEN}memory{len(self.memories)}")
            self._known.add(now.key)
            made = Memory(now, node) if count is None else (Since if node.op == "S" else Delay)(now, node, *count)
            self.memories[node, count] = made
        return self.memories[node, count].atom

    def add_bounded(self, node: Formula, clock: Clock | None) -> Formula:
        """What a bounded operator is by memories: `a S[l:u] b` is `a S[0:u-l] b`, l ticks back, and a in those since.

        `H` and `T` are the duals, and `O` is `true S`.
        """
        if node.op in PAST_STEPS:
            (least, most), passes = step_bound(node), TRUE
            last: int | None = most
        else:
            assert clock is not None, "the caller has a clock for bounds in time"
            (least, last), passes = clock.ticks(time_bound(node.key)), atom(TICK)
        dual = node.op[0] in "HT"
        args = [negation(a) if dual else a for a in node.args]
        keep, goal = TRUE if len(args) == 1 else args[0], args[-1]
        result = FALSE
        if last is None or last >= least:
            result = self.add(apply("S", keep, goal), None if last is None else (last - least, passes))
            if least:
                result = self.add(apply("Y", result), (least, passes))
                if keep is not TRUE:
                    broken = self.add(apply("S", TRUE, negation(keep)), (least - 1, passes))
                    result = conjunction((negation(broken), result))
        return negation(result) if dual else result


def guess_future(formula: Formula) -> tuple[Formula, tuple[str, ...]]:
    """`formula` with atoms for those operands of bounded past operators that look ahead, and their keys.

    The result is true for the one right choice of these exactly when `formula` is.
    """
    done: dict[Formula, Formula] = {}
    guessed: dict[Formula, Formula] = {}
    ahead: set[Formula] = set()
    for node in postorder(formula):
        args = tuple(done[a] for a in node.args)
        if node.op in BOUNDED_PAST:
            for a, now in zip(node.args, args, strict=True):
                if a in ahead:
                    guessed.setdefault(now, atom(f"{HIDDEN}ahead{len(guessed)}"))
            args = tuple(guessed[now] if a in ahead else now for a, now in zip(node.args, args, strict=True))
        elif node.op not in BOOLEAN | PAST or any(a in ahead for a in node.args):
            ahead.add(node)
        done[node] = negation(args[0]) if node.op == "not" else rebuilt(node, args)
    laws = (apply("G", apply("iff", now, meant)) for meant, now in guessed.items())
    return conjunction((done[formula], *laws)), tuple(now.key for now in guessed.values())


def remembering(automaton: Automaton, memories: Sequence[Memory], kept: int) -> Automaton:
    """The automaton over the first `kept` atoms of the words whose letters, with what `memories` say of the letters up
    to there, `automaton` accepts. Its last atoms are those of `memories`.

    AutomatonTooLarge: more than `MAX_STATES` states or `MAX_EDGES` transitions, besides two and eight for each tick of
    a counter, or more than `MAX_TICKS` of these.
    """
    ticks = counted(memories)
    if ticks > MAX_TICKS:
        raise AutomatonTooLarge("ticks of counters", MAX_TICKS)
    guards = Guards(automaton.atoms[:kept])
    pasts = _Pasts(guards, memories)
    shown = (1 << kept) - 1
    places = [automaton.atoms.index(m.atom.key) for m in memories]
    if automaton.is_empty:
        return Automaton(automaton.atoms[:kept], (), automaton.acceptance_sets)

    def following(node: tuple[int, Remembered]) -> Iterator[tuple[int, int, tuple[int, Remembered], int]]:
        now, regions = pasts.of(node[1])
        for edge in automaton.edges[node[0]]:
            label = guards.cube(edge.positive & shown, edge.negative & shown)
            for place, holds in zip(places, now, strict=True):
                if edge.positive >> place & 1:
                    label = label & holds
                elif edge.negative >> place & 1:
                    label = label & ~holds
            for region, after in regions:
                for positive, negative in guards.cubes(label & region):
                    yield positive, negative, (edge.target, after), edge.acceptance

    first = (0, tuple(m.first for m in memories))
    return explore(
        first,
        following,
        automaton.atoms[:kept],
        automaton.acceptance_sets,
        MAX_STATES + 2 * ticks,
        MAX_EDGES + 8 * ticks,
    )


def counted(memories: Sequence[Memory]) -> int:
    """The sum of the bounds of counters."""
    return sum(memory.ticks for memory in memories if isinstance(memory, Since))


class Remembering:
    """The automaton of `remembering`, whose states are made when they are asked for: the protocol `Lazy`."""

    def __init__(self, automaton: Automaton, memories: Sequence[Memory], kept: int) -> None:
        self._guards = Guards(automaton.atoms[:kept])
        self._pasts = _Pasts(self._guards, memories)
        self._moves = Moves(automaton)
        self._places = [1 << automaton.atoms.index(m.atom.key) for m in memories]
        self.acceptance_sets = automaton.acceptance_sets
        self.is_empty = automaton.is_empty
        self.relevant = (1 << kept) - 1
        self._states: list[tuple[int, Remembered]] = [(0, tuple(m.first for m in memories))]
        self._numbers = {self._states[0]: 0}

    def __call__(self, state: int, letter: int) -> tuple[tuple[int, int], ...]:
        """(acceptance, target) of each move from `state`. AutomatonTooLarge: there are too many states."""
        here, before = self._states[state]
        now, regions = self._pasts.of(before)
        holds = self._guards.holds
        after = next(after for region, after in regions if holds(region, letter))
        letter |= sum(place for place, true in zip(self._places, now, strict=True) if holds(true, letter))
        return tuple((acceptance, self._number((target, after))) for acceptance, target in self._moves(here, letter))

    def _number(self, node: tuple[int, Remembered]) -> int:
        number = self._numbers.setdefault(node, len(self._states))
        if number == len(self._states):
            if number >= MAX_MADE:
                raise AutomatonTooLarge("states", MAX_MADE)
            self._states.append(node)
        return number


class _Pasts:
    """What each letter means, by what is remembered."""

    def __init__(self, guards: Guards, memories: Sequence[Memory]) -> None:
        self._guards = guards
        self._memories = memories
        self._known: dict[Remembered, tuple[list[Guard], list[tuple[Guard, Remembered]]]] = {}

    def of(self, before: Remembered) -> tuple[list[Guard], list[tuple[Guard, Remembered]]]:
        """The letters in which each memory's operator holds, and all letters by what is remembered after them."""
        known = self._known.get(before)
        if known is None:
            known = self._known[before] = self._of(before)
        return known

    def _of(self, before: Remembered) -> tuple[list[Guard], list[tuple[Guard, Remembered]]]:
        values: dict[Formula, Formula] = {}
        now: list[Guard] = []
        regions: dict[Remembered, Guard] = {(): self._guards.always}
        for memory, level in zip(self._memories, before, strict=True):
            args = [_with(a, values) for a in memory.node.args]
            value = memory.now(level, args)
            values[memory.atom] = value
            now.append(self._guards.of(value))
            cases = [(self._guards.of(case), after) for case, after in memory.after(level, args)]
            parts = [((*so_far, after), region & case) for so_far, region in regions.items() for case, after in cases]
            regions = {}
            for after_all, part in parts:
                if part:
                    regions[after_all] = regions[after_all] | part if after_all in regions else part
        return now, [(region, after) for after, region in regions.items()]


def _with(formula: Formula, values: dict[Formula, Formula]) -> Formula:
    """A state formula with these formulas in place of atoms."""
    return mapped(formula, lambda node, _: values.get(node))

"""Which variables of a step program can still be seen: backward liveness over the turns of each process.

A variable is live at the beginning of a step when some run from there reads it before it is written as a whole. The
nodes are the slots of a process with the states of their machines; every block is summed up once, as what it reads
before it writes and what it writes on every way through it, and only the sums are iterated. Source: G. Kildall, A
unified approach to global program optimization, POPL 1973. Sets are masks over `names`.

Told apart are scalars that only one process reads and writes (letters are part of every process). All others count as
live everywhere, and so do turns, states, and what a user stores for nothing to read: to leave that out is the business
of the cone of influence, where there are properties.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import reduce
from operator import or_

from llfsm_verify.program.dependence import Uses, blocks, uses
from llfsm_verify.program.outcomes import constants
from llfsm_verify.program.program import (
    Block,
    Const,
    Emit,
    Get,
    If,
    Int,
    Program,
    Set,
    Stmt,
    Switch,
)
from llfsm_verify.program.trees import branches, expressions, statements


@dataclass(frozen=True, slots=True)
class Sum:
    """What a block does to variables: reads before it writes them, writes on every way, touches at all."""

    reads: int = 0
    kills: int = 0
    touches: int = 0

    def before(self, after: int) -> int:
        """What is live before the block, of what is live after it."""
        return self.reads | (after & ~self.kills)


@dataclass(frozen=True, slots=True)
class Turns:
    """What is live around the steps of one slot."""

    live: tuple[int, ...]
    """At the beginning of a step, by the state that is current then."""
    after: tuple[int, ...]
    """After a step in whose block the machine was in that state, unless the process has ended."""
    own: int
    """The variables of this slot alone, which are told apart by states; all others are by turns."""
    touched: int
    """What is live at the beginning of some step of the slot, or touched in one."""
    following: tuple[int, ...]
    """The slots that may have the next turn of the process."""

    @property
    def anywhere(self) -> int:
        """What is live at the beginning of some step."""
        return reduce(or_, self.live, 0)


def used_by(s: Stmt) -> Uses:
    """What a statement itself reads."""
    return uses(*(s.args if isinstance(s, Emit) else expressions(s)))


class Liveness:
    """The analysis of one program; time and memory are about linear in its size."""

    def __init__(self, program: Program) -> None:
        self.program = program
        fixed = {slot.state for slot in program.slots} | {p.turn for p in program.processes}
        fixed |= {p.ended for p in program.processes if p.ended is not None}
        read = {name for block, _ in blocks(program) for s in statements(block) for name in used_by(s).variables}
        self.names = tuple(
            v.name
            for v in program.vars
            if not (v.output or v.length is not None or v.name in fixed or _is_single(v.type))
            and (v.name in read or v.origin.kind in ("input", "control"))
        )
        self.bits: Mapping[str, int] = {name: 1 << i for i, name in enumerate(self.names)}
        self.all = (1 << len(self.names)) - 1
        self._sums: dict[tuple[int, int | None], Sum] = {}
        self.letter = self.sum(program.letter)
        self.shared = self._shared()
        """Variables that are live everywhere, because several processes touch them."""
        self.turns: dict[int, Turns] = {}
        for index in range(len(program.processes)):
            self.turns |= self._process(index)

    def mask(self, names: Iterable[str]) -> int:
        """The variables of these names that are told apart."""
        return reduce(or_, (self.bits.get(name, 0) for name in names), 0)

    def listed(self, mask: int) -> Iterator[str]:
        """The names in a mask, in the order of the program."""
        while mask:
            lowest = mask & -mask
            yield self.names[lowest.bit_length() - 1]
            mask ^= lowest

    @property
    def start(self) -> int:
        """What an initial configuration shows, or a run from there can see."""
        seen = self.mask(name for atom in self.program.atoms for name in uses(atom.expression).variables)
        for process in self.program.processes:
            turn = next(v.init for v in self.program.vars if v.name == process.turn)
            assert isinstance(turn, int)
            seen |= self.turns[process.slots[turn]].anywhere
            for slot in process.slots:
                seen |= self.turns[slot].anywhere & self.turns[slot].own
        return seen | self.shared

    # -------------------------------------------------- blocks

    def sum(self, block: Block, cycle: int | None = None) -> Sum:
        """The sum of a block; `cycle`: what the output `cycle` is while it runs, where that is known."""
        found = self._sums.get((id(block), cycle))
        if found is None:
            found = self._sums[id(block), cycle] = self._summed(block, cycle)
        return found

    def _summed(self, block: Block, cycle: int | None) -> Sum:
        reads = kills = touches = 0
        for s in reversed(block):
            if isinstance(s, (If, Switch)):
                taken = self._taken(s, cycle)
                parts = [self._summed(b, cycle) for b in taken]
                inner = reduce(or_, (p.reads for p in parts), 0)
                both = parts[0].kills if parts else 0
                for p in parts:
                    both &= p.kills
                    touches |= p.touches
                reads, kills = inner | (reads & ~both), kills | both
            elif isinstance(s, Set) and s.index is None:
                stored = self.bits.get(s.var, 0)
                reads, kills, touches = reads & ~stored, kills | stored, touches | stored
            read = self.mask(used_by(s).variables)
            reads, touches = reads | read, touches | read
        return Sum(reads, kills, touches)

    def _taken(self, s: If | Switch, cycle: int | None) -> tuple[Block, ...]:
        """The branches that may be taken."""
        if isinstance(s, If) and cycle is not None and s.condition == Get(self.program.cycle, None, s.condition.type):
            return (s.then,) if cycle else (s.otherwise,)
        if isinstance(s, Switch) and isinstance(s.value.type, Int):
            kind = s.value.type
            if {number for number, _ in s.cases} >= set(range(kind.low, min(kind.high, kind.low + len(s.cases)) + 1)):
                return tuple(b for _, b in s.cases)
        return branches(s)

    def _shared(self) -> int:
        """What is touched by more than one process, letters included where there are several."""
        seen = self.letter.touches if len(self.program.processes) > 1 else 0
        shared = seen
        for process in self.program.processes:
            own = self.sum(process.epilogue).touches
            for i in process.slots:
                own |= self.slot_touches(i)
            shared |= own & seen
            seen |= own
        return shared

    def slot_touches(self, index: int) -> int:
        """What the blocks of a slot touch."""
        slot = self.program.slots[index]
        every = (slot.prologue, *slot.blocks, slot.epilogue, slot.canonical)
        return reduce(or_, (self.sum(b).touches for b in every), 0)

    # -------------------------------------------------- turns

    def _process(self, index: int) -> dict[int, Turns]:
        process = self.program.processes[index]
        elsewhere = self._stored_elsewhere(index)
        parts = [_Part(self, i, elsewhere) for i in process.slots]
        common = self.sum(process.epilogue).touches | self.letter.touches
        for part in parts:
            others = reduce(or_, (p.touches for p in parts if p is not part), 0)
            if len(parts) > 1:
                others |= common
            part.own = part.touches & ~others & ~self.shared if part.keeps_state else 0
            if not part.keeps_turn:
                part.following = tuple(process.slots)
        by_slot = {part.index: part for part in parts}
        changed = True
        while changed:
            changed = False
            for part in reversed(parts):
                following = reduce(or_, (by_slot[j].anywhere for j in part.following), 0)
                changed |= part.update(following | self.shared)
        return {
            part.index: Turns(
                tuple(live | self.shared for live in part.live), tuple(part.after), part.own,
                part.touches | part.anywhere, part.following,
            )
            for part in parts
        }  # fmt: skip

    def _stored_elsewhere(self, index: int) -> dict[str, set[int]]:
        """For states and turns, the slots that store them (-1: something that is not one of the process's slots)."""
        program = self.program
        found: dict[str, set[int]] = {}
        asked = {slot.state for slot in program.slots} | {p.turn for p in program.processes}
        for number, slot in enumerate(program.slots):
            for block in (slot.prologue, *slot.blocks, slot.epilogue, slot.canonical):
                for s in statements(block):
                    if isinstance(s, Set) and s.var in asked:
                        found.setdefault(s.var, set()).add(number if slot.process == index else -1)
        for block in (program.letter, program.letter_stutter, *(p.epilogue for p in program.processes)):
            for s in statements(block):
                if isinstance(s, Set) and s.var in asked:
                    found.setdefault(s.var, set()).add(-1)
        return found


class _Part:
    """One slot while its process is analysed."""

    def __init__(self, whole: Liveness, index: int, stored: Mapping[str, set[int]]) -> None:
        program = whole.program
        slot = program.slots[index]
        process = program.processes[slot.process]
        self.index = index
        states = range(len(slot.blocks))
        cycle = _last_constant(slot.epilogue, program.cycle)
        letter = whole.sum(program.letter, cycle)
        self._tail = [
            whole.sum(slot.epilogue), whole.sum(process.epilogue, cycle), whole.sum(slot.canonical), letter
        ]  # fmt: skip
        self._blocks = [whole.sum(b) for b in slot.blocks]
        self._prologue = whole.sum(slot.prologue)
        self.touches = whole.slot_touches(index)
        self.own = 0
        self.keeps_state = stored.get(slot.state, set()) <= {index}
        self.keeps_turn = -1 not in stored.get(process.turn, set())
        turns = _stored((slot.prologue, *slot.blocks, slot.epilogue, slot.canonical), process.turn)
        if turns is None or not turns or not turns <= set(range(len(process.slots))):
            self.following = tuple(process.slots)
        else:
            self.following = tuple(process.slots[t] for t in sorted(turns))
        self._commanded = _states((slot.prologue,), slot.state, states)
        late = _states((slot.epilogue, slot.canonical), slot.state, states)
        self._ends = [{q} | late | _states((b,), slot.state, states) for q, b in enumerate(slot.blocks)]
        self.live = [0] * len(slot.blocks)
        self.after = [0] * len(slot.blocks)
        self.anywhere = 0

    def update(self, following: int) -> bool:
        """Take in what is live at the beginning of the next turns; whether anything has changed."""
        inside: list[int] = []
        for state, ends in enumerate(self._ends):
            own = reduce(or_, (self.live[q] for q in ends), 0) & self.own
            live = self.after[state] = own | (following & ~self.own)
            for tail in reversed(self._tail):
                live = tail.before(live)
            inside.append(self._blocks[state].before(live))
        before = self.live
        self.live = [
            self._prologue.before(reduce(or_, (inside[q] for q in {state} | self._commanded), 0))
            for state in range(len(inside))
        ]
        self.anywhere = reduce(or_, self.live, 0)
        return before != self.live


def _is_single(kind: object) -> bool:
    return isinstance(kind, Int) and kind.low == kind.high


def _stored(blocks: Iterable[Block], name: str) -> set[int] | None:
    """The values that blocks may store into a variable; None: they are not constants."""
    found: set[int] = set()
    for block in blocks:
        for s in statements(block):
            if isinstance(s, Set) and s.var == name:
                values = constants(s.value)
                if values is None:
                    return None
                found |= values
    return found


def _states(blocks: Iterable[Block], name: str, states: range) -> set[int]:
    found = _stored(blocks, name)
    return set(states) if found is None else found & set(states)


def _last_constant(block: Block, name: str) -> int | None:
    """What a block leaves in a variable, where that is always the same."""
    for s in reversed(block):
        if isinstance(s, Set) and s.var == name:
            return s.value.value if isinstance(s.value, Const) else None
        if isinstance(s, (If, Switch)) and any(isinstance(t, Set) and t.var == name for t in statements((s,))):
            return None
    return None

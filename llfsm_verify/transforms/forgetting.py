"""A step program without dead values, in which choices are sampled where they are first needed.

After the letter of a step a scalar that is dead (`program.liveness`) gets its `init`, unless its process has ended. A
choice that is only stored into such a scalar (an input that is held, `choose(…)` in the model of the surroundings) is
sampled before the first statement of the step that needs it, on each way, and not at all on ways without one. If the
first slot that can see it is a later one, which no cycle skips, then that slot samples it.

Why it is exact: two configurations that differ in dead variables only have the same steps, letters and faults, which
lead to such pairs again: they are bisimilar, and one stands for both. A value that is drawn later is the same in each
statement that reads it. Kept: letters in their order, faults, overflows, fair runs, and so all verdicts. Not kept:
values that nothing sees. Only traces show them, and those are performed with all bits (`Forgetting.whole`).
Sources: `program.liveness`; J. Knoop, O. Rüthing and B. Steffen, Partial dead code elimination, PLDI 1994, whose
sinking of assignments this is for assignments of choices.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from itertools import count
from operator import or_

from llfsm_verify.program.dependence import uses
from llfsm_verify.program.liveness import Liveness, used_by
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import (
    BOOL,
    Block,
    Emit,
    Expr,
    Fault,
    If,
    Ite,
    Let,
    Local,
    Op,
    Program,
    Sample,
    Set,
    Slot,
    Stmt,
    Switch,
)
from llfsm_verify.program.terms import FALSE, TRUE, const, get, may_overflow, op
from llfsm_verify.program.trees import branches, distinct_nodes, statements, with_branches

MOST_NODES = 300
"""Of an expression that is taken apart to draw less."""


@dataclass(frozen=True, slots=True)
class Forgetting:
    """A program without dead values. `late`: the choices of it that are drawn late, and of which process those are
    that another slot draws than the one that begins the cycle."""

    program: Program
    late: frozenset[str] = frozenset()
    moved: Mapping[str, int] = field(default_factory=dict)

    def whole(self, moves: Sequence[Move], loop: int | None) -> tuple[Move, ...]:
        """The moves of the program with all bits: a value that a later slot drew is given where its cycle began, and
        what no step needed has its lowest value.

        A slot draws at most once in a cycle, and not before it begins, so what a cycle saw is the next value drawn from
        its beginning on; of a lasso, in the order in which its moves come. A cycle that needed none has that value as
        well: fewer changes show.
        """
        if not self.late:
            return tuple(moves)
        lowest = {c.name: c.type.low for c in self.program.choices if c.name in self.late}
        following: dict[str, int] = {}

        def extended(move: Move) -> Move:
            mine = [name for name, process in self.moved.items() if process == move.process]
            following.update({name: move.choices[name] for name in mine if name in move.choices})
            given = {name: following[name] for name in mine if name in following}
            return Move(move.process, {**lowest, **move.choices, **given})

        for move in reversed(moves[loop:] if loop is not None else ()):
            extended(move)  # what follows the end of the loop
        return tuple(extended(move) for move in reversed(moves))[::-1]


def forgetting(program: Program) -> Forgetting:
    """The program without dead values, which may be the same one. Time is about linear in its size."""
    return _Forgetter(program).made()


# ---------------------------------------------------------------- draws that a later slot makes


def _moved(program: Program, live: Liveness) -> tuple[Program, dict[str, int]]:
    """Draws that the first slot of each cycle makes, in the first slot that can see them; by choice, its process."""
    slots = list(program.slots)
    moved: dict[str, int] = {}
    for number, process in enumerate(program.processes):
        chain = [process.slots[0]]
        while len(chain) < len(process.slots) and live.turns[chain[-1]].following == (process.slots[len(chain)],):
            chain.append(process.slots[len(chain)])
        if len(chain) == 1:
            continue
        around = live.shared | live.sum(process.epilogue).touches
        around |= live.letter.touches if program.observe == "ringlet" else 0  # else only the last slot has one
        first = slots[chain[0]]
        often = Counter(_touched(first))
        samples = {s.local.name: s for s in first.prologue if isinstance(s, Sample)}
        pairs: dict[int, list[Stmt]] = {}
        for name, store in _drawn(first.prologue).items():
            bit = live.bits.get(store.var, 0) & ~around
            target = next((k for k in chain[1:] if live.slot_touches(k) & bit), None)
            if target is not None and often[store.var] == 1 and name in samples and store in first.prologue:
                pairs.setdefault(target, []).extend((samples[name], store))
                moved[samples[name].choice] = number
        gone = {s for pair in pairs.values() for s in pair}
        left = tuple(s for s in first.prologue if s not in gone)
        slots[chain[0]] = replace(first, prologue=left)
        for target, pair in pairs.items():
            slots[target] = replace(slots[target], prologue=(*pair, *slots[target].prologue))
    return (replace(program, slots=tuple(slots)) if moved else program), moved


def _drawn(block: Block) -> dict[str, Set]:
    """Where each local of a block is stored that is sampled in one place and read in one, to be stored."""
    inside = list(statements(block))
    if not any(isinstance(s, Sample) for s in inside):
        return {}
    places = Counter(s.local.name for s in inside if isinstance(s, (Sample, Let)))
    reads = Counter(name for s in inside for name in used_by(s).locals)
    sampled = {s.local.name for s in inside if isinstance(s, Sample)}
    stores = ((s.value.name, s) for s in inside if isinstance(s, Set) and isinstance(s.value, Local))
    return {n: s for n, s in stores if n in sampled and s.index is None and places[n] == reads[n] == 1}


def _touched(slot: Slot) -> Iterator[str]:
    """The variables that the statements of a slot store and read, with repetitions."""
    for block in (slot.prologue, *slot.blocks, slot.epilogue, slot.canonical):
        for s in statements(block):
            yield from used_by(s).variables
            if isinstance(s, Set):
                yield s.var


# ---------------------------------------------------------------- draws where they are needed


@dataclass(frozen=True, slots=True)
class _Draw:
    """A variable that holds the value of a choice, which is to be sampled. `stored`: on each way to here it is."""

    var: str
    local: Local
    choice: str
    stored: bool = False

    @property
    def block(self) -> Block:
        return Sample(self.local, self.choice), Set(self.var, None, self.local)


_Pending = dict[str, _Draw]


class _Sinking:
    """Moves draws towards their uses, in blocks that run one after another."""

    def __init__(self, program: Program, able: Collection[str], numbers: Iterator[int]) -> None:
        self._choices = {c.name: c for c in program.choices}
        self._able = able
        self._numbers = numbers
        self._open: dict[str, str] = {}
        self.pending: _Pending = {}
        """By variable, what is to be drawn after what was sunk so far."""
        self.late: set[str] = set()
        """Choices that were sampled earlier."""
        self.tried: set[str] = set()
        """Variables that are drawn on some way."""

    def block(self, block: Block) -> Block:
        """A block, in which nothing is drawn before it is needed."""
        drawn = {name: store for name, store in _drawn(block).items() if store.var in self._able}
        return self._sunk(block, drawn) if drawn or self.pending else block

    def settle(self, names: Iterable[str]) -> Block:
        """What draws these variables now, where they are not drawn yet; they are pending no more."""
        draws = [self.pending.pop(name) for name in sorted(names) if name in self.pending]
        return tuple(s for draw in draws if not draw.stored for s in draw.block)

    def _sunk(self, block: Block, drawn: Mapping[str, Set]) -> Block:
        out: list[Stmt] = []
        for s in block:
            if isinstance(s, Sample) and s.local.name in drawn:
                self.late.add(s.choice)
                self._open[s.local.name] = s.choice
            elif isinstance(s, Set) and isinstance(s.value, Local) and drawn.get(s.value.name) is s:
                choice = self._choices[self._open[s.value.name]]
                self.pending[s.var] = _Draw(s.var, Local(f"$late.{s.var}", choice.type), choice.name)
            else:
                self._statement(s, drawn, out)
        return tuple(out)

    def _statement(self, s: Stmt, drawn: Mapping[str, Set], out: list[Stmt]) -> None:
        """What a statement becomes, after what it needs."""
        if isinstance(s, (If, Switch)):
            value = self._needed(s.condition if isinstance(s, If) else s.value, out)
            out.append(self._decision(s, value, drawn))
        elif isinstance(s, Let):
            out.append(Let(s.local, self._needed(s.value, out)))
        elif isinstance(s, Set):
            index = None if s.index is None else self._needed(s.index, out)
            out.append(Set(s.var, index, self._needed(s.value, out)))
            self.pending.pop(s.var, None)
        elif isinstance(s, Fault):
            out.append(Fault(s.fault, self._needed(s.when, out)))
        elif isinstance(s, Emit):
            out.append(Emit(s.kind, s.machine, tuple(self._needed(e, out) for e in s.args)))
        else:
            out.append(s)

    def _decision(self, s: If | Switch, value: Expr, drawn: Mapping[str, Set]) -> Stmt:
        before = self.pending
        ways: list[tuple[Block, _Pending]] = []
        for branch in branches(s):
            self.pending = dict(before)
            ways.append((self._sunk(branch, drawn), self.pending))
        parts = iter(self.joined(ways))
        s = replace(s, condition=value) if isinstance(s, If) else replace(s, value=value)
        return with_branches(s, lambda _: next(parts))

    def joined(self, ways: Sequence[tuple[Block, _Pending]]) -> list[Block]:
        """The blocks of which one runs; what is pending after one and not after another is drawn at its end."""
        common: _Pending = {}
        for var in {var: None for _, pending in ways for var in pending}:
            draws = [pending.get(var) for _, pending in ways]
            first = draws[0]
            if first is not None and all(d is not None and d.choice == first.choice for d in draws):
                common[var] = replace(first, stored=all(d is not None and d.stored for d in draws))
        found: list[Block] = []
        for block, pending in ways:
            self.pending = pending
            found.append((*block, *self.settle(pending.keys() - common.keys())))
        self.pending = common
        return found

    # -------------------------------------------------- expressions

    def _needs(self, e: Expr) -> list[_Draw]:
        """What is to be drawn for an expression."""
        names = dict.fromkeys(uses(e).variables) if self.pending else ()
        return [d for d in map(self.pending.get, names) if d is not None and not d.stored]

    def _needed(self, e: Expr, out: list[Stmt]) -> Expr:
        """An expression with the same value; what draws for it is added to `out`: nothing that it does not need."""
        draws = self._needs(e)
        if not draws:
            return e
        if isinstance(e, (Op, Ite)) and not may_overflow(e) and sum(1 for _ in distinct_nodes(e)) <= MOST_NODES:
            if isinstance(e, Ite):
                return self._chosen(self._needed(e.condition, out), e.then, e.otherwise, e, out)
            if e.op in ("and", "or"):
                first, second = sorted(e.args, key=lambda a: len(self._needs(a)))
                left = self._needed(first, out)
                if not self._needs(second):
                    return op(e.op, left, second)
                then, otherwise = (second, FALSE) if e.op == "and" else (TRUE, second)
                return self._chosen(left, then, otherwise, e, out)
        for draw in draws:
            out += draw.block
            self.tried.add(draw.var)
            self.pending[draw.var] = replace(draw, stored=True)
        return e

    def _chosen(self, condition: Expr, then: Expr, otherwise: Expr, whole: Expr, out: list[Stmt]) -> Expr:
        """One of two values, of which only that is drawn for which is chosen."""
        if not (self._needs(then) or self._needs(otherwise)):
            return Ite(condition, then, otherwise, whole.type)
        local = Local(f"$needed.{next(self._numbers)}", whole.type)
        before = self.pending
        ways: list[tuple[Block, _Pending]] = []
        for value in (then, otherwise):
            self.pending, inner = dict(before), list[Stmt]()
            inner.append(Let(local, self._needed(value, inner)))
            ways.append((tuple(inner), self.pending))
        first, second = self.joined(ways)
        out.append(If(condition, first, second))
        return local


# ---------------------------------------------------------------- the program


def while_running(ended: str, forget: Block, shown: Block) -> Block:
    """What forgets, unless a process has ended: letters go on showing what it was."""
    return (If(get(ended, BOOL), shown, forget),) if forget or shown else ()


class _Forgetter:
    def __init__(self, program: Program) -> None:
        live = Liveness(program)
        program, self._moved = _moved(program, live)
        self._program = program
        self._live = live = Liveness(program) if self._moved else live
        self._vars = {v.name: v for v in program.vars}
        self._able = frozenset(live.listed(live.all & ~live.shared))
        self._late = set(self._moved)
        self._numbers = count()

    def made(self) -> Forgetting:
        program, live = self._program, self._live
        alone = len(program.slots) == 1
        slots: list[Slot] = []
        after: list[tuple[int, Block]] = []
        letter = program.letter
        for index, slot in enumerate(program.slots):
            sinking = _Sinking(program, self._able, self._numbers)
            slot = self._sunk(slot, index, sinking, last=not alone)
            if alone:
                letter = sinking.block(letter)
                ending = self._ending(index, -1, sinking.pending)
            else:
                slot = replace(slot, canonical=(*slot.canonical, *self._ending(index, ~live.letter.touches, {})))
                ending = self._ending(index, live.letter.touches, {})
            self._late |= sinking.late
            slots.append(slot)
            after += [(index + 1, ending)] if ending else []
        if after:
            ran = get(program.ran, self._vars[program.ran].type)
            letter = (*letter, *(after[0][1] if alone else (Switch(ran, tuple(after)),)))
        seen = set(live.listed(live.start))
        variables = tuple(replace(v, free=v.free and (v.name in seen or v.name not in live.bits)) for v in program.vars)
        made = replace(program, vars=variables, slots=tuple(slots), letter=letter)
        return Forgetting(made, frozenset(self._late), self._moved)

    def _sunk(self, slot: Slot, index: int, sinking: _Sinking, *, last: bool) -> Slot:
        """A slot whose blocks draw late. `last`: nothing is drawn after them."""
        live, turns = self._live, self._live.turns[index]
        prologue = sinking.block(slot.prologue)
        # Classes of values are those of the block of a state, so what was sampled before it is not sampled in it.
        prologue += sinking.settle(sinking.tried)
        before = sinking.pending
        process = self._program.processes[slot.process]
        needed = reduce(or_, (live.sum(b).touches for b in (slot.epilogue, process.epilogue, slot.canonical)))
        ways: list[tuple[Block, _Pending]] = []
        for state, block in enumerate(slot.blocks):
            sinking.pending = dict(before)
            sunk = sinking.block(block)
            wanted = needed | (live.letter.touches | turns.after[state] if last else 0)
            sunk += sinking.settle(live.listed(wanted))
            ways.append((sunk, {} if last else sinking.pending))
        return replace(slot, prologue=prologue, blocks=tuple(sinking.joined(ways)))

    def _ending(self, index: int, places: int, pending: _Pending) -> Block:
        """After a step of a slot, for the variables in `places`: what is dead is forgotten, and what is pending and can
        still be seen is drawn; in a process that has ended, all that letters go on showing."""
        live, turns = self._live, self._live.turns[index]
        slot = self._program.slots[index]
        process = self._program.processes[slot.process]
        mine = turns.touched & places & ~live.shared
        unstored = live.mask(name for name, draw in pending.items() if not draw.stored)

        def statements_of(dead: int, drawn: int) -> Block:
            forget = (Set(name, None, const(self._init(name))) for name in live.listed(dead))
            return (*forget, *(s for name in live.listed(drawn) for s in pending[name].block))

        def told(selector: str, seen: Mapping[int, int], among: int) -> Block:
            dead, drawn = among, among & unstored
            for mask in seen.values():
                dead, drawn = dead & ~mask, drawn & mask
            rest = [(key, statements_of(among & ~m & ~dead, unstored & m & among & ~drawn)) for key, m in seen.items()]
            cases = tuple((key, block) for key, block in rest if block)
            by_key = (Switch(get(selector, self._vars[selector].type), cases),) if cases else ()
            return (*statements_of(dead, drawn), *by_key)

        by_turn = {process.slots.index(j): live.turns[j].anywhere for j in turns.following}
        body = told(process.turn, by_turn, mine & ~turns.own) + told(
            slot.state, dict(enumerate(turns.live)), mine & turns.own
        )
        shown = statements_of(0, unstored & live.sum(self._program.letter_stutter).touches)
        return body if process.ended is None else while_running(process.ended, body, shown)

    def _init(self, name: str) -> int:
        init = self._vars[name].init
        assert isinstance(init, int), "arrays are not told apart"
        return init

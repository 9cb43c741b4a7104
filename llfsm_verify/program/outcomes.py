"""What the outcome of a step depends on: terms over the choices it reads, and over variables as they are before.

Two valuations of the choices of a ringlet that give all terms the same values have the same outcome: the same
successor, letter, fault, and the same leaving of 64 bits.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from llfsm_verify.program.program import (
    BOOL,
    INT64_MAX,
    INT64_MIN,
    Atom,
    Block,
    Const,
    Expr,
    Get,
    Int,
    Ite,
    Local,
    Op,
    Program,
    Sample,
    Set,
    Unbounded,
)
from llfsm_verify.program.symbolic import FAULT, BoundedDefinitions, Key, Values
from llfsm_verify.program.terms import const, interval, is_wide, op
from llfsm_verify.program.trees import children, distinct_nodes, nodes, spelt_out, statements

PREFIX = "?"
"""Before the name of a choice in the local that stands for it."""
MOST_NODES = 400
"""Nodes of a term, shared ones counted each time; larger ones are not looked at."""
MOST_SIDES = 64
"""Sides of nested if-then-else that one comparison is taken apart into."""
VALUE = ".$value"
"""The end of the name of outputs that keep an input's value for a letter which is shown later."""
_COMPARISONS = ("eq", "ne", "lt", "le", "gt", "ge")
_LOGIC = ("and", "or", "xor", "not")


@dataclass(frozen=True, slots=True)
class Place:
    """Where choices are sampled: the block of a state in a slot; `slot` None: the letter of a step, or of a stutter."""

    slot: int | None
    state: int
    """Of letters: 0 for that of a step, 1 for that of a stutter."""


@dataclass(frozen=True, slots=True)
class Touched:
    """A term of the outcome, totalised: a division by zero is 0 in it (a fault, of which another term tells)."""

    term: Expr
    """Over locals `PREFIX` + the name of a choice, and over variables at the beginning of the place."""
    into: str
    """A variable whose value after the step depends on it ("" for where none is known)."""

    @property
    def choices(self) -> frozenset[str]:
        return frozenset(n.name.removeprefix(PREFIX) for n in distinct_nodes(self.term) if isinstance(n, Local))

    @property
    def variables(self) -> frozenset[Get]:
        return frozenset(n for n in distinct_nodes(self.term) if isinstance(n, Get))


class TermTooLarge(Exception):
    """An outcome depends on choices by a term with too many nodes."""


def places(program: Program) -> Iterator[tuple[Place, Block]]:
    """Where a program samples: the blocks of its states, and its letters."""
    for index, slot in enumerate(program.slots):
        for state, block in enumerate(slot.blocks):
            yield Place(index, state), block
    yield Place(None, 0), program.letter
    if program.letter_stutter is not program.letter:
        yield Place(None, 1), program.letter_stutter


def sampled_in(block: Block) -> tuple[str, ...]:
    """The choices that a block samples, in the order of its text."""
    return tuple(dict.fromkeys(s.choice for s in statements(block) if isinstance(s, Sample)))


def outcome(program: Program, place: Place) -> tuple[Touched, ...]:
    """The terms of the outcome of a step, from the beginning of `place` to the end of the step.

    Raises TermTooLarge.
    """
    definitions = BoundedDefinitions({v.name: v for v in program.vars}, {c.name: c for c in program.choices})
    values = definitions.start(outputs=False)
    block: tuple[Block, ...]
    if place.slot is None:
        block = (program.letter if place.state == 0 else program.letter_stutter,)
    else:
        slot = program.slots[place.slot]
        process = program.processes[slot.process]
        values.changes |= _known(program, place)
        block = (slot.blocks[place.state], slot.epilogue, process.epilogue, slot.canonical, program.letter)
    for part in block:
        definitions.run(part, values)
    return tuple(dict.fromkeys(_Terms(program, definitions).of(values)))


def _known(program: Program, place: Place) -> dict[Key, Expr]:
    """Variables that have one value whenever the block of a state begins."""
    assert place.slot is not None
    slot = program.slots[place.slot]
    process = program.processes[slot.process]
    definitions = BoundedDefinitions({v.name: v for v in program.vars}, {c.name: c for c in program.choices})
    values = definitions.start(outputs=program.observe == "ringlet")
    values.changes[process.turn, None] = const(process.slots.index(place.slot))
    definitions.run(slot.prologue, values)
    known: dict[Key, Expr] = {
        key: value
        for key, value in values.changes.items()
        if isinstance(value, Const) and key[0] != FAULT and not key[0].startswith("%")
    }
    known[slot.state, None] = const(place.state)
    return known


class _Terms:
    """Takes the values after a step apart."""

    def __init__(self, program: Program, definitions: BoundedDefinitions) -> None:
        self._program = program
        self._made = {local.name: e for e, local in definitions.made.items()}
        self._names = {local: f"{PREFIX}{choice.name}" for local, choice in definitions.sampled.items()}
        self._atoms: Mapping[str, tuple[Expr, ...] | None] = {}
        self._depends: dict[str, bool] = dict.fromkeys(self._names, True)
        self._whole: dict[str, Expr] = {}
        self._sizes: dict[str, int] = {}
        for name, e in self._made.items():  # arguments come before what is made of them
            self._depends[name] = any(map(self._is_touched, children(e)))

    def of(self, values: Values) -> Iterator[Touched]:
        """The terms of all values after the step, and of leaving 64 bits."""
        program = self._program
        cycles = program.observe == "cycle"
        outputs = {v.name for v in program.vars if v.output}
        for (name, _), value in values.changes.items():
            if name.startswith("%") or (name in outputs and name.endswith(VALUE) and not cycles):
                continue
            into = "" if name in outputs or name == FAULT else name
            if name in outputs and name.endswith(VALUE):
                yield from self._kept(name, value)
            else:
                yield from self._terms(value, into)
        for name, e in self._made.items():
            if self._depends[name] and isinstance(e.type, Unbounded):
                for held in (e, *(a for a in children(e) if is_wide(a.type) and self._is_touched(a))):
                    yield from self._leaves(held)

    def _leaves(self, e: Expr) -> Iterator[Touched]:
        """The terms of a value's leaving 64 bits."""
        whole = self._settled(e)
        if whole is not None:
            yield Touched(op("ge", whole, const(INT64_MIN)), "")
            yield Touched(op("le", whole, const(INT64_MAX)), "")
        else:
            for argument in children(e):
                yield from self._terms(argument, "")

    def _is_touched(self, e: Expr) -> bool:
        return isinstance(e, Local) and self._depends[e.name]

    def _defined(self, e: Expr) -> Expr:
        """What a name stands for; a value that is only stored somewhere closer is itself."""
        while isinstance(e, Local) and e.name in self._made:
            e = self._made[e.name]
            if isinstance(e, Ite) and isinstance(e.condition, Const):
                e = e.then if e.condition.value else e.otherwise
        return e

    def _terms(self, root: Expr, into: str) -> Iterator[Touched]:
        todo, seen = [root], set[Expr]()
        while todo:
            name = todo.pop()
            if name in seen or not self._is_touched(name):
                continue
            seen.add(name)
            e = self._defined(name)
            own = self._own(name)
            if own is not None:
                yield Touched(own, into)
            elif isinstance(e, Ite) or (isinstance(e, Op) and (e.op in _LOGIC or _is_truth_of_truths(e))):
                todo += children(e)
            elif isinstance(e, Op) and e.op in _COMPARISONS:
                conditions, pairs = self._sides(e)
                todo += conditions
                for pair in pairs:
                    if any(map(self._is_touched, pair)):
                        left, right = (self._whole_of(side) for side in pair)
                        yield Touched(Op(e.op, (left, right), BOOL), into)
            elif isinstance(e, Op):
                whole = self._settled(e)
                if whole is not None:
                    yield Touched(whole, into)
                else:
                    todo += children(e)  # equal arguments make it equal, whatever the variables
            else:
                yield Touched(self._whole_of(e), into)

    def _own(self, name: Expr) -> Expr | None:
        """A truth that depends on one choice and on nothing else, as a whole: its parts may tell more apart than it."""
        if not (isinstance(name.type, Int) and name.type.boolean):
            return None
        try:
            whole = self._whole_of(name)
        except TermTooLarge:
            return None
        locals_ = {n.name for n in distinct_nodes(whole) if isinstance(n, Local)}
        return whole if len(locals_) == 1 and not any(isinstance(n, Get) for n in distinct_nodes(whole)) else None

    def _settled(self, e: Expr) -> Expr | None:
        """The expression as a whole when it mentions no variable, chooses between nothing, and is not too large."""
        try:
            whole = self._whole_of(e)
        except TermTooLarge:
            return None
        chooses = any(isinstance(n, (Get, Ite)) for n in distinct_nodes(whole) if not _is_guarded(n))
        return None if chooses else whole

    def _sides(self, comparison: Op) -> tuple[list[Expr], list[tuple[Expr, Expr]]]:
        """The conditions inside the sides of a comparison, and the pairs of values that it may compare."""
        conditions: list[Expr] = []
        found: list[list[Expr]] = []
        for side in comparison.args:
            leaves, todo = list[Expr](), [side]
            while todo:
                name = todo.pop()
                e = self._defined(name)
                if isinstance(e, Ite):
                    conditions.append(e.condition)
                    todo += (e.otherwise, e.then)
                else:
                    leaves.append(name)
                if len(leaves) + len(todo) > MOST_SIDES:
                    return [], [(comparison.args[0], comparison.args[1])]
            found.append(list(dict.fromkeys(leaves)))
        if len(found[0]) * len(found[1]) > MOST_SIDES:
            return [], [(comparison.args[0], comparison.args[1])]
        return conditions, [(a, b) for a in found[0] for b in found[1]]

    def _whole_of(self, e: Expr) -> Expr:
        """An expression with all names in it spelt out, and divisions made total. Raises TermTooLarge."""
        if isinstance(e, Local):
            if e.name in self._names:
                return Local(self._names[e.name], e.type)
            if e.name not in self._whole:
                self._whole[e.name] = self._spelt(self._made[e.name], e.name)
            return self._whole[e.name]
        return e if not children(e) or isinstance(e, Get) else self._spelt(e, "")

    def _spelt(self, e: Expr, name: str) -> Expr:
        args = [self._whole_of(c) for c in children(e)]
        size = 1 + sum(self._size(c, a) for c, a in zip(children(e), args, strict=True))
        if size > MOST_NODES:
            raise TermTooLarge
        self._sizes[name] = size
        if isinstance(e, Ite):
            return Ite(args[0], args[1], args[2], e.type)
        assert isinstance(e, Op)
        whole = Op(e.op, tuple(args), e.type)
        if e.op in ("div", "mod"):
            bounds = interval(args[1])
            if bounds is None or bounds[0] <= 0 <= bounds[1]:
                return Ite(op("eq", args[1], const(0)), const(0), whole, e.type)
        return whole

    def _size(self, e: Expr, whole: Expr) -> int:
        known = self._sizes.get(e.name) if isinstance(e, Local) else None
        return known if known is not None else sum(1 for _ in nodes(whole))

    def _kept(self, name: str, value: Expr) -> Iterator[Touched]:
        """An input whose value a later letter shows: what the atoms ask of it, where they ask for nothing else."""
        shown = name.removesuffix(VALUE)
        asked = _asked(self._program.atoms, f"input:{shown}")
        conditions, leaves, todo = list[Expr](), list[Expr](), [value]
        while todo:
            e = self._defined(todo.pop())
            if isinstance(e, Ite):
                conditions.append(e.condition)
                todo += (e.then, e.otherwise)
            else:
                leaves.append(e)
        for condition in conditions:
            yield from self._terms(condition, "")
        for leaf in leaves:
            if isinstance(leaf, Local) and asked is not None:
                whole = self._whole_of(leaf)
                yield from (Touched(spelt_out(question, {f"input:{shown}": whole}), "") for question in asked)
            elif self._is_touched(leaf):
                yield from self._terms(leaf, "")


def _is_truth_of_truths(e: Op) -> bool:
    """A comparison of Booleans."""
    kinds = [a.type for a in e.args]
    return e.op in _COMPARISONS and all(isinstance(k, Int) and k.boolean for k in kinds)


def _is_guarded(e: Expr) -> bool:
    """The choice that makes a division total."""
    return (
        isinstance(e, Ite) and e.then == const(0) and isinstance(e.otherwise, Op) and e.otherwise.op in ("div", "mod")
    )


def _asked(atoms: Iterable[Atom], local: str) -> tuple[Expr, ...] | None:
    """The comparisons by which atoms ask for a local; None: they ask for it together with something else."""
    found: list[Expr] = []
    for atom in atoms:
        todo = [atom.expression]
        while todo:
            e = todo.pop()
            named = {n.name for n in distinct_nodes(e) if isinstance(n, Local)}
            if local not in named:
                continue
            if isinstance(e, Op) and e.op in _COMPARISONS:
                if named != {local} or any(isinstance(n, Get) for n in distinct_nodes(e)):
                    return None
                found.append(e)
            elif isinstance(e, Ite) or (isinstance(e, Op) and e.op in _LOGIC):
                todo += children(e)
            else:
                return None
    return tuple(found)


# ---------------------------------------------------------------- values that variables can have


def possible_values(program: Program, most: int) -> dict[str, tuple[int, ...]]:
    """The values that scalars can have, and elements of arrays, where there are at most `most`: those that are
    stored, where only constants are, or those of the type."""
    found: dict[str, set[int] | None] = {}
    for v in program.vars:
        inits = v.init if isinstance(v.init, tuple) else (v.init,)
        found[v.name] = None if v.free else set(inits)
    blocks = [program.letter, program.letter_stutter, *(p.epilogue for p in program.processes)]
    for slot in program.slots:
        blocks += [slot.prologue, *slot.blocks, slot.epilogue, slot.canonical]
    for block in blocks:
        for s in statements(block):
            if isinstance(s, Set):
                stored, known = constants(s.value), found[s.var]
                found[s.var] = None if stored is None or known is None else known | stored
    result: dict[str, tuple[int, ...]] = {}
    for v in program.vars:
        known = found[v.name]
        if isinstance(v.type, Int) and v.type.high - v.type.low < most and (known is None or len(known) > most):
            known = set(range(v.type.low, v.type.high + 1))
        if known is not None and len(known) <= most:
            result[v.name] = tuple(sorted(known))
    return result


def constants(root: Expr) -> set[int] | None:
    """The values of a choice between constants."""
    found, todo = set[int](), [root]
    while todo:
        e = todo.pop()
        if isinstance(e, Const):
            found.add(e.value)
        elif isinstance(e, Ite):
            todo += (e.then, e.otherwise)
        else:
            return None
    return found

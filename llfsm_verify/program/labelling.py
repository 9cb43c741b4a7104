"""A step program in which the values of inputs are numbers of classes, each with one representative.

What a representative is may depend on variables as they are when the block begins that samples it. A block that has
decided the value of a choice which the letter samples too tells it by two outputs.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

from llfsm_verify.program.outcomes import Place, places, sampled_in
from llfsm_verify.program.program import (
    BOOL,
    Block,
    Choice,
    Const,
    Expr,
    Fault,
    FaultSite,
    Get,
    If,
    Int,
    Let,
    Local,
    Origin,
    Program,
    Sample,
    Set,
    Stmt,
    Switch,
    Var,
)
from llfsm_verify.program.terms import FALSE, TRUE, const, found, get, op, searched
from llfsm_verify.program.trees import rebuilt, with_branches

LABEL, LABELLED = ".$label", ".$labelled"
"""Ends of the names of the outputs that tell the letter what a block has decided."""
UNKNOWN = FaultSite("unknown", "a step met values of variables that its classes were not made for", None)
"""The end of a step whose classes are not made (yet); no run of an arrangement ends in it."""
_MARK = "~"
"""Begins the names of our locals, and parts those of our choices: no name of a user has it."""


@dataclass(frozen=True)
class Classes:
    """The representatives of a group of choices at one place.

    Either `rows` gives them for each valuation of `keys`, in ascending order; or `candidates` are expressions over
    `keys`, one for each representative of the only choice, in any order (some may be equal).
    """

    name: str
    """Of the choice of a class's number."""
    members: tuple[Choice, ...]
    keys: tuple[Get, ...]
    rows: Mapping[tuple[int, ...], tuple[tuple[int, ...], ...]] = field(default_factory=dict)
    candidates: tuple[Expr, ...] = ()
    partial: bool = False
    """Valuations may be met that have no row."""

    @property
    def size(self) -> int:
        """The numbers of classes: where a valuation has fewer, the last one stands for the rest."""
        return len(self.candidates) or max(map(len, self.rows.values()))

    @cached_property
    def choice(self) -> Choice:
        inputs = dict.fromkeys(c.source for c in self.members)
        return Choice(self.name, Int(0, self.size - 1), "input", ", ".join(inputs))

    @property
    def number(self) -> Local:
        return Local(f"{_MARK}{self.name}", self.choice.type)

    def sample(self, unknown: int) -> Iterator[Stmt]:
        """Read the class's number; `unknown` is the fault of a valuation without a row."""
        yield Sample(self.number, self.name)
        if self.partial:
            yield Fault(unknown, op("not", _known([_captured(k) for k in self.keys], list(self.rows))))
        if self.candidates:
            yield from self._sorted()

    def member(self, index: int) -> Expr:
        """The representative's value of a member, after `sample`."""
        if self.candidates:
            kind = self.members[0].type
            return found(self.number, [self._candidate(i, kind) for i in range(self.size)])
        values = {
            keys: found(self.number, [const(row[index]) for row in rows]) for keys, rows in sorted(self.rows.items())
        }
        return _selected([_captured(k) for k in self.keys], list(values.items()))

    def _candidate(self, number: int, kind: Int) -> Local:
        return Local(f"{_MARK}{self.name}{_MARK}{number}", kind)

    def _sorted(self) -> Iterator[Stmt]:
        """The candidates into locals, in ascending order: by insertion, a network of comparators."""
        kind = self.members[0].type
        for i, candidate in enumerate(self.candidates):
            yield Let(self._candidate(i, kind), capture(candidate))
            for j in range(i, 0, -1):
                lower, upper, kept = self._candidate(j - 1, kind), self._candidate(j, kind), self._candidate(-1, kind)
                yield Let(kept, op("max", lower, upper))
                yield Let(lower, op("min", lower, upper))
                yield Let(upper, kept)


def is_class(choice: Choice) -> bool:
    """The choice is the number of a class."""
    return _MARK in choice.name


def clamp(e: Expr, kind: Int) -> Expr:
    """An expression, brought to the nearest value of a type."""
    return op("max", const(kind.low), op("min", const(kind.high), e))


Plan = Mapping[Place, Mapping[str, Classes]]
"""By place, the classes of each choice that is sampled there by its class."""


def label_program(program: Program, plan: Plan) -> Program:
    """The program with classes for values. What it can do, `program` can do with the representatives' values, and
    of what `program` can do nothing is missing when every class is one."""
    return _Rewriting(program, plan).program()


class _Rewriting:
    def __init__(self, program: Program, plan: Plan) -> None:
        self._program = program
        self._plan = plan
        self._unknown = len(program.faults)
        shown = {c for place, block in places(program) if place.slot is None for c in sampled_in(block)}
        classed = {m.name for classes in plan.values() for c in classes.values() for m in c.members}
        read = {c for place, block in places(program) if place.slot is not None for c in sampled_in(block)}
        decided = {m.name for p, cs in plan.items() if p.slot is not None for c in cs.values() for m in c.members}
        told = shown & classed & (read | decided)
        self._told = {c.name: c for c in program.choices if c.name in told}
        """The choices of which blocks tell the letter."""

    def program(self) -> Program:
        program = self._program
        slots = tuple(
            replace(slot, blocks=tuple(self._block(Place(i, s), b) for s, b in enumerate(slot.blocks)))
            for i, slot in enumerate(program.slots)
        )
        letter = self._block(Place(None, 0), program.letter)
        stutter = letter
        if program.letter_stutter is not program.letter:
            stutter = self._block(Place(None, 1), program.letter_stutter)
        made = {c.name: c.choice for classes in self._plan.values() for c in classes.values()}
        origin = Origin("output")
        outputs = [
            var
            for name, choice in self._told.items()
            for var in (
                Var(name + LABEL, choice.type, choice.type.low, origin, output=True),
                Var(name + LABELLED, BOOL, 0, origin, output=True),
            )
        ]
        blocks = [letter, stutter, *(b for slot in slots for b in (slot.prologue, *slot.blocks))]
        left = {name for block in blocks for name in sampled_in(block)}
        return replace(
            program,
            vars=(*program.vars, *outputs),
            choices=(*(c for c in program.choices if c.name in left), *made.values()),
            slots=slots,
            letter=letter,
            letter_stutter=stutter,
            faults=(*program.faults, UNKNOWN),
        )

    def _block(self, place: Place, block: Block) -> Block:
        classes = self._plan.get(place, {})
        in_letter = place.slot is None
        if not classes and not self._told:
            return block
        keys = dict.fromkeys(k for c in classes.values() for k in c.keys)
        begin = tuple(Let(_captured(k), k) for k in keys)
        return (*begin, *self._rewritten(block, classes, in_letter))

    def _rewritten(self, block: Block, classes: Mapping[str, Classes], in_letter: bool) -> Block:
        out: list[Stmt] = []
        for s in block:
            match s:
                case If() | Switch():
                    out.append(with_branches(s, lambda inner: self._rewritten(inner, classes, in_letter)))
                case Sample(local, choice) if in_letter and choice in self._told:
                    kind = self._told[choice].type
                    known: Block = (Let(local, get(choice + LABEL, kind)),)
                    fresh: Block = (s,)
                    if choice in classes:
                        fresh = tuple(self._sampled(local, classes[choice], choice))
                    out.append(If(get(choice + LABELLED, BOOL), known, fresh))
                case Sample(local, choice) if choice in classes:
                    out += self._sampled(local, classes[choice], choice, tell=not in_letter)
                case Sample(local, choice) if choice in self._told:
                    out += [s, *_tell(choice, local)]
                case _:
                    out.append(s)
        return tuple(out)

    def _sampled(self, local: Local, classes: Classes, choice: str, *, tell: bool = False) -> Iterator[Stmt]:
        yield from classes.sample(self._unknown)
        for index, member in enumerate(classes.members):
            if member.name == choice:
                yield Let(local, classes.member(index))
            if tell and member.name in self._told:
                yield from _tell(member.name, classes.member(index))


def _tell(choice: str, value: Expr) -> Block:
    return Set(choice + LABEL, None, value), Set(choice + LABELLED, None, TRUE)


# ---------------------------------------------------------------- tables as expressions


def _captured(key: Get) -> Local:
    """The local that holds a variable as it was when the block began."""
    assert key.index is None or isinstance(key.index, Const)
    at = "" if key.index is None else f"[{key.index.value}]"
    return Local(f"{_MARK}{key.var}{at}", key.type)


def capture(root: Expr) -> Expr:
    """An expression over variables as they were when the block began."""
    return rebuilt(root, lambda e: _captured(e) if isinstance(e, Get) else None)


def _selected(keys: Sequence[Expr], rows: Sequence[tuple[tuple[int, ...], Expr]]) -> Expr:
    """The value of the row that the keys name; of some row, where none has their values."""
    if len({value for _, value in rows}) == 1:
        return rows[0][1]
    groups: dict[int, list[tuple[tuple[int, ...], Expr]]] = {}
    for row, value in rows:
        groups.setdefault(row[0], []).append((row[1:], value))
    inner = [(first, _selected(keys[1:], rest)) for first, rest in sorted(groups.items())]
    return searched(keys[0], inner)


def _known(keys: Sequence[Expr], rows: Sequence[tuple[int, ...]]) -> Expr:
    """Whether the keys name a row."""
    if not keys:
        return TRUE if rows else FALSE
    groups: dict[int, list[tuple[int, ...]]] = {}
    for row in rows:
        groups.setdefault(row[0], []).append(row[1:])
    inner = [(x, op("and", op("eq", keys[0], const(x)), _known(keys[1:], rest))) for x, rest in sorted(groups.items())]
    return searched(keys[0], inner) if inner else FALSE

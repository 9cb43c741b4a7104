"""The cone of influence: a step program without what no property, fault, fairness condition or turn depends on.

Why it is exact: a step is a function of the configuration, the process and the values of the choices. Let a walk
through both programs begin in c and in its projection, with the same values for the choices that are left. Then,
statement by statement, the relevant variables and locals stay equal. A statement that is cut stores into nothing
relevant, and can neither fault nor leave 64 bits. One that stays reads relevant values only, and the decisions around
it are relevant, so it runs in both programs or in neither. So both steps meet the same fault or overflow, or end in c'
and in its projection, with the same letter. Which process may step, which slot acts and where outputs are reset is
relevant as well. The projection is therefore a bisimulation.

Kept: every reachable configuration up to projection, all letters in their order, faults, overflows and fair runs, and
so all verdicts of properties, of faults and of termination of what is left. Not kept: events, and what only traces
show. Source: M. Weiser, Program slicing, ICSE 1981.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from llfsm_verify.program.dependence import Relevant, blocks, decided_by, relevant, uses
from llfsm_verify.program.program import (
    Block,
    Emit,
    Fault,
    If,
    Int,
    Let,
    Origin,
    Program,
    Sample,
    Set,
    Slot,
    Stmt,
    Switch,
    Var,
)
from llfsm_verify.program.trees import branches

Value = int | tuple[int, ...]
"""A scalar's value, or the tuple of an array's elements."""

STATELESS = Var("$stateless", Int(0, 0), 0, Origin("control"))
"""Selects the only block of slots whose state is left out; it takes no bits."""
EMPTY = Var("$empty", Int(0, 1), 0, Origin("control"))
"""The bit of a configuration in which no variable is left that has more than one value: packed ones have a word."""


@dataclass(frozen=True, slots=True)
class Cone:
    """A program and the part of it that can be observed.

    `program` does not emit events, and names in `ran`, `fired` and `spent` outputs that it has only where something
    observed reads them: traces are performed by `full`. For every configuration c of `full` and every choice of values,
    the step of `program` from `project(c)` is the projection of the step from c, with the same letter, the same fault,
    or an overflow where that one overflows (docs/decisions/0007-cone-of-influence.md).
    """

    full: Program
    program: Program
    left_out: tuple[str, ...]
    """What users know and `program` lacks, as they write it: variables (``count``, ``lamp.n``, ``queue[*].x``), inputs
    that are sampled, and machines (``lamp``) whose state is left out."""
    late: frozenset[str] = frozenset()
    """Choices of which `transforms.forgetting` gives the values that no step needs."""

    def project(self, values: Mapping[str, Value]) -> dict[str, Value]:
        """A configuration of `program` from one of `full`, both by variable."""
        return {v.name: _projected(v, values) for v in self.program.vars if not v.output}

    def start(self, values: Mapping[str, Value]) -> dict[str, Value]:
        """An initial configuration of `full` from one of `program`: the variables left out have their `init`."""
        return {v.name: values.get(v.name, v.init) for v in self.full.vars if not v.output}

    def extend(self, choices: Mapping[str, int]) -> dict[str, int]:
        """The choices of a step of `full` from those of a step of `program`: the others have their lowest values, or
        none if they are `late`.

        A walk of `program` whose steps are extended is a walk of `full` of the same processes, letters and projections.
        """
        given = (c for c in self.full.choices if c.name in choices or c.name not in self.late)
        return {c.name: choices.get(c.name, c.type.low) for c in given}


def _projected(v: Var, values: Mapping[str, Value]) -> Value:
    return v.init if v in (STATELESS, EMPTY) else values[v.name]


def cone(program: Program, also: Iterable[str] = ()) -> Cone:
    """The cone of influence of a program's letters, fairness, faults, overflows and turns, and of the variables `also`.

    Slicing on the dependence graph; exact for reachable configurations and letters, not least. Time and memory are
    linear in the program's size. A program is left as it is where nothing can be left out, but for events and outputs
    that only traces show.
    """
    kept = relevant(program, also)
    cut = _Cut(kept)
    slots = tuple(_slot(slot, cut) for slot in program.slots)
    processes = tuple(replace(p, epilogue=cut.block(p.epilogue)) for p in program.processes)
    letter, letter_stutter = cut.block(program.letter), cut.block(program.letter_stutter)
    variables = [v for v in program.vars if v.name in kept.variables]
    if any(slot.state == STATELESS.name for slot in slots):
        variables.append(STATELESS)
    if all(v.output or (isinstance(v.type, Int) and v.type.low == v.type.high) for v in variables):
        variables.append(EMPTY)
    choices = tuple(c for c in program.choices if c.name in cut.sampled)
    inputs = {c.input for c in choices} | _mentioned(program)
    sliced = replace(
        program,
        vars=tuple(variables),
        choices=choices,
        inputs=tuple(i for i in program.inputs if i.name in inputs),
        slots=slots,
        processes=processes,
        letter=letter,
        letter_stutter=letter_stutter,
    )
    return Cone(program, sliced, _left_out(program, kept, inputs))


def _slot(slot: Slot, cut: _Cut) -> Slot:
    """A slot whose state nothing asks for has nothing left in its blocks: any statement there would ask for it."""
    dispatched = slot.state in cut.kept.variables
    return replace(
        slot,
        state=slot.state if dispatched else STATELESS.name,
        prologue=cut.block(slot.prologue),
        blocks=tuple(cut.block(b) for b in slot.blocks) if dispatched else ((),),
        epilogue=cut.block(slot.epilogue),
        canonical=cut.block(slot.canonical),
    )


class _Cut:
    """Cuts blocks down to what is relevant; `sampled` collects the choices that are left."""

    def __init__(self, kept: Relevant) -> None:
        self.kept = kept
        self.sampled: set[str] = set()
        self._done: dict[int, Block] = {}

    def block(self, block: Block) -> Block:
        """The relevant statements, in their order; a block used twice stays one."""
        done = self._done.get(id(block))
        if done is None:
            done = self._done[id(block)] = self._cut(block)
        return done

    def _cut(self, block: Block) -> Block:
        key = id(block)
        out: list[Stmt] = []
        # What to do, where the result goes, and (once they are done) what is left of the statement's own blocks.
        todo: list[tuple[Stmt, list[Stmt], list[list[Stmt]] | None]] = [(s, out, None) for s in reversed(block)]
        while todo:
            statement, into, parts = todo.pop()
            if isinstance(statement, (If, Switch)):
                if parts is None:
                    inner = branches(statement)
                    results: list[list[Stmt]] = [[] for _ in inner]
                    todo.append((statement, into, results))
                    todo += [(s, r, None) for b, r in zip(inner, results, strict=True) for s in reversed(b)]
                elif any(parts) or uses(decided_by(statement)).fails:
                    into.append(_decision(statement, [tuple(p) for p in parts]))
            elif self._stays(statement, key):
                into.append(statement)
        return tuple(out)

    def _stays(self, statement: Set | Let | Sample | Fault | Emit, block: int) -> bool:
        if isinstance(statement, Set):
            return statement.var in self.kept.variables
        if isinstance(statement, (Let, Sample)):
            stays = (block, statement.local.name) in self.kept.locals
            if stays and isinstance(statement, Sample):
                self.sampled.add(statement.choice)
            return stays
        return isinstance(statement, Fault)


def _decision(statement: If | Switch, parts: list[Block]) -> Stmt:
    """The decision with what is left of its branches."""
    if isinstance(statement, If):
        return If(statement.condition, parts[0], parts[1])
    *cases, default = parts
    kept = [(k, b) for (k, _), b in zip(statement.cases, cases, strict=True) if b or default]
    return Switch(statement.value, tuple(kept), default)


def _mentioned(program: Program) -> set[str]:
    """The unstored inputs that atoms mention; the first letter shows their `init`."""
    named = (name for a in program.atoms for name in uses(a.expression).locals)
    return {name.removeprefix("input:") for name in named}


def _left_out(program: Program, kept: Relevant, inputs: set[str]) -> tuple[str, ...]:
    machines = {slot.state: program.machines[slot.machine].name for slot in program.slots}
    found: list[str] = []
    for v in program.vars:
        if v.output or v.name in kept.variables:
            continue
        if v.name in machines:
            found.append(machines[v.name])
        elif v.origin.kind not in ("control", "output"):
            found.append(v.origin.pattern.replace("{}", "*").removesuffix("[*]") if v.origin.pattern else v.name)
    sampled = _sampled(program)
    found += [i.name for i in program.inputs if i.name in sampled and i.name not in inputs]
    return tuple(found)


def _sampled(program: Program) -> set[str]:
    """The inputs that some statement samples."""
    inputs = {c.name: c.input for c in program.choices}
    todo: list[Stmt] = [s for block, _ in blocks(program) for s in block]
    found: set[str] = set()
    while todo:
        statement = todo.pop()
        if isinstance(statement, Sample):
            found.add(inputs[statement.choice])
        elif isinstance(statement, (If, Switch)):
            todo += [s for b in branches(statement) for s in b]
    return found

"""The lock-step product of an arrangement with one that has more machines after its own: both take each step together,
with the same samples.

Where a machine of both has its turn, it has it in both. The product ends, in faults of its own, where the alarm is set
at the end of a cycle, and where the two differ there.

Kept: the runs of the guarded arrangement up to the first of these ends, and beside each of them the one run of the
original with the same samples. Source: the self-composition of programs (G. Barthe, P. R. D'Argenio and T. Rezk, Secure
information flow by self-composition, CSFW 2004), here of two programs.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace

from llfsm_verify.plug import (
    BOOL,
    Block,
    Emit,
    Expr,
    Fault,
    FaultSite,
    Get,
    If,
    Let,
    Local,
    Program,
    Sample,
    Set,
    Stmt,
    Switch,
    Var,
    any_of,
    const,
    fold,
    get,
    op,
    ringlet,
    statements,
    with_arguments,
)

MARK = "$original."
"""Begins the names of the variables and locals of the original: no name of a user does."""
COMPARED = ("whiteboard", "machine")
STATE = ".$state"


class Unlike(Exception):
    """The two cannot take their steps together; the message says why."""


@dataclass(frozen=True, slots=True)
class Lockstep:
    """`program` has the variables, choices and steps of the guarded arrangement, and beside them those of the
    original."""

    program: Program
    original: Program
    guarded: Program
    alarm: int
    """The fault in which a step ends at whose end the alarm is set."""
    differs: int
    """The fault in which it ends where something is not as in the original."""
    compared: tuple[str, ...]
    """Variables of both."""
    own: frozenset[int]
    """Faults of the machines that the original does not have."""
    resampled: frozenset[str]
    """Choices that the original's part of a step also reads."""
    named: Mapping[str, str]
    """Choices that have another name there than in the original, by that name."""

    def start(self, values: Mapping[str, int | tuple[int, ...]]) -> dict[str, int | tuple[int, ...]]:
        """The configuration in which both begin, from an initial one of the guarded arrangement."""
        known = {v.name: v for v in self.guarded.vars}
        first = dict(values)
        for variable in self.original.vars:
            if not variable.output:
                same = variable.free and variable.name in known and known[variable.name].free
                first[MARK + variable.name] = values[variable.name] if same else variable.init
        return first


def lockstep(original: Program, guarded: Program, alarm: str, requests: Mapping[str, str]) -> Lockstep:
    """The product of programs of one process each, with all bits kept. `alarm` is a variable of the guarded one, and so
    are `requests`, by the outputs of the original in whose place they are written.

    Unlike: an input or a machine of the original is another one there.
    """
    choices = {choice.name: choice for choice in guarded.choices}
    named = dict(_named(original, choices, requests))
    for choice in original.choices:
        if choices.setdefault(named.get(choice.name, choice.name), choice).type != choice.type:
            raise Unlike(f"`{choice.source}` does not have the same values")
    names = {info.name: number for number, info in enumerate(original.machines)}
    slots = {original.machines[slot.machine].name: index for index, slot in enumerate(original.slots)}
    faults = len(guarded.faults)
    first, site = faults + len(original.faults), FaultSite("lockstep", "", None)
    compared = tuple(_compared(original, guarded))
    copy = _Copy(faults, named)
    (process,), (own_process,) = guarded.processes, original.processes
    parts = []
    for slot in guarded.slots:
        name = guarded.machines[slot.machine].name
        if name in names:
            step = copy.block(ringlet(original, slots[name]))
            turn = _variable(original, own_process.turn)
            position = own_process.slots.index(slots[name])
            mine = op("eq", get(MARK + turn.name, turn.type), const(position))
            # What the guard has commanded since the alarm was set may act in the same cycle.
            block: Block = (If(mine, step, (Fault(first + 1, op("not", get(alarm, BOOL))),)),)
            if own_process.ended is not None:
                block = (If(get(MARK + own_process.ended, BOOL), (), block),)
            slot = replace(slot, epilogue=(*slot.epilogue, *block))
        parts.append(slot)
    differs = any_of([op("ne", one, other) for name in compared for one, other in _pairs(_variable(guarded, name))])
    ends: Block = (Fault(first, get(alarm, BOOL)), Fault(first + 1, differs))
    check = If(get(guarded.cycle, BOOL), ends)
    variables = [replace(v, name=MARK + v.name, free=False) for v in original.vars]
    program = replace(
        guarded,
        vars=(*guarded.vars, *variables),
        choices=tuple(choices.values()),
        slots=tuple(parts),
        processes=(replace(process, epilogue=(*process.epilogue, check)),),
        faults=(*guarded.faults, *original.faults, site, site),
    )
    new = [i for i, slot in enumerate(guarded.slots) if guarded.machines[slot.machine].name not in names]
    own = frozenset(s.fault for i in new for s in statements(ringlet(guarded, i)) if isinstance(s, Fault))
    return Lockstep(program, original, guarded, first, first + 1, compared, own, frozenset(copy.choices), named)


def _named(original: Program, known: Collection[str], requests: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """Choices of the original that have the name of another variable in what is `known`: what operators, or models of
    machines, write."""
    for choice in original.choices:
        for output, slot in requests.items():
            name = choice.name.replace(f"({output})", f"({slot})")
            if choice.name not in known and name in known:
                yield choice.name, name


def _compared(original: Program, guarded: Program) -> Iterator[str]:
    known = {v.name: v for v in guarded.vars}
    for variable in original.vars:
        if variable.output or not (variable.origin.kind in COMPARED or variable.name.endswith(STATE)):
            continue
        other = known.get(variable.name)
        labels = variable.origin.labels
        # A machine that only the guard suspends has one state more there, the implicit suspend state.
        more = other is not None and variable.name.endswith(STATE) and other.origin.labels[:-1] == labels
        if other is None or (not more and (other.type, other.length) != (variable.type, variable.length)):
            raise Unlike(f"`{variable.name}` is another variable there")
        if not more and other.origin.labels != labels:
            raise Unlike(f"the values of `{variable.name}` have other names there")
        yield variable.name


def _pairs(variable: Var) -> Iterator[tuple[Expr, Expr]]:
    """The scalars of a variable, in both."""
    for index in [None] if variable.length is None else map(const, range(variable.length)):
        yield Get(variable.name, index, variable.type), Get(MARK + variable.name, index, variable.type)


def _variable(program: Program, name: str) -> Var:
    return next(v for v in program.vars if v.name == name)


class _Copy:
    """Statements of the original, with names of their own."""

    def __init__(self, faults: int, named: Mapping[str, str]) -> None:
        self._faults, self._named = faults, named
        self.choices: set[str] = set()
        """Those that what was copied reads."""

    def block(self, block: Block) -> Block:
        return tuple(copied for statement in block if (copied := self._statement(statement)) is not None)

    def _statement(self, statement: Stmt) -> Stmt | None:
        match statement:
            case Set(name, index, value):
                return Set(MARK + name, None if index is None else self._expression(index), self._expression(value))
            case Let(local, value):
                return Let(self._local(local), self._expression(value))
            case Sample(local, choice):
                choice = self._named.get(choice, choice)
                self.choices.add(choice)
                return Sample(self._local(local), choice)
            case If(condition, then, otherwise):
                return If(self._expression(condition), self.block(then), self.block(otherwise))
            case Switch(value, cases, default):
                copied = tuple((number, self.block(block)) for number, block in cases)
                return Switch(self._expression(value), copied, self.block(default))
            case Fault(number, when):
                return Fault(self._faults + number, self._expression(when))
            case Emit():
                return None
        raise AssertionError(f"no copy of {statement}")

    def _local(self, local: Local) -> Local:
        return Local(MARK + local.name, local.type)

    def _expression(self, root: Expr) -> Expr:
        def visit(node: Expr, args: list[Expr]) -> Expr:
            match node:
                case Get(name, _, kind):
                    return Get(MARK + name, args[0] if args else None, kind)
                case Local():
                    return self._local(node)
            return with_arguments(node, args)

        return fold(root, visit)

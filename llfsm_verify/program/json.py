"""A step program as JSON: cells, expressions and blocks, each list referring only to what stands before it."""

from __future__ import annotations

from collections.abc import Sequence

from llfsm_verify.jsonvalue import Json
from llfsm_verify.program.program import (
    INT64_MAX,
    INT64_MIN,
    Block,
    Const,
    Emit,
    Expr,
    Fault,
    Get,
    If,
    Int,
    Ite,
    Let,
    Local,
    Op,
    Program,
    Sample,
    Set,
    Stmt,
    Switch,
    Var,
)
from llfsm_verify.program.trees import branches, children

WIDEST = 1 << 128
"""No number on the way has more bits, without its sign."""


def program_json(program: Program) -> dict[str, Json]:
    """What `program` does, without what is only printed: spans, states' names, and `Emit`, which changes nothing.

    `cells` are [name, low, high, init, free] of the configuration, then of the outputs, then of the locals, arrays
    element by element; `sizes` tells where the first two groups end. A term is
    [operator, …]; a block a list of statements; both refer by index to earlier ones. A process is [name, cell of its
    `ended` or null, block]: its block is a whole step (program.py, module docstring), the letter included.
    """
    return _Writer(program).document()


class _Writer:
    def __init__(self, program: Program) -> None:
        self._program = program
        self._cells: list[Json] = []
        self._place: dict[str, int] = {}
        self._vars: dict[str, Var] = {}
        self._locals: dict[str, int] = {}
        self._choices = {c.name: i for i, c in enumerate(program.choices)}
        self._terms: list[Json] = []
        self._known_terms: dict[tuple[Json, ...], int] = {}
        self._term_of: dict[int, int] = {}
        self._blocks: list[Json] = []
        self._known_blocks: dict[str, int] = {}
        self._block_of: dict[int, int] = {}
        persistent = [v for v in program.vars if not v.output]
        for v in (*persistent, *(v for v in program.vars if v.output)):
            self._declare(v)
        self._width = sum(_size(v) for v in persistent)
        self._kept = len(self._cells)

    def _declare(self, v: Var) -> None:
        self._place[v.name], self._vars[v.name] = len(self._cells), v
        low, high = (v.type.low, v.type.high) if isinstance(v.type, Int) else (INT64_MIN, INT64_MAX)
        inits = v.init if isinstance(v.init, tuple) else (v.init,)
        for i, init in enumerate(inits):
            name = v.name if v.length is None else f"{v.name}[{i}]"
            self._cells.append([name, low, high, init, v.free])

    def document(self) -> dict[str, Json]:
        p = self._program
        letter, stutter = self._block(p.letter), self._block(p.letter_stutter)
        processes: list[Json] = []
        for process in p.processes:
            turns: list[Json] = []
            for turn, number in enumerate(process.slots):
                slot = p.slots[number]
                own: list[Json] = [[state, self._block(b)] for state, b in enumerate(slot.blocks)]
                state = self._get(slot.state)
                parts = (slot.epilogue, process.epilogue, slot.canonical)
                step: list[Json] = [["do", self._block(slot.prologue)], ["switch", state, own, self._block(())]]
                step += [["do", self._block(b)] for b in parts]
                turns.append([turn, self._new_block([*step, ["do", letter]])])
            whole = self._new_block([["switch", self._get(process.turn), turns, self._block(())]])
            ended = None if process.ended is None else self._place[process.ended]
            processes.append([process.name, ended, whole])
        first: list[Json] = [self._term(a.expression) for a in p.atoms]
        inputs: list[Json] = [[i.name, self._local(f"input:{i.name}"), i.init] for i in p.inputs]
        shown: list[Json] = [self._place[a.output] for a in p.atoms]
        fairness: list[Json] = []
        for condition in p.fairness:
            bits: list[Json] = []
            for name in (condition.premise, condition.goal):
                bits.append(None if name is None else len(shown))
                shown += [] if name is None else [self._place[name]]
            fairness.append([condition.name, *bits])
        faults: list[Json] = [[f.code, f.message, None if f.span is None else f.span.line] for f in p.faults]
        return {
            "name": p.name,
            "observe": p.observe,
            "sizes": [self._width, self._kept],
            "cells": self._cells,
            "choices": [[c.name, c.type.low, c.type.high, c.kind, c.input] for c in p.choices],
            "inputs": inputs,
            "terms": self._terms,
            "blocks": self._blocks,
            "processes": processes,
            "letter": {"first": first, "cells": shown, "cycle": self._place[p.cycle], "stutter": stutter},
            "fairness": fairness,
            "faults": faults,
        }

    # -------------------------------------------------- expressions

    def _get(self, name: str) -> int:
        return self._new_term(("get", self._place[name]))

    def _local(self, name: str) -> int:
        """The cell of a local; locals of one name share it, since each is assigned before it is read."""
        if name not in self._locals:
            self._locals[name] = len(self._cells)
            self._cells.append([name, -WIDEST, WIDEST - 1, 0, False])
        return self._locals[name]

    def _new_term(self, term: tuple[Json, ...]) -> int:
        number = self._known_terms.setdefault(term, len(self._terms))
        if number == len(self._terms):
            self._terms.append(list(term))
        return number

    def _term(self, root: Expr) -> int:
        """The number of an expression, parts first, without recursion."""
        todo: list[Expr] = [root]
        while todo:
            e = todo[-1]
            parts = children(e)
            missing = [x for x in parts if id(x) not in self._term_of]
            if id(e) in self._term_of or not missing:
                todo.pop()
                if id(e) not in self._term_of:
                    self._term_of[id(e)] = self._new_term(self._written(e, [self._term_of[id(x)] for x in parts]))
            else:
                todo += missing
        return self._term_of[id(root)]

    def _written(self, e: Expr, parts: Sequence[int]) -> tuple[Json, ...]:
        match e:
            case Const(value, _):
                return "const", value
            case Get(var, None, _):
                return "get", self._place[var]
            case Get(var, _, _):
                return "element", self._place[var], self._vars[var].length, *parts
            case Local(name, _):
                return "get", self._local(name)
            case Ite():
                return "ite", *parts
            case Op("wrap", _, Int() as kind):
                return "wrap", kind.low, kind.high, *parts
            case Op(name, _, _):
                return name, *parts
        raise AssertionError(e)

    # -------------------------------------------------- blocks

    def _new_block(self, statements: list[Json]) -> int:
        number = self._known_blocks.setdefault(repr(statements), len(self._blocks))
        if number == len(self._blocks):
            self._blocks.append(statements)
        return number

    def _block(self, root: Block) -> int:
        """The number of a block, inner blocks first, without recursion."""
        todo: list[Block] = [root]
        while todo:
            block = todo[-1]
            missing = [b for s in block for b in _inner(s) if id(b) not in self._block_of]
            if id(block) in self._block_of or not missing:
                todo.pop()
                if id(block) not in self._block_of:
                    self._block_of[id(block)] = self._new_block(
                        [self._statement(s) for s in block if not isinstance(s, Emit)]
                    )
            else:
                todo += missing
        return self._block_of[id(root)]

    def _statement(self, s: Set | Let | Sample | If | Switch | Fault) -> Json:
        match s:
            case Set(var, None, value):
                return ["set", self._place[var], self._term(value)]
            case Set(var, index, value):
                assert index is not None
                return ["put", self._place[var], self._vars[var].length, self._term(index), self._term(value)]
            case Let(local, value):
                return ["set", self._local(local.name), self._term(value)]
            case Sample(local, choice):
                return ["sample", self._local(local.name), self._choices[choice]]
            case If(condition, then, otherwise):
                return ["if", self._term(condition), self._block_of[id(then)], self._block_of[id(otherwise)]]
            case Switch(value, cases, default):
                table: list[Json] = [[k, self._block_of[id(b)]] for k, b in cases]
                return ["switch", self._term(value), table, self._block_of[id(default)]]
            case Fault(fault, when):
                return ["fault", fault, self._term(when)]


def _size(v: Var) -> int:
    return 1 if v.length is None else v.length


def _inner(s: Stmt) -> tuple[Block, ...]:
    return branches(s) if isinstance(s, (If, Switch)) else ()

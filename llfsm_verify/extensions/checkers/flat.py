"""What a model for another checker is written from: a block for the ringlet of each slot, without what has no effect on
what is checked."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.plug import (
    BOOL,
    FAULT,
    Block,
    Const,
    Emit,
    Expr,
    Fault,
    Get,
    If,
    Int,
    Let,
    Local,
    Op,
    Program,
    Sample,
    Set,
    Span,
    Specification,
    Stmt,
    Switch,
    Type,
    Var,
    decimal_text,
    distinct_nodes,
    expressions,
    fold,
    op,
    ringlet,
    statements,
    stop_at_faults,
)

INT32 = Int(-(1 << 31), (1 << 31) - 1)
"""The numbers that both NuSMV and Promela hold."""


@dataclass(frozen=True, slots=True)
class Flat:
    """A specification whose program is reduced to blocks: `steps` by slot, `stutter` of an arrangement that has ended.

    Without goals neither letters nor any output that the steps do not need themselves are left.
    """

    specification: Specification
    vars: tuple[Var, ...]
    """The variables that are left: the configuration's, then outputs."""
    steps: tuple[Block, ...]
    stutter: Block

    @property
    def program(self) -> Program:
        return self.specification.program

    @property
    def faulty(self) -> bool:
        """Some step can fault."""
        return any(isinstance(s, Fault) for block in self.steps for s in statements(block))

    def latched(self) -> dict[str, int | None]:
        """The outputs that make up a letter, in order, with the index of their atom (None: of a fairness condition)."""
        program = self.specification.program
        found: dict[str, int | None] = {a.output: i for i, a in enumerate(program.atoms)}
        for condition in program.fairness:
            found |= {name: None for name in (condition.premise, condition.goal) if name is not None}
        return found if self.specification.observed else {}


def flatten(specification: Specification) -> Flat:
    """Reduce a specification to blocks. Raises DiagnosticError (E420, E421) for numbers that 32 bits do not hold."""
    program = specification.program
    letter = program.letter if specification.observed else ()
    steps = [_folded((*ringlet(program, i), *letter)) for i in range(len(program.slots))]
    stutter = program.letter_stutter if specification.observed else ()
    atoms = {a.output for a in program.atoms}
    fair = {name for c in program.fairness for name in (c.premise, c.goal) if name is not None}
    roots = atoms | fair if specification.observed else set()
    roots |= {v.name for v in program.vars if not v.output}
    if program.observe == "cycle":
        roots.add(program.cycle)
    blocks = _pruned([*steps, stutter], roots)
    kept = {s.var for block in blocks for s in statements(block) if isinstance(s, Set)} | _reads(blocks)
    variables = tuple(v for v in program.vars if not v.output or v.name in kept | (roots & atoms))
    flat = Flat(specification, variables, tuple(blocks[:-1]), blocks[-1])
    _refuse(flat)
    return flat


def _reads(blocks: Iterable[Block]) -> set[str]:
    """The names of all variables and locals that are read."""
    found: set[str] = set()
    for block in blocks:
        for s in statements(block):
            for e in expressions(s):
                found |= {
                    n.var if isinstance(n, Get) else n.name for n in distinct_nodes(e) if isinstance(n, (Get, Local))
                }
    return found


# ---------------------------------------------------------------- what is known before


def _folded(block: Block) -> Block:
    """The block without branches that constants assigned on its outermost level decide (`$cycle`, mostly)."""
    known: dict[str, Const] = {}

    def visit(e: Expr, args: list[Expr]) -> Expr:
        match e:
            case Get(name, None, _):
                return known.get(name, e)
            case Op("not", _, _) if args != list(e.args):
                return op("not", args[0])
        return e

    out: list[Stmt] = []
    todo = list(reversed(block))
    while todo:
        s = todo.pop()
        if isinstance(s, If):
            condition = fold(s.condition, visit)
            if isinstance(condition, Const):
                todo += reversed(s.then if condition.value else s.otherwise)
                continue
        if isinstance(s, Set) and s.index is None and isinstance(s.value, Const):
            known[s.var] = s.value
        else:
            for inner in statements((s,)):
                if isinstance(inner, Set):
                    known.pop(inner.var, None)
        out.append(s)
    return tuple(out)


# ---------------------------------------------------------------- what has no effect


def _pruned(blocks: list[Block], roots: set[str]) -> list[Block]:
    """The blocks without events and without assignments to what is never read, `roots` apart."""
    while True:
        live = roots | _reads(blocks)
        smaller = [_prune(block, live) for block in blocks]
        if smaller == blocks:
            return smaller
        blocks = smaller


def _prune(block: Block, live: set[str]) -> Block:
    out: list[Stmt] = []
    for s in block:
        match s:
            case Emit():
                continue
            case Set(name, _, _) if name not in live:
                continue
            case Let(Local(name, _), _) | Sample(Local(name, _), _) if name not in live:
                continue
            case Fault(_, Const(0, _)):
                continue
            case If(condition, then, otherwise):
                then, otherwise = _prune(then, live), _prune(otherwise, live)
                if not then and not otherwise:
                    continue
                s = If(condition, then, otherwise) if then else If(op("not", condition), otherwise)
            case Switch(value, cases, default):
                cases, default = tuple((k, _prune(b, live)) for k, b in cases), _prune(default, live)
                if not default:
                    cases = tuple((k, b) for k, b in cases if b)
                if not cases and not default:
                    continue
                s = Switch(value, cases, default)
        out.append(s)
    return tuple(out)


def stopping(block: Block) -> Block:
    """The block with faults as assignments to `FAULT`, after which nothing more is done."""
    fine = Op("eq", (Get(FAULT, None, INT32), Const(0, INT32)), BOOL)
    return stop_at_faults(block, fine, lambda s: If(s.when, (Set(FAULT, None, Const(s.fault + 1, INT32)),)))


# ---------------------------------------------------------------- numbers


def _refuse(flat: Flat) -> None:
    problems: dict[str, Diagnostic] = {}
    for v in flat.vars:
        if not isinstance(v.type, Int):
            message = f"`{v.name}` is a mathematical integer (type int), which no model for another checker can hold"
            hint = "declare the range that it keeps to, such as 0..1000: leaving it is then a fault"
            problems[v.name] = Diagnostic("E420", message, _place(flat, v.name), hint=hint)
        elif not fits(v.type) or not fits(Int(0, v.type.high - v.type.low)):
            values = f"{v.type.low} to {v.type.high}"
            message = f"`{v.name}` has values from {values}, beyond the 32-bit integers of this format"
            problems[v.name] = Diagnostic("E421", message, _place(flat, v.name), hint="declare a smaller range")
    if problems:
        raise DiagnosticError(list(problems.values()))
    for e in (e for block in (*flat.steps, flat.stutter) for s in statements(block) for e in expressions(s)):
        for node in distinct_nodes(e):
            if not fits(node.type):
                raise DiagnosticError(_too_wide(node, flat))


def fits(t: Type) -> bool:
    """All values of a type are 32-bit integers."""
    return isinstance(t, Int) and INT32.low <= t.low and t.high <= INT32.high


def _place(flat: Flat, name: str) -> Span | None:
    """Where a variable is declared, or the one that it is a part of."""
    found = [n for n in flat.specification.declared if name == n or name.startswith((f"{n}.", f"{n}["))]
    return flat.specification.declared[max(found, key=len)] if found else None


def _too_wide(node: Expr, flat: Flat) -> Diagnostic:
    written = flat.specification.numbers
    for n in distinct_nodes(node):
        if isinstance(n, Const) and not fits(n.type) and n.value in written:
            message = f"`{written[n.value].text}` does not fit into the 32-bit integers of this format"
            return Diagnostic("E421", message, written[n.value], hint="write a number of 32 bits")
    names = sorted({n.var for n in distinct_nodes(node) if isinstance(n, Get)})
    of = f" of {', '.join(f'`{n}`' for n in names)}" if names else ""
    message = f"a calculation{of} can leave 32 bits, and the integers of this format have no more"
    place = next((p for p in (_place(flat, name) for name in names) if p is not None), None)
    return Diagnostic("E421", message, place, hint="declare smaller ranges, so that no intermediate value leaves them")


# ---------------------------------------------------------------- names


class Identifiers:
    """Names of the arrangement as identifiers of another language, each given once.

    Every identifier gets a prefix with an underscore, so that no identifier is a word of that language.
    """

    def __init__(self, *taken: str) -> None:
        self._taken = set(taken)

    def new(self, prefix: str, name: str) -> str:
        """An identifier that looks like `name`."""
        letters = "".join(c if c.isascii() and c.isalnum() else "_" for c in name)
        words = "_".join(w for w in letters.split("_") if w)
        found, number = prefix + words, 1
        while found in self._taken:
            number += 1
            found = f"{prefix}{words}_{number}"
        self._taken.add(found)
        return found


def values_note(v: Var) -> str:
    """What the numbers of a variable stand for, for a comment; "" when they stand for themselves."""
    if isinstance(v.type, Int) and v.type.digits:
        return f"in steps of {decimal_text(1, v.type.digits)}"
    low = v.type.low if isinstance(v.type, Int) else 0
    return ", ".join(f"{low + i} = {label}" for i, label in enumerate(v.origin.labels))


def comment(text: str) -> str:
    """User's text for a comment of one line in any of the languages."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split()).replace("*/", "* /")

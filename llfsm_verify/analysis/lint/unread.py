"""Writes never read and declarations never used, among them values that are overwritten before anything reads them.

Machines are found elsewhere: one of the pool that nothing loads is L002, one in no schedule an error (E083), and a
parameter that a machine's text does not use W001.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from llfsm_verify.analysis.lint.finding import Finding
from llfsm_verify.arrangement.model import ACTION_KINDS, ActionKind, Arrangement, State
from llfsm_verify.diagnostics import Span
from llfsm_verify.language import types as lt
from llfsm_verify.language.trees import nodes, of_kind
from llfsm_verify.language.typed import (
    Assign,
    Binary,
    Declare,
    For,
    IfElse,
    Index,
    Literal,
    Read,
    ReadLocal,
    Statement,
    Unary,
    Variable,
)
from llfsm_verify.language.types import EnumType
from llfsm_verify.semantics.letters import Observed


@dataclass(frozen=True, slots=True)
class Lost:
    """A store, by its place, whose value is lost; `machine` makes it in its `action`."""

    machine: str
    target: str
    span: Span
    local: bool
    """Into a local variable of the action."""


def actions(state: State) -> Iterator[tuple[ActionKind, tuple[Statement, ...]]]:
    """The actions of a state that are not empty."""
    texts = (state.on_entry, state.on_exit, state.internal, state.on_suspend, state.on_resume)
    yield from ((kind, text) for kind, text in zip(ACTION_KINDS, texts, strict=True) if text)


def unread(arrangement: Arrangement, atoms: Iterable[Observed] = ()) -> list[Variable]:
    """The variables that machines write, and that no guard, condition, output or property (`atoms`) depends on.

    What is read only to compute such variables counts as not read.
    """
    needed = {e.variable.name for e in arrangement.whiteboard if e.role != "shared"}
    needed |= {r.variable.name for a in atoms for r in of_kind(a.expression, Read)}
    written: dict[str, Variable] = {}
    sources: dict[str, set[str]] = {}
    for machine in arrangement.texts:
        for state in machine.states:
            needed |= _names(state.transitions)
            for _, action in actions(state):
                needed |= _directly(action, sources, written)
    todo = list(needed)
    while todo:
        for name in sources.get(todo.pop(), set()) - needed:
            needed.add(name)
            todo.append(name)
    return [v for name, v in written.items() if name not in needed]


def _directly(action: tuple[Statement, ...], sources: dict[str, set[str]], written: dict[str, Variable]) -> set[str]:
    """What an action reads to decide, into its locals, or where that may fault; what its other stores read goes to
    `sources` of their targets."""
    stores = [s for s in of_kind(action, Assign) if isinstance(s.target, Read)]
    inside: set[int] = set()
    deciding: set[str] = set()
    for s in stores:
        assert isinstance(s.target, Read)
        name = s.target.variable.name
        written.setdefault(name, s.target.variable)
        read = _names((s.value, *s.target.path))
        if _may_fault(s):
            deciding |= read if s.op is None else {*read, name}
        sources.setdefault(name, set()).update(read)
        inside |= {id(n) for n in nodes((s.value, s.target))}
    return deciding | {r.variable.name for r in of_kind(action, Read) if id(r) not in inside}


FAULTING = ("div", "mod", "shl", "shr")
"""The operations that fault with some right sides."""


def _may_fault(s: Assign) -> bool:
    """Whether a store faults may depend on what it reads, as far as the text tells."""
    if s.op in FAULTING and not isinstance(s.value, Literal):
        return True
    reads = (s.value, s.target)
    if any(b.op in FAULTING and not isinstance(b.right, Literal) for b in of_kind(reads, Binary)):
        return True
    if any(not isinstance(i.value, Literal) for i in of_kind(reads, Index)):
        return True
    kind, value = s.target.type, s.value.type
    if isinstance(kind, lt.DecimalType) or any(u.op == "sqrt" for u in of_kind(reads, Unary)):
        return True
    if not isinstance(kind, lt.RangeType):
        return False
    if s.op is None and isinstance(s.value, Literal):
        return not kind.low <= s.value.value <= kind.high
    if s.op is None and isinstance(s.value, Read | ReadLocal) and isinstance(value, lt.RangeType | lt.FixedType):
        return not (kind.low <= value.low and value.high <= kind.high)
    return True


def _names(root: object) -> set[str]:
    return {r.variable.name for r in of_kind(root, Read)}


# ---------------------------------------------------------------- values lost inside an action


def lost(arrangement: Arrangement) -> Iterator[Lost]:
    """Stores into scalars whose value the same action overwrites, on every path before anything reads it, and locals
    that are never read."""
    for machine in arrangement.texts:
        for state in machine.states:
            for _, action in actions(state):
                for target, span, local in _Backward().action(action):
                    yield Lost(machine.name, target, span, local)


class _Backward:
    """Goes backwards through an action; a set holds what is overwritten, or gone, before it is read."""

    def __init__(self) -> None:
        self._found: list[tuple[str, Span, bool]] = []
        self._telling = True

    def action(self, statements: Sequence[Statement]) -> list[tuple[str, Span, bool]]:
        own = {f"%{s.local.key}" for s in of_kind(tuple(statements), Declare)}
        read = {f"%{r.local.key}" for s in _evaluated(statements) for r in of_kind(s, ReadLocal)}
        self._block(statements, frozenset(own))
        unused = [s for s in of_kind(tuple(statements), Declare) if f"%{s.local.key}" not in read]
        names = {s.local.key.partition("#")[0] for s in unused}
        found = [f for f in self._found if not (f[2] and f[0] in names)]
        return [*found, *((s.local.key.partition("#")[0], s.span, True) for s in unused)]

    def _block(self, statements: Sequence[Statement], gone: frozenset[str]) -> frozenset[str]:
        for s in reversed(statements):
            gone = self._statement(s, gone)
        return gone

    def _statement(self, s: Statement, gone: frozenset[str]) -> frozenset[str]:
        match s:
            case Assign(target, op, value):
                key = _key(target)
                if key is not None and key in gone and self._telling:
                    self._found.append((" ".join(target.span.text.split()), s.span, key.startswith("%")))
                read = _keys((value, *(target.path if isinstance(target, Read) else ())))
                if key is not None:
                    gone |= {key}
                if op is not None or key is None:
                    read |= _keys(target)
                return gone - read
            case Declare(local, value):
                return (gone | {f"%{local.key}"}) - _keys(value)
            case IfElse(condition, then, otherwise):
                return (self._block(then, gone) & self._block(otherwise, gone)) - _keys(condition)
            case For(_, first, last, body):
                return gone if last < first else self._loop(body, gone)
        return gone

    def _loop(self, body: Sequence[Statement], after: frozenset[str]) -> frozenset[str]:
        """After the body comes the body again, or what follows the loop."""
        telling, self._telling = self._telling, False
        gone = self._block(body, after)
        while (again := self._block(body, after & gone)) != gone:
            gone = again
        self._telling = telling
        return self._block(body, after & gone)


def _evaluated(statements: Sequence[Statement]) -> Iterator[object]:
    """What the statements evaluate, without the targets of plain stores."""
    for s in of_kind(tuple(statements), Assign):
        yield s.value
        if isinstance(s.target, Read):
            yield s.target.path
    for d in of_kind(tuple(statements), Declare):
        yield d.value
    for i in of_kind(tuple(statements), IfElse):
        yield i.condition


def _key(target: Read | ReadLocal) -> str | None:
    """What a store replaces as a whole; None: a part of something."""
    if isinstance(target, ReadLocal):
        return f"%{target.local.key}"
    whole = not target.path and not isinstance(target.type, lt.ArrayType | lt.RecordType)
    return target.variable.name if whole else None


def _keys(root: object) -> set[str]:
    return _names(root) | {f"%{r.local.key}" for r in of_kind(root, ReadLocal)}


ASK = "or give lint the property files that use it"
_WORD = re.compile(r"\w+")


def unused(arrangement: Arrangement, atoms: Sequence[Observed] = ()) -> Iterator[Finding]:
    """L021 and L022. `atoms` are those of properties: what they mention is used."""
    yield from _variables(arrangement, atoms)
    yield from _types(arrangement, atoms)
    yield from _tables(arrangement, atoms)


def _texts(arrangement: Arrangement) -> tuple[object, ...]:
    """The guards and actions of all machines."""
    return tuple((m.actions, tuple(s.transitions for s in m.states)) for m in arrangement.texts)


def _mentioned(root: object) -> Iterator[str]:
    """The variables that typed trees read, write or ask about."""
    found = (getattr(node, "variable", None) for node in nodes(root))
    return (variable.name for variable in found if isinstance(variable, Variable))


def _variables(arrangement: Arrangement, atoms: Iterable[Observed]) -> Iterator[Finding]:
    used = set(_mentioned((_texts(arrangement), tuple(atom.expression for atom in atoms))))
    used |= {operator.target for operator in arrangement.operators if operator.kind == "write"}
    for entry in arrangement.whiteboard:
        name = entry.variable.name
        if name not in used:
            message = f"nothing reads or writes the whiteboard variable `{name}`"
            yield _finding("L021", message, entry.variable.span, ())
    places: dict[Span, list[tuple[str, Variable]]] = {}
    for machine in arrangement.texts:
        for variable in (*machine.variables, *(v for s in machine.states for v in s.variables)):
            places.setdefault(variable.span, []).append((machine.name, variable))
    for span, declared in places.items():
        if not any(variable.name in used for _, variable in declared):
            name = declared[0][1].name.rpartition(".")[2]
            message = f"nothing reads or writes the variable `{name}`"
            yield _finding("L021", message, span, tuple(machine for machine, _ in declared))


def _types(arrangement: Arrangement, atoms: Iterable[Observed]) -> Iterator[Finding]:
    root = (_texts(arrangement), tuple(atom.expression for atom in atoms))
    named = {word[0] for node in of_kind(root, Declare) if (word := _WORD.match(node.span.text)) is not None}
    named |= {node.type.name for node in of_kind(root, Literal) if isinstance(node.type, EnumType)}
    used = {declared.name for declared in arrangement.declared_types if "" in declared.named_in} | named
    while more := {d.name for d in arrangement.declared_types if d.named_in & used} - used:
        used |= more
    for declared in arrangement.declared_types:
        if declared.name not in used:
            message = f"nothing uses the type `{declared.name}`"
            yield _finding("L022", message, declared.span, (), "the arrangement")


def _tables(arrangement: Arrangement, atoms: Iterable[Observed]) -> Iterator[Finding]:
    """Looked for by their names: of what is constant the typed trees may have the number alone."""
    if not arrangement.tables:
        return
    root = (_texts(arrangement), tuple(atom.expression for atom in atoms))
    spans = {span for node in nodes(root) if isinstance(span := getattr(node, "span", None), Span)}
    words = {word for span in spans for word in _WORD.findall(span.text)}
    for table in arrangement.tables.values():
        if table.name not in words:
            yield _finding("L022", f"nothing looks up the table `{table.name}`", table.span, (), "the arrangement")


def _finding(code: str, message: str, span: Span, machines: tuple[str, ...], place: str = "its declaration") -> Finding:
    hint = f"remove it, {ASK}; `lint: {{{code}: why}}` in {place} accepts it"
    return Finding(code, "warning", message, span, machines, "text", (), hint)

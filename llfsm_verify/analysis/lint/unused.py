"""What is declared and then never used: variables that no text reads or writes, types and tables that none names.

Machines are found elsewhere: one of the pool that nothing loads is L002, one in no schedule an error (E083), and a
parameter that a machine's text does not use W001.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence

from llfsm_verify.analysis.lint.finding import Finding
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.diagnostics import Span
from llfsm_verify.language.trees import nodes, of_kind
from llfsm_verify.language.typed import Declare, Literal, Variable
from llfsm_verify.language.types import EnumType
from llfsm_verify.semantics.letters import Observed

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

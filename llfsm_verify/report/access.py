"""Who may do what in an arrangement, and who does: as text, as JSON, and as a graph to be drawn."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

from llfsm_verify.arrangement.model import Access, Arrangement, Machine
from llfsm_verify.jsonvalue import Json
from llfsm_verify.report.drawing.graph import Edge, EdgeKind, Graph, Node

COMMANDS = ("suspend", "resume", "restart", "load", "unload")
WRITE = "write"


@dataclass(frozen=True, slots=True)
class Right:
    """`may`: `who` is allowed to do `what` to `target`; `does`: its text does. What is done and not allowed is refused
    when it happens."""

    who: str
    what: str
    """``write``, or a command."""
    target: str
    may: bool
    does: bool


def rights(arrangement: Arrangement) -> tuple[Right, ...]:
    """Those of all machines, to variables of the whiteboard but inputs, and to machines. Without `access` each may do
    everything."""
    access = arrangement.access
    found: list[Right] = []
    for machine in arrangement.machines:
        written = {name for name, _ in machine.writes()}
        for entry in arrangement.whiteboard:
            name = entry.variable.name
            if entry.role != "input":
                may = access is None or access.may_write(machine.name, name)
                found.append(Right(machine.name, WRITE, name, may, name in written))
        given = {(c.kind.replace("load_suspended", "load"), c.machine) for c in machine.commands()}
        for target in arrangement.machines:
            for kind in COMMANDS:
                may = access is None or access.may_command(machine.name, kind, target.name)
                found.append(Right(machine.name, kind, target.name, may, (kind, target.name) in given))
    return tuple(found)


def report_json(arrangement: Arrangement, digest: str) -> str:
    """The policy and the rights as JSON; `digest` is the hash of the policy, as recordings have it."""
    access = arrangement.access
    value: dict[str, Json] = {
        "arrangement": arrangement.name,
        "policy": digest,
        "levels": [] if access is None else list(access.levels),
        "machines": {m.name: _level(access, m) for m in arrangement.machines},
        "users": {} if access is None else {name: access.levels[level] for name, level in access.users.items()},
        "operators": [[o.kind, o.target] for o in arrangement.operated],
        "rights": [
            {"who": r.who, "what": r.what, "target": r.target, "may": r.may, "does": r.does}
            for r in rights(arrangement)
            if r.may or r.does
        ],
    }
    return json.dumps(value, indent=2) + "\n"


def access_text(arrangement: Arrangement, digest: str) -> str:
    """A few lines for each machine and user."""
    access, every = arrangement.access, rights(arrangement)
    first = "there is no `access`: each machine may do everything"
    lines = [first if access is None else f"levels, the lowest first: {', '.join(access.levels)}"]
    for machine in arrangement.machines:
        lines += _machine_lines(access, machine, [r for r in every if r.who == machine.name])
    return "\n".join([*lines, *_user_lines(arrangement), f"policy {digest}"]) + "\n"


def _machine_lines(access: Access | None, machine: Machine, own: list[Right]) -> Iterator[str]:
    level = _level(access, machine)
    yield f"machine {machine.name}" + (f" ({level})" if level else "")
    yield from _listed("does", [r for r in own if r.does and r.may])
    yield from _listed("is refused", [r for r in own if r.does and not r.may])
    if access is not None:
        yield from _listed("may also", [r for r in own if r.may and not r.does and not _common(access, r)])


def _user_lines(arrangement: Arrangement) -> Iterator[str]:
    access = arrangement.access
    users: dict[str, int] = {} if access is None else dict(access.users)
    declared = [(o.kind, o.target) for o in (*arrangement.operators, *arrangement.replaceable)]
    for user in [*users, "others"] if declared else users:
        level = "" if access is None else f" ({access.levels[users.get(user, 0)]})"
        yield f"user {user}{level}" if user != "others" else f"other users{level}"
        granted = [pair for pair in declared if _granted(access, users.get(user, 0), *pair)]
        yield from _listed("may", [Right(user, kind, target, True, False) for kind, target in granted])
        if user in {operator.target for operator in arrangement.policy_users}:
            yield "  may change the policy"


def access_graph(arrangement: Arrangement) -> Graph:
    """Machines and users on one side, what has a class above the lowest, or is used, on the other. Solid edges: does;
    dashed ones: may, and does not."""
    access = arrangement.access
    keys = {m.name: f"m{i}" for i, m in enumerate(arrangement.machines)}
    written = {f"w{i}": w for i, w in enumerate(arrangement.whiteboard) if w.role != "input"}
    slots = {w.variable.name: key for key, w in written.items()}
    nodes = [
        Node(keys[m.name], m.name, tuple(filter(None, [_level(access, m)])), "machine") for m in arrangement.machines
    ]
    nodes += [Node(k, w.variable.name, _class(access, w.variable.name), w.role) for k, w in written.items()]
    edges: dict[tuple[str, str, bool], list[str]] = {}
    for r in filter(partial(_drawn, access), rights(arrangement)):
        target = slots[r.target] if r.what == WRITE else keys[r.target]
        what = r.what if r.may else f"{r.what} (refused)"
        edges.setdefault((keys[r.who], target, r.does), []).append("" if what == WRITE else what)
    drawn = tuple(
        Edge(source, target, ", ".join(filter(None, what)), "write" if does else "read")
        for (source, target, does), what in edges.items()
    )
    legend: tuple[tuple[EdgeKind, str], ...] = (("write", "does"), ("read", "may, and does not"))
    return Graph(f"{arrangement.name}: who may do what", tuple(nodes), drawn, "arrangement", legend)


def _drawn(access: Access | None, right: Right) -> bool:
    """It is used, or not everyone has it."""
    return right.does or (right.may and access is not None and not _common(access, right))


def _common(access: Access, right: Right) -> bool:
    """Everybody may do it, or a machine to itself."""
    if right.what == WRITE:
        return access.write_class(right.target) == 0
    return access.command_class(right.target) == 0 or right.who == right.target


def _granted(access: Access | None, level: int, kind: str, target: str) -> bool:
    if access is None:
        return True
    return level >= (access.write_class(target) if kind == WRITE else access.command_class(target))


def _listed(what: str, found: list[Right]) -> Iterator[str]:
    """A line for what is written, and one for each group of machines that have the same commands."""
    kinds: dict[str, list[str]] = {}
    for right in found:
        kinds.setdefault(right.target if right.what != WRITE else "", []).append(right.what)
    written = [right.target for right in found if right.what == WRITE]
    if written:
        yield f"  {what} write {', '.join(written)}"
    groups: dict[tuple[str, ...], list[str]] = {}
    for target, commands in kinds.items():
        if target:
            groups.setdefault(tuple(commands), []).append(target)
    for given, targets in groups.items():
        yield f"  {what} {', '.join(given)} {', '.join(targets)}"


def _level(access: Access | None, machine: Machine) -> str:
    return "" if access is None else access.levels[access.clearance(machine.name)]


def _class(access: Access | None, variable: str) -> tuple[str, ...]:
    return () if access is None else (access.levels[access.write_class(variable)],)

"""Who may do what: the keys `access` and `operators`, and the texts that do what they may not."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping
from typing import cast

from llfsm_verify.arrangement import keys
from llfsm_verify.arrangement.keys import OPERATORS
from llfsm_verify.arrangement.model import POLICY, Access, Machine, Operator, OperatorKind, WhiteboardVariable
from llfsm_verify.diagnostics import Span
from llfsm_verify.language.scope import did_you_mean
from llfsm_verify.language.types import ArrayType, IntType, RecordType
from llfsm_verify.yaml.fields import Report
from llfsm_verify.yaml.nodes import Node, mark


def resolve_access(
    report: Report, node: Node | None, machines: Mapping[str, object], whiteboard: tuple[WhiteboardVariable, ...],
    broken: Container[str] = (),
) -> Access | None:  # fmt: skip
    """What the key `access` says; None where it is not there, or wrong in a way that leaves no levels. `broken`: names
    whose declarations are wrong.
    """
    fields = None if node is None else report.fields(node, "`access`", keys.POLICY.keys, keys.POLICY.required)
    sequence = None if fields is None else report.sequence(fields["levels"], "`levels`")
    if fields is None or sequence is None:
        return None
    levels: list[str] = []
    marks = {"levels": mark(sequence)}
    for item in sequence.items:
        scalar = report.scalar(item, "a level")
        name = None if scalar is None else report.name(scalar, "the name of a level")
        if name in levels:
            report.error("E099", f"the level `{name}` appears twice here", mark(item), "remove one")
        elif name is not None:
            levels.append(name)
    if not levels:
        report.error("E099", "there are no levels", mark(sequence), "write them from the lowest to the highest")
        return None
    slots = {w.variable.name: w for w in whiteboard if w.role != "input"}

    def table(key: str, known: Mapping[str, object] | None, what: str) -> dict[str, int]:
        mapping = report.mapping(fields[key], f"`{key}`") if key in fields else None
        found: dict[str, int] = {}
        for name, value in mapping.items if mapping else ():
            level = report.scalar(value, f"the level of `{name.text[:60]}`")
            if name.text in broken:
                continue
            if known is not None and name.text not in known:
                hint = did_you_mean(name.text, known)
                if any(w.variable.name == name.text for w in whiteboard):
                    hint = "inputs are written by the surroundings, and have no class"
                report.error("E099", f"there is no {what} `{name.text[:60]}`", name.span, hint)
            elif level is not None and level.text not in levels:
                hint = did_you_mean(level.text, levels)
                report.error("E099", f"there is no level `{level.text[:60]}`", mark(level), hint)
            elif level is not None:
                found[name.text] = levels.index(level.text)
                marks[f"{key}.{name.text}"] = mark(level)
        return found

    return Access(
        tuple(levels), table("machines", machines, "machine"), table("write", slots, "output or shared variable"),
        table("command", machines, "machine"), table("users", None, "user"),
        report.choice(fields.get("on_violation"), "`on_violation`", ("reject", "refuse"), "reject") == "refuse",
        marks,
    )  # fmt: skip


def check_access(
    report: Report, access: Access, machines: Iterable[Machine], operators: Iterable[Operator],
    whiteboard: Iterable[WhiteboardVariable],
) -> None:  # fmt: skip
    """Report the texts that do what they may not, unless that is refused when they run, and what must have a class."""
    declared = {w.variable.name: w.variable.span for w in whiteboard}
    unnamed: dict[str, str] = {}
    for machine in machines:
        for variable, span in machine.writes():
            if access.clearance(machine.name) and variable not in access.write:
                unnamed.setdefault(variable, machine.name)
            if not access.refuses and not access.may_write(machine.name, variable):
                denial = access.write_denial(machine.name, variable)
                _deny(report, access, machine.name, denial, access.write_class(variable), span)
        for command in machine.commands():
            if not access.refuses and not access.may_command(machine.name, command.kind, command.machine):
                denial = access.command_denial(machine.name, command.kind, command.machine)
                _deny(report, access, machine.name, denial, access.command_class(command.machine), command.span)
    for variable, writer in unnamed.items():
        level = access.levels[access.clearance(writer)]
        message = f"machine `{writer}` ({level}) writes `{variable}`, to which `access` gives no class"
        report.error("E158", message, declared[variable], f"write `write: {{{variable}: {level}}}`")
    most = max([0, *access.users.values()])
    for operator in operators:
        if operator.kind == POLICY:
            _check_policy_user(report, access, operator)
            continue
        write = operator.kind == "write"
        needed = access.write_class(operator.target) if write else access.command_class(operator.target)
        if needed > most:
            message = f"nobody may {operator.kind} `{operator.target}`: it needs `{access.levels[needed]}`"
            hint = f"give a user the level: `users: {{NAME: {access.levels[needed]}}}`"
            report.error("E157", message, operator.span, hint)


def _check_policy_user(report: Report, access: Access, operator: Operator) -> None:
    """Report a user who may give rights that he does not have himself."""
    has, needed = access.users.get(operator.target, 0), len(access.levels) - 1
    if has < needed:
        name, level = operator.target[:60], access.levels[needed]
        message = f"user `{name}` ({access.levels[has]}) may not change the policy: that needs `{level}`"
        report.error("E157", message, operator.span, f"give the user the level: `users: {{{name}: {level}}}`")


def _deny(report: Report, access: Access, machine: str, denial: str, needed: int, span: Span) -> None:
    clearance = f"`machines: {{{machine}: {access.levels[needed]}}}`"
    hint = f"give the machine the clearance, {clearance}, or let it ask another machine"
    report.error("E157", denial, span, hint)


def resolve_operators(
    report: Report, node: Node | None, machines: Mapping[str, object], whiteboard: tuple[WhiteboardVariable, ...],
    broken: Container[str] = (),
) -> tuple[Operator, ...]:  # fmt: skip
    """What the key `operators` allows, in its order. `broken`: names whose declarations are wrong."""
    fields = None if node is None else report.fields(node, "`operators`", OPERATORS.keys)
    found: list[Operator] = []
    variables = {w.variable.name: w for w in whiteboard}
    for kind, value in (fields or {}).items():
        sequence = report.sequence(value, f"`{kind}`")
        seen: set[str] = set()
        for item in sequence.items if sequence else ():
            scalar = report.scalar(item, f"an entry of `{kind}`")
            if scalar is None or scalar.text in broken:
                continue
            name = scalar.text
            if name in seen:
                report.error("E098", f"`{name}` appears twice here", mark(scalar), "remove one")
            elif kind == "write" and name not in variables:
                hint = did_you_mean(name, variables) or "declare it under `whiteboard`"
                report.error("E098", f"there is no whiteboard variable `{name[:60]}`", mark(scalar), hint)
            elif kind == "write" and (problem := _unwritable(variables[name])):
                report.error(
                    "E098", f"operators cannot write `{name}`: {problem}", mark(scalar), "name another variable"
                )
            elif kind not in ("write", POLICY) and name not in machines:
                report.error("E098", f"there is no machine `{name[:60]}`", mark(scalar), did_you_mean(name, machines))
            else:
                found.append(Operator(cast(OperatorKind, kind), name, mark(scalar)))
            seen.add(name)
    return tuple(found)


def check_replaceable(report: Report, operator: Operator, machines: Iterable[Machine]) -> None:
    """Report a machine that cannot be replaced alone: what is inside a state, and what has others inside its own."""
    machine = next((m for m in machines if m.name == operator.target), None)
    if machine is not None and (machine.nested or any(state.runs for state in machine.states)):
        message = f"`{machine.name}` cannot be replaced alone: it runs inside a state, or has others inside its own"
        report.error("E159", message, operator.span, "leave it out")


def _unwritable(entry: WhiteboardVariable) -> str | None:
    if entry.role == "input":
        return "the surroundings write inputs"
    if isinstance(entry.variable.type, ArrayType | RecordType):
        return "it has several parts"
    if isinstance(entry.variable.type, IntType):
        return "`int` has infinitely many values"
    return None

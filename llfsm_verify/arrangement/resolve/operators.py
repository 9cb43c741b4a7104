"""Operators: what people and other programs may do to a running arrangement."""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping
from typing import cast

from llfsm_verify.arrangement.keys import OPERATORS
from llfsm_verify.arrangement.model import POLICY, Machine, Operator, OperatorKind, WhiteboardVariable
from llfsm_verify.language.scope import did_you_mean
from llfsm_verify.language.types import ArrayType, IntType, RecordType
from llfsm_verify.yaml.fields import Report
from llfsm_verify.yaml.nodes import Node, mark


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

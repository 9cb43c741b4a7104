"""Initial values and other constants, checked against the type they are for."""

from __future__ import annotations

from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.language.scope import Scope, did_you_mean
from llfsm_verify.language.statements import check_constant
from llfsm_verify.language.types import ArrayType, FixedType, RecordType, ScalarType, Type, Value
from llfsm_verify.yaml.fields import Report
from llfsm_verify.yaml.nodes import Mapping, Node, Scalar, Sequence, mark


def read_value(report: Report, node: Node, kind: Type, scope: Scope, what: str) -> Value | None:
    """The value of type `kind` that `node` describes: a constant expression, a list, or a mapping of fields.

    None when it is wrong, which has then been reported.
    """
    if isinstance(kind, ArrayType):
        return _array(report, node, kind, scope, what)
    if isinstance(kind, RecordType):
        return _record(report, node, kind, scope, what)
    return read_constant(report, node, kind, scope, what)


def read_constant(report: Report, node: Node, kind: ScalarType, scope: Scope, what: str) -> int | bool | None:
    if not isinstance(node, Scalar):
        report.error("E050", f"{what} is {kind}: one value is expected", mark(node))
        return None
    parsed = report.guard(node, "init")
    if parsed is None:
        return None
    try:
        value = check_constant(parsed, scope, kind, what)
    except DiagnosticError as e:
        report.add(e)
        return None
    if isinstance(kind, FixedType) and not kind.low <= value <= kind.high:
        report.error("E128", f"{value} is outside {what}'s range {kind.low}..{kind.high}", mark(node))
        return None
    return value


def _array(report: Report, node: Node, kind: ArrayType, scope: Scope, what: str) -> Value | None:
    if not isinstance(node, Sequence):
        report.error("E050", f"{what} is {kind}: a list is expected", mark(node), "write `[…, …]`")
        return None
    if len(node.items) != kind.size:
        report.error("E050", f"{what} has {kind.size} elements, this list has {len(node.items)}", mark(node))
        return None
    values = [read_value(report, item, kind.element, scope, what) for item in node.items]
    return None if None in values else tuple(v for v in values if v is not None)


def _record(report: Report, node: Node, kind: RecordType, scope: Scope, what: str) -> Value | None:
    if not isinstance(node, Mapping):
        report.error(
            "E050", f"{what} is {kind}: a mapping of its fields is expected", mark(node), "write `{x: …, y: …}`"
        )
        return None
    given = {key.text: (key, value) for key, value in node.items}
    names = [name for name, _ in kind.fields]
    for name, (key, _) in given.items():
        if name not in names:
            report.error("E115", f"there is no field `{name[:60]}` in {kind}", key.span, did_you_mean(name, names))
    values: list[Value] = []
    for name, field_type in kind.fields:
        if name not in given:
            report.error("E051", f"field `{name}` of {what} has no value", mark(node), f"write `{name}: …`")
            continue
        value = read_value(report, given[name][1], field_type, scope, f"field `{name}` of {what}")
        if value is not None:
            values.append(value)
    return tuple(values) if len(values) == len(names) == len(given) else None

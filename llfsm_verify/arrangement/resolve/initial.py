"""Initial values and other constants, checked against the type they are for, and tables of numbers."""

from __future__ import annotations

import re
from collections.abc import Iterable
from fractions import Fraction

from llfsm_verify.arrangement.draft import Entry
from llfsm_verify.arrangement.keys import MOST_NUMBERS
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.language.scope import Scope, Table, did_you_mean
from llfsm_verify.language.statements import check_constant
from llfsm_verify.language.types import (
    MAX_DIGITS,
    ArrayType,
    DecimalType,
    FixedType,
    RangeType,
    RecordType,
    ScalarType,
    Type,
    Value,
    fits_in_64_bits,
)
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


SMALLER = "write numbers from -9223372036854775808 to 9223372036854775807, in steps of the smallest digit"
_NUMBER = re.compile(r"-?[0-9]{1,20}(?:\.([0-9]{1,20}))?\Z")


def resolve_tables(report: Report, drafts: Iterable[Entry], taken: Iterable[str]) -> dict[str, Table]:
    """The tables by name; `taken` are names that enumerators and whiteboard variables have."""
    found: dict[str, Table] = {}
    names = frozenset(taken)
    for key, node in drafts:
        name = report.name(key, "the name of a table")
        listed = report.sequence(node, "a table")
        if name is None or listed is None:
            continue
        if name in names:
            report.error("E118", f"there is already something called `{name}`", key.span, "choose another name")
            continue
        if not 1 <= len(listed.items) <= MOST_NUMBERS:
            message = f"a table has from 1 to {MOST_NUMBERS:,} numbers, not {len(listed.items):,}"
            report.error("E047", message, mark(node), "write, for example, `[0.00, 0.50, 0.87, 1.00]`")
            continue
        numbers = _numbers(report, listed.items)
        if numbers is None:
            continue
        digits = max(d for _, d in numbers)
        steps = tuple(int(number * 10**digits) for number, _ in numbers)
        low, high = min(steps), max(steps)
        if not fits_in_64_bits(low, high):
            report.error("E129", "a number of this table does not fit in 64 bits with a sign", mark(node), SMALLER)
            continue
        kind = DecimalType(digits, low, high) if digits else RangeType(low, high)
        found[name] = Table(name, steps, kind, key.span)
    return found


def _numbers(report: Report, items: Iterable[Node]) -> list[tuple[Fraction, int]] | None:
    """Each number and how many digits are after its point; None: an item is not a number, and that is reported."""
    numbers: list[tuple[Fraction, int]] = []
    for item in items:
        scalar = report.scalar(item, "a number of a table")
        if scalar is None:
            return None
        matched = _NUMBER.match(scalar.text)
        digits = 0 if matched is None or matched[1] is None else len(matched[1])
        if matched is None or digits > MAX_DIGITS:
            message = f"`{scalar.text[:40]}` is not a number that a table can have"
            report.error("E047", message, mark(item), f"write digits, at most {MAX_DIGITS} after the point")
            return None
        numbers.append((Fraction(matched[0]), digits))
    return numbers

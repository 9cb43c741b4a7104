"""Mappings of logs: which column gives which slot, and what its cells mean."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction

from llfsm_verify import DiagnosticError
from llfsm_verify.extensions.logs.codes import UNKNOWN
from llfsm_verify.plug import (
    FORMAT_KEY,
    TRUTHS,
    ByName,
    Choice,
    Either,
    Field,
    MappingNode,
    Node,
    Report,
    Scalar,
    Single,
    Span,
    Table,
    ValueProblem,
    Words,
    choice_value,
    compose,
    decimal_text,
    did_you_mean,
    mark,
    read_source,
    schema_of,
)  # fmt: skip

_NAME = Single(("string", "number"))
ROUND = ("never", "nearest")
COLUMN = Table(
    "a column whose cells are not written as properties write values",
    (
        Field("column", "its name", _NAME, required=True),
        Field("values", "what cells mean: the value of the slot for each text", ByName(Single())),
        Field("scale", "a number that cells are multiplied with", _NAME),
        Field("offset", "a number that is added after that", _NAME),
        Field(
            "round",
            "what to do with a number between two values of the type: refuse it, or take the nearest one",
            Words(ROUND),
        ),
    ),
)
UNITS = {"s": Fraction(1_000), "ms": Fraction(1), "us": Fraction(1, 1_000), "ns": Fraction(1, 1_000_000)}
"""The milliseconds of each unit of time."""
IN_NANOSECONDS = ("log_time", "publish_time")
"""Columns of MCAP, whose unit is known."""
TIME = Table(
    "a column with times that are not in seconds",
    (
        Field("column", "its name", _NAME, required=True),
        Field("unit", "the unit of its numbers", Words(tuple(UNITS))),
    ),
)
MAPPING = Table(
    "which column of a log gives which slot of an arrangement: `llfsm check-recording LOG --mapping FILE`",
    (
        FORMAT_KEY,
        Field(
            "columns",
            "the column of each slot: an input, a variable, an element of an array, or a machine, for its state",
            ByName(Either((_NAME, COLUMN))),
            required=True,
        ),
        Field(
            "time",
            "the column with the time of a row, in seconds or a date with a time, which does not fall; bounds in time "
            "compare it",
            Either((_NAME, TIME)),
        ),
        Field("topic", "of an MCAP file or a rosbag: the topic of which each message is a row", Single(("string",))),
        Field("ended", "`true`: the last row repeats forever. `false`: what came after it is not known", Words(TRUTHS)),
    ),
)
NUMBER = re.compile(r"[+-]?[0-9]{1,400}(?:\.[0-9]{1,1100})?(?:[eE][+-]?[0-9]{1,3})?\Z", re.ASCII)
"""As programs write numbers, the smallest ones too."""
_TRUTHS = {"true": 1, "True": 1, "TRUE": 1, "1": 1, "false": 0, "False": 0, "FALSE": 0, "0": 0}


@dataclass(frozen=True, slots=True)
class Column:
    """The column of one slot."""

    name: str
    choice: Choice
    """The values of the slot."""
    place: Span
    values: Mapping[str, int] = field(default_factory=dict)
    """The number of the value that each text means; empty: cells are written as values are."""
    scale: Fraction = Fraction(1)
    offset: Fraction = Fraction(0)
    nearest: bool = False

    def reader(self) -> Callable[[str], int]:
        """A function from a cell to the number of its value. It raises ValueProblem."""
        if self.values:
            return self._named
        if self.choice.labels:
            return lambda text: choice_value(self.choice, text)
        return self._truth if self.choice.type.boolean else self._number

    def _named(self, text: str) -> int:
        if text not in self.values:
            raise ValueProblem(f"`{text[:60]}` is not one of {', '.join(self.values)}")
        return self.values[text]

    def _truth(self, text: str) -> int:
        if text not in _TRUTHS:
            raise ValueProblem(f"`{text[:60]}` is neither true nor false")
        return _TRUTHS[text]

    def _number(self, text: str) -> int:
        kind = self.choice.type
        low, high = (decimal_text(bound, kind.digits) for bound in (kind.low, kind.high))
        if not NUMBER.match(text):
            raise ValueProblem(f"`{text[:60]}` is not a number from {low} to {high}")
        steps = (Fraction(text) * self.scale + self.offset) * 10**kind.digits
        number = round(steps) if self.nearest else int(steps)
        if steps != number and not self.nearest:
            what = f"multiple of {decimal_text(1, kind.digits)}" if kind.digits else "whole number"
            raise ValueProblem(f"`{text[:60]}` is not a {what}; `round: nearest` in the mapping takes the nearest one")
        if not kind.low <= number <= kind.high:
            raise ValueProblem(f"`{text[:60]}` is outside {low}..{high}")
        return number


@dataclass(frozen=True, slots=True)
class LogMapping:
    """What a mapping says."""

    columns: Mapping[str, Column]
    """By slot."""
    time: str | None
    topic: str | None
    ended: bool
    """Whether the last row repeats forever."""
    places: Mapping[str, Span]
    """Where each column, and the topic, is named."""
    unit: Fraction = Fraction(1_000)
    """The milliseconds of a unit of the column `time`."""


def read_mapping(path: str, slots: Mapping[str, Choice]) -> LogMapping:
    """The mapping in a file, for an arrangement with these slots.

    DiagnosticError: what any YAML file can have (E001 to E018, E030 to E036), a slot or value that there is not (E496).
    """
    source, _ = read_source(path)
    reader = _Reader(slots)
    found = reader.file(compose(source, reader.report.diagnostics))
    if reader.report.diagnostics or found is None:
        raise DiagnosticError(sorted(reader.report.diagnostics, key=lambda d: d.span.start if d.span else 0)[:50])
    return found


def schema(name: str) -> dict[str, object]:
    """The JSON Schema of a mapping."""
    return schema_of(name, "Mapping of a log", MAPPING)


class _Reader:
    def __init__(self, slots: Mapping[str, Choice]) -> None:
        self.report = Report()
        self._slots = slots
        self._places: dict[str, Span] = {}

    def file(self, root: Node) -> LogMapping | None:
        report = self.report
        if not report.can_read(root, "the mapping"):
            return None
        fields = report.fields(root, "a mapping", MAPPING.keys, MAPPING.required)
        mapping = None if fields is None else report.mapping(fields["columns"], "`columns`")
        if fields is None or mapping is None:
            return None
        if not mapping.items:
            report.error("E034", "there are no columns", mark(mapping), "write `SLOT: COLUMN`")
        columns: dict[str, Column] = {}
        for key, node in mapping.items:
            column = self._column(key, node)
            if column is not None:
                columns[key.text] = column
        time, unit = self._time(fields["time"]) if "time" in fields else (None, Fraction(1_000))
        topic = self._name(fields["topic"], "`topic`") if "topic" in fields else None
        ended = report.choice(fields.get("ended"), "`ended`", TRUTHS, "false")
        return LogMapping(columns, time, topic, ended == "true", self._places, unit)

    def _time(self, node: Node) -> tuple[str | None, Fraction]:
        """The column with the times, and the milliseconds of its unit."""
        unit: str | None = None
        if isinstance(node, MappingNode):
            found = self.report.fields(node, "`time`", TIME.keys, TIME.required)
            if found is None:
                return None, Fraction(1_000)
            unit = self.report.choice(found.get("unit"), "`unit`", tuple(UNITS), "s") if "unit" in found else None
            node = found["column"]
        name = self._name(node, "`time`")
        return name, UNITS[unit or ("ns" if name in IN_NANOSECONDS else "s")]

    def _name(self, node: Node, what: str) -> str | None:
        scalar = self.report.scalar(node, what)
        if scalar is None:
            return None
        self._places.setdefault(scalar.text, mark(scalar))
        return scalar.text

    def _column(self, key: Scalar, node: Node) -> Column | None:
        report, what = self.report, f"the column of `{key.text[:60]}`"
        choice = self._slots.get(key.text)
        if choice is None:
            hint = did_you_mean(key.text, self._slots) or "name an input, a variable, or a machine, for its state"
            report.error(UNKNOWN, f"there is no slot `{key.text[:60]}`", mark(key), hint)
        if not isinstance(node, MappingNode):
            name = self._name(node, what)
            return None if name is None or choice is None else Column(name, choice, mark(node))
        found = report.fields(node, what, COLUMN.keys, COLUMN.required)
        name = None if found is None else self._name(found["column"], what)
        if found is None or name is None or choice is None:
            return None
        values = self._values(found["values"], choice, key.text) if "values" in found else {}
        numbers = [k for k in ("scale", "offset", "round") if k in found]
        if numbers and (values or choice.labels or choice.type.boolean):
            reason = "the mapping names its values" if values else f"`{key.text[:60]}` is not a number"
            report.error(
                UNKNOWN, f"`{numbers[0]}` is for numbers, and {reason}", mark(found[numbers[0]]), "leave it out"
            )
        scale = self._number(found.get("scale"), "scale", Fraction(1))
        offset = self._number(found.get("offset"), "offset", Fraction(0))
        nearest = report.choice(found.get("round"), "`round`", ROUND, "never") == "nearest"
        return Column(name, choice, mark(found["column"]), values, scale, offset, nearest)

    def _values(self, node: Node, choice: Choice, slot: str) -> dict[str, int]:
        mapping = self.report.mapping(node, "`values`")
        found: dict[str, int] = {}
        if mapping is not None and not mapping.items:
            self.report.error("E034", "`values` has no value", mark(node), "write `TEXT: VALUE`, or leave it out")
        for key, value in () if mapping is None else mapping.items:
            scalar = self.report.scalar(value, f"the value of `{key.text[:60]}`")
            if scalar is None:
                continue
            try:
                found[key.text] = choice_value(choice, scalar.text)
            except ValueProblem as problem:
                self.report.error(UNKNOWN, f"{slot}: {problem}", mark(scalar), "write a value of its type")
        return found

    def _number(self, node: Node | None, key: str, default: Fraction) -> Fraction:
        scalar = None if node is None else self.report.scalar(node, f"`{key}`")
        if scalar is None:
            return default
        if not NUMBER.match(scalar.text):
            self.report.error(
                UNKNOWN, f"`{key}` cannot be `{scalar.text[:40]}`", mark(scalar), "write a number such as 0.1"
            )
            return default
        return Fraction(scalar.text)

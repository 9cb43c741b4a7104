"""Types as people write them, resolved to the types of the language."""

from __future__ import annotations

import re
from collections.abc import Iterable
from fractions import Fraction

from llfsm_verify.arrangement.draft import Entry
from llfsm_verify.arrangement.keys import ARRAY, DECIMAL, MAX_ELEMENTS, RECORD
from llfsm_verify.arrangement.model import DeclaredType
from llfsm_verify.diagnostics import Span
from llfsm_verify.language.scope import DECIMAL_NAMES, DECIMAL_TYPE, TYPE_NAMES, did_you_mean
from llfsm_verify.language.statements import BEYOND, basic_type
from llfsm_verify.language.types import (
    MAX_DIGITS,
    ArrayType,
    DecimalType,
    EnumType,
    RangeType,
    RecordType,
    ScalarType,
    Type,
    fits_in_64_bits,
)
from llfsm_verify.yaml.fields import Report
from llfsm_verify.yaml.nodes import Mapping, Node, Scalar, Sequence, mark

_RANGE = re.compile(r"(-?[0-9]{1,20})\s*\.\.\s*(-?[0-9]{1,20})\Z")
_STEP = re.compile(r"0\.(0*1)\Z")
_DECIMAL_RANGE = re.compile(r"(-?[0-9]{1,20}(?:\.[0-9]{1,20})?)\s*\.\.\s*(-?[0-9]{1,20}(?:\.[0-9]{1,20})?)\Z")
_MAX_TYPE_DEPTH = 32


def elements(t: Type) -> int:
    """How many scalars a value of the type consists of."""
    if isinstance(t, ArrayType):
        return t.size * elements(t.element)
    if isinstance(t, RecordType):
        return sum(elements(f) for _, f in t.fields)
    return 1


_TEXTS = "there are no texts: declare an enumeration under `types`"


class TypeTable:
    """The named types of an arrangement, resolved in whatever order they refer to each other."""

    def __init__(self, report: Report, drafts: Iterable[Entry]) -> None:
        self.report = report
        self.types: dict[str, Type] = {}
        self.broken: set[str] = set()
        self._pending: dict[str, Node] = {}
        self._open: list[str] = []
        self._places: dict[str, Span] = {}
        self._named_in: dict[str, set[str]] = {}
        """For each name of a type, the types in whose declarations it stands; "" is any other place."""
        for key, value in drafts:
            name = report.name(key, "the name of a type")
            if name is not None:
                self._pending[name] = value
                self._places[name] = key.span
        declared = tuple(self._pending)
        for name in declared:
            self._resolve(name)
        self.types = {name: self.types[name] for name in declared if name in self.types}

    def declared(self) -> tuple[DeclaredType, ...]:
        """The types as they are declared, and where each is named."""
        places = {name: frozenset(self._named_in.get(name, ())) for name in self.types}
        return tuple(DeclaredType(name, self._places[name], places[name]) for name in self.types)

    def _resolve(self, name: str) -> Type | None:
        if name in self._pending:
            node = self._pending.pop(name)
            self._open.append(name)
            found = self._enumeration(name, node) if isinstance(node, Sequence) else self.read(node, "a type")
            self._open.pop()
            if found is None:
                self.broken.add(name)
            else:
                self.types[name] = found
        return self.types.get(name)

    def _enumeration(self, name: str, node: Sequence) -> EnumType | None:
        values: list[str] = []
        for item in node.items:
            value = self.report.name(item, "a value of an enumeration")
            if value is None:
                return None
            if value in values:
                self.report.error("E044", f"`{value}` appears twice in enumeration `{name}`", mark(item))
                return None
            values.append(value)
        if not values:
            self.report.error("E044", f"enumeration `{name}` has no values", mark(node), "write `[ON, OFF]`")
            return None
        return EnumType(name, tuple(values))

    def read(self, node: Node, what: str, depth: int = 1) -> Type | None:
        """The type that `node` describes; None when it is wrong, which has then been reported."""
        if depth + len(self._open) > _MAX_TYPE_DEPTH:
            self.report.error("E043", f"the type is nested more than {_MAX_TYPE_DEPTH} deep", mark(node))
            return None
        found: Type | None
        if isinstance(node, Scalar):
            found = self._named(node, what)
        elif isinstance(node, Mapping):
            found = self._compound(node, depth)
        else:
            self.report.error("E042", f"{what} cannot be a list", mark(node), "declare the enumeration under `types`")
            return None
        if found is not None and elements(found) > MAX_ELEMENTS:
            self.report.error("E043", f"a value of this type has more than {MAX_ELEMENTS:,} elements", mark(node))
            return None
        return found

    def read_scalar(self, node: Node, what: str) -> ScalarType | None:
        found = self.read(node, what)
        if isinstance(found, ArrayType | RecordType):
            self.report.error("E042", f"{what} cannot be {found}", mark(node), "use a type without parts")
            return None
        return found

    def _named(self, node: Scalar, what: str) -> Type | None:
        text = node.text.strip()
        bounds = _RANGE.match(text)
        if bounds:
            low, high = int(bounds[1]), int(bounds[2])
            if low > high:
                self.report.error("E042", f"the range {text} is empty", mark(node), f"write `{high}..{low}`")
                return None
            if not fits_in_64_bits(low, high):
                self.report.error("E129", "this range does not fit in 64 bits with a sign", mark(node), BEYOND)
                return None
            return RangeType(low, high)
        basic = basic_type(text)
        if basic is not None:
            return basic
        if text in self._open:
            self.report.error("E041", f"type `{text}` contains itself", mark(node))
            return None
        found = self._resolve(text)
        self._named_in.setdefault(text, set()).add(self._open[-1] if self._open else "")
        if found is None and text not in self.broken:
            known = (*TYPE_NAMES, *self.types, *self._pending)
            hint = DECIMAL_TYPE if text.lower() in DECIMAL_NAMES or _DECIMAL_RANGE.match(text) else None
            hint = (
                hint
                or _type_meant(text)
                or did_you_mean(text, known)
                or "write `bool`, `0..15`, `int8` to `uint64`, `int` or a name from `types`"
            )
            self.report.error(
                "E040", f"there is no type `{text[:60]}`" if text else f"{what} is missing", mark(node), hint
            )
        return found

    def _compound(self, node: Mapping, depth: int) -> Type | None:
        keys = {key.text for key, _ in node.items}
        if "record" in keys:
            fields = self.report.fields(node, "a record type", RECORD.keys)
            return None if fields is None else self._record(fields["record"], depth)
        if keys & {"decimal", "range"}:
            fields = self.report.fields(node, "a decimal type", DECIMAL.keys, DECIMAL.required)
            return None if fields is None else self._decimal(fields["decimal"], fields["range"])
        if keys and not keys & {"array", "size"}:
            known = "`{array: TYPE, size: N}`, `{record: {x: TYPE}}` or `{decimal: 0.01, range: -1.0..1.0}`"
            values = next((value for key, value in node.items if key.text == "enum"), None)
            listed = ", ".join(key.text for key, _ in node.items[:6])
            if isinstance(values, Sequence):
                known = "the list alone, under `types`"
            elif all(isinstance(value, Scalar) and not value.text for _, value in node.items):
                known = f"`[{listed}]` for an enumeration"
            self.report.error("E042", "this is not a type", mark(node), f"write {known}")
            return None
        fields = self.report.fields(node, "an array type", ARRAY.keys, ARRAY.required)
        if fields is None:
            return None
        element = self.read(fields["array"], "the type of the elements", depth + 1)
        size = self.report.scalar(fields["size"], "the size of an array")
        if size is None:
            return None
        if not size.text.isascii() or not size.text.isdigit() or not 1 <= int(size.text[:9]) <= MAX_ELEMENTS:
            self.report.error("E045", f"the size of an array is a number from 1 to {MAX_ELEMENTS}", mark(size))
            return None
        return None if element is None else ArrayType(element, int(size.text[:9]))

    def _decimal(self, step: Node, bounds: Node) -> DecimalType | None:
        """Numbers between two multiples of a step that is a power of ten."""
        written, limits = self.report.scalar(step, "the step of a decimal"), self.report.scalar(bounds, "a range")
        if written is None or limits is None:
            return None
        found = _STEP.match(written.text.strip())
        if found is None or len(found[1]) > MAX_DIGITS:
            smallest = "0." + "0" * (MAX_DIGITS - 1) + "1"
            message = f"the step of a decimal is 0.1, 0.01 and so on, not `{written.text[:40]}`"
            self.report.error("E046", message, mark(written), f"write a power of ten from 0.1 to {smallest}")
            return None
        digits = len(found[1])
        ends = _DECIMAL_RANGE.match(limits.text.strip())
        if ends is None:
            message = "the range of a decimal is two numbers with `..` between them"
            self.report.error("E046", message, mark(limits), "write, for example, `-1.0..1.0`")
            return None
        low, high = (Fraction(ends[i]) * 10**digits for i in (1, 2))
        for number, text in ((low, ends[1]), (high, ends[2])):
            if number.denominator != 1:
                message = f"{text} is not a multiple of the step {written.text.strip()}"
                self.report.error("E046", message, mark(limits), "write a multiple, or a smaller step")
                return None
        if low > high:
            self.report.error(
                "E042", f"the range {limits.text} is empty", mark(limits), f"write `{ends[2]}..{ends[1]}`"
            )
            return None
        if not fits_in_64_bits(low, high):
            self.report.error(
                "E129", "the steps of this range do not fit in 64 bits", mark(limits), "use a larger step"
            )
            return None
        return DecimalType(digits, int(low), int(high))

    def _record(self, node: Node, depth: int) -> RecordType | None:
        mapping = self.report.mapping(node, "a record's fields")
        if mapping is None:
            return None
        fields: list[tuple[str, Type]] = []
        for key, value in mapping.items:
            name = self.report.name(key, "the name of a field")
            kind = self.read(value, "the type of a field", depth + 1)
            if name is None or kind is None:
                return None
            fields.append((name, kind))
        if not fields:
            self.report.error("E042", "a record needs at least one field", mark(node))
            return None
        return RecordType(tuple(fields))


def _type_meant(text: str) -> str | None:
    """What to write for a range or a list of values in another notation."""
    ends = re.fullmatch(r"[(\[]?\s*(-?\d+)\s*(?:-|\.{3}|:|to|,)\s*(-?\d+)\s*[)\]]?", text)
    if ends is not None:
        return f"write `{ends[1]}..{ends[2]}`"
    if (given := re.fullmatch(r"([\w.]+)\s*=\s*(\w+)", text)) is not None:
        return f"write `type: {given[1]}, init: {given[2]}`"
    words = re.findall(r"[A-Za-z_]\w*", text[:200], re.ASCII)
    if len(words) > 1 and re.fullmatch(r"[(]?[-\w\s,;|]+[)]?", text) and re.search("[,;|]|^-", text):
        return f"write `[{', '.join(words[:6])}{', …' if len(words) > 6 else ''}]` under `types`"
    return _TEXTS if text.lower() in ("string", "str", "char", "text") else None

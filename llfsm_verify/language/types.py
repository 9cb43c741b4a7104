"""The types of the modelling language."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class BoolType:
    """True or false."""

    def __str__(self) -> str:
        return "bool"


@dataclass(frozen=True, slots=True)
class RangeType:
    """A bounded integer: a store outside `low` … `high` is a fault."""

    low: int
    high: int

    def __str__(self) -> str:
        return f"{self.low}..{self.high}"


@dataclass(frozen=True, slots=True)
class FixedType:
    """A fixed-width integer, two's complement: a store wraps."""

    bits: int
    signed: bool

    @property
    def low(self) -> int:
        return -(1 << (self.bits - 1)) if self.signed else 0

    @property
    def high(self) -> int:
        return (1 << (self.bits - (1 if self.signed else 0))) - 1

    def __str__(self) -> str:
        return f"{'' if self.signed else 'u'}int{self.bits}"


@dataclass(frozen=True, slots=True)
class IntType:
    """A mathematical integer; also the type of the result of arithmetic."""

    def __str__(self) -> str:
        return "int"


@dataclass(frozen=True, slots=True)
class EnumType:
    """An enumeration; a value is the index of its name in `values`."""

    name: str
    values: tuple[str, ...]

    def __str__(self) -> str:
        return self.name


@dataclass(frozen=True, slots=True)
class ArrayType:
    """`size` values of one type, counted from 0."""

    element: Type
    size: int

    def __str__(self) -> str:
        return f"array of {self.size} {self.element}"


@dataclass(frozen=True, slots=True)
class RecordType:
    """A record; two records are the same type when their fields are."""

    fields: tuple[tuple[str, Type], ...]

    def __str__(self) -> str:
        return "record {" + ", ".join(f"{n}: {t}" for n, t in self.fields) + "}"


ScalarType = BoolType | RangeType | FixedType | IntType | EnumType
Type = ScalarType | ArrayType | RecordType

INTEGERS = (RangeType, FixedType, IntType)

Value = int | bool | tuple["Value", ...]
"""A value of a type: a bool for `bool`; an int for integers and for enumerations (the index); for an array the tuple
of its elements; for a record the tuple of its fields' values in declared order."""


def is_integer(t: Type) -> bool:
    return isinstance(t, INTEGERS)


def has_int(t: Type) -> bool:
    """Whether a value of the type is or contains one of the type `int`, which has no range."""
    if isinstance(t, ArrayType):
        return has_int(t.element)
    if isinstance(t, RecordType):
        return any(has_int(field) for _, field in t.fields)
    return isinstance(t, IntType)


def default_value(t: Type) -> Value:
    """What a variable without `init` starts with: false, 0 (the nearest bound where 0 is outside), the first name."""
    if isinstance(t, BoolType):
        return False
    if isinstance(t, RangeType):
        return min(max(0, t.low), t.high)
    if isinstance(t, ArrayType):
        return (default_value(t.element),) * t.size
    if isinstance(t, RecordType):
        return tuple(default_value(f) for _, f in t.fields)
    return 0

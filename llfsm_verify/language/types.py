"""The types of the modelling language."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from llfsm_verify.diagnostics import counted


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
class DecimalType:
    """A decimal number, held as a whole number of steps of ``10 ** -digits``: a store truncates towards zero to a step,
    and is a fault outside `low` … `high` (in steps). Without them: the type of the result of arithmetic."""

    digits: int
    low: int | None = None
    high: int | None = None

    def __str__(self) -> str:
        if self.low is None or self.high is None:
            return f"decimal with {counted(self.digits, 'digit')} after the point"
        return f"{decimal_text(self.low, self.digits)}..{decimal_text(self.high, self.digits)}"


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


ScalarType = BoolType | RangeType | FixedType | IntType | DecimalType | EnumType
Type = ScalarType | ArrayType | RecordType

INTEGERS = (RangeType, FixedType, IntType)

Value = int | bool | tuple["Value", ...]
"""A value of a type: a bool for `bool`; an int for integers, decimals (in steps) and enumerations (the index); for an
array the tuple of its elements; for a record the tuple of its fields' values in declared order."""


MAX_DIGITS = 18
"""Digits after the point of any decimal: a step is not smaller than this."""


def fits_in_64_bits(*numbers: Fraction | int) -> bool:
    """Whether integers with a sign can hold all of these."""
    return all(-(1 << 63) <= number < 1 << 63 for number in numbers)


def is_integer(t: Type) -> bool:
    return isinstance(t, INTEGERS)


def is_number(t: Type) -> bool:
    """Whether one can calculate with it: an integer or a decimal."""
    return isinstance(t, (*INTEGERS, DecimalType))


def digits_of(t: Type) -> int:
    """The digits after the point of a number's type; 0 of everything else."""
    return t.digits if isinstance(t, DecimalType) else 0


def decimal_text(value: int, digits: int) -> str:
    """`value` steps of ``10 ** -digits`` as people write it: ``-0.05``."""
    if digits == 0:
        return str(value)
    whole, part = divmod(abs(value), 10**digits)
    return f"{'-' if value < 0 else ''}{whole}.{part:0{digits}}"


def scalar_text(value: int | bool, t: ScalarType) -> str:
    """A value as guards, actions and files write it."""
    if isinstance(t, BoolType):
        return str(bool(value)).lower()
    if isinstance(t, EnumType):
        return t.values[int(value)]
    return decimal_text(int(value), digits_of(t))


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
    if isinstance(t, DecimalType) and t.low is not None and t.high is not None:
        return min(max(0, t.low), t.high)
    if isinstance(t, ArrayType):
        return (default_value(t.element),) * t.size
    if isinstance(t, RecordType):
        return tuple(default_value(f) for _, f in t.fields)
    return 0

"""Where the language's variables live in a step program: records flattened, arrays kept, inputs by element."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

from llfsm_verify.language import types as lt
from llfsm_verify.language.types import Value
from llfsm_verify.program.program import BOOL, UNBOUNDED, Int, Type


@lru_cache(maxsize=4096)
def machine_type(t: lt.ScalarType) -> Type:
    """The step-program type that holds the values of a scalar type of the language."""
    if isinstance(t, lt.BoolType):
        return BOOL
    if isinstance(t, lt.EnumType):
        return Int(0, len(t.values) - 1)
    if isinstance(t, lt.IntType):
        return UNBOUNDED
    if isinstance(t, lt.DecimalType):
        return UNBOUNDED if t.low is None or t.high is None else Int(t.low, t.high, digits=t.digits)
    return Int(t.low, t.high)


def labels(t: lt.ScalarType) -> tuple[str, ...]:
    return t.values if isinstance(t, lt.EnumType) else ()


@dataclass(frozen=True, slots=True)
class Leaf:
    """One scalar, or one array of scalars, of a variable's type.

    `suffix` is appended to the variable's name (``.x``); `dimensions` are the sizes of the arrays on the way, outermost
    first; the elements of a leaf are numbered in row-major order.
    """

    suffix: str
    type: lt.ScalarType
    dimensions: tuple[int, ...]
    pattern: str
    """The path as users write it, ``{}`` for each index: ``[{}].x``."""

    @property
    def length(self) -> int | None:
        size = 1
        for d in self.dimensions:
            size *= d
        return size if self.dimensions else None


def leaves(t: lt.Type, suffix: str = "", dimensions: tuple[int, ...] = (), pattern: str = "") -> Iterator[Leaf]:
    """The leaves of a type in declared order."""
    if isinstance(t, lt.ArrayType):
        yield from leaves(t.element, suffix, (*dimensions, t.size), pattern + "[{}]")
    elif isinstance(t, lt.RecordType):
        for name, field in t.fields:
            yield from leaves(field, f"{suffix}.{name}", dimensions, f"{pattern}.{name}")
    else:
        yield Leaf(suffix, t, dimensions, pattern)


def leaf_values(t: lt.Type, value: Value) -> Iterator[int | tuple[int, ...]]:
    """The values of the leaves of `t`, in the order of `leaves`, of a `value` of type `t`."""
    for index, leaf in enumerate(leaves(t)):
        flat = list(_leaf_scalars(t, value, index))
        yield tuple(flat) if leaf.dimensions else flat[0]


def _leaf_scalars(t: lt.Type, value: Value, index: int) -> Iterator[int]:
    if isinstance(t, lt.ArrayType):
        assert isinstance(value, tuple)
        for element in value:
            yield from _leaf_scalars(t.element, element, index)
    elif isinstance(t, lt.RecordType):
        assert isinstance(value, tuple)
        for (_, field), part in zip(t.fields, value, strict=True):
            count = sum(1 for _ in leaves(field))
            if index < count:
                yield from _leaf_scalars(field, part, index)
                return
            index -= count
    else:
        assert isinstance(value, (int, bool))
        yield int(value)


def element_names(base: str, t: lt.Type) -> Iterator[tuple[str, lt.ScalarType]]:
    """Each scalar of a variable with its full name (``a[1].x``), in declared order."""
    if isinstance(t, lt.ArrayType):
        for i in range(t.size):
            yield from element_names(f"{base}[{i}]", t.element)
    elif isinstance(t, lt.RecordType):
        for name, field in t.fields:
            yield from element_names(f"{base}.{name}", field)
    else:
        yield base, t


def element_values(t: lt.Type, value: Value) -> Iterator[int]:
    """The scalars of a value in the order of `element_names`."""
    if isinstance(t, lt.ArrayType):
        assert isinstance(value, tuple)
        for part in value:
            yield from element_values(t.element, part)
    elif isinstance(t, lt.RecordType):
        assert isinstance(value, tuple)
        for (_, field), part in zip(t.fields, value, strict=True):
            yield from element_values(field, part)
    else:
        assert isinstance(value, (int, bool))
        yield int(value)

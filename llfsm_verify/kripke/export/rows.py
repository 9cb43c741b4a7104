"""The values of many configurations as text, written quickly: what neighbouring fields say together is written once."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import groupby

from llfsm_verify.kripke.structure import Structure
from llfsm_verify.program.program import Var
from llfsm_verify.values import Shown, element_names, shown

PORTION = 1 << 13
"""Configurations or edges written between two looks at the limits."""
TOGETHER = 14
"""Bits of neighbouring fields whose texts are remembered together, one for each value that occurs."""


@dataclass(frozen=True, slots=True)
class Element:
    """A scalar of a configuration: a variable, or element `index` of an array."""

    name: str
    variable: Var
    index: int | None

    def shown(self, value: int) -> Shown:
        """A number of it as users write it."""
        return shown(self.variable.type, self.variable.origin.labels, value)


Column = tuple[Element, Callable[[Shown], str]]
"""What to write of each configuration: an element, and the text of its value."""


def elements(structure: Structure) -> dict[str, Element]:
    """The scalars of a configuration by their names, in declared order."""
    found = {}
    for v in structure.program.vars:
        if not v.output:
            for i, name in enumerate(element_names(v)):
                found[name] = Element(name, v, None if v.length is None else i)
    return found


def portions(start: int, end: int) -> Iterator[tuple[int, int]]:
    """The numbers start … end - 1 in pieces of at most `PORTION`."""
    return ((at, min(at + PORTION, end)) for at in range(start, end, PORTION))


class _Texts(dict[int, str]):
    """The texts of values, each made when it first occurs."""

    def __init__(self, text: Callable[[int], str]) -> None:
        self._text = text

    def __missing__(self, value: int) -> str:
        made = self[value] = self._text(value)
        return made


class RowWriter:
    """Writes the columns of configurations, `between` them."""

    def __init__(self, structure: Structure, columns: Sequence[Column], between: str) -> None:
        self._structure = structure
        self._between = between
        self._groups = [_Group(structure, list(group)) for group in _together(structure, columns)]

    def of(self, start: int, end: int) -> list[str]:
        """The texts of the configurations start … end - 1."""
        texts = [group.of(slice(start, end), self._between) for group in self._groups]
        if len(texts) == 1:
            return texts[0]
        return list(map(self._between.join, zip(*texts, strict=True))) if texts else [""] * (end - start)


def _together(structure: Structure, columns: Sequence[Column]) -> list[list[Column]]:
    """Neighbouring columns in groups of at most `TOGETHER` bits, or of one."""
    numbers, used, group = [], 0, 0
    for element, _ in columns:
        bits = structure.layout.fields[element.variable.name].bits
        used += bits
        if used > TOGETHER:
            group, used = group + 1, bits
        numbers.append(group)
    pairs = zip(numbers, columns, strict=True)
    return [[column for _, column in found] for _, found in groupby(pairs, key=lambda pair: pair[0])]


class _Group:
    """Columns whose values together make one number, the last one in its lowest bits."""

    def __init__(self, structure: Structure, columns: list[Column]) -> None:
        self._structure = structure
        self._columns = columns
        self._fields = [structure.layout.fields[e.variable.name] for e, _ in columns]
        self._known: _Texts | None = None

    def of(self, rows: slice, between: str) -> list[str]:
        columns = [self._structure.column(e.variable.name, e.index, rows) for e, _ in self._columns]
        if len(columns) == 1 and self._fields[0].bits > TOGETHER:  # too many to be remembered
            element, text = self._columns[0]
            return [text(element.shown(value)) for value in columns[0].tolist()]
        together = columns[0] - self._fields[0].low
        for values, field in zip(columns[1:], self._fields[1:], strict=True):
            together = (together << field.bits) | (values - field.low)
        if self._known is None:
            self._known = _Texts(partial(self._text, between))
        return list(map(self._known.__getitem__, together.tolist()))

    def _text(self, between: str, together: int) -> str:
        parts = []
        for (element, text), field in zip(reversed(self._columns), reversed(self._fields), strict=True):
            parts.append(text(element.shown((together & ((1 << field.bits) - 1)) + field.low)))
            together >>= field.bits
        return between.join(reversed(parts))

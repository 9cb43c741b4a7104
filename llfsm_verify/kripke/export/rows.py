"""Configurations and edges as the text formats write them, in portions.

Configurations are written quickly: what neighbouring fields say together is made once. Edges have letters, and how each
is taken.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from time import monotonic

from llfsm_verify.kripke.steps import Step, Steps
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


STEPS_UPTO = 100_000
"""In structures of more configurations the edges do not say how they are taken: finding that out takes a while."""
SECONDS = 0.1
"""How long steps are found out before they are written."""


@dataclass(frozen=True, slots=True)
class Edges:
    """Some edges, a list item each: configurations, the row of the alphabet, the ways to take it (None: not known)."""

    sources: list[int]
    targets: list[int]
    labels: list[int]
    steps: list[tuple[Step, ...]] | None


def steps_known(structure: Structure) -> bool:
    """Edges say how they are taken."""
    return structure.program.observe == "ringlet" and len(structure) <= STEPS_UPTO


def edges(structure: Structure) -> Iterator[Edges]:
    """All edges in the order of their sources, in portions that are made in a moment each."""
    if steps_known(structure):
        yield from _with_steps(structure)
        return
    import numpy as np

    s = structure
    for start, end in portions(0, len(s.targets)):
        sources = s.indptr.searchsorted(np.arange(start, end), side="right") - 1
        yield Edges(sources.tolist(), s.targets[start:end].tolist(), s.labels[start:end].tolist(), None)


def _with_steps(structure: Structure) -> Iterator[Edges]:
    steps, s = Steps(structure), structure
    sources, targets, labels = list[int](), list[int](), list[int]()
    taken = list[tuple[Step, ...]]()
    began = monotonic()
    for source in range(s.expanded):
        start, end = int(s.indptr[source]), int(s.indptr[source + 1])
        ways = steps.of(source)
        sources += [source] * (end - start)
        targets += s.targets[start:end].tolist()
        labels += s.labels[start:end].tolist()
        taken += [ways.get(number, ()) for number in range(start, end)]
        if monotonic() - began > SECONDS:
            yield Edges(sources, targets, labels, taken)
            sources, targets, labels, taken = [], [], [], []
            began = monotonic()
    if sources:
        yield Edges(sources, targets, labels, taken)


def letters(structure: Structure) -> list[tuple[str, ...]]:
    """The propositions that hold in each letter of the alphabet."""
    return [tuple(n for n, x in zip(structure.propositions, row, strict=True) if x) for row in structure.alphabet]


def initial_letters(structure: Structure, start: int, end: int) -> dict[int, tuple[str, ...]]:
    """The atoms that hold in c0, by initial configuration; of those numbered start … end - 1."""
    first, last = structure.roots.searchsorted([start, end])
    rows = zip(structure.roots[first:last].tolist(), structure.first[first:last], strict=True)
    return {root: tuple(n for n, x in zip(structure.atoms, row, strict=True) if x) for root, row in rows}


def ways(steps: tuple[Step, ...]) -> str:
    """How an edge is taken, in a line."""
    return " or ".join(map(str, steps))

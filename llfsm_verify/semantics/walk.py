"""What typed guards and actions contain: commands, clock bounds and reads of inputs."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from math import floor

from llfsm_verify.language import types as lt
from llfsm_verify.language.constants import longest
from llfsm_verify.language.trees import nodes, of_kind
from llfsm_verify.language.typed import After, Command, Field, Index, Literal, Read, Unary
from llfsm_verify.semantics.storage import element_names


def input_reads(root: object, inputs: frozenset[str]) -> list[Read]:
    """Reads of the whiteboard variables named in `inputs`."""
    return [r for r in of_kind(root, Read) if r.variable.name in inputs]


def elements(read: Read) -> list[str]:
    """The scalars that a read whose indices are constants has, by their full names (``a[1].x``)."""
    name, kind = read.variable.name, read.variable.type
    for step in read.path:
        if isinstance(step, Field):
            assert isinstance(kind, lt.RecordType)
            name, kind = f"{name}.{step.name}", kind.fields[step.index][1]
        else:
            assert isinstance(kind, lt.ArrayType)
            name, kind = f"{name}[{constant_index(step)}]", kind.element
    return [n for n, _ in element_names(name, kind)]


def constant_index(step: Index) -> int:
    """The index that a step of a property's path says."""
    value = step.value
    sign = 1
    while isinstance(value, Unary) and value.op == "neg":
        sign, value = -sign, value.operand
    assert isinstance(value, Literal), "the atom checker allows constant indices only"
    return sign * int(value.value)


@dataclass(frozen=True, slots=True)
class Survey:
    """What guards and actions contain that decides which control variables there are."""

    commands: tuple[Command, ...]
    bounds: tuple[Bound, ...]


def survey(root: object) -> Survey:
    """The commands and the bounds of `after` in some guards and actions, in order."""
    found = [n for n in nodes(root) if isinstance(n, (Command, After))]
    return Survey(
        tuple(n for n in found if isinstance(n, Command)), tuple(_bound(n) for n in found if isinstance(n, After))
    )


@dataclass(frozen=True, slots=True)
class Bound:
    """The bound of one `after`: a constant in ms, or the largest value of an expression."""

    constant: Fraction | None
    largest: Fraction

    def ticks(self, cycle_ms: Fraction | None) -> int:
        """The last tick at which `after` does not hold yet."""
        assert cycle_ms is not None
        return floor(self.largest / cycle_ms)


def _bound(after: After) -> Bound:
    largest = longest(after)
    assert largest is not None, "the loader asks for a bound"
    return Bound(after.bound if isinstance(after.bound, Fraction) else None, largest)

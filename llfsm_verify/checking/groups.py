"""Which properties are searched together: groups by what they have letters try and the program remember
(docs/decisions/0064-groups.md).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.problem import Problem, only_shown
from llfsm_verify.language import types as lt
from llfsm_verify.language.trees import nodes
from llfsm_verify.language.typed import Edge, Expression, Observe, Read, Sampled
from llfsm_verify.logic.bounds import TICK
from llfsm_verify.logic.properties import Property
from llfsm_verify.program.program import Int
from llfsm_verify.semantics.letters import TimePasses
from llfsm_verify.semantics.storage import element_names, machine_type
from llfsm_verify.semantics.walk import elements

MOST = 3
"""Bits of what is needed up to which properties with different needs share a search."""
WIDE = 3
"""Bits that a wide value counts: a search looks at classes of its values."""


@dataclass(frozen=True, slots=True)
class Group:
    """The part of a problem that one search decides, and what its properties need beside the assumptions."""

    problem: Problem
    needs: tuple[str, ...]


def groups_of(problem: Problem, most: int = MOST) -> tuple[Group, ...]:
    """The groups of a problem, those that need least first; one, with the problem as it is, where all its atoms need no
    more than `most` bits together.

    The properties that need most come first (as in first-fit decreasing: D. Johnson, Near-optimal bin packing
    algorithms, 1973), and each goes where it costs least. A group of n properties that needs b bits costs 2^b for its
    exploration, half of that for the search of each property, and about twice 2^most to be lowered and compiled.
    """
    needs = {a.name: dict(_needs(problem.arrangement, a.expression)) for a in problem.searched}
    weight = {name: bits for of_atom in needs.values() for name, bits in of_atom.items()}

    def wanted(line: Property) -> frozenset[str]:
        return frozenset(name for atom in line.searched for name in needs[atom])

    def bits(names: frozenset[str]) -> int:
        return sum(weight[name] for name in names)

    def cost(names: frozenset[str], count: int) -> int:
        return (2 + count) << bits(names)

    assumed = frozenset[str]().union(*map(wanted, problem.assumptions))
    if bits(frozenset(weight) - assumed) <= most:
        return (Group(problem, tuple(n for n in weight if n not in assumed)),)
    made: list[tuple[frozenset[str], list[Property]]] = []
    own = [(wanted(line) - assumed, line) for line in problem.properties]
    for mine, line in sorted(own, key=lambda each: -bits(each[0])):
        prices = [cost(names | mine, len(lines) + 1) - cost(names, len(lines)) for names, lines in made]
        price = min(prices, default=None)
        if price is None or price > (4 << most) - 4 + cost(mine, 1):
            made.append((mine, [line]))
        else:
            names, lines = made[prices.index(price)]
            made[prices.index(price)] = names | mine, [*lines, line]
    made = sorted(made, key=lambda each: bits(each[0])) or [(assumed, [])]
    return tuple(_group(problem, lines, [name for name in weight if name in names]) for names, lines in made)


def _group(problem: Problem, lines: Sequence[Property], needs: Sequence[str]) -> Group:
    """These properties, in their order, with the atoms that they and the assumptions name. An edge that only
    properties of other groups have as a hidden variable is shown, and no more."""
    lines = tuple(line for line in problem.properties if line in lines)
    both = (*lines, *problem.assumptions)
    named = {TICK, *(atom for line in both for atom in (*line.atoms, *line.searched))}
    atoms = tuple(a for a in problem.atoms if a.name in named)
    return Group(replace(problem, properties=lines, atoms=atoms, shown=only_shown(both)), tuple(needs))


def _needs(arrangement: Arrangement, e: Expression | TimePasses) -> Iterator[tuple[str, int]]:
    """What an atom needs: inputs, whose values letters try, or which are stored as long as a letter may see them, and
    what is stored for it alone. What a step did (``m.ran``, ``m.read(x)``) hardly makes more of what it leads to."""
    inputs = {w.variable.name for w in arrangement.whiteboard if w.role == "input" and w.changes != "never"}
    for node in nodes(e):
        match node:
            case Read(variable) if variable.name in inputs:
                yield from _scalars(node, "")
            case Sampled(machine, variable, path, kind, span):
                read = Read(variable, path, kind, span)
                held = arrangement.profile.snapshot == "cycle"
                yield from _scalars(read, "" if held else f"{machine}.sampled " if machine else "sampled ")
            case Edge(_, operand, _, span):
                yield " ".join(span.text.split()), sum(_bits(kind) for _, kind in element_names("", operand.type))
            case Observe("entered" | "finished", machine):
                yield f"{machine}.{node.kind}", 1


def _scalars(read: Read, prefix: str) -> Iterator[tuple[str, int]]:
    kinds = (kind for _, kind in element_names("", read.type))
    return ((f"{prefix}{name}", _bits(kind)) for name, kind in zip(elements(read), kinds, strict=True))


def _bits(scalar: lt.ScalarType) -> int:
    kind = machine_type(scalar)
    return min(WIDE, (kind.high - kind.low).bit_length()) if isinstance(kind, Int) else WIDE

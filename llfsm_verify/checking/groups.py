"""Which properties are searched together: groups by what they have letters try and the program remember
(docs/decisions/0064-groups.md).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import compress

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.problem import Problem
from llfsm_verify.language import types as lt
from llfsm_verify.language.trees import nodes
from llfsm_verify.language.typed import Edge, Expression, Observe, Read, Sampled, Sampling
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

    First-fit decreasing (D. Johnson, Near-optimal bin packing algorithms, 1973). A property then goes to the group that
    needs least among those that have what it needs; to one that needs more than `most` bits only if it does so itself.
    """
    needs = {a.name: dict(_needs(problem.arrangement, a.expression)) for a in problem.atoms}
    weight = {name: bits for of_atom in needs.values() for name, bits in of_atom.items()}

    def wanted(lines: Iterable[Property]) -> frozenset[str]:
        return frozenset(name for line in lines for atom in line.atoms for name in needs[atom])

    def bits(names: frozenset[str]) -> int:
        return sum(weight[name] for name in names)

    def suits(mine: frozenset[str], group: frozenset[str]) -> bool:
        return mine <= group and (bits(group) <= most or bits(mine) > most)

    assumed = wanted(problem.assumptions)
    if bits(frozenset(weight) - assumed) <= most:
        return (Group(problem, tuple(n for n in weight if n not in assumed)),)
    own = [wanted((line,)) - assumed for line in problem.properties] or [frozenset()]
    made: list[frozenset[str]] = []
    for mine in sorted(own, key=lambda mine: -bits(mine)):
        if not any(suits(mine, group) for group in made):
            place = next((i for i, group in enumerate(made) if bits(group | mine) <= most), len(made))
            made[place : place + 1] = [mine.union(*made[place : place + 1])]
    made.sort(key=bits)
    chosen = [next(group for group in made if suits(mine, group)) for mine in own]
    used = [group for group in made if any(group is each for each in chosen)]
    return tuple(_group(problem, [each is group for each in chosen], weight, group) for group in used)


def _group(problem: Problem, mine: Sequence[bool], weight: Iterable[str], needs: frozenset[str]) -> Group:
    """The properties that are `mine`, with the atoms that they and the assumptions name."""
    lines = tuple(compress(problem.properties, mine))
    named = {TICK, *(atom for line in (*lines, *problem.assumptions) for atom in line.atoms)}
    part = replace(problem, properties=lines, atoms=tuple(a for a in problem.atoms if a.name in named))
    return Group(part, tuple(name for name in weight if name in needs))


def _needs(arrangement: Arrangement, e: Expression | TimePasses) -> Iterator[tuple[str, int]]:
    """What an atom needs: inputs, whose values letters try, or which are stored as long as a letter may see them, and
    what is stored for it alone."""
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
            case Observe("ran" | "fired", machine) if arrangement.observe == "cycle":
                yield f"{machine}.{node.kind}{'' if node.state < 0 else f' {node.state}.{node.transition}'}", 1
            case Sampling(machine, variable) if arrangement.observe == "cycle":
                yield f"{machine}.read {variable.name}", 1


def _scalars(read: Read, prefix: str) -> Iterator[tuple[str, int]]:
    kinds = (kind for _, kind in element_names("", read.type))
    return ((f"{prefix}{name}", _bits(kind)) for name, kind in zip(elements(read), kinds, strict=True))


def _bits(scalar: lt.ScalarType) -> int:
    kind = machine_type(scalar)
    return min(WIDE, (kind.high - kind.low).bit_length()) if isinstance(kind, Int) else WIDE

"""A walk through a graph: what a search hands to the maker of counterexamples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from llfsm_verify.kripke.graph import Letters
from llfsm_verify.kripke.paths import PathStep
from llfsm_verify.kripke.product import ProductNode


@dataclass(frozen=True, slots=True)
class Walk:
    """Nodes of the graph, and what each of the steps between them shows: a letter, those of a chain, None for nothing.

    ``len(letters) == len(nodes) - 1``. The last step may be the first part of a chain. With `loop` the last node equals
    ``nodes[loop]`` and the walk goes on from there forever. With `ends` it goes one step or chain further, up to a step
    that shows this letter; then the letters before were not looked at, which are all None.
    """

    nodes: tuple[int, ...]
    letters: tuple[Letters, ...]
    loop: int | None = None
    ends: int | None = None

    @property
    def shown(self) -> tuple[int, ...]:
        """The letters of all steps, one after the other."""
        words = ((each,) if isinstance(each, int) else each or () for each in self.letters)
        return tuple(letter for word in words for letter in word)


def walk(start: ProductNode, steps: Sequence[PathStep], loop: int | None = None) -> Walk:
    """The steps of a search as a walk; `loop` is the number of steps before the loop."""
    return Walk((start[0], *(s.target[0] for s in steps)), tuple(s.letter for s in steps), loop)


def join(stem: Walk, rest: Walk) -> Walk:
    """`stem`, which ends where `rest` begins, and then `rest`."""
    loop = None if rest.loop is None else len(stem.letters) + rest.loop
    return Walk((*stem.nodes, *rest.nodes[1:]), (*stem.letters, *rest.letters), loop)

"""A sample of mutants, balanced over the rooms of the package and, in each, over the operators."""

from __future__ import annotations

import random
from collections import defaultdict
from math import sqrt
from pathlib import PurePosixPath

from tests.mutation.operators import Mutant, compiles, mutants
from tests.mutation.scratch import Project


def sample(project: Project, number: int, seed: int) -> list[Mutant]:
    """So many mutants; the same ones for the same seed and source.

    A room gets its share by the square root of how many mutants it has: large rooms more, small ones enough to be seen.
    Within a room the operators take turns.
    """
    sources = {path.relative_to(project.root).as_posix(): path.read_bytes() for path in project.sources()}
    rooms: dict[str, dict[str, list[Mutant]]] = defaultdict(lambda: defaultdict(list))
    for file, source in sources.items():
        for mutant in mutants(file, source):
            rooms[room(file)][mutant.operator].append(mutant)
    chance = random.Random(seed)
    drawn: list[Mutant] = []
    for name, wanted in _shares({name: sum(map(len, found.values())) for name, found in rooms.items()}, number).items():
        drawn += _draw(rooms[name], wanted, chance, sources)
    return drawn


def room(file: str) -> str:
    """The folder of a file; a module beside the rooms is one of its own."""
    parts = PurePosixPath(file).parts[1:]
    return "/".join(parts[:-1]) or parts[-1]


def _shares(sizes: dict[str, int], number: int) -> dict[str, int]:
    """How many of `number` each room gets: the largest remainders are rounded up."""
    weights = {name: sqrt(size) for name, size in sizes.items()}
    exact = {name: number * weight / sum(weights.values()) for name, weight in weights.items()}
    shares = {name: int(value) for name, value in exact.items()}
    by_remainder = sorted(exact, key=lambda name: (shares[name] - exact[name], name))
    for name in by_remainder[: number - sum(shares.values())]:
        shares[name] += 1
    return {name: min(shares[name], sizes[name]) for name in sorted(shares)}


def _draw(
    found: dict[str, list[Mutant]], wanted: int, chance: random.Random, sources: dict[str, bytes]
) -> list[Mutant]:
    left = {operator: found[operator][:] for operator in sorted(found)}
    drawn: list[Mutant] = []
    while len(drawn) < wanted and left:
        turn = list(left)
        chance.shuffle(turn)
        for operator in turn:
            mutant = left[operator].pop(chance.randrange(len(left[operator])))
            if not left[operator]:
                del left[operator]
            if len(drawn) < wanted and compiles(mutant.apply(sources[mutant.file])):
                drawn.append(mutant)
    return drawn

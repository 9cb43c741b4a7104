"""What several machines that explore one space together would send each other, counted on spaces that one explores.

`python -m benchmarks.shards [--only TEXT] [--write PAGE]`. A configuration belongs to the shard that its hash names.
Whoever expands a node sends its successors to their shards, level by level: all shards wait for each other at the end
of a level. A successor that goes to another shard crosses. `dropped` are those that need not be sent, because a cache
of the sender, with one slot for each hash modulo its size, has sent them last.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks import writing
from benchmarks.ring import ring
from llfsm_verify.arrangement.loader import load_arrangement, load_arrangement_text
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.limits import endless_budget
from llfsm_verify.semantics.lowering import lower

ROOT = Path(__file__).parents[1]
NAME = "benchmarks.shards"
SHARDS = (2, 4, 8, 16)
CACHE = 1 << 16
"""Slots of the cache of a sender."""
PARENT_BYTES, LETTER_BYTES = 4, 4
"""What goes with the words of a successor: who sends it, and what the step shows."""
HEADINGS = ["space", "configurations", "levels", *(f"{shards} shards" for shards in SHARDS), "largest"]
"""A cell of shards: successors that cross, those that the cache lets through, and MB a second of a shard that
expands nodes at the speed of one core. `largest`: of 16 shards, beside the mean."""
Words = NDArray[np.uint64]


@dataclass(frozen=True, slots=True)
class Space:
    """A graph that was explored: for each edge its source and target, for each node its hash and level."""

    name: str
    sources: NDArray[np.int64]
    targets: NDArray[np.int64]
    hashes: Words
    levels: int
    node_bytes: int
    seconds: float
    """That one core took to explore it."""

    def __len__(self) -> int:
        return len(self.hashes)


@dataclass(frozen=True, slots=True)
class Traffic:
    """With so many shards: edges that cross, those that the cache does not drop, and nodes of the largest shard."""

    shards: int
    crossing: int
    sent: int
    largest: int


def spaces() -> Iterable[tuple[str, Arrangement]]:
    """What is explored."""
    for name in ("microwave", "vacuum"):
        yield name, load_arrangement(str(ROOT / "models" / name / "arrangement.yaml"))
    for size in (5, 6):
        yield f"ring({size},3)", load_arrangement_text(ring(size, 3))


def explored(name: str, arrangement: Arrangement) -> Space:
    """The whole space, explored on one core."""
    explorer = Explorer(lower(arrangement, ()), endless_budget())
    try:
        began = time.process_time()
        explorer.explore(None)
        seconds = time.process_time() - began
        graph = explorer.graph
        words = np.frombuffer(graph.keys.read(0, 8 * graph.words * graph.count), np.uint64).reshape(graph.count, -1)
        first = np.frombuffer(graph.first.read(0, 8 * (graph.count + 1)), np.int64)
        targets = np.frombuffer(graph.targets.read(0, 4 * graph.edge_count), np.uint32).astype(np.int64)
        sources = np.repeat(np.arange(graph.count), np.diff(first))
        return Space(name, sources, targets, hashed(words), graph.depth + 1, 8 * graph.words, seconds)
    finally:
        explorer.close()


def hashed(words: Words) -> Words:
    """A hash value for each row: the finaliser of MurmurHash3 (A. Appleby, 2011), word after word."""
    found = np.zeros(len(words), np.uint64)
    for column in words.T:
        found ^= column
        for factor in (0xFF51AFD7ED558CCD, 0xC4CEB9FE1A85EC53):
            found ^= found >> np.uint64(33)
            found *= np.uint64(factor)
        found ^= found >> np.uint64(33)
    return found


def traffic(space: Space, shards: int, cache: int = CACHE) -> Traffic:
    """What crosses between so many shards."""
    owner = (space.hashes % np.uint64(shards)).astype(np.int64)
    senders, receivers = owner[space.sources], owner[space.targets]
    crossing = senders != receivers
    sent = 0
    for shard in range(shards):
        going = space.targets[crossing & (senders == shard)]
        sent += len(going) - repeated(going, space.hashes, cache)
    return Traffic(shards, int(crossing.sum()), sent, int(np.bincount(owner, minlength=shards).max()))


def repeated(going: NDArray[np.int64], hashes: Words, cache: int) -> int:
    """How many of these nodes are the last ones that went into their slots of the cache."""
    slots = (hashes[going] >> np.uint64(32)) % np.uint64(cache)
    order = np.argsort(slots, kind="stable")
    same = (slots[order][1:] == slots[order][:-1]) & (going[order][1:] == going[order][:-1])
    return int(same.sum())


def row(space: Space, found: list[Traffic]) -> list[str]:
    """Cells of a line of the table."""
    edges, each = len(space.targets), space.node_bytes + PARENT_BYTES + LETTER_BYTES
    cells = [
        f"{one.crossing / edges:.0%}/{one.sent / edges:.0%}/{one.sent * each / space.seconds / 1e6:.0f}"
        for one in found
    ]
    largest = found[-1].largest * found[-1].shards / len(space)
    return [space.name, f"{len(space):,}", f"{space.levels:,}", *cells, f"{largest:.2f}×"]


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog=f"python -m {NAME}", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--only", default="", metavar="TEXT", help="spaces whose names contain the text")
    parser.add_argument("--write", type=Path, metavar="PAGE", help="put the table into this page as well")
    options = parser.parse_args(arguments)
    if options.write is not None:
        writing.check(parser, options.write, NAME)
    lines = []
    for name, arrangement in spaces():
        if options.only in name:
            space = explored(name, arrangement)
            lines.append(row(space, [traffic(space, shards) for shards in SHARDS]))
    table = writing.markdown(HEADINGS, lines)
    print(table)
    if options.write is not None:
        how = f"a cache of {CACHE:,} slots a shard"
        writing.replace(options.write, NAME, f"{table}\n\n{writing.signature(NAME, how)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

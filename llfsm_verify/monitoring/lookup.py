"""Monitors as tables that are walked without a branch: a state and some bits of the letter at a time lead on."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

MAX_NODES = 50_000
MAX_BYTES = 1 << 23
CACHED = 1 << 15
"""Bytes of tables that stay in the fastest cache."""
WIDTHS = (8, 6, 4, 3, 2, 1)
WIDEST = 12
"""A letter of so many bits may be one index."""
MAX_ENTRIES = 1 << 15
"""Of a stage that is to be found by 16 bits, on a machine whose arrays have no more than 32,767 bytes."""


class MonitorTooLarge(Exception):
    """The tables of a monitor have too many entries."""


class MonitorStep(Protocol):
    """A step for all letters in which the atoms of `positive` hold and those of `negative` do not (bit i: atom i)."""

    @property
    def positive(self) -> int: ...
    @property
    def negative(self) -> int: ...
    @property
    def target(self) -> int: ...


class Stepping(Protocol):
    """The part of `monitoring.monitor.Monitor` that is compiled (this stage comes before it).

    Deterministic and complete: all edges of a state that allow a letter lead to one state, and there is one.
    """

    @property
    def atoms(self) -> tuple[str, ...]: ...
    @property
    def edges(self) -> Sequence[Sequence[MonitorStep]]: ...


@dataclass(frozen=True, slots=True)
class WalkTable:
    """A step of a monitor as a walk: stage i reads the next `widths[i]` of the atoms in `places`, lowest first.

    `stages[i][node << widths[i] | bits]` is the node of the next stage, after the last one the next state. The first
    nodes are the states, numbered so that those from `settled` on are never left; `numbers[q]` is the new number of the
    monitor's state q.
    """

    places: tuple[int, ...]
    """The atoms that matter, by their index."""
    widths: tuple[int, ...]
    stages: tuple[tuple[int, ...], ...]
    settled: int
    numbers: tuple[int, ...]

    @property
    def states(self) -> tuple[int, ...]:
        """The monitor's state of each new number."""
        order = [0] * len(self.numbers)
        for state, number in enumerate(self.numbers):
            order[number] = state
        return tuple(order)

    def step(self, number: int, letter: int) -> int:
        """The walk, for those who check it: new numbers in and out, `letter` the mask of the atoms that hold."""
        node, at = number, 0
        for width, stage in zip(self.widths, self.stages, strict=True):
            bits = sum(1 << i for i, place in enumerate(self.places[at : at + width]) if letter >> place & 1)
            node, at = stage[node << width | bits], at + width
        return node


def first_states(
    tables: Sequence[WalkTable], atoms: Sequence[Sequence[str]], letter: Mapping[str, bool]
) -> ctypes.Array[ctypes.c_int64]:
    """The states of monitors that have read a first letter; there is room for one at least."""
    states = (ctypes.c_int64 * max(1, len(tables)))()
    for k, (table, own) in enumerate(zip(tables, atoms, strict=True)):
        states[k] = table.step(table.numbers[0], sum(1 << i for i, key in enumerate(own) if letter[key]))
    return states


_Cubes = frozenset[tuple[int, int, int]]
"""Positive atoms, negative atoms, target; atoms that have been read are shifted out."""


def walk_table(monitor: Stepping, *, look_up: int | None = None) -> WalkTable:
    """The tables of `monitor`. MonitorTooLarge: more than `MAX_NODES` nodes, or `MAX_BYTES` bytes.

    `look_up`: how many bytes a look-up less is worth, for a short table where memory is scarce: one without entries for
    settled states, and with stages of up to `MAX_ENTRIES` bytes (else MonitorTooLarge).

    All states together are one decision diagram with an entry for each, reduced level by level (Bryant, Graph-based
    algorithms for Boolean function manipulation, IEEE Trans. Computers 35, 1986), of which several levels are then
    taken at once.
    """
    settled = [all(edge.target == q for edge in row) for q, row in enumerate(monitor.edges)]
    order = sorted(range(len(settled)), key=lambda q: settled[q])
    numbers = [0] * len(order)
    for number, state in enumerate(order):
        numbers[state] = number
    mask = 0
    for row in monitor.edges:
        for edge in row:
            mask |= edge.positive | edge.negative
    places = [i for i in range(mask.bit_length()) if mask >> i & 1]

    def narrow(bits: int) -> int:
        return sum(1 << i for i, place in enumerate(places) if bits >> place & 1)

    roots = [
        _plain(frozenset((narrow(e.positive), narrow(e.negative), numbers[e.target]) for e in monitor.edges[state]))
        for state in order[: None if look_up is None else len(order) - sum(settled)]
    ]
    if not roots:
        return WalkTable((), (), (), 0, tuple(numbers))
    if not places:  # whatever the letter: a stage that reads no atom
        stage = tuple(next(iter(cubes))[2] for cubes in roots)
        return WalkTable((), (0,), (stage,), len(order) - sum(settled), tuple(numbers))
    levels = _levels(roots, len(places))
    widths = _widths(levels) if look_up is None else _short_widths(levels, len(order), look_up)
    stages = []
    at = 0
    for width in widths:
        stages.append(_stage(levels[at : at + width]))
        at += width
    return WalkTable(tuple(places), widths, tuple(stages), len(order) - sum(settled), tuple(numbers))


_Level = list[tuple[int, int]]
"""The nodes of one level: where each leads to in the next one without and with the level's atom."""


def _plain(cubes: _Cubes) -> _Cubes:
    """Cubes that all lead to one target are one."""
    targets = {target for _, _, target in cubes}
    return frozenset(((0, 0, next(iter(targets))),)) if len(targets) == 1 else cubes


def _levels(roots: Sequence[_Cubes], depth: int) -> list[_Level]:
    """A level for each atom; the nodes of the first are the roots, those after the last are targets."""
    queues: list[dict[_Cubes, int]] = [{}]
    first = [queues[0].setdefault(cubes, len(queues[0])) for cubes in roots]
    raw: list[_Level] = []
    made = 0
    for _ in range(depth):
        following: dict[_Cubes, int] = {}
        level: _Level = []
        for cubes in queues[-1]:
            low = _plain(frozenset((p >> 1, n >> 1, t) for p, n, t in cubes if not p & 1))
            high = _plain(frozenset((p >> 1, n >> 1, t) for p, n, t in cubes if not n & 1))
            level.append((following.setdefault(low, len(following)), following.setdefault(high, len(following))))
            if made + len(following) > MAX_NODES:
                raise MonitorTooLarge(f"the tables of a monitor have more than {MAX_NODES:,} nodes")
        made += len(following)
        raw.append(level)
        queues.append(following)
    below = [next(iter(cubes))[2] for cubes in queues[-1]]
    reduced: list[_Level] = []
    for level in reversed(raw):
        unique: dict[tuple[int, int], int] = {}
        below = [unique.setdefault((below[low], below[high]), len(unique)) for low, high in level]
        reduced.append(list(unique))
    reduced.reverse()
    if reduced:  # each state keeps a node of its own, which is its number
        top = reduced[0]
        reduced[0] = [top[below[node]] for node in first]
    return reduced


def _widths(levels: Sequence[_Level]) -> tuple[int, ...]:
    """How many levels are taken at once: as many as possible while the tables are small."""
    depth = len(levels)
    if depth == 0:
        return ()
    candidates: list[tuple[int, ...]] = [(depth,)] if depth <= WIDEST else []
    candidates += [(width,) * (depth // width) + ((depth % width,) if depth % width else ()) for width in WIDTHS]

    def size(widths: tuple[int, ...]) -> int:
        total = at = 0
        for width in widths:
            total += len(levels[at]) << width
            at += width
        return total * 2

    chosen = next((c for c in candidates if size(c) <= CACHED), min(candidates, key=size))
    if size(chosen) > MAX_BYTES:
        raise MonitorTooLarge(f"the tables of a monitor take more than {MAX_BYTES:,} bytes")
    return chosen


def _short_widths(levels: Sequence[_Level], states: int, look_up: int) -> tuple[int, ...]:
    """The widths whose bytes, and `look_up` for each stage, are the fewest."""
    depth = len(levels)
    best: list[tuple[int, tuple[int, ...]]] = [(0, ())]
    """For the first levels, so many: the bytes, and the widths."""
    for end in range(1, depth + 1):
        leads_to = len(levels[end]) if end < depth else states
        found = []
        for begin in range(max(0, end - WIDEST), end):
            cost, widths = best[begin]
            size = (len(levels[begin]) << end - begin) * entry_bytes(leads_to)
            if widths or begin == 0:
                found += [(cost + size + look_up, (*widths, end - begin))] if size <= MAX_ENTRIES - 1 else []
        best.append(min(found, default=(0, ())))
    if not best[-1][1]:
        raise MonitorTooLarge(f"a table of a monitor would have more than {MAX_ENTRIES - 1:,} bytes")
    return best[-1][1]


def entry_bytes(count: int) -> int:
    """Of a number below `count`."""
    return next(size for size in (1, 2, 4) if count <= 1 << 8 * size)


def _stage(levels: Sequence[_Level]) -> tuple[int, ...]:
    """The nodes of the first level by all bits of these levels: `node << width | bits`."""
    table = [node for pair in levels[-1] for node in pair]
    width = 1
    for level in reversed(levels[:-1]):
        size = 1 << width
        # The level's own bit is the lowest one: entries of its two successors alternate.
        table = [table[child * size + rest] for low, high in level for rest in range(size) for child in (low, high)]
        width += 1
    return tuple(table)

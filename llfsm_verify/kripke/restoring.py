"""Looking at a saved exploration before kernels use it: numbers in range, indices inside, values of their types.

Nothing here tells whether the configurations are those of the arrangement: only searching again would. But whatever the
file says, the kernels and the step program read and write where they may, and come to an end.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from llfsm_verify.backends.native.layout import WORD_BITS, BitField, Layout
from llfsm_verify.kripke.checkpoint import Numbers, need
from llfsm_verify.kripke.graph import EPSILON, NO_PREFIX, Graph
from llfsm_verify.kripke.kernels.chain_blocks import MAX_CHAIN
from llfsm_verify.kripke.memory import Region
from llfsm_verify.limits import Budget

if TYPE_CHECKING:
    from numpy.typing import NDArray

ROWS = 1 << 16
"""Configurations looked at at once."""


@dataclass(frozen=True, slots=True)
class Memory:
    """What was read: a graph, its letters and the words of its chains (None: it has none), with what they must fit.

    `roots` are the graph's initial nodes as they lie in memory, `mask` tells which bits letters may have.
    """

    graph: Graph
    layout: Layout
    roots: bytes
    letters: Region
    mask: bytes
    trie: Region | None

    def check(self, n: Numbers, budget: Budget) -> int:
        """The number of configurations, which are the nodes that are not in the middle of a cycle.

        Raises Unusable when a kernel could not use this, LimitReached when `budget` ends that.
        """
        graph, inside = self.graph, None
        need(n.nodes >= graph.roots and n.level_end >= graph.roots)
        need(graph.keys.read(0, len(self.roots)) == self.roots)
        self._check_values(n, budget)
        _check_parents(_array(graph.parents, n.nodes, "<u4"), graph.roots, n.expanded)
        if graph.has_silent_edges:
            inside = self._inside_cycles(n)
        budget.check()
        if graph.with_edges:
            _check_edges(graph, n, inside, n.letters if self.trie is None else n.words)
        else:
            need(n.edges == 0)
        budget.check()
        self._check_letters(n.letters)
        if self.trie is None:
            need(n.words == 0)
        else:
            _check_words(_array(self.trie, n.words, "<u8"), n.letters)
        return n.nodes if inside is None else n.nodes - int(inside.sum())

    def _check_values(self, n: Numbers, budget: Budget) -> None:
        """Each variable of each node has a value of its type, and bits of no variable are 0."""
        words = self.graph.words
        if words == 0:
            need(n.nodes <= 1)
            return
        used, limited = _fields(self.layout, words)
        unused = ~np.array(used, dtype="<u8")
        records = _array(self.graph.keys, n.nodes * words, "<u8").reshape(n.nodes, words)
        for start in range(0, n.nodes, ROWS):
            budget.check()
            columns = np.ascontiguousarray(records[start : start + ROWS].T)
            need(not (columns & unused[:, None]).any())
            for word, shift, mask, most in limited:
                need(((columns[word] >> shift) & mask).max() <= most)

    def _inside_cycles(self, n: Numbers) -> NDArray[np.bool_]:
        """Which nodes are in the middle of a cycle."""
        records = _array(self.graph.keys, n.nodes * self.graph.words, "<u8").reshape(n.nodes, self.graph.words)
        fresh = np.frombuffer(self.graph.fresh, dtype="<u8")
        inside: NDArray[np.bool_] = (records[:, self.layout.words :] != fresh).any(axis=1)
        return inside

    def _check_letters(self, count: int) -> None:
        mask = np.frombuffer(self.mask, dtype="<u8")
        letters = _array(self.letters, count * len(mask), "<u8").reshape(count, len(mask))
        need(not (letters & ~mask).any())


def _array(region: Region, count: int, kind: str) -> NDArray[np.uint64]:
    """What lies at the beginning of a region."""
    return np.frombuffer(region.view(count * np.dtype(kind).itemsize), dtype=kind)


def _fields(layout: Layout, words: int) -> tuple[list[int], list[tuple[int, np.uint64, np.uint64, int]]]:
    """By word the bits that belong to a variable; and of each whose type has fewer values than its bits: its word, its
    shift, the mask of its bits and the largest value there, each element of an array by itself."""
    used = [0] * words
    limited: list[tuple[int, np.uint64, np.uint64, int]] = []
    for field in layout.fields.values():
        if field.bits == 0:
            continue
        for word, shift in _places(field):
            if word < words:
                used[word] |= (1 << field.bits) - 1 << shift
                if field.bits < WORD_BITS and field.high - field.low < (1 << field.bits) - 1:
                    limited.append((word, np.uint64(shift), np.uint64((1 << field.bits) - 1), field.high - field.low))
    return used, limited


def _places(field: BitField) -> list[tuple[int, int]]:
    return [field.place(index) for index in range(field.elements)]


def _check_parents(parents: NDArray[np.uint64], roots: int, expanded: int) -> None:
    """Roots are their own parents; other nodes were found in the order in which their parents were expanded."""
    need((parents[:roots] == np.arange(roots)).all())
    found = parents[roots:]
    if len(found):
        need(found[-1] < expanded and (found[:-1] <= found[1:]).all())
        need((found < np.arange(roots, len(parents))).all())


def _check_edges(graph: Graph, n: Numbers, inside: NDArray[np.bool_] | None, labels: int) -> None:
    """Offsets go up to the number of edges, and these lead to nodes, with labels that there are; those without a letter
    lead into the middle of a cycle, and no others do."""
    need(n.transitions <= n.edges)
    first = _array(graph.first, n.expanded + 1, "<i8")
    need(first[0] == 0 and first[-1] == n.edges and (first[:-1] <= first[1:]).all())
    if n.edges == 0:
        return
    targets, shown = _array(graph.targets, n.edges, "<u4"), _array(graph.labels, n.edges, "<u4")
    need(targets.max() < n.nodes)
    if inside is None:
        need(shown.max() < labels)
    else:
        silent = shown == EPSILON
        need((silent | (shown < labels)).all())
        need((inside[targets] == silent).all())


def _check_words(pairs: NDArray[np.uint64], letters: int) -> None:
    """A word goes on from an earlier one by a letter that there is, and is no longer than a chain."""
    if len(pairs) == 0:
        return
    prefixes, last = pairs >> np.uint64(32), pairs & np.uint64(NO_PREFIX)
    begins = prefixes == NO_PREFIX
    need(last.max() < letters)
    need((begins | (prefixes < np.arange(len(pairs), dtype=np.uint64))).all())
    # The prefix of a prefix, and so on: after i rounds, of what is left a word has more than 2**i letters.
    above = np.where(begins, -1, prefixes.astype(np.int64))
    for _ in range(MAX_CHAIN.bit_length() - 1):
        above = np.where(above < 0, -1, above[above])
    need((above < 0).all())

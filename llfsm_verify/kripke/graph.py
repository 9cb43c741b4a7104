"""The explored part of an arrangement's Kripke structure: configurations, edges with their letters, faults."""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field


@dataclass(slots=True)
class Graph:
    """Configurations numbered in breadth-first order; the first `roots` of them are initial.

    `keys[i]` are the packed words of configuration i. The edges of the expanded configuration i are
    ``targets[first[i]:first[i + 1]]`` with ``labels`` alike, which are indices into `alphabet`: each distinct pair of a
    successor and a letter once. A letter is a bit mask: bit k tells the k-th observed output of the program (its atoms,
    then the outputs that fairness names). `parents[i]` is the configuration that i was first found from (itself for a
    root).
    """

    keys: list[bytes] = field(default_factory=list)
    index: dict[bytes, int] = field(default_factory=dict)
    parents: array[int] = field(default_factory=lambda: array("q"))
    roots: int = 0
    first: array[int] = field(default_factory=lambda: array("q", [0]))
    targets: array[int] = field(default_factory=lambda: array("q"))
    labels: array[int] = field(default_factory=lambda: array("L"))
    alphabet: list[int] = field(default_factory=list)
    transitions: int = 0
    """Distinct pairs of a configuration and a successor."""
    depth: int = 0
    faults: dict[int, int] = field(default_factory=dict)
    """By fault number: the first configuration found from which a step faults."""
    overflow: int | None = None
    """The first configuration found from which a step leaves 64-bit arithmetic; its successors are incomplete."""
    _labels: dict[int, int] = field(default_factory=dict)
    complete: bool = False
    """Every configuration has been expanded, and no step left 64-bit arithmetic."""
    stopped: str | None = None
    """Why the exploration ended before it was complete, in a sentence."""

    @property
    def expanded(self) -> int:
        return len(self.first) - 1

    @property
    def exhausted(self) -> bool:
        """Nothing is left to expand (the graph is complete, unless a step left 64-bit arithmetic)."""
        return self.expanded == len(self.keys)

    def add(self, key: bytes, parent: int | None) -> int:
        """The number of a configuration, new or known."""
        found = self.index.get(key)
        if found is None:
            found = len(self.keys)
            self.index[key] = found
            self.keys.append(key)
            self.parents.append(found if parent is None else parent)
        return found

    def label(self, letter: int) -> int:
        """The index of a letter in the alphabet, new or known."""
        found = self._labels.get(letter)
        if found is None:
            found = self._labels[letter] = len(self.alphabet)
            self.alphabet.append(letter)
        return found

    def edges(self, node: int) -> Iterator[tuple[int, int]]:
        """The (successor, letter) pairs of an expanded configuration; none of one that is not expanded yet."""
        if node < self.expanded:
            for i in range(self.first[node], self.first[node + 1]):
                yield self.targets[i], self.alphabet[self.labels[i]]

    def path_to(self, node: int) -> list[int]:
        """A shortest path from a root to `node`, as configurations."""
        path = [node]
        while self.parents[node] != node:
            node = self.parents[node]
            path.append(node)
        return path[::-1]

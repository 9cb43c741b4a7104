"""The explored part of an arrangement's Kripke structure: configurations, edges with their letters or words, faults."""

from __future__ import annotations

from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from llfsm_verify.kripke.memory import Region

WORD_BYTES = 8
NO_PREFIX = 0xFFFFFFFF
"""The prefix of a word of one letter."""


class Sequences:
    """Words by number. Number i lies in 64 bits of `trie`: the number of its prefix (high half; NO_PREFIX: none) and
    that of its last letter in `alphabet`. A prefix has a smaller number than the words that go on from it."""

    def __init__(self, alphabet: Sequence[int], trie: Region) -> None:
        self._alphabet = alphabet
        self._trie = trie
        self.count = 0

    def __len__(self) -> int:
        return self.count

    def __getitem__(self, word: int) -> tuple[int, ...]:
        """The letters of a word, as masks."""
        letters = []
        while word != NO_PREFIX:
            pair = int.from_bytes(self._trie.read(WORD_BYTES * word, WORD_BYTES), "little")
            letters.append(self._alphabet[pair & NO_PREFIX])
            word = pair >> 32
        return tuple(reversed(letters))

    def pairs(self) -> array[int]:
        """Prefix and last letter of each word, as they lie in memory."""
        return array("Q", self._trie.read(0, WORD_BYTES * self.count))


EPSILON = 0xFFFFFFFF
"""The label of an edge in the middle of a cycle when only whole cycles have a letter (``observe: cycle``)."""
MAX_NODES = (1 << 32) - 2
"""Nodes are numbered in 32 bits."""
OVERFLOW = "a value of type int left the 64 bits in which the executor holds it"
Letters = int | tuple[int, ...] | None
"""What an edge shows: a letter, as a mask; the letters of a chain; None for nothing."""
FIRST_BYTES, NUMBER_BYTES = 8, 4
"""Bytes of an offset into the edges, and of a node's or label's number."""


@dataclass(slots=True)
class Graph:
    """Nodes numbered in breadth-first order; the first `roots` of them are initial.

    A node is a configuration; with ``observe: cycle`` also a record in the middle of a cycle, whose edges inside the
    cycle have the label `EPSILON`. The arrays lie in memory that the kernels share, little endian:

    - `keys`: `words` 64-bit words a node, of which the first `configuration_bytes` are the configuration;
    - `parents`: 32-bit numbers, the node that a node was first found from (itself for a root);
    - `letter_sources`: 32-bit numbers, for each label of a letter the first node found whose step, or chain of steps,
      shows it; of letters read from a checkpoint it is not known;
    - when `is_narrow`: `sources`, `targets` and `labels`, 32-bit numbers of those edges only that matter
      (`kripke.narrow`), in the order of their sources;
    - when `with_edges`: `first`, 64-bit, and `targets` and `labels`, 32-bit. The edges of the expanded node i are
      ``first[i] … first[i + 1] - 1``, each distinct pair of a successor and a label once; ``alphabet[label]`` is the
      letter, a bit mask in which bit k tells the k-th observed output of the program (its atoms, then the outputs that
      fairness names).

    In a graph of chains the configurations with one step only are passed over, but for some: an edge is a step and
    those that follow it without a choice, and its label is the number of the word of their letters in `sequences`.
    """

    words: int
    configuration_bytes: int
    with_edges: bool = True
    fresh: bytes = b""
    """What follows the configuration in the words of a node that is not in the middle of a cycle."""
    is_narrow: bool = False
    """Some edges are stored; `with_edges` is then False."""
    has_silent_edges: bool = False
    """Some edges may have the label `EPSILON`."""
    roots: int = 0
    count: int = 0
    """Nodes found."""
    expanded: int = 0
    """Nodes expanded: the first ones."""
    configurations: int = 0
    """Configurations found; the nodes that are not in the middle of a cycle."""
    edge_count: int = 0
    transitions: int = 0
    """Distinct pairs of a configuration and a successor (of nodes, until the exploration of whole cycles ends)."""
    depth: int = 0
    keys: Region = field(default_factory=lambda: Region(1))
    parents: Region = field(default_factory=lambda: Region(1))
    letter_sources: Region = field(default_factory=lambda: Region(1))
    first: Region = field(default_factory=lambda: Region(1))
    sources: Region = field(default_factory=lambda: Region(1))
    targets: Region = field(default_factory=lambda: Region(1))
    labels: Region = field(default_factory=lambda: Region(1))
    alphabet: list[int] = field(default_factory=list)
    sequences: Sequences | None = None
    """The words that labels stand for; None: they stand for letters."""
    faults: dict[int, int] = field(default_factory=dict)
    """By fault number: the first node found from which a step faults."""
    overflow: int | None = None
    """The first node found from which a step leaves 64-bit arithmetic; its successors are incomplete."""
    complete: bool = False
    """Every node has been expanded, and no step left 64-bit arithmetic."""
    stopped: str | None = None
    """Why the exploration ended before it was complete, in a sentence."""

    def __len__(self) -> int:
        return self.count

    @property
    def exhausted(self) -> bool:
        """Nothing is left to expand (the graph is complete, unless a step left 64-bit arithmetic)."""
        return self.expanded == self.count

    @property
    def unfinished(self) -> str | None:
        """Why it is not complete, in a sentence without its full stop."""
        return self.stopped or (None if self.overflow is None else OVERFLOW)

    def record(self, node: int) -> bytes:
        """All words of a node."""
        size = 8 * self.words
        return self.keys.read(node * size, size)

    def key(self, node: int) -> bytes:
        """The configuration words of a node."""
        return self.keys.read(node * 8 * self.words, self.configuration_bytes)

    def in_cycle(self, node: int) -> bool:
        """Whether a node lies in the middle of a cycle that is observed as a whole."""
        return self.record(node)[self.configuration_bytes :] != self.fresh

    def edges(self, node: int) -> Iterator[tuple[int, int | None]]:
        """The (successor, letter) pairs of an expanded node; none of one that is not expanded yet.

        The letter is None in the middle of a cycle. Raises ValueError for a graph of chains, as `arcs` does not.
        """
        if self.sequences is not None:
            raise ValueError("the edges of this graph are chains")
        for target, label in self.arcs(node):
            yield target, None if label == EPSILON else self.alphabet[label]

    def arcs(self, node: int) -> Iterator[tuple[int, int]]:
        """The (successor, label) pairs of an expanded node; none of one that is not expanded yet."""
        if not self.with_edges:
            raise ValueError("the edges were not stored")
        if node < self.expanded:
            start, end = array("q", self.first.read(node * FIRST_BYTES, 2 * FIRST_BYTES))
            size = (end - start) * NUMBER_BYTES
            targets = array("I", self.targets.read(start * NUMBER_BYTES, size))
            labels = array("I", self.labels.read(start * NUMBER_BYTES, size))
            yield from zip(targets, labels, strict=True)

    def shown(self, label: int) -> Letters:
        """What the edges with a label show."""
        if label == EPSILON:
            return None
        return self.alphabet[label] if self.sequences is None else self.sequences[label]

    def steps(self, node: int) -> Iterator[tuple[int, int]]:
        """The (successor, letter) pairs of a configuration at the beginning of a step: `edges`, with what lies in the
        middle of a cycle passed over. Each pair once."""
        seen, passed, found = {node}, [node], set[tuple[int, int]]()
        for middle in passed:
            for target, letter in self.edges(middle):
                if letter is None:
                    if target not in seen:
                        seen.add(target)
                        passed.append(target)
                elif (target, letter) not in found:
                    found.add((target, letter))
                    yield target, letter

    def parent(self, node: int) -> int:
        """The node that this one was first found from; itself for a root."""
        return int.from_bytes(self.parents.read(node * NUMBER_BYTES, NUMBER_BYTES), "little")

    def letter_source(self, label: int) -> int:
        """The first node found whose step, or chain of steps, shows the letter with this label."""
        return int.from_bytes(self.letter_sources.read(label * NUMBER_BYTES, NUMBER_BYTES), "little")

    def path_to(self, node: int) -> list[int]:
        """A shortest path from a root to `node`, as nodes."""
        path = [node]
        while (parent := self.parent(path[-1])) != path[-1]:
            path.append(parent)
        return path[::-1]

    def drop_edges(self) -> None:
        """Give the memory of the edges back, and store none from now on."""
        self.with_edges = False
        for region in (self.first, self.targets, self.labels):
            region.close()

    def close(self) -> None:
        """Give the memory back."""
        edges = self.first, self.sources, self.targets, self.labels
        for region in (self.keys, self.parents, self.letter_sources, *edges):
            region.close()

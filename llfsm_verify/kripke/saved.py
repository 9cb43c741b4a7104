"""The numbers of a saved exploration: what a checkpoint's header says of it, and the sizes that follow from them."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields

from llfsm_verify.jsonvalue import Json
from llfsm_verify.kripke.checkpoint import Unusable
from llfsm_verify.kripke.graph import FIRST_BYTES, MAX_NODES, NUMBER_BYTES, Graph

MOST = 1 << 60
"""Counts are no larger: kernels add to them in 64 bits."""


@dataclass(frozen=True, slots=True)
class Numbers:
    """The numbers of an exploration between two batches of nodes: how much lies in memory, and what is counted.

    `words` are those of chains, `level_end` is the node with which the next level begins; `overflow` and the faults are
    the first nodes from which they happen, or -1.
    """

    nodes: int
    expanded: int
    letters: int
    words: int
    edges: int
    transitions: int
    level_end: int
    depth: int
    overflow: int
    faults: tuple[int, ...]

    def header(self) -> dict[str, Json]:
        """The same for the header of a checkpoint."""
        return {**asdict(self), "faults": list(self.faults)}

    @staticmethod
    def of_header(data: Json, faults: int) -> Numbers:
        """What `header` gave, of a program with so many faults. Raises Unusable, also for a number out of range."""
        if not isinstance(data, dict) or data.keys() != {f.name for f in fields(Numbers)}:
            raise Unusable("it is damaged")
        sites = data["faults"]
        if not isinstance(sites, list) or len(sites) != faults:
            raise Unusable("it is damaged")
        plain = {key: whole(value, -1, MOST) for key, value in data.items() if key != "faults"}
        found = Numbers(**plain, faults=tuple(whole(site, -1, MOST) for site in sites))
        _check_numbers(found)
        return found


def whole(data: Json, low: int, high: int) -> int:
    """A number of a header, from `low` to `high`. Raises Unusable for anything else."""
    if isinstance(data, bool) or not isinstance(data, int) or not low <= data <= high:
        raise Unusable("it is damaged")
    return data


def _check_numbers(n: Numbers) -> None:
    counts = (n.nodes, n.expanded, n.letters, n.words, n.edges, n.transitions, n.level_end, n.depth)
    need(min(counts) >= 0)
    need(max(n.nodes, n.letters, n.words) <= MAX_NODES)
    need(max(n.expanded, n.level_end, n.depth) <= n.nodes)
    need(max(n.overflow, *n.faults, -1) < n.expanded)


def need(found: object) -> None:
    """Raises Unusable unless this is true."""
    if not found:
        raise Unusable("it is damaged")


def sizes(n: Numbers, graph: Graph, letter_bytes: int, *, with_words: bool) -> list[int]:
    """Bytes of the regions of an exploration: `keys`, `parents`, `first`, `targets`, `labels`, letters, words."""
    return [
        n.nodes * graph.words * 8,
        n.nodes * NUMBER_BYTES,
        (n.expanded + 1) * FIRST_BYTES if graph.with_edges else 0,
        n.edges * NUMBER_BYTES,
        n.edges * NUMBER_BYTES,
        n.letters * letter_bytes,
        *([n.words * 8] if with_words else []),
    ]

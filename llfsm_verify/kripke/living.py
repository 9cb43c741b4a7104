"""Which product nodes are lost: no accepting component can be reached from them any more."""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Iterator, Sequence

from llfsm_verify.kripke.emptiness import Components
from llfsm_verify.kripke.graph import Graph
from llfsm_verify.kripke.kernels import product_blocks as p
from llfsm_verify.kripke.memory import Region
from llfsm_verify.kripke.paths import Breadth, SearchTarget
from llfsm_verify.kripke.product import SIZES, ProductNode, Rows, Sizes


class Living(Breadth):
    """All product nodes that can be reached, nearest first, and which of them are live: an accepting component can be
    reached.

    A bit more for each product node than in `Breadth`. What is live is found by sweeps, from the product node found
    last to the first, until one finds no more; each takes time for all edges of what is not live.
    """

    kernels = ("product_live", "product_lost")
    """Those that it needs beside that of `Breadth`."""

    def __init__(
        self,
        graph: Graph,
        rows: Rows,
        starts: Iterable[ProductNode],
        components: Components,
        sizes: Sizes = SIZES,
    ) -> None:
        """`components`: a search that has found an accepting component from `starts`, with the same states, and has
        ended (`Components.collect`) with all of them."""
        super().__init__(graph, rows, starts, goal=SearchTarget.NOTHING, marks=(components, None), sizes=sizes)
        self._live, self._watched = Region(1), Region(1)

    def sweep(self) -> None:
        """Reach everything, and find out what is live."""
        b = self._block
        self.next()
        self._fit()
        places = self.found if self._sparse else self._rows.states * len(self._graph)
        self._live.grow(8 * (places // 64 + 1))
        b[p.LIVE] = self._live.address
        b[p.LEARNT] = 1
        while b[p.LEARNT]:
            b[p.LEARNT], b[p.LEFT] = 0, self.found
            self._run_kernel("product_live")

    def lost(self, watched: Sequence[int]) -> Iterator[int]:
        """After `sweep`, the numbers of the product nodes that are not live, nearest first; only of those with a state
        that `watched` marks with 1."""
        b = self._block
        self._watched.write(array("I", watched).tobytes())
        b[p.WATCHED] = self._watched.address
        b[p.POSITION] = 0
        while self._run_kernel("product_lost") == p.FOUND:
            yield b[p.HIT]

    def _run_kernel(self, name: str) -> int:
        self.kernel = name
        return self._run()

    def _regions(self) -> tuple[Region, ...]:
        return *super()._regions(), self._live, self._watched

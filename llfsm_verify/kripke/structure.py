"""The Kripke structure of an arrangement as users compute with it: arrays in CSR form, and a networkx graph."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, TypeVar

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.backends.native.layout import Layout
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.kripke.graph import FIRST_BYTES, NUMBER_BYTES, Graph
from llfsm_verify.kripke.labels.wide import labels_of
from llfsm_verify.kripke.memory import Region
from llfsm_verify.limits import Budget, endless_budget, processors
from llfsm_verify.program.program import INT64_MAX, Program
from llfsm_verify.semantics.letters import Observed
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.values import Shown, elements

if TYPE_CHECKING:
    import networkx as nx
    import numpy as np
    from numpy.typing import NDArray

    from llfsm_verify.kripke.labels.labels import Labels

    _Number = TypeVar("_Number", bound=np.generic)


GRAPH_EXTRA = "install it with `pip install networkx`, or this package with the extra `graph`"
PORTION = 1 << 12
"""Configurations between two looks at the budget."""


class Observations(Protocol):
    """The atoms that letters show: what `checking.problem.bind` makes of property files."""

    @property
    def atoms(self) -> tuple[Observed, ...]: ...


@dataclass(frozen=True, slots=True)
class FaultAt:
    """A fault that a step ends in: its code, its message, its place in the source, and a configuration before it."""

    code: str
    message: str
    place: str
    configuration: int


@dataclass(frozen=True, slots=True, eq=False)
class Structure:
    """Configurations 0 … n - 1 in breadth-first order and m edges, each with its letter.

    The edges of configuration i are ``targets[indptr[i]:indptr[i + 1]]``, ``labels`` alike: each distinct pair of a
    successor and a letter once. Row ``labels[e]`` of `alphabet` is the letter of edge e: its column k tells whether
    ``propositions[k]`` holds after the step. The first ``len(first[0])`` propositions are the atoms of the properties,
    the others are what fairness asks about (docs/kripke.md).

    The large arrays are read-only, and lie where the exploration put them: copy them to change them. They number edges
    and configurations without a sign: convert before subtracting (``targets.astype(np.int64)``).
    """

    program: Program
    layout: Layout
    indptr: NDArray[np.int64]
    """Shape (n + 1,)."""
    targets: NDArray[np.uint32]
    """Shape (m,): configurations."""
    labels: NDArray[np.uint32]
    """Shape (m,): rows of `alphabet`."""
    alphabet: NDArray[np.bool_]
    """Shape (letters, propositions)."""
    propositions: tuple[str, ...]
    roots: NDArray[np.int64]
    """Shape (r,): the initial configurations."""
    first: NDArray[np.bool_]
    """Shape (r, atoms): the letter c0 of each initial configuration."""
    keys: NDArray[np.uint64]
    """Shape (n, words): the configurations, packed as `layout` says."""
    expanded: int
    """All edges of the configurations 0 … expanded - 1 are here, none of the others."""
    complete: bool
    """Nothing is missing."""
    stopped: str | None
    """Why something is missing, in a sentence."""
    faults: tuple[FaultAt, ...]
    transitions: int
    """Distinct pairs of a configuration and a successor."""
    symbolic: Labels | None = None
    """The labels of the steps, where inputs were split into classes."""

    def __len__(self) -> int:
        return int(self.keys.shape[0])

    @property
    def name(self) -> str:
        return self.program.name

    @property
    def atoms(self) -> tuple[str, ...]:
        """The propositions that come from properties."""
        return self.propositions[: self.first.shape[1]]

    # ------------------------------------------------------------ configurations

    def values(self, configuration: int) -> dict[str, Shown]:
        """The variables of a configuration, each element by its name (``a[1]``, ``ball.x``): enumerators and states as
        their names, booleans as bools. Names with a ``$`` are control variables (docs/kripke.md)."""
        decoded = self.layout.decode(self.keys[configuration].tobytes())
        return {name: x for v in self.program.vars if not v.output for name, x in elements(v, decoded[v.name])}

    def column(
        self, variable: str, index: int | None = None, rows: slice = slice(None)
    ) -> NDArray[np.int64] | NDArray[np.uint64]:
        """The numbers that a variable (element `index` of an array) has in the configurations `rows`, all unless given,
        one each.

        Enumerators and states are their index, decimals their number of steps; values of a `uint64` have no sign.
        Raises KeyError and IndexError as `Layout.reader` does.
        """
        return column(self.keys[rows], self.layout, variable, index)

    # ------------------------------------------------------------ letters

    def letter(self, edge: int) -> frozenset[str]:
        """The propositions that hold after edge number `edge` (an index into `targets`)."""
        return self._names(self.alphabet[self.labels[edge]])

    def first_letter(self, root: int) -> frozenset[str]:
        """The atoms that hold in the initial configuration ``roots[root]``, with inputs at their `init`."""
        return self._names(self.first[root])

    def _names(self, row: NDArray[np.bool_]) -> frozenset[str]:
        return frozenset(self.propositions[k] for k in row.nonzero()[0])

    # ------------------------------------------------------------ networkx

    def to_networkx(self) -> nx.MultiDiGraph[int]:
        """The structure as a multigraph (needs the package networkx).

        Nodes are the configurations with their `values` as attributes, and `initial`; an initial one has the set of the
        atoms that hold in c0 as `letter`. An edge has the set of the propositions that hold after the step as `letter`.
        The graph's own attributes are `name`, `complete` and `stopped`. Raises DiagnosticError (E423) without networkx.
        """
        try:
            import networkx as nx
        except ImportError:
            message = "a graph of networkx needs the package networkx, which is not installed"
            raise DiagnosticError(Diagnostic("E423", message, hint=GRAPH_EXTRA)) from None

        graph: nx.MultiDiGraph[int] = nx.MultiDiGraph(name=self.name, complete=self.complete, stopped=self.stopped)
        for node in range(len(self)):
            graph.add_node(node, **self.values(node), initial=False)
        for index, root in enumerate(self.roots):
            graph.add_node(int(root), initial=True, letter=self.first_letter(index))
        letters = [self._names(row) for row in self.alphabet]
        for source in range(self.expanded):
            for edge in range(int(self.indptr[source]), int(self.indptr[source + 1])):
                graph.add_edge(source, int(self.targets[edge]), letter=letters[self.labels[edge]])
        return graph


def column(
    keys: NDArray[np.uint64], layout: Layout, variable: str, index: int | None = None
) -> NDArray[np.int64] | NDArray[np.uint64]:
    """The numbers that a variable (element `index` of an array) has in packed configurations, shape (n, words): without
    a sign where they are too large for one."""
    import numpy as np

    layout.reader(variable, index)  # for its errors
    field = layout.fields[variable]
    if field.bits == 0:
        return np.full(len(keys), field.low, dtype=np.int64)
    word, shift = field.place(index or 0)
    bits = (keys[:, word] >> np.uint64(shift)) & np.uint64((1 << field.bits) - 1)
    if field.high > INT64_MAX:
        return bits + np.uint64(field.low)
    return bits.view(np.int64) + np.int64(field.low)


def structure(
    arrangement: Arrangement,
    properties: Observations | None = None,
    *,
    keep_all_bits: bool = False,
    budget: Budget | None = None,
    report: Callable[[Graph], None] | None = None,
    labels: bool = True,
    jobs: int | None = None,
) -> Structure:
    """Explore `arrangement`; letters show the atoms of `properties` (from `checking.problem.bind`).

    `budget` limits the exploration (`limits.Budget`); a structure cut short says so in `complete` and
    `stopped`. With `labels`, steps are those of classes of wide inputs (docs/kripke.md); the structure is the same
    without, where that can be enumerated. `report` is called with the graph now and then. `jobs`: threads; None: as
    many as processors.

    Raises DiagnosticError where the arrangement asks for something that has no meaning, LimitReached when the
    exploration ended within `budget` and what it found cannot be put together within it, and KeyboardInterrupt.
    """
    atoms: Sequence[Observed] = () if properties is None else properties.atoms
    program = lower(arrangement, atoms, keep_all_bits=keep_all_bits)
    found = labels_of(program, budget or endless_budget()) if labels else None
    explorer = Explorer(program, budget or endless_budget(), report, labels=found, jobs=jobs or processors())
    try:
        explorer.explore(None)
        # The limit that cut an exploration short has been used up; what is put together then is no larger than before.
        return structure_of(explorer, budget if explorer.graph.stopped is None else None)
    finally:
        explorer.close()


def structure_of(explorer: Explorer, budget: Budget | None = None) -> Structure:
    """The structure that an explorer has found so far. It takes over the explorer's memory instead of copying it, and
    closes the explorer.

    Raises LimitReached where `budget` ends the work (whole cycles must be found in the edges inside them).
    """
    import numpy as np

    graph, program = explorer.graph, explorer.program
    layout = Layout.of(program)
    budget = budget or endless_budget()
    edges = _of_cycles(graph, layout, budget) if graph.has_silent_edges else _of_ringlets(graph, budget)
    faults = tuple(_fault(graph, program, number, node, edges) for number, node in sorted(graph.faults.items()))
    explorer.close()
    return Structure(
        program=program,
        layout=layout,
        indptr=edges.indptr,
        targets=edges.targets,
        labels=edges.labels,
        alphabet=_bits(graph.alphabet, len(explorer.observed)),
        propositions=explorer.observed,
        roots=np.arange(graph.roots, dtype=np.int64),
        first=_bits(list(explorer.first_letters), len(program.atoms)),
        keys=edges.keys,
        expanded=edges.expanded,
        complete=graph.complete,
        stopped=graph.stopped or _overflow(graph),
        faults=faults,
        transitions=edges.transitions,
        symbolic=explorer.labels,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Edges:
    """The configurations of a graph, and the edges between them. `nodes` are the graph's numbers of the configurations,
    None: all."""

    keys: NDArray[np.uint64]
    indptr: NDArray[np.int64]
    targets: NDArray[np.uint32]
    labels: NDArray[np.uint32]
    expanded: int
    transitions: int
    nodes: NDArray[np.int64] | None = None


def _of_ringlets(graph: Graph, budget: Budget) -> _Edges:
    """The arrays where they are: the graph's regions are taken out of it, and live as long as their arrays."""
    import numpy as np

    count, expanded, edges = len(graph), graph.expanded, graph.edge_count
    if expanded < count:
        budget.check(FIRST_BYTES * (count - expanded))
        rest = np.full(count - expanded, edges, dtype="<i8")
        graph.first.write(rest.tobytes(), FIRST_BYTES * (expanded + 1))
    taken = (graph.keys, graph.first, graph.targets, graph.labels)
    graph.keys, graph.first, graph.targets, graph.labels = (Region(1) for _ in taken)
    keys, first, targets, labels = taken
    return _Edges(
        _frozen(np.frombuffer(keys.view(8 * graph.words * count), dtype="<u8").reshape(count, graph.words)),
        _frozen(np.frombuffer(first.view(FIRST_BYTES * (count + 1)), dtype="<i8")),
        _frozen(np.frombuffer(targets.view(NUMBER_BYTES * edges), dtype="<u4")),
        _frozen(np.frombuffer(labels.view(NUMBER_BYTES * edges), dtype="<u4")),
        expanded,
        graph.transitions,
    )


def _of_cycles(graph: Graph, layout: Layout, budget: Budget) -> _Edges:
    """Whole cycles as edges: what lies in their middle is passed over."""
    import numpy as np

    count, words = len(graph), graph.words
    # A byte a node to tell configurations apart, the number of each, and its key.
    budget.check((1 + NUMBER_BYTES) * count + 8 * (1 + layout.words) * graph.configurations)
    records = np.frombuffer(graph.keys.view(8 * words * count), dtype="<u8").reshape(count, words)
    whole = np.ones(count, dtype=np.bool_)
    for k, fresh in enumerate(array("Q", graph.fresh)):
        whole &= records[:, layout.words + k] == fresh
    nodes = whole.nonzero()[0]
    keys = records[nodes, : layout.words]
    del records  # the region is closed with the explorer
    number = np.zeros(count, dtype=np.uint32)
    number[nodes] = np.arange(len(nodes), dtype=np.uint32)
    rows = {letter: i for i, letter in enumerate(graph.alphabet)}
    indptr = np.zeros(len(nodes) + 1, dtype=np.int64)
    targets, labels = array("I"), array("I")
    # A cycle under way when the exploration ended is missing, so no configuration counts as expanded then.
    expanded = len(nodes) if graph.exhausted else 0
    transitions = 0
    for i in range(expanded):
        if i % PORTION == 0:
            budget.check(len(targets) * NUMBER_BYTES // 2)  # what the arrays may grow by
        pairs = list(graph.steps(int(nodes[i])))
        targets.extend(int(number[t]) for t, _ in pairs)
        labels.extend(rows[letter] for _, letter in pairs)
        transitions += len({t for t, _ in pairs})
        indptr[i + 1] = len(targets)
    indptr[expanded + 1 :] = len(targets)
    return _Edges(
        _frozen(keys),
        _frozen(indptr),
        _frozen(np.frombuffer(targets, dtype=np.uint32)),
        _frozen(np.frombuffer(labels, dtype=np.uint32)),
        expanded,
        transitions,
        nodes,
    )


def _frozen(values: NDArray[_Number]) -> NDArray[_Number]:
    values.flags.writeable = False
    return values


def _bits(masks: list[int], width: int) -> NDArray[np.bool_]:
    """Bit k of mask i as element (i, k)."""
    import numpy as np

    size = (width + 7) // 8
    data = np.frombuffer(b"".join(m.to_bytes(size, "little") for m in masks), dtype=np.uint8)
    bits = np.unpackbits(data.reshape(len(masks), size), axis=1, bitorder="little")
    return bits[:, :width].astype(np.bool_)


def _overflow(graph: Graph) -> str | None:
    return None if graph.overflow is None else f"an integer left 64 bits in a step from configuration {graph.overflow}"


def _fault(graph: Graph, program: Program, number: int, node: int, edges: _Edges) -> FaultAt:
    site = program.faults[number]
    if edges.nodes is not None:  # the configuration in which the cycle began
        path = graph.path_to(node)
        while graph.in_cycle(path[-1]):
            path.pop()
        node = int(edges.nodes.searchsorted(path[-1]))
    return FaultAt(site.code, site.message, "" if site.span is None else str(site.span), node)

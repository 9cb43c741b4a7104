"""Witnesses: the moves that the edges of a graph stand for, found again when they are asked for."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

from llfsm_verify.backends.native.executor import Edge, NativeProgram
from llfsm_verify.kripke.graph import Graph, Letters
from llfsm_verify.kripke.observing import Observer, move_of
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Program

if TYPE_CHECKING:
    from llfsm_verify.kripke.chains import Chains
    from llfsm_verify.kripke.labels.labels import Labels


class NoWitness(KeyError):
    """The program has no step for an edge of the graph; the message says which."""


class GraphWitnesses:
    """Steps from the nodes of one graph. `chains` are those that its edges pass over, if they do."""

    def __init__(
        self,
        native: NativeProgram,
        observer: Observer,
        graph: Graph,
        chains: Chains | None,
        labels: Labels | None = None,
    ) -> None:
        """`labels`: the moves are those of the program that they belong to, not of `native`."""
        self._labels = labels
        self._native = native
        self._program: Program = native.program
        self._observer = observer
        self._graph = graph
        self._chains = chains
        layout = native.layout
        self._fresh = layout.encode_outputs(layout.initial_outputs())
        self._width = layout.configuration_bytes
        self._cycles = native.program.observe == "cycle"

    def _moves(self, node: int) -> Iterator[tuple[Move, int, bytes, bool]]:
        """The steps from a node: the move, its status, the node it leads to, and whether a letter is shown."""
        record = self._graph.record(node)
        if not self._cycles:
            record += self._fresh
        for edge in self._native.edges(record, 1):
            move = self._move(record, edge)
            yield (
                move,
                edge.status,
                edge.record,
                not self._cycles or move.process is None or self._observer.ends_cycle(edge.record),
            )

    def _move(self, before: bytes, edge: Edge) -> Move:
        """The move of a step from a record."""
        return move_of(self._program, edge) if self._labels is None else self._labels.move(before, edge)

    def step(self, source: int, target: int, letter: Letters) -> list[Move]:
        """The move of an edge of the graph, in a list; `letter` None: in the middle of a cycle, or any.

        Of a chain, all moves, or as many as `letter` has letters. Raises NoWitness when there is none.
        """
        node = self._graph.record(target)
        if self._chains is not None:
            return self._chain_witness(source, node, letter)
        for move, status, record, shown in self._moves(source):
            if status == 0 and (letter is None or (shown and self._observer.letter(record) == letter)):
                key = record[: self._width] + self._fresh if self._cycles and shown else record
                if key[: len(node)] == node:
                    return [move]
        raise NoWitness(f"no step from node {source} to {target}")

    def _chain_witness(self, source: int, target: bytes, letters: Letters) -> list[Move]:
        assert self._chains is not None
        assert not isinstance(letters, int)
        for first in self._native.edges(self._graph.record(source) + self._fresh, 1):
            moves: list[Move] = []
            before = self._graph.record(source) + self._fresh
            for edge in self._chains.from_edge(first):
                place = len(moves)
                if (
                    letters is not None
                    and place < len(letters)
                    and self._observer.letter(edge.record) != letters[place]
                ):
                    break
                moves.append(self._move(before, edge))
                before = edge.record
                if edge.record[: len(target)] == target and (letters is None or len(moves) >= len(letters)):
                    return moves if letters is None else moves[: len(letters)]
        raise NoWitness(f"no chain of steps from node {source} to that node")

    def letter(self, source: int, letter: int) -> list[Move]:
        """The moves that lead from a node to a step that shows a letter: one, of a chain as many as it takes. Raises
        NoWitness when there are none; not with ``observe: cycle``."""
        record = self._graph.record(source) + self._fresh
        for first in self._native.edges(record, 1):
            if first.status:
                continue
            moves, before = list[Move](), record
            for edge in (first,) if self._chains is None else self._chains.from_edge(first):
                moves.append(self._move(before, edge))
                if self._observer.letter(edge.record) == letter:
                    return moves
                before = edge.record
        raise NoWitness(f"no step from node {source} shows that letter")

    def shown(self, source: int, target: int) -> int:
        """The letter of the first step from one node to another; not with ``observe: cycle``, nor of chains. Raises
        NoWitness when there is none."""
        node = self._graph.record(target)
        for _, status, record, _ in self._moves(source):
            if status == 0 and record[: len(node)] == node:
                return self._observer.letter(record)
        raise NoWitness(f"no step from node {source} to {target}")

    def along(self, path: Sequence[int]) -> list[Move]:
        """The moves along a path of the graph. NoWitness: an edge has no moves."""
        return [move for source, target in pairwise(path) for move in self.step(source, target, None)]

    def fault(self, source: int, faults: Collection[int]) -> tuple[int, Move]:
        """The first of the steps from a node that lead into one of these faults. Raises NoWitness."""
        for move, status, _, _ in self._moves(source):
            if status - 1 in faults:
                return status - 1, move
        raise NoWitness(f"none of the faults {sorted(faults)} happens from node {source}")

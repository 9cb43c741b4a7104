"""Breadth-first exploration of a step program by the native step function."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from struct import Struct
from typing import Protocol

from llfsm_verify.backends.layout import TooManyInitial
from llfsm_verify.backends.native import NativeProgram
from llfsm_verify.backends.reference import evaluate
from llfsm_verify.kripke.graph import Graph
from llfsm_verify.semantics.program import Program

LARGEST_BATCH = 512
"""Configurations expanded in one native call."""
MAX_ROOTS = 1 << 20
MAX_STEPS = 1 << 24
"""Steps from one configuration: inputs wider than this are not for enumeration."""
STEPS_BETWEEN_CHECKS = 1 << 16
LETTERS_EACH = 64
"""Successors of one configuration, with different letters, that may stand for one configuration more."""


class LimitReached(Exception):
    """A limit has been reached; the message says which, in a sentence."""


class Allowance(Protocol):
    """What an exploration may use."""

    @property
    def max_states(self) -> int | None: ...

    def check(self) -> None:
        """Raises LimitReached when time or memory is used up."""


@dataclass(frozen=True, slots=True)
class Move:
    """One ringlet (`process` None: the stutter) with the values of the choices it read."""

    process: int | None
    choices: dict[str, int]


@dataclass(frozen=True, slots=True)
class Successor:
    """What one observed step leads to: `key` None and a fault's number, or overflow (-1), where it leads nowhere."""

    key: bytes | None
    outputs: bytes
    status: int
    moves: tuple[Move, ...] = ()


def observed_outputs(program: Program) -> tuple[tuple[str, str], ...]:
    """What letters show, as (name, output variable): the atoms in order, then what fairness asks about."""
    fair = [name for f in program.fairness for name in (f.premise, f.goal) if name is not None]
    return (*((a.name, a.output) for a in program.atoms), *((name, name) for name in fair))


class Explorer:
    """Explores one program into a `Graph`, in portions; witnesses of its edges are found again when asked for.

    With ``observe: cycle`` an edge is a whole cycle: what lies between its ringlets is searched, but not kept.
    """

    def __init__(self, program: Program, allowance: Allowance, report: Callable[[Graph], None] | None = None) -> None:
        self.program = program
        self.graph = Graph()
        self._allowance = allowance
        self._report = report
        self._native = NativeProgram(program)
        self._layout = self._native.layout
        self._width = self._layout.configuration_bytes
        self._fresh = self._layout.encode_outputs(self._layout.initial_outputs())
        outputs_width = len(self._fresh)
        rest = self._native.edge_size - self._native.samples_offset
        self._edge = Struct(f"<IiiI{self._width}s{outputs_width}s{rest}x")
        names = observed_outputs(program)
        self.observed = tuple(name for name, _ in names)
        self._readers = [self._layout.reader(output) for _, output in names]
        self._cycle = self._layout.reader(program.cycle)
        self._labels: dict[bytes, int] = {}
        self._level_end = 0
        try:
            for record in self._layout.initial(MAX_ROOTS):
                self.graph.add(record[: self._width], None)
        except TooManyInitial as error:
            self.graph.stopped = str(error)
        self._level_end = len(self.graph.keys)
        try:
            self.first_letters = tuple(self._first_letter(key) for key in self.graph.keys)
            """The letter c0 of each root."""
        except OverflowError:
            self.first_letters = ()
            self.graph.stopped = "a property leaves 64-bit arithmetic in an initial configuration"
        self.graph.roots = len(self.first_letters)

    # -------------------------------------------------- letters

    def letter(self, outputs: bytes) -> int:
        """The mask of the observed outputs in the output words of a record."""
        return self.graph.alphabet[self._label(outputs)]

    def _label(self, outputs: bytes) -> int:
        found = self._labels.get(outputs)
        if found is None:
            record = bytes(self._width) + outputs
            letter = sum(1 << i for i, read in enumerate(self._readers) if read(record))
            found = self._labels[outputs] = self.graph.label(letter)
        return found

    def _first_letter(self, key: bytes) -> int:
        """Atoms over an initial configuration, with inputs at their `init`."""
        outputs = {v.name: v.init for v in self.program.vars if v.output}
        values = self._layout.decode(key) | outputs
        inputs = {f"input:{i.name}": i.init for i in self.program.inputs}
        return sum(1 << i for i, a in enumerate(self.program.atoms) if evaluate(a.expression, values, inputs))

    def free(self, root: int) -> tuple[tuple[str, int], ...]:
        """The values of the free variables in a root."""
        values = self._layout.decode(self.graph.keys[root])
        free = [(v.name, values[v.name]) for v in self.program.vars if v.free]
        return tuple((name, value) for name, value in free if isinstance(value, int))

    # -------------------------------------------------- exploration

    def explore(self, target: int | None) -> None:
        """Expand configurations in order until there are `target` of them, none is left, or a limit is reached.

        The graph says which: `complete`, or `stopped` with the reason. Raises KeyboardInterrupt between batches.
        """
        graph = self.graph
        batch = 1
        while graph.stopped is None and graph.expanded < len(graph.keys):
            if target is not None and len(graph.keys) >= target:
                return
            try:
                self._allowance.check()
                self._check_states(0)
                limit = self._allowance.max_states
                if limit is not None:
                    batch = min(batch, 1 + (limit - len(graph.keys)) // 4)
                self._expand(graph.expanded, min(batch, len(graph.keys) - graph.expanded))
            except LimitReached as error:
                graph.stopped = str(error)
                return
            batch = min(2 * batch, LARGEST_BATCH)
            if self._report is not None:
                self._report(graph)
        graph.complete = graph.stopped is None and graph.overflow is None

    def _check_states(self, more: int) -> None:
        """`more` counts successors that are not in the graph yet, with their letters."""
        limit = self._allowance.max_states
        if limit is not None and (len(self.graph.keys) > limit or more > limit * LETTERS_EACH):
            raise LimitReached(f"the limit of {limit} configurations was reached")

    def _expand(self, start: int, count: int) -> None:
        for node, successors in self._grouped(range(start, start + count)):
            while node >= self._level_end:
                self._level_end = len(self.graph.keys)
                self.graph.depth += 1
            self._keep(node, successors)

    def _keep(self, node: int, successors: Iterable[tuple[bytes | None, bytes, int]]) -> None:
        graph = self.graph
        seen: set[tuple[int, int]] = set()
        targets: set[int] = set()
        for key, outputs, status in successors:
            if key is None:
                if status < 0:
                    graph.overflow = node if graph.overflow is None else graph.overflow
                else:
                    graph.faults.setdefault(status - 1, node)
                continue
            target = graph.add(key, node)
            edge = target, self._label(outputs)
            if edge not in seen:
                seen.add(edge)
                targets.add(target)
                graph.targets.append(target)
                graph.labels.append(edge[1])
        graph.transitions += len(targets)
        graph.first.append(len(graph.targets))

    def _grouped(self, nodes: Sequence[int]) -> Iterator[tuple[int, Iterable[tuple[bytes | None, bytes, int]]]]:
        """The successors of each node, as (key, output words, status)."""
        keys = self.graph.keys
        if self.program.observe == "cycle":
            for node in nodes:
                yield node, ((s.key, s.outputs, s.status) for s in self._cycles(keys[node], self._guard()))
            return
        records = b"".join(keys[n] + self._fresh for n in nodes)
        current: list[tuple[bytes | None, bytes, int]] = []
        position, steps = 0, 0
        expansion = self._native.expand(records, len(nodes))
        size, edge = expansion.edge_size, self._edge
        for view, count in expansion:
            for source, _, status, _, key, outputs in edge.iter_unpack(view[: count * size]):
                while source > position:
                    yield nodes[position], current
                    position, current, steps = position + 1, [], 0
                current.append((None, b"", status) if status else (key, outputs, 0))
            steps += count
            if len(current) > STEPS_BETWEEN_CHECKS:
                self._allowance.check()
                current = list(dict.fromkeys(current))
                self._check_states(len(current))
            if steps > MAX_STEPS:
                raise LimitReached(self._too_many_steps())
        while position < len(nodes):
            yield nodes[position], current
            position, current = position + 1, []

    def _too_many_steps(self) -> str:
        widest = max(self.program.choices, key=lambda c: c.type.high - c.type.low)
        size = widest.type.high - widest.type.low + 1
        return (
            f"one configuration has more than {MAX_STEPS} steps, more than this engine enumerates: "
            f"`{widest.input or widest.name}` alone has {size} values; declare a smaller range"
        )

    # -------------------------------------------------- single steps and cycles

    def _moves(self, record: bytes) -> Iterator[tuple[Move, int, bytes]]:
        choices = self.program.choices
        for edge in self._native.edges(record, 1):
            process = None if edge.process < 0 else edge.process
            yield Move(process, {choices[c].name: v for c, v in edge.samples}), edge.status, edge.record

    def _steps(self, key: bytes) -> Iterator[Successor]:
        """Every observed step from a configuration, with the moves that make it up."""
        if self.program.observe == "cycle":
            yield from self._cycles(key)
            return
        for move, status, record in self._moves(key + self._fresh):
            if status:
                yield Successor(None, b"", status, (move,))
            else:
                yield Successor(record[: self._width], record[self._width :], 0, (move,))

    def _cycles(self, key: bytes, guard: Callable[[], None] = lambda: None) -> Iterator[Successor]:
        """Every cycle from a configuration at the beginning of one: its ringlets, searched breadth first.

        `guard` is called for every ringlet, and may raise to stop.
        """
        start = key + self._fresh
        origins: dict[bytes, tuple[bytes, Move] | None] = {start: None}
        queue = [start]

        def moves(record: bytes, last: Move) -> tuple[Move, ...]:
            found, origin = [last], origins[record]
            while origin is not None:
                found.append(origin[1])
                origin = origins[origin[0]]
            return tuple(reversed(found))

        for record in queue:
            for move, status, following in self._moves(record):
                guard()
                if status:
                    yield Successor(None, b"", status, moves(record, move))
                elif move.process is None or self._cycle(following):
                    found = following[: self._width], following[self._width :]
                    yield Successor(*found, 0, moves(record, move))
                elif following not in origins:
                    origins[following] = record, move
                    queue.append(following)

    def _guard(self) -> Callable[[], None]:
        """What bounds the search for the successors of one configuration."""
        steps = 0

        def guard() -> None:
            nonlocal steps
            steps += 1
            if steps % STEPS_BETWEEN_CHECKS == 0:
                self._allowance.check()
                self._check_states(0)
                if steps > MAX_STEPS:
                    raise LimitReached(self._too_many_steps())

        return guard

    # -------------------------------------------------- witnesses

    def witness(self, source: int, target: int, letter: int | None) -> list[Move]:
        """The moves of an edge of the graph with this letter (any, when None). Raises KeyError when there is none."""
        key = self.graph.keys[target]
        for s in self._steps(self.graph.keys[source]):
            if s.key == key and (letter is None or self.letter(s.outputs) == letter):
                return list(s.moves)
        raise KeyError(f"no step from configuration {source} to {target}")

    def fault_witness(self, source: int, fault: int) -> list[Move]:
        """The moves that lead from a configuration into a fault. Raises KeyError when there are none."""
        for s in self._steps(self.graph.keys[source]):
            if s.status == fault + 1:
                return list(s.moves)
        raise KeyError(f"fault {fault} does not happen from configuration {source}")

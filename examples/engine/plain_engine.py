"""A model checker in plain Python, registered from outside: all configurations one by one, and runs by automata.

It is slow, and complete on what it can explore. `pip install examples/engine`, then `llfsm-verify --engine plain …`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product

from llfsm_verify.plug import (
    Answer,
    Automaton,
    AutomatonTooLarge,
    EngineEntry,
    Exploration,
    Given,
    Goal,
    Holds,
    Int,
    Interpreter,
    Lazy,
    Letter,
    LimitReached,
    Move,
    PrefixMonitor,
    Schedule,
    Session,
    Unknown,
    Value,
    Var,
    Violated,
    add_premises,
    bad_prefixes_of,
    claim_of,
    evaluate,
    find_accepting_lasso,
    mask,
    moves_of,
    observed_outputs,
    reached,
    tick,
)

ENTRY = EngineEntry(
    "plain",
    "plain_engine:PlainSession",
    "all configurations in plain Python",
    decides=frozenset({"violations", "proofs", "faults"}),
    options=frozenset({"max_states"}),
)

Node = tuple[tuple[Value, ...], tuple[Value, ...]]
"""The values of the variables, and those of the outputs where the next step goes on with them."""
States = tuple[int | None, ...]
"""One state of each reader."""


@dataclass(frozen=True, slots=True)
class Edge:
    """A step. `letter` None: it lies inside an observed cycle."""

    move: Move
    target: Node
    letter: Letter | None


@dataclass(frozen=True, slots=True)
class Reader:
    """What reads the letters of a run and accepts some runs: from a state and a letter to (acceptance, state)."""

    first: int | None
    read: Callable[[int | None, Letter], Iterable[tuple[int, int | None]]]
    sets: int


class PlainSession(Session):
    """Breadth-first search in plain Python (``--engine plain``)."""

    def __init__(self, given: Given) -> None:
        self._given = given
        self._program = given.problem.program(keep_all_bits=given.options.keep_all_bits)
        self._interpreter = Interpreter(self._program)
        self._variables = [v for v in self._program.vars if not v.output]
        self._outputs = {v.name: v.init for v in self._program.vars if v.output}
        self._roots: dict[Node, Letter] = {}
        self._edges: dict[Node, list[Edge]] = {}
        self._parents: dict[Node, tuple[Node, Move]] = {}
        self._faults: dict[int, tuple[Node, Move]] = {}
        """Of each fault by its number a configuration and the step that ends in it."""
        self._overflow = False
        self._complete = False
        self._answers: dict[int, Answer] = {}
        """By `id` of the goal."""
        self._possible: bool | None = None if given.problem.assumptions else True
        self._why = "the exploration was cut short"

    # ------------------------------------------------------------ searching

    def search(self) -> None:
        self._explore()
        self._complete = not self._overflow
        if self._overflow:
            self._why = "a value of type int left the 64 bits in which the executor holds it"
        for goal in self._given.goals:
            try:
                found = self._violation(goal)
            except AutomatonTooLarge as limit:
                self._answers[id(goal)] = Unknown(str(limit))
                continue
            if found is not None:
                self._answers[id(goal)] = found
            elif self._complete:
                self._answers[id(goal)] = Holds()
        if self._given.problem.assumptions and self._complete:
            self._possible = self._lasso(self._assumptions()) is not None

    def _explore(self) -> None:
        most = self._given.budget.max_states
        for values in product(*map(_first_values, self._variables)):
            self._roots[values, self._kept({})] = self._first_letter(values)
        todo = list(self._roots)
        for node in todo:
            edges = []
            for edge in self._steps(node):
                edges.append(edge)
                if edge.target not in self._parents and edge.target not in self._roots:
                    if most is not None and len(todo) >= most:
                        raise LimitReached(reached(most, "configurations"))
                    self._parents[edge.target] = node, edge.move
                    todo.append(edge.target)
            self._edges[node] = edges

    def _steps(self, node: Node) -> Iterator[Edge]:
        """The steps from a node that do not fail; those that do are noted."""
        program = self._program
        values = dict(zip((v.name for v in self._variables), node[0], strict=True))
        outputs = dict(zip(self._outputs, node[1], strict=True))
        for process, after in self._interpreter.successors(values, outputs):
            tick()
            move = Move(process, dict(after.samples))
            if after.overflow:
                self._overflow = True
            elif after.fault is not None:
                self._faults.setdefault(after.fault, (node, move))
            else:
                whole = program.observe == "ringlet" or process is None or after.outputs[program.cycle] == 1
                shown = (name for name, output in observed_outputs(program) if after.outputs[output])
                kept = self._kept({} if whole else after.outputs)
                yield Edge(move, (tuple(after.values.values()), kept), frozenset(shown) if whole else None)

    def _kept(self, outputs: dict[str, Value]) -> tuple[Value, ...]:
        """The outputs with which the next step begins; none: fresh ones, as after a cycle."""
        return tuple((outputs or {**self._outputs, self._program.cycle: 1}).values())

    def _first_letter(self, values: tuple[Value, ...]) -> Letter:
        program = self._program
        seen = {v.name: value for v, value in zip(self._variables, values, strict=True)} | self._outputs
        inputs = {f"input:{i.name}": i.init for i in program.inputs}
        return frozenset(a.name for a in program.atoms if evaluate(a.expression, seen, inputs))

    # ------------------------------------------------------------ violations

    def _violation(self, goal: Goal) -> Violated | None:
        """A bad prefix, or else a run that violates the goal forever. Bad prefixes have to go on under assumptions."""
        monitor, safe = bad_prefixes_of(goal)
        assumed = bool(self._given.problem.assumptions)
        if monitor is not None:
            lost = self._lasso([*self._assumptions(), _lost(goal, monitor)]) if assumed else self._prefix(goal, monitor)
            if lost is not None or safe:
                return lost
        return self._lasso([*self._assumptions(), _reader(goal.violations(), goal.atoms)])

    def _assumptions(self) -> list[Reader]:
        """What reads the assumptions, and fairness with a premise."""
        claims = [claim_of(line, self._given.problem.clock) for line in self._given.problem.assumptions]
        return [_reader(claim.automaton(), claim.atoms) for claim in (*claims, *add_premises(self._program))]

    def _prefix(self, goal: Goal, monitor: PrefixMonitor) -> Violated | None:
        """A shortest run that shows a bad prefix."""
        begin = monitor.initial()
        parents: dict[tuple[Node, int | None], tuple[tuple[Node, int | None], Edge] | None] = {}
        for root, letter in self._roots.items():
            parents[root, None if begin is None else monitor.step(begin, mask(letter, goal.atoms))] = None
        for here in (todo := list(parents)):
            tick()
            node, state = here
            if state is None:
                edges: list[Edge] = []
                while (before := parents[here]) is not None:
                    here, edge = before
                    edges.append(edge)
                return self._run(here[0], edges[::-1], None)
            for edge in self._edges[node]:
                after = state if edge.letter is None else monitor.step(state, mask(edge.letter, goal.atoms))
                if (edge.target, after) not in parents:
                    parents[edge.target, after] = here, edge
                    todo.append((edge.target, after))
        return None

    def _lasso(self, readers: Sequence[Reader]) -> Violated | None:
        """A fair run that all readers accept."""
        fair = [condition.goal for condition in self._program.fairness if condition.premise is None]
        sets = sum(reader.sets for reader in readers)

        def read(states: States, letter: Letter) -> Iterator[tuple[int, States]]:
            went = sum(1 << sets + i for i, goal in enumerate(fair) if goal in letter)
            for joint in product(*(r.read(s, letter) for r, s in zip(readers, states, strict=True))):
                acceptance, shift = went, 0
                for reader, (accepted, _) in zip(readers, joint, strict=True):
                    acceptance |= accepted << shift
                    shift += reader.sets
                yield acceptance, tuple(target for _, target in joint)

        def successors(node: tuple[Node, States]) -> Iterator[tuple[Edge, int, tuple[Node, States]]]:
            for edge in self._edges[node[0]]:
                if edge.letter is None:
                    yield edge, 0, (edge.target, node[1])
                else:
                    for acceptance, states in read(node[1], edge.letter):
                        yield edge, acceptance, (edge.target, states)

        begin = tuple(reader.first for reader in readers)
        starts = [(root, states) for root, letter in self._roots.items() for _, states in read(begin, letter)]
        lasso = find_accepting_lasso(starts, successors, sets + len(fair))
        if lasso is None:
            return None
        edges = [edge for edge, _ in (*lasso.stem, *lasso.loop)]
        return self._run(lasso.start[0], edges, len(lasso.stem))

    def _run(self, root: Node, edges: Sequence[Edge], loop: int | None) -> Violated:
        letters = tuple(edge.letter for edge in edges if edge.letter is not None)
        return Violated(self._schedule(root, [edge.move for edge in edges], loop), letters)

    def _schedule(self, root: Node, moves: Sequence[Move], loop: int | None) -> Schedule:
        free = ((v.name, value) for v, value in zip(self._variables, root[0], strict=True) if v.free)
        return Schedule(tuple((name, value) for name, value in free if isinstance(value, int)), tuple(moves), loop)

    # ------------------------------------------------------------ answers

    def ended(self, why: str | None) -> None:
        self._why = why or self._why

    def answers(self, goal: Goal) -> Iterator[Answer]:
        answer = self._answers.get(id(goal), Unknown(self._why))
        yield answer
        if isinstance(answer, Violated):
            yield Unknown(self._why)

    def fault_runs(self) -> Iterator[tuple[int, Violated]]:
        for number, (node, last) in sorted(self._faults.items()):
            moves = [last]
            while node in self._parents:
                node, move = self._parents[node]
                moves.append(move)
            yield number, Violated(self._schedule(node, moves[::-1], None))

    def faults(self) -> Holds | Unknown:
        return Holds() if self._complete and not self._faults else Unknown(self._why)

    def possible(self) -> bool | None:
        return self._possible

    def exploration(self) -> Exploration:
        return Exploration(self._complete, len(self._edges), sum(map(len, self._edges.values())))


def _reader(automaton: Automaton | Lazy, atoms: Sequence[str]) -> Reader:
    """Accepts what an automaton over these atoms accepts."""
    moves = moves_of(automaton)

    def read(state: int | None, letter: Letter) -> Iterable[tuple[int, int | None]]:
        return () if moves.is_empty else moves(state or 0, mask(letter, atoms))

    return Reader(0, read, moves.acceptance_sets)


def _lost(goal: Goal, monitor: PrefixMonitor) -> Reader:
    """Accepts the runs with a bad prefix; its state is then None."""

    def read(state: int | None, letter: Letter) -> Iterable[tuple[int, int | None]]:
        after = None if state is None else monitor.step(state, mask(letter, goal.atoms))
        return [(int(after is None), after)]

    return Reader(monitor.initial(), read, 1)


def _first_values(variable: Var) -> list[Value]:
    if not variable.free or not isinstance(variable.type, Int):
        return [variable.init]
    return list(range(variable.type.low, variable.type.high + 1))

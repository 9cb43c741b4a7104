"""Finite automata of regular expressions over state formulas, with sets of letters on their edges."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.boolean import Guard, Guards
from llfsm_verify.automata.omega.components import reaching
from llfsm_verify.automata.omega.refinement import by_class, equivalent
from llfsm_verify.limits import tick
from llfsm_verify.logic.bounds import repeat
from llfsm_verify.logic.expressions import (
    EMPTY,
    effort,
    first_match,
    fusion,
    intersection,
    nullable,
    pieces,
    sequence,
    union,
)
from llfsm_verify.logic.formula import FALSE, Formula, apply, repetition

MAX_STATES = 20_000
MAX_EDGES = 200_000
MAX_EFFORT = 5_000_000
"""The most arguments that the expressions of an automaton's states may have in all: a few seconds."""

Moves = dict[Formula, Guard]
"""What may follow, with the letters after which it may."""
Subset = frozenset[int]
"""States of an automaton, which are one of its subset construction."""


@dataclass(frozen=True, slots=True)
class FiniteAutomaton:
    """A nondeterministic automaton for finite words; state 0 is initial.

    `edges[q]` are pairs of a set of letters, not empty, and a target; `accepting[q]`: a word may end in q.
    """

    guards: Guards
    edges: tuple[tuple[tuple[Guard, int], ...], ...]
    accepting: tuple[bool, ...]


def nondeterministic(expression: Formula, guards: Guards, max_states: int = MAX_STATES) -> FiniteAutomaton:
    """The automaton of `expression`, of about one state for each of its letters, and those that accept something.

    Its states are what remains to be matched. Source: Antimirov, Partial derivatives of regular expressions and finite
    automaton constructions, TCS 155 (1996), with sets of letters in place of letters. AutomatonTooLarge: the limit.
    """
    numbers = {expression: 0}
    queue = [expression]
    edges: list[tuple[tuple[Guard, int], ...]] = []
    known: dict[Formula, Moves] = {}
    made, left = 0, MAX_EFFORT
    for state in queue:
        tick()
        left -= effort(state)
        if left < 0:
            raise AutomatonTooLarge("operands in the expressions of its states", MAX_EFFORT)
        row: list[tuple[Guard, int]] = []
        for target, guard in continuations(state, guards, known).items():
            if target not in numbers:
                numbers[target] = len(queue)
                queue.append(target)
            row.append((guard, numbers[target]))
        edges.append(tuple(row))
        made += len(row)
        if len(queue) > max_states:
            raise AutomatonTooLarge("states", max_states)
        if made > MAX_EDGES:
            raise AutomatonTooLarge("transitions", MAX_EDGES)
    return FiniteAutomaton(guards, tuple(edges), tuple(map(nullable, queue)))


def continuations(expression: Formula, guards: Guards, known: dict[Formula, Moves]) -> Moves:
    """What may remain of `expression` after one letter, with the letters after which it may; sets may overlap."""
    for node in pieces(expression):
        if node not in known:
            known[node] = _moves(node, guards, known)
    return known[expression]


def _moves(node: Formula, guards: Guards, known: dict[Formula, Moves]) -> Moves:
    args = node.args
    found: Moves = {}

    def add(rest: Formula, guard: Guard) -> None:
        if guard and rest is not FALSE:
            found[rest] = found[rest] | guard if rest in found else guard

    def add_all(moves: Moves) -> None:
        for rest, guard in moves.items():
            add(rest, guard)

    match node.op:
        case "empty":
            pass
        case "seq":
            for i, a in enumerate(args):
                for rest, guard in known[a].items():
                    add(sequence((rest, *args[i + 1 :])), guard)
                if not nullable(a):
                    break
        case "fuse":
            left, right = _first_and_rest("fuse", args)
            for rest, guard in known[left].items():
                add(fusion(rest, right), guard)
                if nullable(rest):
                    for later, other in continuations(right, guards, known).items():
                        add(later, guard & other)
        case "alt":
            for a in args:
                add_all(known[a])
        case "inter" | "nlm":
            left, right = _first_and_rest(node.op, args)
            others = continuations(right, guards, known)
            for rest, guard in known[left].items():
                for later, other in others.items():
                    add(intersection(node.op, (rest, later)), guard & other)
            if node.op == "nlm":
                add_all(known[left] if nullable(right) else {})
                add_all(others if nullable(left) else {})
        case "repeat":
            low, high = repetition(node)
            again = repeat(args[0], max(0, low - 1), None if high is None else max(0, high - 1))
            for rest, guard in known[args[0]].items() if high != 0 else ():
                add(sequence((rest, again)), guard)
        case "first_match":
            # A shorter match must be noticed: the parts that a letter leaves are kept together.
            if not nullable(args[0]):
                inner = known[args[0]]
                for part, inside in guards.partition(inner.values()).items():
                    add(first_match(union(r for r, guard in inner.items() if guard in inside)), part)
        case _:
            add(EMPTY, guards.of(node))
    return found


def _first_and_rest(op: str, args: tuple[Formula, ...]) -> tuple[Formula, Formula]:
    if len(args) == 2:
        return args[0], args[1]
    return args[0], apply("fuse" if op == "fuse" else "inter" if op == "inter" else "nlm", *args[1:])


@dataclass(frozen=True, slots=True)
class DeterministicAutomaton:
    """A deterministic automaton for finite words; state 0 is initial; a letter without an edge leads nowhere.

    `edges[q]` are pairs of a set of letters and a target, the sets disjoint and not empty, the targets distinct.
    """

    guards: Guards
    edges: tuple[tuple[tuple[Guard, int], ...], ...]
    accepting: tuple[bool, ...]

    def step(self, state: int, letter: int) -> int | None:
        """The state after `letter` (the mask of the atoms that hold); None: no state is."""
        return next((target for guard, target in self.edges[state] if self.guards.holds(guard, letter)), None)


def explore_subsets(
    first: Subset, following: Callable[[Subset], Iterable[tuple[Guard, Subset]]], max_states: int
) -> tuple[list[Subset], tuple[tuple[tuple[Guard, int], ...], ...]]:
    """The sets of states that are reached from `first`, and the edges of each: a guard, and the number of a set.

    `following`: what comes after a set of states, by letters that exclude each other. AutomatonTooLarge.
    """
    numbers = {first: 0}
    queue = [first]
    edges: list[tuple[tuple[Guard, int], ...]] = []
    for states in queue:
        tick()
        merged: dict[Subset, Guard] = {}
        for part, targets in following(states):
            merged[targets] = merged[targets] | part if targets in merged else part
        row: list[tuple[Guard, int]] = []
        for targets, guard in merged.items():
            if targets not in numbers:
                numbers[targets] = len(queue)
                queue.append(targets)
                if len(queue) > max_states:
                    raise AutomatonTooLarge("states", max_states)
            row.append((guard, numbers[targets]))
        edges.append(tuple(row))
    return queue, tuple(edges)


def minimise(automaton: DeterministicAutomaton) -> DeterministicAutomaton:
    """The smallest such automaton: useless states dropped, states of the same language merged.

    Source: `refinement`; which letters lead to which class is what counts (D'Antoni and Veanes, Minimization of
    symbolic automata, POPL 2014).
    """
    useful = useful_states(automaton)
    if 0 not in useful:
        return DeterministicAutomaton(automaton.guards, ((),), (False,))
    edges = [[(g, t) for g, t in row if t in useful and q in useful] for q, row in enumerate(automaton.edges)]
    colours = [int(accepts) if q in useful else -1 for q, accepts in enumerate(automaton.accepting)]
    block = equivalent(edges, colours)
    order: dict[int, int] = {block[0]: 0}
    representative = {}
    for q in sorted(useful, reverse=True):
        representative[block[q]] = q
    queue = [block[0]]
    rows: list[tuple[tuple[Guard, int], ...]] = []
    for name in queue:
        row = by_class(edges[representative[name]], block)
        for target in row:
            if target not in order:
                order[target] = len(order)
                queue.append(target)
        rows.append(tuple((guard, order[target]) for target, guard in row.items()))
    accepting = tuple(automaton.accepting[representative[name]] for name in queue)
    return DeterministicAutomaton(automaton.guards, tuple(rows), accepting)


def useful_states(automaton: DeterministicAutomaton | FiniteAutomaton) -> set[int]:
    """The states from which a word is accepted."""
    found = reaching([[target for _, target in row] for row in automaton.edges], automaton.accepting)
    return {q for q, accepts in enumerate(found) if accepts}

"""Coverage by its definitions: all runs of a small arrangement by an interpreter that knows no step programs, and
masking MC/DC by truth tables."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import product
from unittest.mock import patch

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.language import types as lt
from llfsm_verify.language.trees import of_kind
from llfsm_verify.language.typed import Binary, Conditional, Expression, IfElse, Literal, Unary
from llfsm_verify.language.types import Value
from tests.oracle import evaluation
from tests.oracle.direct import Direct
from tests.oracle.evaluation import Locals, World

MOST = 250
"""Configurations of the arrangements that are searched."""

Place = tuple[str, str]
"""Machine, and where in the text."""
Vector = tuple[bool | None, ...]
"""The conditions of a decision in one evaluation; None: not evaluated."""


def is_logic(e: Expression) -> bool:
    """Whether it has conditions below it."""
    if isinstance(e, Unary):
        return e.op == "not"
    boolean = isinstance(e, Binary) and isinstance(e.left.type, lt.BoolType)
    return boolean and e.op in ("and", "or", "xor", "eq", "ne")


def conditions(e: Expression) -> list[Expression]:
    """From left to right."""
    if isinstance(e, Literal):
        return []
    if not is_logic(e):
        return [e]
    return conditions(e.operand) if isinstance(e, Unary) else conditions(e.left) + conditions(e.right)


def outcome(e: Expression, given: Mapping[int, bool], nodes: dict[int, bool]) -> bool:
    """The decision, and what every node of it is; all of it is evaluated."""
    if isinstance(e, Literal):
        value = bool(e.value)
    elif not is_logic(e):
        value = given[id(e)]
    elif isinstance(e, Unary):
        value = not outcome(e.operand, given, nodes)
    else:
        left, right = outcome(e.left, given, nodes), outcome(e.right, given, nodes)
        by = {"and": left and right, "or": left or right, "xor": left != right, "ne": left != right}
        value = by.get(e.op, left == right)
    nodes[id(e)] = value
    return value


def above(e: Expression, leaf: Expression) -> Iterator[Expression]:
    """The nodes from the decision down to a condition."""
    if any(c is leaf for c in conditions(e)):
        yield e
        if is_logic(e):
            for below in (e.operand,) if isinstance(e, Unary) else (e.left, e.right):
                yield from above(below, leaf)


def decides(decision: Expression, number: int, vector: Vector) -> Iterator[dict[int, bool]]:
    """What the nodes are wherever changing the condition alone changes the outcome; what was not evaluated is free."""
    leaves = conditions(decision)
    for values in product(*((v,) if v is not None else (False, True) for v in vector)):
        given = {id(leaf): value for leaf, value in zip(leaves, values, strict=True)}
        nodes: dict[int, bool] = {}
        other = given | {id(leaves[number]): not values[number]}
        if outcome(decision, given, nodes) != outcome(decision, other, {}):
            yield nodes


def independent(decision: Expression, number: int, vectors: Sequence[Vector]) -> bool:
    """Two evaluations differ in the condition, which decides in both, and in every operator above it."""
    leaf = conditions(decision)[number]
    path = [id(node) for node in above(decision, leaf)]
    seen = {
        tuple(nodes[p] for p in path)
        for vector in vectors
        if vector[number] is not None
        for nodes in decides(decision, number, vector)
    }
    return any(tuple(not value for value in one) in seen for one in seen)


class Runs:
    """All runs: states, transitions, outcomes of decisions and independent conditions that occur."""

    def __init__(self, arrangement: Arrangement) -> None:
        self.decisions: dict[tuple[str, int], tuple[Expression, str]] = {}
        for machine in arrangement.machines:
            for state in machine.states:
                for number, t in enumerate(state.transitions):
                    self.decisions[machine.name, id(t.guard)] = t.guard, f"{t.guard.span} {state.name} {number}"
            text = (machine.actions, tuple(t.guard for state in machine.states for t in state.transitions))
            for one in (*of_kind(text, IfElse), *of_kind(text, Conditional)):
                self.decisions[machine.name, id(one.condition)] = one.condition, f"{one.condition.span}  -1"
        self.vectors: dict[tuple[str, int], set[tuple[Vector, bool]]] = defaultdict(set)
        self.complete = self._explore(arrangement)

    def _explore(self, arrangement: Arrangement) -> bool:
        usual, open_now = evaluation.evaluate, list[tuple[tuple[str, int], dict[int, bool]]]()

        def evaluate(e: Expression, world: World, locals_: Locals) -> Value:
            key = (getattr(world, "me", ""), id(e))
            if key in self.decisions:
                open_now.append((key, {}))
            try:
                value = usual(e, world, locals_)
            except BaseException:
                if key in self.decisions:
                    open_now.pop()
                raise
            if key in self.decisions:
                _, found = open_now.pop()
                leaves = conditions(e)
                if len(leaves) == 1 and leaves[0] is e:
                    found[id(e)] = bool(value)
                self.vectors[key].add((tuple(found.get(id(leaf)) for leaf in leaves), bool(value)))
            for outer, found in open_now[-1:]:
                if isinstance(value, bool) and any(leaf is e for leaf in conditions(self.decisions[outer][0])):
                    found[id(e)] = value
            return value

        runs = Direct(replace(arrangement, observe="ringlet"))
        with patch.object(evaluation, "evaluate", evaluate):
            todo = runs.initial()
            seen = set(todo)
            while todo:
                for _, _, step in runs.successors(todo.pop()):
                    if step.wide or len(seen) > MOST:
                        return False
                    if step.after is not None and step.after not in seen:
                        seen.add(step.after)
                        todo.append(step.after)
        return True

    def leaf(self, machine: str, place: str, number: int) -> Expression:
        """A condition of the decision there."""
        decision = next(e for (name, _), (e, at) in self.decisions.items() if (name, at) == (machine, place))
        return conditions(decision)[number]

    def branches(self) -> set[tuple[str, str, bool]]:
        """Outcomes of decisions."""
        return {
            (key[0], self.decisions[key][1], value) for key, found in self.vectors.items() for _, value in found
        }  # fmt: skip

    def independent(self) -> set[tuple[str, str, int]]:
        """Conditions, by their number, of decisions with several for which there is an independence pair."""
        found = set()
        for key, seen in self.vectors.items():
            decision, place = self.decisions[key]
            if len(conditions(decision)) > 1:
                vectors = [vector for vector, _ in seen]
                found |= {
                    (key[0], place, n) for n in range(len(vectors[0])) if independent(decision, n, vectors)
                }  # fmt: skip
        return found

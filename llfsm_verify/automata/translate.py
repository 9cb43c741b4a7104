"""From a formula of linear temporal logic to a Büchi automaton, by the tableau of what must hold now and next.

A state is a set of formulas that the rest of the word has to satisfy. The construction is that of Gerth, Peled, Vardi
and Wolper (Simple on-the-fly automatic verification of linear temporal logic, PSTV 1995) with acceptance on transitions
as in Couvreur (On-the-fly verification of linear temporal logic, FM 1999): there is one set for each `F`, `U` or `M`,
of all transitions that do not postpone it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

from llfsm_verify.automata.automaton import Automaton, AutomatonTooLarge, Edge
from llfsm_verify.automata.reduction import reduced
from llfsm_verify.logic.formula import FALSE, TRUE, Formula, atoms, negation, postorder
from llfsm_verify.logic.rewriting import nnf

MAX_STATES = 4_000
MAX_TRANSITIONS = 100_000
MAX_COMPARED = 200
"""More covers of one state than this are not compared with each other: it would take too long."""


def translate(
    formula: Formula,
    atom_order: Sequence[str] | None = None,
    *,
    negate: bool = False,
    max_states: int = MAX_STATES,
    max_transitions: int = MAX_TRANSITIONS,
    tick: Callable[[], None] | None = None,
) -> Automaton:
    """The automaton of the words that satisfy `formula` (`negate`: that do not), each state with a non-empty language.

    `atom_order` gives the automaton's atoms (those of the formula by default; ValueError when one is missing). `tick`
    is called often, and may raise to stop. AutomatonTooLarge: the limits are passed.
    """
    keys = tuple(atoms(formula) if atom_order is None else atom_order)
    missing = [key for key in atoms(formula) if key not in keys]
    if missing:
        raise ValueError(f"atoms not listed: {', '.join(missing)}")
    tableau = _Tableau(nnf(formula, negate), keys, max_transitions, tick)
    numbers = {tableau.initial: 0}
    queue = [tableau.initial]
    edges: list[tuple[Edge, ...]] = []
    made = 0
    for state in queue:
        row: list[Edge] = []
        for cover in tableau.covers(state):
            if cover.next not in numbers:
                numbers[cover.next] = len(queue)
                queue.append(cover.next)
            row.append(Edge(cover.positive, cover.negative, numbers[cover.next], tableau.full & ~cover.postponed))
        edges.append(tuple(row))
        made += len(row)
        if len(queue) > max_states:
            raise AutomatonTooLarge("states", max_states)
        if made > max_transitions:
            raise AutomatonTooLarge("transitions", max_transitions)
    return reduced(Automaton(keys, tuple(edges), tableau.full.bit_length()))


class _Cover(NamedTuple):
    """One way to satisfy a state: literals now, formulas next, and what is postponed (a mask of acceptance sets)."""

    positive: int
    negative: int
    next: frozenset[Formula]
    postponed: int

    def covers(self, other: _Cover) -> bool:
        """Everything `other` allows is allowed here, with no more obligations."""
        return (
            self.positive & ~other.positive == 0
            and self.negative & ~other.negative == 0
            and self.postponed & ~other.postponed == 0
            and self.next <= other.next
        )


def _without_needless(covers: dict[_Cover, None]) -> dict[_Cover, None]:
    """`covers`, of which only the last is new, without those that another one covers."""
    *others, last = covers
    if any(other.covers(last) for other in others):
        return dict.fromkeys(others)
    return dict.fromkeys([*(other for other in others if not last.covers(other)), last])


class _Choice(NamedTuple):
    """One alternative of a formula: what must hold now, what is put off to the next letter."""

    now: Formula
    later: Formula | None

    @property
    def is_literal(self) -> bool:
        return self.later is None and _is_literal(self.now)


class _Branch:
    """A cover in the making."""

    __slots__ = ("negative", "next", "now", "open", "positive", "postponed", "todo")

    def __init__(self, todo: Iterable[Formula]) -> None:
        self.todo = list(todo)
        self.open: dict[Formula, None] = {}
        self.now: set[Formula] = set()
        self.next: set[Formula] = set()
        self.positive = self.negative = self.postponed = 0

    def copy(self) -> _Branch:
        other = _Branch(self.todo)
        other.open, other.now, other.next = dict(self.open), set(self.now), set(self.next)
        other.positive, other.negative, other.postponed = self.positive, self.negative, self.postponed
        return other


class _Tableau:
    def __init__(self, formula: Formula, keys: Sequence[str], max_covers: int, tick: Callable[[], None] | None) -> None:
        self._bits = {key: 1 << i for i, key in enumerate(keys)}
        promises = [node for node in postorder(formula) if node.op in ("F", "U", "M")]
        self._promise = {node: 1 << i for i, node in enumerate(promises)}
        self._consequences: dict[Formula, frozenset[Formula]] = {}
        self._max_covers = max_covers
        self._tick = tick
        for node in postorder(formula):
            self._consequences[node] = self._implied(node)
        self.full = (1 << len(promises)) - 1
        self.initial = self._state((formula,))

    def _implied(self, node: Formula) -> frozenset[Formula]:
        """What expanding `node` adds to the formulas that hold now in any case."""
        direct = node.args if node.op == "and" else node.args[-1:] if node.op in ("G", "R", "M") else ()
        return frozenset(direct).union(*(self._consequences[a] for a in direct))

    def _state(self, formulas: Iterable[Formula]) -> frozenset[Formula]:
        """The set without what expanding the others adds anyway: equal states, and fewer of them."""
        flat = {g for f in formulas for g in (f.args if f.op == "and" else (f,)) if g is not TRUE}
        return frozenset(flat.difference(*(self._consequences[f] for f in flat)) if flat else ())

    def covers(self, state: frozenset[Formula]) -> list[_Cover]:
        """The covers of `state`; unless they are very many, none of them covered by another."""
        found: dict[_Cover, None] = {}
        branches = [_Branch(sorted(state, key=_number))]
        steps = 0
        while branches:
            steps += 1
            if self._tick is not None:
                self._tick()
            if steps > self._max_covers:
                raise AutomatonTooLarge("alternatives in one state", self._max_covers)
            branch = branches.pop()
            split = self._close(branch)
            if split is None:
                continue
            formula, choices = split
            if formula is None:
                cover = _Cover(branch.positive, branch.negative, self._state(branch.next), branch.postponed)
                found[cover] = None
                if len(found) <= MAX_COMPARED:
                    found = _without_needless(found)
                continue
            # A literal that holds is the best choice when nothing is put off; so the others assume that it does not.
            choices.sort(key=lambda choice: not choice.is_literal)
            literals = [choice.now for choice in choices if choice.is_literal]
            for k, choice in enumerate(choices):
                other = branch.copy()
                self._choose(other, formula, choice)
                other.todo.extend(map(negation, literals[:k]))
                branches.append(other)
        return list(found)

    def _close(self, branch: _Branch) -> tuple[Formula | None, list[_Choice]] | None:
        """Do all that needs no choice; then a formula to split on (None: the branch is complete), or None: dead."""
        while True:
            while branch.todo:
                if not self._add(branch, branch.todo.pop()):
                    return None
            best: tuple[Formula | None, list[_Choice]] = (None, [])
            for formula in list(branch.open):
                choices = [c for c in self._choices(formula) if not self._refuted(branch, c.now)]
                if any(c.later is None and c.now in branch.now for c in choices):
                    del branch.open[formula]
                elif not choices:
                    return None
                elif len(choices) == 1:
                    self._choose(branch, formula, choices[0])
                    break
                elif best[0] is None or len(choices) < len(best[1]):
                    best = formula, choices
            if not branch.todo and not (best[0] is None and branch.open):
                return best

    def _add(self, branch: _Branch, formula: Formula) -> bool:
        """Make `formula` hold now; False: it cannot."""
        if formula in branch.now:
            return True
        branch.now.add(formula)
        match formula.op:
            case "true":
                pass
            case "false":
                return False
            case "atom":
                branch.positive |= self._bits[formula.key]
            case "not":
                branch.negative |= self._bits[formula.args[0].key]
            case "and":
                branch.todo.extend(formula.args)
            case "X":
                branch.next.add(formula.args[0])
            case "G":
                branch.todo.append(formula.args[0])
                branch.next.add(formula)
            case "R" | "M":
                branch.todo.append(formula.args[1])
                branch.open[formula] = None
            case _:
                branch.open[formula] = None
        return branch.positive & branch.negative == 0

    def _choose(self, branch: _Branch, formula: Formula, choice: _Choice) -> None:
        del branch.open[formula]
        branch.todo.append(choice.now)
        if choice.later is not None:
            branch.next.add(choice.later)
            branch.postponed |= self._promise.get(formula, 0)

    @staticmethod
    def _choices(formula: Formula) -> list[_Choice]:
        args = formula.args
        match formula.op:
            case "or":
                return [_Choice(a, None) for a in args]
            case "F":
                return [_Choice(args[0], None), _Choice(TRUE, formula)]
            case "U" | "W":
                return [_Choice(args[1], None), _Choice(args[0], formula)]
            case "R" | "M":
                return [_Choice(args[0], None), _Choice(TRUE, formula)]
        raise AssertionError(formula.op)

    @staticmethod
    def _refuted(branch: _Branch, formula: Formula) -> bool:
        return formula is FALSE or (_is_literal(formula) and negation(formula) in branch.now)


def _is_literal(formula: Formula) -> bool:
    return formula.op in ("atom", "not")


def _number(formula: Formula) -> int:
    return formula.number

"""Bounds in time taken out of a formula: what is left starts counters, and says what each of them watches."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Literal

from llfsm_verify.logic.bounds import HIDDEN, Clock, rebuilt, time_bound
from llfsm_verify.logic.formula import (
    FALSE,
    TIMED,
    TRUE,
    Formula,
    apply,
    atom,
    atoms,
    conjunction,
    disjunction,
    is_boolean,
    negation,
    postorder,
)
from llfsm_verify.logic.rewriting.normal_form import both, either, polar_parts, temporal

Sort = Literal["within", "throughout", "delay"]


@dataclass(frozen=True, slots=True)
class Counter:
    """What a bound in time demands from each letter on in which the atom `start` is chosen to hold.

    `within` (`F[<=t]`, `U[<=t]`): `goal` holds before more than `ticks` periods have passed, and `keep` until then.
    `throughout` (`G[<=t]` and the dual of `U[<=t]`): `keep` holds until more than `ticks` periods have passed, or until
    `goal` does, that letter included.
    `delay`: `goal` holds at the first letter after `ticks` periods, of which there is one at least.
    `keep` and `goal` are state formulas, or atoms that stand for other formulas.
    """

    sort: Sort
    ticks: int
    keep: Formula
    goal: Formula
    start: str


@dataclass(frozen=True, slots=True)
class Separated:
    """A formula over more atoms, and its counters.

    A word satisfies the formula that this was made of exactly when the atoms `hidden` can be chosen so that `formula`
    holds and every counter's demands are met. A start that holds less often, or another hidden atom that holds more
    often, never makes a counter's demands harder to meet.
    """

    formula: Formula
    counters: tuple[Counter, ...]
    hidden: tuple[str, ...]


def separate(formula: Formula, clock: Clock, visible: Collection[str]) -> Separated:
    """`formula` without its bounds in time; `visible` are the atoms that letters show.

    A bounded subformula under an even number of negations becomes a start, and one under an odd number the negation of
    the start of its dual: so starts only occur where it does no harm that one is chosen not to hold, and choosing them
    exactly where the subformula holds is right. An operand that is no state formula over the visible atoms becomes an
    atom that implies it. Sources: the existential choice is that of the temporal testers of Pnueli and Zaks (FM 2006).
    """
    taken = _Taken(clock, visible)
    done = taken.built(formula)
    return Separated(conjunction((done, *taken.laws)), tuple(taken.counters.values()), tuple(taken.hidden))


class _Taken:
    def __init__(self, clock: Clock, visible: Collection[str]) -> None:
        self._clock = clock
        self._visible = frozenset(visible)
        self.counters: dict[tuple[Sort, int, Formula, Formula], Counter] = {}
        self.laws: list[Formula] = []
        self.hidden: list[str] = []
        self._operands: dict[Formula, Formula] = {}
        self._done: dict[tuple[Formula, bool], Formula] = {}

    def built(self, formula: Formula) -> Formula:
        """`formula` with starts; what stands under a negation is right there, and nowhere else."""
        bounded: set[Formula] = set()
        for node in postorder(formula):
            if node.op in TIMED or any(a in bounded for a in node.args):
                bounded.add(node)
        done = self._done
        stack = [(formula, False)]
        while stack:
            node, negative = stack[-1]
            if (node, negative) in done:
                stack.pop()
            elif node not in bounded:
                done[node, negative] = node
            elif missing := [need for need in polar_parts(node, negative) if need not in done]:
                stack.extend(missing)
            else:
                done[node, negative] = self._node(node, negative)
        return done[formula, False]

    def _node(self, node: Formula, negative: bool) -> Formula:
        args = [self._done[need] for need in polar_parts(node, negative)]
        if node.op == "not":
            return negation(args[0])
        if node.op in ("xor", "iff"):
            a, b, not_a, not_b = *args[:2], *map(negation, args[2:])
            if (node.op == "iff") != negative:
                result = disjunction((conjunction((a, b)), conjunction((not_a, not_b))))
            else:
                result = disjunction((conjunction((a, not_b)), conjunction((not_a, b))))
            return negation(result) if negative else result
        if node.op not in TIMED:
            return rebuilt(node, tuple(args))
        if negative:
            args = [negation(a) for a in args]
        first, last = args[0], args[-1]
        if (node.op in ("F<=", "U<=")) != negative:
            result = self._within(TRUE if len(args) == 1 else first, last, *self._clock.ticks(time_bound(node.key)))
        else:
            result = self._throughout(
                last, FALSE if len(args) == 1 else first, *self._clock.ticks(time_bound(node.key))
            )
        return negation(result) if negative else result

    def _within(self, keep: Formula, goal: Formula, least: int, most: int | None) -> Formula:
        """`keep U goal`, `goal` when from `least` to `most` periods (None: any number) have passed."""
        if most is None:
            rest = temporal("U", keep, goal)
            # What holds at the first letter after `least` periods then holds at all letters before.
            return (
                rest if least == 0 else self._start("throughout", least - 1, both((keep, temporal("X", rest))), FALSE)
            )
        if most < least:
            return FALSE
        rest = self._start("within", most - least, keep, goal)
        if least == 0:
            return rest
        later = self._start("delay", least, TRUE, rest)
        return later if keep is TRUE else conjunction((self._start("throughout", least - 1, keep, FALSE), later))

    def _throughout(self, keep: Formula, goal: Formula, least: int, most: int | None) -> Formula:
        """`goal R keep`, `keep` while from `least` to `most` periods (None: any number) have passed."""
        if most is None:
            rest = temporal("R", goal, keep)
            return rest if least == 0 else self._start("within", least - 1, TRUE, either((goal, temporal("X", rest))))
        if most < least:
            return TRUE
        rest = self._start("throughout", most - least, keep, goal)
        if least == 0:
            return rest
        later = self._start("delay", least, TRUE, rest)
        return later if goal is FALSE else disjunction((self._start("within", least - 1, TRUE, goal), later))

    def _start(self, sort: Sort, ticks: int, keep: Formula, goal: Formula) -> Formula:
        key = (sort, ticks, self._operand(keep), self._operand(goal))
        if key not in self.counters:
            self.hidden.append(f"{HIDDEN}start{len(self.counters)}")
            self.counters[key] = Counter(*key, self.hidden[-1])
        return atom(self.counters[key].start)

    def _operand(self, formula: Formula) -> Formula:
        if is_boolean(formula) and self._visible.issuperset(atoms(formula)):
            return formula
        if formula not in self._operands:
            self.hidden.append(f"{HIDDEN}operand{len(self._operands)}")
            holds = self._operands[formula] = atom(self.hidden[-1])
            self.laws.append(apply("G", apply("implies", holds, formula)))
        return self._operands[formula]

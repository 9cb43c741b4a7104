"""What a formula asks of the first letter, and of the rest: Couvreur's symbolic expansion of temporal operators."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Generic

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.labels import Alphabet, L
from llfsm_verify.automata.omega.symbolic import Arc, Symbolic, merged_row
from llfsm_verify.limits import tick
from llfsm_verify.logic.formula import TRUE, Formula, conjunction, postorder
from llfsm_verify.logic.rewriting.implication import Implication

Ways = dict[int, L]
"""Alternatives: a mask of duties (promises made, formulas for the rest of the word), and the letters that allow it."""

MAX_TOGETHER = 6
"""With more formulas `G F …` in a state they are fulfilled one at a time."""
MAX_COMPARED = 300
"""More alternatives than this are not compared with each other: it would take too long."""


class Expansion(Generic[L]):
    """The expansion of formulas in negation normal form.

    There is a promise for each right side of an `F`, `U` or `M`: an alternative makes it when it puts the fulfilment
    off; a run that makes a promise on all but finitely many transitions is not accepted. Operators with the same right
    side share a promise, since all of them can keep it at the same letter. Source: Couvreur, On-the-fly verification of
    linear temporal logic, FM 1999; Duret-Lutz, LTL translation improvements in Spot, VECoS 2011.
    """

    def __init__(self, alphabet: Alphabet[L], bits: dict[str, int], implication: Implication, max_ways: int) -> None:
        self._alphabet = alphabet
        self._bits = bits
        self._implies = implication
        self._max_ways = max_ways
        self._bits_of: dict[tuple[bool, Formula], int] = {}
        self._duties: list[Formula] = []
        self.promises = 0
        self._ways: dict[Formula, Ways[L]] = {}
        self._covered: dict[tuple[Formula, Formula], bool] = {}
        self._asked: dict[int, int] = {}
        self._coverers: dict[int, int] = {}
        """For the bit of a formula: the bits of those it was compared with, and of those among them that cover it."""

    def graph(self, formula: Formula, max_states: int, max_transitions: int) -> Symbolic[L]:
        """The automaton of `formula`: states are sets of formulas, of which those with equal alternatives are one."""
        states = _States(self._conjunction, max_states)
        states.number(self._duty(formula))
        drawn: list[list[tuple[L, int, int]]] = []
        made = 0
        for ways in states.ways:
            row = [
                (label, duties & self.promises, states.number(duties & ~self.promises))
                for duties, label in ways.items()
            ]
            drawn.append(row)
            made += len(row)
            if made > max_transitions:
                raise AutomatonTooLarge("transitions", max_transitions)
        return Symbolic(self._alphabet, *self._kept_promises(drawn))

    def lazily(
        self, formula: Formula, max_states: int, max_transitions: int
    ) -> tuple[int, Callable[[int], Sequence[Arc[L]]]]:
        """The acceptance sets of `graph`, and its rows as they are asked for; state 0 is initial.

        AutomatonTooLarge from the rows too: more states, or transitions in the rows so far, than the limits.
        """
        for node in postorder(formula):
            if node.op in ("F", "U", "M"):
                self._bit(True, _promise(node))
        promises = _bits(self.promises)
        states = _States(self._conjunction, max_states)
        states.number(self._duty(formula))
        rows: dict[int, list[Arc[L]]] = {}
        made = 0

        def row(number: int) -> list[Arc[L]]:
            nonlocal made
            known = rows.get(number)
            if known is None:
                ways = states.ways[number]
                made += len(ways)
                if made > max_transitions:
                    raise AutomatonTooLarge("transitions", max_transitions)
                known = rows[number] = [
                    (label, _without(promises, duties), states.number(duties & ~self.promises))
                    for duties, label in ways.items()
                ]
            return known

        return len(promises), row

    def _kept_promises(self, drawn: list[list[Arc[L]]]) -> tuple[tuple[tuple[Arc[L], ...], ...], int]:
        """Acceptance set k: the transitions that do not make promise k."""
        promises = _bits(self.promises)
        sets: dict[int, int] = {}
        for row in drawn:
            for _, made, _ in row:
                if made not in sets:
                    sets[made] = _without(promises, made)
        return tuple(merged_row((label, sets[made], q) for label, made, q in row) for row in drawn), len(promises)

    def _duty(self, formula: Formula) -> int:
        """The conjuncts of `formula`, owed by the rest of the word."""
        mask = 0
        for part in formula.args if formula.op == "and" else (formula,):
            if part is not TRUE:
                mask |= self._bit(False, part)
        return mask

    def _bit(self, promise: bool, formula: Formula) -> int:
        """The bit of a duty: of the promise that `formula` will be true, or that it is true for the rest."""
        key = (promise, formula)
        bit = self._bits_of.get(key)
        if bit is None:
            bit = self._bits_of[key] = 1 << len(self._duties)
            self._duties.append(formula)
            if promise:
                self.promises |= bit
        return bit

    def _conjunction(self, duties: int) -> Ways[L]:
        """The alternatives of a state."""
        tick()
        parts = self._parts(self._irredundant(duties))
        suspended = [part for part in parts if self._implies.purity.is_suspendable(part)]
        rest = [part for part in parts if part not in suspended]
        if suspended and rest and all(part.op == "X" for part in rest):
            # What does not depend on the position can wait while the rest only counts letters: a recurrence is not
            # pursued while one of its fulfilments is still being checked. Meanwhile all its promises are made.
            waiting = self._duty(conjunction([*suspended, *(part.args[0] for part in rest)]))
            for node in postorder(*suspended):
                if node.op in ("F", "U", "M"):
                    waiting |= self._bit(True, _promise(node))
            return {waiting: self._alphabet.true}
        recurring = [part for part in parts if part.op == "G" and part.args[0].op == "F"]
        if len(recurring) > MAX_TOGETHER:
            ways = self._one_at_a_time(recurring)
            parts = [part for part in parts if part not in recurring]
        else:
            ways = {0: self._alphabet.true}
        for part in parts:
            ways = self._product(ways, self._of(part))
        return self._canonical(ways)

    def _one_at_a_time(self, recurring: list[Formula]) -> Ways[L]:
        """Alternatives of many formulas `G F …`: at most one is fulfilled at each letter, the others promise again.

        That is enough to fulfil each infinitely often, and it takes as many alternatives as there are formulas, where
        all ways to fulfil some of them together would be exponentially many.
        """
        again = {part: self._duty(part) | self._bit(True, _promise(part.args[0])) for part in recurring}
        put_off = 0
        for duties in again.values():
            put_off |= duties
        ways: Ways[L] = {put_off: self._alphabet.true}
        for part in recurring:
            others = self._duty(part)
            for other in recurring:
                if other is not part:
                    others |= again[other]
            ways = self._sum(ways, self._product({others: self._alphabet.true}, self._of(part.args[0].args[0])))
        return ways

    def _canonical(self, ways: Ways[L]) -> Ways[L]:
        """`ways` without the formulas for the rest of the word that others beside them imply."""
        reduced: Ways[L] = {}
        for duties, label in ways.items():
            key = duties & self.promises | self._irredundant(duties & ~self.promises)
            known = reduced.get(key)
            reduced[key] = label if known is None else known | label
        return self._without_needless(reduced)

    def _irredundant(self, duties: int) -> int:
        """`duties`, formulas for the rest of the word, without those that another one beside them covers."""
        if duties & duties - 1:
            for bit in _bits(duties):
                if self._covering(bit, duties & ~bit):
                    duties &= ~bit
        return duties

    def _covering(self, bit: int, others: int) -> int:
        """Those of `others` that cover the formula of `bit`."""
        fresh = others & ~self._asked.get(bit, 0)
        if fresh:
            part = self._duties[bit.bit_length() - 1]
            found = sum(b for b in _bits(fresh) if self._covers(self._duties[b.bit_length() - 1], part))
            self._asked[bit] = self._asked.get(bit, 0) | fresh
            self._coverers[bit] = self._coverers.get(bit, 0) | found
        return self._coverers.get(bit, 0) & others

    def _covers(self, f: Formula, g: Formula) -> bool:
        """Whether `f` makes `g` needless beside it: each alternative of `f` is one of `g` as well, and so on.

        That `f` implies `g` is not enough. `G X F p` implies `F p`, and the promise that `p` will hold would never be
        made if each `F p` were dropped beside it. Here the promises of `f` are those of `g` at least, at every letter.
        """
        if not self._implies(f, g):
            return False
        known = self._covered.get((f, g))
        if known is not None:
            return known
        pairs = {(f, g): True}
        queue = [(f, g)]
        for left, right in queue:
            owed = self._owed(right)
            for x in self._owed(left):
                for y in owed:
                    if x is not y and (x, y) not in pairs and self._implies(x, y):
                        pairs[x, y] = self._covered.get((x, y), True)
                        queue.append((x, y))
        changed = True
        while changed:
            changed = False
            for pair, holds in pairs.items():
                if holds and not self._step_covered(*pair, pairs):
                    pairs[pair] = False
                    changed = True
        self._covered.update(pairs)
        return pairs[f, g]

    def _step_covered(self, f: Formula, g: Formula, pairs: dict[tuple[Formula, Formula], bool]) -> bool:
        tick()
        for mine, label in self._of(f).items():
            rest = label
            for other, allowed in self._of(g).items():
                if (other & ~mine & self.promises) == 0 and rest & allowed:
                    parts = self._parts(mine)
                    if all(any(x is y or pairs.get((x, y), False) for x in parts) for y in self._parts(other & ~mine)):
                        rest = rest & ~allowed
            if rest:
                return False
        return True

    def _owed(self, formula: Formula) -> list[Formula]:
        """What the alternatives of `formula` owe the rest of the word, all together."""
        total = 0
        for duties in self._of(formula):
            total |= duties
        return self._parts(total)

    def _parts(self, duties: int) -> list[Formula]:
        """The formulas that the rest of the word owes."""
        return [self._duties[bit.bit_length() - 1] for bit in _bits(duties & ~self.promises)]

    def _of(self, formula: Formula) -> Ways[L]:
        found = self._ways.get(formula)
        if found is None:
            for node in postorder(formula):
                if node not in self._ways:
                    self._ways[node] = self._expanded(node)
            found = self._ways[formula]
        return found

    def _expanded(self, node: Formula) -> Ways[L]:
        alphabet, ways = self._alphabet, self._ways
        match node.op:
            case "true":
                return {0: alphabet.true}
            case "false":
                return {}
            case "atom":
                return {0: alphabet.atom(self._bits[node.key])}
            case "not":
                return {0: alphabet.true & ~alphabet.atom(self._bits[node.args[0].key])}
            case "and":
                found: Ways[L] = {0: alphabet.true}
                for arg in node.args:
                    found = self._product(found, ways[arg])
                return found
            case "or":
                return self._sum(*(ways[arg] for arg in node.args))
            case "X":
                return self._next(node.args[0])
        again = self._next(node)
        if node.op in ("F", "U", "M"):
            promise = self._bit(True, _promise(node))
            again = {duties | promise: label for duties, label in again.items()}
        match node.op:
            case "F":
                return self._sum(ways[node.args[0]], again)
            case "G":
                return self._product(ways[node.args[0]], again)
            case "U" | "W":
                return self._sum(ways[node.args[1]], self._product(ways[node.args[0]], again))
            case "R" | "M":
                return self._product(ways[node.args[1]], self._sum(ways[node.args[0]], again))
        raise ValueError(f"not in negation normal form: {node.op}")

    def _next(self, formula: Formula) -> Ways[L]:
        return {self._duty(formula): self._alphabet.true}

    def _sum(self, *summands: Ways[L]) -> Ways[L]:
        total: Ways[L] = dict(summands[0])
        for ways in summands[1:]:
            for duties, label in ways.items():
                known = total.get(duties)
                total[duties] = label if known is None else known | label
        return self._without_needless(total)

    def _product(self, left: Ways[L], right: Ways[L]) -> Ways[L]:
        if len(left) * len(right) > self._max_ways:
            raise AutomatonTooLarge("alternatives in one state", self._max_ways)
        found: Ways[L] = {}
        for a, la in left.items():
            tick()
            for b, lb in right.items():
                label = la & lb
                if label:
                    known = found.get(a | b)
                    found[a | b] = label if known is None else known | label
        return self._without_needless(found)

    def _without_needless(self, ways: Ways[L]) -> Ways[L]:
        """An alternative is not needed for letters that allow one with fewer duties."""
        if len(ways) < 2 or len(ways) > MAX_COMPARED:
            return ways
        kept: Ways[L] = {}
        for duties, label in sorted(ways.items(), key=_number_of_duties):
            tick()
            for other, stronger in kept.items():
                if other & ~duties == 0:
                    label = label & ~stronger
                    if not label:
                        break
            else:
                kept[duties] = label
        return kept


class _States(Generic[L]):
    """Numbers of states, in the order in which they are met, and their alternatives."""

    def __init__(self, conjunction: Callable[[int], Ways[L]], most: int) -> None:
        self._conjunction = conjunction
        self._most = most
        self._numbers: dict[tuple[tuple[int, L], ...], int] = {}
        self._known: dict[int, int] = {}
        self.ways: list[Ways[L]] = []

    def number(self, duties: int) -> int:
        """The state that owes `duties`; AutomatonTooLarge: it is one too many."""
        number = self._known.get(duties)
        if number is None:
            ways = self._conjunction(duties)
            name = tuple(sorted(ways.items(), key=_first))
            number = self._numbers.setdefault(name, len(self.ways))
            self._known[duties] = number
            if number == len(self.ways):
                self.ways.append(ways)
                if len(self.ways) > self._most:
                    raise AutomatonTooLarge("states", self._most)
        return number


def _without(promises: list[int], made: int) -> int:
    """The acceptance sets of a transition that makes the promises of the mask `made`."""
    return sum(1 << k for k, bit in enumerate(promises) if not made & bit)


def _promise(node: Formula) -> Formula:
    """What must happen: the argument of `F`, the right side of `U`, the left side of `M`."""
    return node.args[0] if node.op in ("F", "M") else node.args[1]


def _bits(mask: int) -> list[int]:
    found: list[int] = []
    while mask:
        low = mask & -mask
        found.append(low)
        mask ^= low
    return found


def _first(item: tuple[int, object]) -> int:
    return item[0]


def _number_of_duties(item: tuple[int, object]) -> tuple[int, int]:
    return item[0].bit_count(), item[0]

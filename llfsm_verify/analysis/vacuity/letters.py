"""The letters that an explored graph shows: atoms that never or always hold, state formulas that nothing satisfies."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property, reduce
from operator import and_, or_

from llfsm_verify.checking.engine import Explored
from llfsm_verify.logic.bounds import HIDDEN
from llfsm_verify.logic.formula import Formula, is_boolean
from llfsm_verify.logic.lasso import evaluate

MOST = 5_000
"""Letters that are asked one by one; where there are more, a search is faster."""


class Letters:
    """Every letter of a complete graph."""

    def __init__(self, explored: Explored) -> None:
        self._masks = explored.masks
        self._bits = {name: i for i, name in enumerate(explored.names)}

    @cached_property
    def _letters(self) -> list[frozenset[str]]:
        """By the keys of the atoms that hold."""
        return [frozenset(name for name, i in self._bits.items() if mask >> i & 1) for mask in self._masks]

    def never(self, keys: Iterable[str]) -> tuple[str, ...]:
        """The atoms that no letter shows."""
        shown = reduce(or_, self._masks, 0)
        return tuple(k for k in keys if not k.startswith(HIDDEN) and not shown >> self._bits[k] & 1)

    def always(self, keys: Iterable[str]) -> tuple[str, ...]:
        """The atoms that every letter shows."""
        shown = reduce(and_, self._masks, -1 if self._masks else 0)
        return tuple(k for k in keys if not k.startswith(HIDDEN) and shown >> self._bits[k] & 1)

    def unmatched(self, formulas: Sequence[Formula]) -> list[Formula]:
        """The state formulas that no letter satisfies."""
        return [f for f in formulas if not any(evaluate(f, (), (letter,)) for letter in self._letters)]

    def decide(self, formula: Formula) -> bool | None:
        """Whether `G f`, or a conjunction of such, with state formulas f holds without assumptions; None: this is not
        told by letters alone, or there are too many of them."""
        if len(self._masks) > MOST:
            return None
        if formula.op == "and":
            answers = [self.decide(part) for part in formula.args]
            return False if False in answers else None if None in answers else True
        if formula.op != "G" or not is_boolean(formula.args[0]):
            return None
        return all(evaluate(formula.args[0], (), (letter,)) for letter in self._letters)

"""The letters that an explored graph shows: atoms that never or always hold, state formulas that nothing satisfies."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from llfsm_verify.checking.searching import Search
from llfsm_verify.logic.bounds import HIDDEN
from llfsm_verify.logic.formula import Formula
from llfsm_verify.logic.lasso import evaluate


class Letters:
    """Every letter of a complete graph, by the keys of the atoms that hold."""

    def __init__(self, search: Search) -> None:
        explorer = search.explorer
        masks = {*explorer.first_letters, *explorer.graph.alphabet}
        self._letters = [
            frozenset(name for i, name in enumerate(explorer.observed) if mask >> i & 1) for mask in sorted(masks)
        ]

    def never(self, keys: Iterable[str]) -> tuple[str, ...]:
        """The atoms that no letter shows."""
        shown: frozenset[str] = frozenset().union(*self._letters)
        return tuple(k for k in keys if not k.startswith(HIDDEN) and k not in shown)

    def always(self, keys: Iterable[str]) -> tuple[str, ...]:
        """The atoms that every letter shows."""
        if not self._letters:
            return ()
        shown = frozenset.intersection(*self._letters)
        return tuple(k for k in keys if not k.startswith(HIDDEN) and k in shown)

    def unmatched(self, formulas: Sequence[Formula]) -> list[Formula]:
        """The state formulas that no letter satisfies."""
        return [f for f in formulas if not any(evaluate(f, (), (letter,)) for letter in self._letters)]

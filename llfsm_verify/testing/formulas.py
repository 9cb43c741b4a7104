"""Hypothesis strategies for formulas, letters and lassos."""

from __future__ import annotations

from collections.abc import Sequence

from hypothesis import strategies as st

from llfsm_verify.logic.formula import ARITY, FALSE, TRUE, Formula, Op, apply, atom

ATOMS = ("p", "q", "r")
_INNER: tuple[Op, ...] = tuple(op for op, arity in ARITY.items() if arity != 0)


def formulas(keys: Sequence[str] = ATOMS, max_leaves: int = 6) -> st.SearchStrategy[Formula]:
    """Formulas of all operators over the atoms `keys`, with at most `max_leaves` atoms and constants."""
    leaves = st.one_of(st.sampled_from([atom(key) for key in keys]), st.sampled_from([TRUE, FALSE]))
    return st.recursive(leaves, _applied, max_leaves=max_leaves)


def _applied(inner: st.SearchStrategy[Formula]) -> st.SearchStrategy[Formula]:
    def arguments(op: Op) -> st.SearchStrategy[Formula]:
        arity = ARITY[op]
        count = st.integers(2, 3) if arity is None else st.just(arity)
        return count.flatmap(lambda n: st.tuples(*[inner] * n)).map(lambda args: apply(op, *args))

    return st.sampled_from(_INNER).flatmap(arguments)


def letters(keys: Sequence[str] = ATOMS) -> st.SearchStrategy[frozenset[str]]:
    """Letters: the sets of the atoms that hold."""
    return st.frozensets(st.sampled_from(list(keys)))


Word = list[frozenset[str]]


def lassos(keys: Sequence[str] = ATOMS, max_stem: int = 4, max_loop: int = 4) -> st.SearchStrategy[tuple[Word, Word]]:
    """Ultimately periodic words: a stem, perhaps empty, and a loop of at least one letter."""
    letter = letters(keys)
    return st.tuples(st.lists(letter, max_size=max_stem), st.lists(letter, min_size=1, max_size=max_loop))

"""The searches with automata that count time, on random graphs: against bounds written out, and the definition."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.automata.ltl.translate import translate
from llfsm_verify.automata.ltl.translation import is_safety_property, monitor_of, reader_of
from llfsm_verify.automata.safety import BadPrefix
from llfsm_verify.engines.explicit.bad_prefixes import (
    continued_bad_prefix,
    has_continued_bad_prefix,
    shortest_bad_prefix,
)
from llfsm_verify.kripke.graph import Graph
from llfsm_verify.kripke.product import Sizes
from llfsm_verify.kripke.product_search import (
    Product,
    Projection,
    Reader,
    accepting_lasso,
)
from llfsm_verify.logic.bounds import TICK
from llfsm_verify.logic.formula import Formula, apply, atom, conjunction
from tests.automata.ltl.test_counting import CLOCK, ORDER, timed, true_on, written_out
from tests.engines.explicit.graphs import FAIR, SIZES, follows, graphs, word
from tests.oracle.product import Reference, bad_prefix_length
from tests.quick import examples

WHOLE = Projection(range(len(ORDER)))
"""The graphs' fairness bit is the tick, so that time passes forever on every fair run."""
FOREVER = apply("G", apply("F", atom(TICK)))


def letters_of(masks: list[int]) -> list[frozenset[str]]:
    return [frozenset(key for i, key in enumerate(ORDER) if mask >> i & 1) for mask in masks]


def written(formula: Formula, *, negate: bool = False) -> Reader:
    return Reader(translate(written_out(formula), ORDER, negate=negate), WHOLE)


def counted(formula: Formula, *, negate: bool = False) -> Reader:
    return Reader(reader_of(formula, ORDER, CLOCK, negate=negate), WHOLE)


@pytest.mark.slow
@settings(max_examples=examples(120))
@given(graphs(), timed(4), timed(2), st.sampled_from(SIZES))
def test_lassos(case: tuple[Graph, list[int]], formula: Formula, assumed: Formula, sizes: Sizes) -> None:
    graph, first = case
    readers = [counted(assumed), counted(formula, negate=True)]
    found = accepting_lasso(graph, first, readers, [FAIR], sizes)
    reference = Reference(graph, [written(assumed), written(formula, negate=True)], [FAIR])
    assert (found is not None) == reference.has_lasso(reference.starts(first))
    if found is not None:
        assert follows(graph, found)
        stem, loop = map(letters_of, word(found, first))
        assert true_on(assumed, stem, loop)
        assert not true_on(formula, stem, loop)


@pytest.mark.slow
@settings(max_examples=examples(120))
@given(graphs(), timed(4), st.sampled_from(SIZES))
def test_bad_prefixes(case: tuple[Graph, list[int]], formula: Formula, sizes: Sizes) -> None:
    graph, first = case
    found = shortest_bad_prefix(graph, first, monitor_of(formula, ORDER, CLOCK), WHOLE, sizes)
    length = bad_prefix_length(graph, first, BadPrefix(conjunction((written_out(formula), FOREVER)), ORDER), WHOLE)
    assert (found is None) == (length is None)
    if found is not None:
        assert follows(graph, found)
        assert len(found.shown) == length
    elif is_safety_property(formula, ORDER, CLOCK):
        assert accepting_lasso(graph, first, [counted(formula, negate=True)], [FAIR], sizes) is None


@pytest.mark.slow
@settings(max_examples=examples(80))
@given(graphs(), timed(3), timed(2), st.sampled_from(SIZES))
def test_bad_prefixes_that_go_on(
    case: tuple[Graph, list[int]], formula: Formula, assumed: Formula, sizes: Sizes
) -> None:
    graph, first = case
    product = Product(graph, [counted(assumed)], [FAIR], sizes)
    found = continued_bad_prefix(first, monitor_of(formula, ORDER, CLOCK), WHOLE, product)
    there = Product(graph, [counted(assumed)], [FAIR], sizes)
    assert (found is not None) == has_continued_bad_prefix(first, monitor_of(formula, ORDER, CLOCK), WHOLE, there)
    reference = Reference(graph, [written(assumed)], [FAIR])
    monitor = BadPrefix(conjunction((written_out(formula), FOREVER)), ORDER)
    assert (found is None) == (reference.continued_bad_prefix(first, monitor, WHOLE) is None)
    if found is not None:
        stem, loop = map(letters_of, word(found, first))
        assert true_on(assumed, stem, loop)
        assert not true_on(formula, stem, loop)

"""Truth tables and decision diagrams mean the same, and their covers are exact and irredundant."""

from unittest.mock import patch

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.automata import labels
from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.diagrams import Diagrams
from llfsm_verify.automata.labels import TruthTables, cubes, of_cube
from llfsm_verify.limits import ticking
from tests.quick import examples

SIZE = 4


@st.composite
def functions(draw):
    """A truth table with the decision diagram of the same function, by the same operations."""
    tables, diagrams = TruthTables(SIZE), Diagrams(SIZE)
    pairs = [(tables.atom(i), diagrams.atom(i)) for i in range(SIZE)] + [(tables.true, diagrams.true)]
    for _ in range(draw(st.integers(0, 8))):
        (a, x), (b, y) = draw(st.sampled_from(pairs)), draw(st.sampled_from(pairs))
        match draw(st.sampled_from("&|~")):
            case "&":
                pairs.append((a & b, x & y))
            case "|":
                pairs.append((a | b, x | y))
            case "~":
                pairs.append((tables.true & ~a, ~x))
    return tables, diagrams, *pairs[-1]


def holds(diagram, letter):
    while diagram.level < SIZE:
        diagram = diagram.high if letter >> diagram.level & 1 else diagram.low
    return bool(diagram)


@pytest.mark.slow
@given(functions())
@settings(max_examples=examples(300), deadline=None)
def test_tables_and_diagrams_agree(case):
    tables, diagrams, table, diagram = case
    assert [bool(table >> letter & 1) for letter in range(1 << SIZE)] == [
        holds(diagram, letter) for letter in range(1 << SIZE)
    ]
    assert bool(table) == bool(diagram)
    assert (table == tables.true) == (diagram is diagrams.true)
    assert ~~diagram is diagram and (diagram & ~diagram) is diagrams.false and (diagram | ~diagram) is diagrams.true


@pytest.mark.slow
@given(functions())
@settings(max_examples=examples(300), deadline=None)
def test_covers_are_exact_and_irredundant(case):
    tables, diagrams, table, diagram = case
    for alphabet, label in ((tables, table), (diagrams, diagram)):
        found = cubes(alphabet, label)
        parts = [of_cube(alphabet, *cube) for cube in found]

        def union(labels, alphabet=alphabet):
            total = alphabet.false
            for part in labels:
                total = total | part
            return total

        assert union(parts) == label
        for i, (positive, negative) in enumerate(found):
            assert positive & negative == 0
            assert union(parts[:i] + parts[i + 1 :]) != label  # every cube is needed
            for bit in (1 << k for k in range(SIZE)):  # and prime: no literal can be left out
                if (positive | negative) & bit:
                    wider = of_cube(alphabet, positive & ~bit, negative & ~bit)
                    assert wider & (alphabet.true & ~label)


def test_constants():
    for alphabet in (TruthTables(0), TruthTables(3), Diagrams(3)):
        assert cubes(alphabet, alphabet.true) == [(0, 0)]
        assert cubes(alphabet, alphabet.false) == []
    with pytest.raises(ValueError, match="constant"):
        TruthTables(2).split(0, 3 << 2 | 3, 0)


@pytest.mark.slow
def test_many_atoms_are_no_crash():
    n = 3_000
    diagrams = Diagrams(n)
    everything = of_cube(diagrams, (1 << n) - 1, 0)
    assert cubes(diagrams, everything) == [((1 << n) - 1, 0)]
    assert len(cubes(diagrams, ~everything)) == n
    assert (everything & ~everything) is diagrams.false


def test_limits_end_the_search_for_cubes() -> None:
    """Of the parity of ten atoms, whose cubes have all atoms in them."""
    alphabet = Diagrams(10)
    odd = alphabet.false
    for i in range(10):
        bit = alphabet.atom(i)
        odd = (odd & ~bit) | (bit & ~odd)
    calls: list[None] = []
    with ticking(lambda: calls.append(None)):
        assert len(cubes(alphabet, odd)) == 512
    assert len(calls) > 512
    with patch.object(labels, "MAX_PIECES", 100), pytest.raises(AutomatonTooLarge, match="more than 100 parts"):
        cubes(alphabet, odd)

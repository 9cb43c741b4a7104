"""Moves are the transitions that allow a letter, without needless ones."""

from hypothesis import given, settings

from llfsm_verify.automata.ltl.translate import translate
from llfsm_verify.automata.omega.moves import Moves
from llfsm_verify.logic.formula import apply, atom, conjunction
from llfsm_verify.testing.formulas import ATOMS, formulas
from tests.quick import examples


@given(formulas(max_leaves=6))
@settings(max_examples=examples(100), deadline=None)
def test_moves_are_the_best_of_the_transitions(f):
    automaton = translate(f, ATOMS)
    moves = Moves(automaton)
    for state, row in enumerate(automaton.edges):
        for letter in range(8):
            allowed = {(e.acceptance, e.target) for e in row if e.allows(letter)}
            found = moves(state, letter)
            assert set(found) <= allowed and len(set(found)) == len(found)
            assert all(any(a & ~b == 0 and t == u for b, u in found) for a, t in allowed)
            assert not any(a & ~b == 0 and t == u and (a, t) != (b, u) for a, t in found for b, u in found)
            assert moves(state, letter) is found


def test_recurrence_has_one_move():
    f = conjunction(apply("G", apply("F", atom(k))) for k in "abc")
    assert Moves(translate(f))(0, 0b101) == ((0b101, 0),)
    assert Moves(translate(f)).relevant == 0b111

"""Monitors give the verdicts of the definition, are minimal, and know when none can come."""

from itertools import product

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.ltl.translate import translate
from llfsm_verify.diagnostics import Fragment, Source
from llfsm_verify.logic.formula import apply, atom, conjunction, disjunction, negation
from llfsm_verify.logic.parsing.formulas import parse_formula
from llfsm_verify.logic.progression import progress
from llfsm_verify.logic.rewriting.normal_form import nnf
from llfsm_verify.monitoring.monitor import Monitorability, MonitorVerdict, monitor, monitor_of
from llfsm_verify.testing.formulas import formulas, letters
from tests.quick import examples

KEYS = ("p", "q")
LETTERS = range(1 << len(KEYS))


def parsed(text):
    return parse_formula(Fragment.whole(Source("test", text))).formula


def by_definition(f, word):
    """The verdict by what progression leaves: unsatisfiable, valid, or neither."""
    rest = nnf(f)
    for letter in word:
        rest = progress(rest, letter)
    if translate(rest, KEYS).is_empty:
        return MonitorVerdict.FALSE
    return MonitorVerdict.TRUE if translate(rest, KEYS, negate=True).is_empty else MonitorVerdict.NOT_YET


@pytest.mark.slow
@given(formulas(KEYS, max_leaves=6), st.lists(letters(KEYS), max_size=4))
@settings(max_examples=examples(200), deadline=None)
def test_verdicts_are_those_of_the_definition(f, word):
    assert monitor(f, KEYS).verdict(word) is by_definition(f, word)


@pytest.mark.slow
@given(formulas(KEYS, max_leaves=8))
@settings(max_examples=examples(150), deadline=None)
def test_monitors_are_deterministic_complete_and_minimal(f):
    m = monitor(f, KEYS)
    for state, row in enumerate(m.edges):
        for letter in LETTERS:
            assert sum(e.positive & ~letter == 0 and e.negative & letter == 0 for e in row) >= 1
            targets = {e.target for e in row if e.positive & ~letter == 0 and e.negative & letter == 0}
            assert targets == {m.step(state, letter)}
            if m.verdicts[state] is not MonitorVerdict.NOT_YET:
                assert targets == {state}
    apart = {(a, b) for a, b in product(range(len(m.edges)), repeat=2) if m.verdicts[a] is not m.verdicts[b]}
    while True:
        more = {
            (a, b)
            for a, b in product(range(len(m.edges)), repeat=2)
            if (a, b) not in apart and any((m.step(a, x), m.step(b, x)) in apart for x in LETTERS)
        }
        if not more:
            break
        apart |= more
    assert all((a, b) in apart for a, b in product(range(len(m.edges)), repeat=2) if a != b)
    reached = [0]
    for state in reached:
        reached += [t for t in dict.fromkeys(m.step(state, x) for x in LETTERS) if t not in reached]
    assert sorted(reached) == list(range(len(m.edges)))


@pytest.mark.slow
@given(formulas(KEYS, max_leaves=6))
@settings(max_examples=examples(150), deadline=None)
def test_hopeless_states_reach_no_verdict(f):
    m = monitor(f, KEYS)
    for start, hopeless in enumerate(m.hopeless):
        reached = [start]
        for state in reached:
            reached += [t for t in dict.fromkeys(m.step(state, x) for x in LETTERS) if t not in reached]
        assert hopeless == all(m.verdicts[s] is MonitorVerdict.NOT_YET for s in reached)


@pytest.mark.parametrize(
    ("text", "states", "expected"),
    [
        ("G p", 2, Monitorability.ALWAYS),
        ("F p", 2, Monitorability.ALWAYS),
        ("p U q", 3, Monitorability.ALWAYS),
        ("true", 1, Monitorability.ALWAYS),
        ("p && !p", 1, Monitorability.ALWAYS),
        ("G F p", 1, Monitorability.NEVER),
        ("F G p", 1, Monitorability.NEVER),
        ("G (p -> F q)", 1, Monitorability.NEVER),
        ("(p -> G F q) && (!p -> X G q)", 4, Monitorability.SOMETIMES),
    ],
)
def test_monitorability(text, states, expected):
    m = monitor(parsed(text))
    assert m.monitorability is expected
    assert len(m.verdicts) == states


def test_valid_and_unsatisfiable_formulas_are_decided_at_once():
    assert monitor(parsed("F p || G !p")).verdict([]) is MonitorVerdict.TRUE
    assert monitor(parsed("F p && G !p")).verdict([]) is MonitorVerdict.FALSE


@pytest.mark.slow
def test_many_atoms_are_not_enumerated():
    atoms_ = [atom(f"p{i}") for i in range(40)]
    m = monitor(apply("G", disjunction(atoms_)))
    assert (len(m.verdicts), sum(map(len, m.edges))) == (2, 42)
    m = monitor(apply("U", conjunction(atoms_), conjunction(map(negation, atoms_))))
    assert len(m.verdicts) == 3


def test_atoms_that_do_not_matter_stay_in_place():
    m = monitor(parsed("G q"), ["z", "q", "y"])
    assert m.step(0, m.letter({"z", "y"})) != 0 == m.step(0, m.letter({"q"}))


def test_limits_are_named():
    f = parsed("G (p -> X X X X X q)")
    with pytest.raises(AutomatonTooLarge, match="10 states"):
        monitor(f, max_states=10)
    with pytest.raises(AutomatonTooLarge, match="20 transitions"):
        monitor(f, max_edges=20)


def test_automata_must_have_the_same_atoms():
    with pytest.raises(ValueError, match="atoms"):
        monitor_of(translate(atom("p")), translate(atom("q")))

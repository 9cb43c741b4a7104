"""The hierarchy by meaning: dual, in agreement with the closure, with the form, and with hand-made cases."""

import pytest
from hypothesis import given, settings

from llfsm_verify.automata import diagrams, labels
from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.ltl import classes
from llfsm_verify.automata.ltl.classes import Membership, PropertyClass, classify, membership
from llfsm_verify.automata.ltl.translate import translate
from llfsm_verify.automata.safety import safety
from llfsm_verify.diagnostics import Fragment, Source
from llfsm_verify.logic.formula import apply, atom, conjunction, disjunction, negation
from llfsm_verify.logic.hierarchy import Form, form
from llfsm_verify.logic.parsing.formulas import parse_formula
from llfsm_verify.logic.rewriting.normal_form import nnf
from llfsm_verify.monitoring.monitor import monitor
from llfsm_verify.testing.formulas import formulas
from tests.quick import examples

DUAL = dict(zip("BSGORPT", "BGSOPRT", strict=True))


def parsed(text):
    return parse_formula(Fragment.whole(Source("test", text))).formula


@pytest.mark.parametrize(
    ("text", "letter"),
    [
        ("true", "B"),
        ("p && X X q", "B"),
        ("F p || G !p", "B"),  # valid
        ("G (p -> X q)", "S"),
        ("F p -> (!q U p)", "S"),  # does not look like it
        ("p U q", "G"),
        ("F p && !G !p", "G"),
        ("G p || F q", "O"),
        ("p W (q && F r)", "O"),
        ("G (p -> F q)", "R"),
        ("G F p || G q", "R"),
        ("F G p", "P"),
        ("!G (p -> F q)", "P"),
        ("F G p || G F q", "T"),
        ("(G F p -> G F q) && (F r || G s)", "T"),
        ("G (p || F G q)", "P"),  # by its form in no class below reactivity
        ("(p U q) U F G r", "P"),
    ],
)
def test_cases(text, letter):
    assert classify(parsed(text)) == letter


@given(formulas(max_leaves=6))
@settings(max_examples=examples(150), deadline=None)
def test_negation_is_dual_and_safety_is_that_of_the_closure(f):
    found = classify(f)
    assert classify(negation(f)) == DUAL[found]
    assert safety(f).holds == (found in ("S", "B"))
    assert safety(negation(f)).holds == (found in ("G", "B"))


@given(formulas(max_leaves=6))
@settings(max_examples=examples(150), deadline=None)
def test_the_form_is_never_refuted(f):
    shown, found = form(nnf(f)), membership(f)
    assert found.safety or not shown.safety
    assert found.guarantee or not shown.guarantee
    assert found.recurrence or not shown.recurrence
    assert found.persistence or not shown.persistence
    assert (found.recurrence and found.persistence) or not shown.obligation


@given(formulas(max_leaves=6))
@settings(max_examples=examples(150), deadline=None)
def test_the_automata_alone_say_the_same(f):
    expected = membership(f)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(classes, "form", lambda _: Form(False, False, False, False, False))
        patch.setattr(classes, "_is_deterministic", lambda _: False)
        assert membership(f) == expected


@pytest.mark.slow
@given(formulas(("p", "q"), max_leaves=4), formulas(("r", "s"), max_leaves=4))
@settings(max_examples=examples(100), deadline=None)
def test_classes_are_closed_under_conjunction_and_disjunction(f, g):
    first, second = membership(f), membership(g)
    for joined in (conjunction((f, g)), disjunction((f, g))):
        both = membership(joined)
        for name in ("safety", "guarantee", "recurrence", "persistence"):
            assert getattr(both, name) or not (getattr(first, name) and getattr(second, name))


def test_beyond_the_limits_nothing_is_guessed():
    hard = parsed("G (p -> F G q) && G (r -> G F s)")
    assert classify(hard) == "T"
    assert membership(hard, max_subsets=1) == Membership(False, False, None, None)
    assert membership(parsed("G (p -> F q)"), max_subsets=1) == Membership(False, False, True, None)
    assert Membership(None, True, True, True).smallest is None
    assert Membership(False, False, None, True).smallest is None
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(classes, "MAX_PAIRS", 1)
        assert membership(hard) == Membership(None, None, None, None)
        patch.setattr(classes, "MAX_STATES", 1)
        assert classify(hard) is None
        assert membership(parsed("G F p && G (q -> F r)")).recurrence is True


@pytest.mark.slow
def test_letters_too_large_to_write_down_are_a_limit():
    """Seventeen atoms are beyond truth tables; the diagrams of this need more than a hundred nodes."""
    one = parsed("F p0 && G (p1 -> X F (" + " xor ".join(f"p{i}" for i in range(16)) + ")) && F G (p1 && p16)")
    assert classify(one) == "T"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(diagrams, "MAX_NODES", 100)
        assert membership(one).smallest is None
        with pytest.raises(AutomatonTooLarge, match="100 nodes in the decision diagrams"):
            translate(one)
        with pytest.raises(AutomatonTooLarge):
            monitor(one)


@pytest.mark.slow
def test_an_automaton_of_too_many_cubes_is_a_limit():
    """The parity of thirty atoms is one transition, and half a billion cubes; its class needs none of them."""
    parity = parsed("G (" + " xor ".join(f"p{i}" for i in range(30)) + ")")
    assert classify(parity) == "S"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(labels, "MAX_CUBES", 1_000)
        with pytest.raises(AutomatonTooLarge, match="1,000 transitions"):
            translate(parity)


def test_states_that_others_simulate_do_not_count():
    """The initial state simulates all that can be reached: one subset is enough."""
    assert membership(parsed("(F G a || G F b) && (F G c || G F d)"), max_subsets=1).smallest == "T"


@given(formulas(max_leaves=6))
@settings(max_examples=examples(100), deadline=None)
def test_within_narrow_limits_an_answer_is_right_or_none(f):
    expected = membership(f)
    for limit in (1, 2, 4):
        found = membership(f, max_subsets=limit)
        for name in ("safety", "guarantee", "recurrence", "persistence"):
            assert getattr(found, name) in (None, getattr(expected, name))


def test_more_than_plain_logic_is_refused():
    with pytest.raises(ValueError, match="plain"):
        classify(apply("Y", atom("p")))


def test_letters_are_their_values():
    assert "".join(PropertyClass) == "BSGORPT"


@pytest.mark.parametrize(
    ("known", "letter"),
    [
        ((True, True, True, True), "B"),
        ((True, False, True, True), "S"),
        ((False, True, True, True), "G"),
        ((True, None, True, True), None),
        ((None, True, True, True), None),
        ((False, None, False, False), None),
        ((None, False, False, False), None),
        ((False, False, True, True), "O"),
        ((False, False, True, False), "R"),
        ((False, False, False, True), "P"),
        ((False, False, False, False), "T"),
        ((False, False, None, True), None),
        ((False, False, True, None), None),
        ((True, False, None, None), "S"),
        ((False, True, None, None), "G"),
    ],
)
def test_the_smallest_of_what_is_known(known, letter):
    assert Membership(*known).smallest == letter

"""What is remembered of the past, against evaluation on lassos and against guessing the same."""

from __future__ import annotations

from itertools import product

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.ltl.history import memories_of
from llfsm_verify.automata.ltl.translate import translate
from llfsm_verify.automata.ltl.translation import automaton_of, project, without_past
from llfsm_verify.automata.omega.products import accepts
from llfsm_verify.diagnostics import Fragment, Source
from llfsm_verify.logic.formula import PAST, Formula, apply, atom, negation, operators
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.parsing.formulas import parse_formula
from llfsm_verify.testing.formulas import lassos
from tests.quick import examples

KEYS = ("p", "q")
P, Q = map(atom, KEYS)
Word = tuple[list[frozenset[str]], list[frozenset[str]]]


def parsed(text: str) -> Formula:
    return parse_formula(Fragment.whole(Source("test", text))).formula


def backwards(max_leaves: int = 4) -> st.SearchStrategy[Formula]:
    """Past operators over state formulas, in each other."""

    def larger(inner: st.SearchStrategy[Formula]) -> st.SearchStrategy[Formula]:
        unary = st.builds(apply, st.sampled_from(["Y", "Z", "O", "H"]), inner)
        binary = st.builds(apply, st.sampled_from(["S", "T", "and", "or", "iff", "xor", "implies"]), inner, inner)
        return st.one_of(unary, binary, inner.map(negation))

    return st.recursive(st.sampled_from([P, Q]), larger, max_leaves=max_leaves)


around = st.sampled_from(
    ["X ({})", "G ({})", "F ({})", "G F ({})", "F G ({})", "({}) U ({})", "({}) R ({})", "G (({}) -> X ({}))"]
)


@pytest.mark.slow
@given(backwards(), backwards(3), around, lassos(KEYS))
@settings(max_examples=examples(150))
def test_against_evaluation_and_guessing(a: Formula, b: Formula, form: str, word: Word) -> None:
    f = parsed(form.replace("{}", "(a1)", 1).replace("{}", "(b1)"))
    rest, memories = memories_of(f, ("a1", "b1"))
    assert rest is f and not memories
    f = substituted(f, {"a1": a, "b1": b})
    rest, memories = memories_of(f, KEYS)
    assert not operators(rest) & PAST
    assert bool(memories) == bool(operators(f) & PAST)
    expected = evaluate(f, *word)
    assert accepts(automaton_of(f, KEYS), *word) is expected
    assert accepts(automaton_of(f, KEYS, negate=True), *word) is not expected
    present, guessed = without_past(f)
    assert accepts(project(translate(present, (*KEYS, *guessed)), len(KEYS)), *word) is expected


@pytest.mark.parametrize("text", ["Y p", "Z p", "O p", "H p", "p S q", "p T q", "Z Y p", "Y Z p", "H Z p", "O Y p"])
def test_each_operator_on_all_short_words(text: str) -> None:
    alphabet = [frozenset(x) for x in ("", "p", "q", "pq")]
    for form in ("{}", "X ({})", "G ({})", "F G ({})"):
        f = parsed(form.format(text))
        automaton = automaton_of(f, KEYS)
        for a, b, c in product(alphabet, repeat=3):
            assert accepts(automaton, [a, b], [c]) is evaluate(f, [a, b], [c])


def substituted(f: Formula, values: dict[str, Formula]) -> Formula:
    if f.op == "atom":
        return values[f.key]
    return (
        negation(substituted(f.args[0], values))
        if f.op == "not"
        else apply(f.op, *(substituted(a, values) for a in f.args))
    )


def test_the_past_of_the_future_is_guessed() -> None:
    rest, memories = memories_of(parsed("G (O (p && Y q) -> O F (q && Y p))"), KEYS)
    assert [m.node.op for m in memories] == ["Y", "O", "Y"]
    assert [op for op in operators(rest) if op in PAST] == ["O"]


def test_one_operator_in_two_places_is_remembered_once() -> None:
    _, memories = memories_of(parsed("G (O p -> X (q || O p && Y O p))"), KEYS)
    assert [m.node.op for m in memories] == ["O", "Y"]


@pytest.mark.slow
def test_many_operators_side_by_side() -> None:
    keys = [f"p{i}" for i in range(7)]
    f = parsed("G (" + " && ".join(f"O {k}" for k in keys[:-1]) + f" -> O {keys[-1]})")
    automaton = automaton_of(f)
    assert len(automaton.edges) == 2**6
    assert automaton.acceptance_sets == 0


def test_too_many_states_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("llfsm_verify.automata.ltl.history.MAX_STATES", 20)
    with pytest.raises(AutomatonTooLarge, match="20 states"):
        automaton_of(parsed("G (O a && O b && O c && O d && O e -> p)"))
    monkeypatch.setattr("llfsm_verify.automata.ltl.history.MAX_STATES", 64)
    monkeypatch.setattr("llfsm_verify.automata.ltl.history.MAX_EDGES", 50)
    with pytest.raises(AutomatonTooLarge, match="50 transitions"):
        automaton_of(parsed("G (O a && O b && O c && O d && O e -> p)"))

"""Words that satisfy a formula: there is one exactly where the automaton has one, and it says no more than it must."""

from __future__ import annotations

import pytest
from hypothesis import given, settings

from llfsm_verify.automata.ltl import satisfiability
from llfsm_verify.automata.ltl.satisfiability import satisfying_word
from llfsm_verify.automata.ltl.translate import translate
from llfsm_verify.automata.omega.products import accepted_word
from llfsm_verify.diagnostics import Fragment, Source
from llfsm_verify.logic.formula import Formula, atoms
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.parsing.formulas import parse_formula
from llfsm_verify.logic.wordtext import write_word
from llfsm_verify.testing.formulas import formulas
from tests.quick import examples


def read(text: str) -> Formula:
    return parse_formula(Fragment.whole(Source("f", text))).formula


@pytest.mark.parametrize(
    ("text", "negate", "word"),
    [
        ("p && !q", False, "p&!q;cycle{1}"),
        ("q && X !p", False, "q;!p;cycle{1}"),
        ("G p", False, "cycle{p}"),
        ("G (b && !a)", False, "cycle{b&!a}"),
        ("p -> X q", True, "p;!q;cycle{1}"),
        ("p U q", True, "!p&!q;cycle{1}"),
        ("p && !p", False, None),
        ("F p || G !p", True, None),
    ],
)
def test_words(text: str, negate: bool, word: str | None) -> None:
    found = satisfying_word(read(text), negate=negate)
    assert (None if found is None else write_word(*found)) == word


@given(formulas())
@settings(max_examples=examples(150), deadline=None)
def test_a_word_is_there_where_the_automaton_has_one_and_satisfies(formula: Formula) -> None:
    found = satisfying_word(formula)
    assert (found is None) == (accepted_word(translate(formula)) is None)
    if found is not None:
        for others in (False, True):  # atoms of which a letter says nothing may be either
            stem, loop = ([{**dict.fromkeys(atoms(formula), others), **dict(x)} for x in part] for part in found)
            assert evaluate(formula, stem, loop)


def test_what_is_too_large_for_the_search_is_answered_by_the_whole_automaton(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(satisfiability, "MAX_STATES", 1)
    found = satisfying_word(read("X X p"))
    assert found is not None and evaluate(read("X X p"), *([{"p": False, **dict(x)} for x in part] for part in found))


def test_only_plain_temporal_logic_is_searched() -> None:
    with pytest.raises(ValueError, match="only plain temporal logic"):
        satisfying_word(read("O p"))

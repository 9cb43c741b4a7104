"""Properties that are automata from files: what they allow and forbid, complements, and what is asked for instead."""

import pytest
from hypothesis import given, settings

from llfsm_verify.automata.automaton import Automaton
from llfsm_verify.automata.ltl.translate import translate
from llfsm_verify.automata.omega.complement import NotDeterministic, complement
from llfsm_verify.automata.omega.products import accepts
from llfsm_verify.automata.omega.reduction import closure_of
from llfsm_verify.automata.properties import load_automata, over, regular_monitor
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.extensions.hoa.writing import write_hoa
from llfsm_verify.logic.formula import apply, atom
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.properties import FEATURES, parse_properties
from llfsm_verify.logic.reading import read_source
from llfsm_verify.testing.formulas import formulas, lassos
from tests.quick import examples

P, Q = atom("p"), atom("q")


@pytest.mark.slow
@given(formulas(("p", "q"), 5), lassos(("p", "q")))
@settings(max_examples=examples(200), deadline=None)
def test_complement(f, word):
    try:
        opposite = complement(translate(f, ("p", "q")))
    except NotDeterministic:
        return
    assert accepts(opposite, *word) != evaluate(f, *word)


@pytest.mark.slow
@given(formulas(("p", "q"), 5), lassos(("p", "q")))
@settings(max_examples=examples(150), deadline=None)
def test_closure(f, word):
    automaton = translate(f, ("p", "q"))
    assert accepts(closure_of(automaton), *word) == accepts(translate(f, ("p", "q"), closed=True), *word)


def test_complement_of_two_sets_and_of_no_states():
    both = apply("and", apply("G", apply("F", P)), apply("G", apply("F", Q)))
    opposite = complement(translate(both, ("p", "q")))
    p, q = frozenset("p"), frozenset("q")
    assert [accepts(opposite, [], loop) for loop in ([p], [q], [p, q], [p | q])] == [True, True, False, False]
    assert accepts(complement(Automaton(("p",), (), 0)), [], [p])


def loaded(tmp_path, text):
    (tmp_path / "properties.ltl").write_text(text, encoding="utf-8")
    return load_automata(parse_properties([read_source(tmp_path / "properties.ltl")], features=FEATURES))


def test_files(tmp_path):
    (tmp_path / "sub").mkdir()
    always = apply("G", apply("implies", atom("ns@GREEN"), atom("x==3")))
    (tmp_path / "sub" / "always.hoa").write_text(write_hoa(translate(always)))
    properties, automata = loaded(
        tmp_path, "automaton a: sub/always.hoa # relative\nautomaton never b: sub/always.hoa\nG p\n"
    )
    assert [(p.name, p.kind, p.file) for p in properties] == [
        ("a", "automaton", "sub/always.hoa"),
        ("b", "automaton never", "sub/always.hoa"),
        ("L3", "ltl", None),
    ]
    assert list(properties.atoms) == ["ns@GREEN", "x == 3", "p"]
    place = properties.properties[0].atoms["x == 3"]
    assert place.span(0, 6).text == "x==3"
    good, bad = frozenset({"x == 3", "ns@GREEN"}), frozenset({"ns@GREEN"})
    assert automata["a"] == automata["b"]
    assert accepts(automata["b"], [], [good]) and not accepts(automata["b"], [good], [bad])
    wider = over(automata["a"], ("q", "x == 3", "ns@GREEN"))
    assert wider.atoms[0] == "q" and accepts(wider, [], [good]) and not accepts(wider, [good], [bad])


def test_refusals(tmp_path):
    (tmp_path / "fg.hoa").write_text(write_hoa(translate(apply("F", apply("G", P)))))
    with pytest.raises(DiagnosticError) as raised:
        loaded(tmp_path, "automaton a: fg.hoa\nautomaton never fine: fg.hoa\nautomaton b: missing.hoa\n")
    one, two = raised.value.diagnostics
    assert (one.code, one.span.line) == ("E364", 1) and one.hint.startswith(
        "write `automaton never a:` with an automaton of the negation"
    )
    assert two.code == "E301" and two.file.endswith("missing.hoa")
    (tmp_path / "none.hoa").write_text("")
    with pytest.raises(DiagnosticError, match="E363"):
        loaded(tmp_path, "automaton a: none.hoa")
    (tmp_path / "two.hoa").write_text('HOA: v1 AP: 2 "x==3" "x == 3" Acceptance: 0 t --BODY-- --END--')
    with pytest.raises(DiagnosticError, match="one proposition with another"):
        loaded(tmp_path, "automaton a: two.hoa")


def test_regular_monitors_name_the_line():
    (line,) = parse_properties([Source("t", "\nenforce x: true true")], features=FEATURES)
    with pytest.raises(DiagnosticError, match=r"t:2:12: error\[E344\]"):
        regular_monitor(line, ("p",))
    (line,) = parse_properties([Source("t", "forbid x: p p | q")], features=FEATURES)
    assert regular_monitor(line, ("p", "q")).step(0, 2) is None

"""What is said to be vacuous against every subformula replaced and decided by plain Python, on random graphs."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from llfsm_verify.analysis.vacuity.check import TooManySubformulas, findings
from llfsm_verify.automata.ltl.satisfiability import satisfying_word
from llfsm_verify.automata.ltl.translate import translate
from llfsm_verify.checking.verdict import VacuityFinding
from llfsm_verify.diagnostics import Fragment, Source
from llfsm_verify.kripke.graph import Graph
from llfsm_verify.kripke.product_search import Reader, accepting_lasso
from llfsm_verify.logic.bounds import TICK, Clock, rebuilt, written_out
from llfsm_verify.logic.formula import FALSE, TRUE, Formula, apply, conjunction, negation
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.parsing.formulas import parse_formula
from llfsm_verify.logic.rewriting.strengthening import Occurrence, replace_subformula
from llfsm_verify.testing.formulas import Word, formulas, lassos
from tests.engines.explicit.graphs import KEYS, graphs, projection
from tests.oracle.product import Reference
from tests.quick import examples, many

Case = tuple[Graph, list[int]]


def formula_of(text: str) -> Formula:
    return parse_formula(Fragment.whole(Source("", text))).formula


def wrong(formula: Formula) -> list[Reader]:
    keys, project = projection(formula)
    return [Reader(translate(formula, keys, negate=True), project)]


def by_reference(case: Case, formula: Formula) -> bool:
    graph, first = case
    reference = Reference(graph, wrong(formula), [])
    return not reference.has_lasso(reference.starts(first))


def by_engine(case: Case, formula: Formula) -> bool:
    graph, first = case
    return accepting_lasso(graph, first, wrong(formula), []) is None


def put(node: Formula, path: tuple[int, ...], by: Formula) -> Formula:
    """The plain substitution, without folding anything."""
    if not path:
        return by
    args = list(node.args)
    args[path[0]] = put(args[path[0]], path[1:], by)
    return rebuilt(node, tuple(args))


def stronger(case: Case, whole: Formula, node: Formula, path: tuple[int, ...], negative: bool) -> Iterator[Formula]:
    """The stronger formulas that hold, outermost places first, by the definition."""
    if node.op in ("xor", "iff") or written_out(node) is not None:
        return
    if node.op == "implies" and not negative and node.args[1] is not FALSE:
        without = put(whole, (*path, 1), FALSE)
        folded = replace_subformula(whole, (*path, 1), FALSE)
        if folded not in (TRUE, FALSE) and by_reference(case, without):
            yield without
            return
    for i, arg in enumerate(node.args):
        sign = negative != (node.op == "not" or (node.op == "implies" and i == 0))
        if arg in (TRUE, FALSE):
            continue
        without = put(whole, (*path, i), TRUE if sign else FALSE)
        consequent = node.op == "implies" and i == 1 and not negative
        if not consequent and replace_subformula(whole, (*path, i), TRUE if sign else FALSE) is not FALSE:
            if by_reference(case, without):
                yield without
                continue
        yield from stronger(case, whole, arg, (*path, i), sign)


def implies(left: Formula, right: Formula) -> bool:
    return satisfying_word(conjunction((left, negation(right)))) is None


def check(case: Case, formula: Formula) -> None:
    assume(by_reference(case, formula))
    found = list(findings(formula, lambda f: by_engine(case, f), everything=True))
    expected = list(stronger(case, formula, formula, (), False))
    assert len(found) == len(expected)
    for finding in found:
        assert finding.witness is not None
        witness = formula_of(finding.witness)
        assert by_reference(case, witness)
        assert implies(witness, formula)
        assert any(implies(witness, other) and implies(other, witness) for other in expected)


@pytest.mark.slow
@settings(max_examples=examples(40), deadline=None)
@given(graphs(4, silent=False), formulas(KEYS, max_leaves=4))
def test_findings_are_those_of_the_definition(case: Case, formula: Formula) -> None:
    case[0].expanded = len(case[0])
    check(case, formula)


@pytest.mark.long
@settings(max_examples=many(5_000), deadline=None)
@given(graphs(5, silent=False), formulas(KEYS, max_leaves=6))
def test_findings_are_those_of_the_definition_at_length(case: Case, formula: Formula) -> None:
    case[0].expanded = len(case[0])
    check(case, formula)


@settings(max_examples=examples(100), deadline=None)
@given(formulas(KEYS, max_leaves=5))
def test_a_replaced_subformula_makes_a_stronger_formula_and_folding_changes_nothing(formula: Formula) -> None:
    for i, arg in enumerate(formula.args):
        if formula.op in ("xor", "iff"):
            continue
        place = Occurrence(arg, (i,), formula.op == "not" or (formula.op == "implies" and i == 0))
        folded, plain = replace_subformula(formula, place.path, place.extreme), put(formula, place.path, place.extreme)
        assert implies(folded, formula)
        assert implies(folded, plain) and implies(plain, folded)


def found_in(text: str, *holding: str) -> list[VacuityFinding]:
    """The findings when only these formulas hold."""
    true = [formula_of(h) for h in holding]
    return list(findings(formula_of(text), lambda f: f in true, everything=True))


@pytest.mark.parametrize(
    ("text", "holds", "kind", "message"),
    [
        ("G (p -> F q)", "G !p", "antecedent", "`p` is never true in any run: `G !p` also holds"),
        ("G (p -> F q)", "G F q", "subformula", "`p` does not matter: `G F q` also holds"),
        ("G (X p -> q)", "G !X p", "antecedent", "`X p` never holds in any run: `G !X p` also holds"),
        ("F (p -> q)", "F !p", "antecedent", "`p` is never true where it is asked for: `F !p` also holds"),
        ("G !(p && q)", "G !p", "subformula", "`q` does not matter: `G !p` also holds"),
        ("G (p -> (q W r))", "G (p -> G q)", "subformula", "`r` does not matter: `G (p -> G q)` also holds"),
    ],
)
def test_findings_in_words(text: str, holds: str, kind: str, message: str) -> None:
    (finding,) = found_in(text, holds)
    assert (finding.kind, finding.message) == (kind, message)


def test_nothing_is_said_below_equivalences_and_inside_written_out_bounds() -> None:
    bound = apply("G", formula_of("p || X (p || X p)"))
    assert list(findings(bound, lambda _: True, everything=True)) == []
    assert found_in("G (p <-> q)", "G p", "G q", "G !p", "G !q") == []


def test_formulas_with_very_many_subformulas_are_not_looked_at_wholly() -> None:
    formula = conjunction(apply("X", apply("F", f)) for f in [formula_of(f"p{i} && q{i}") for i in range(60)])
    with pytest.raises(TooManySubformulas):
        list(findings(formula, lambda _: False, everything=True))


@pytest.mark.slow
@settings(max_examples=examples(200), deadline=None)
@given(
    st.sampled_from(["p U{} q", "p R{} q", "F{} p", "G{} p"]),
    st.sampled_from(["[<=10ms]", "[10ms:20ms]", "[>=10ms]", "[<=0ms]", "[>=0ms]"]),
    st.integers(0, 1),
    st.sampled_from([TRUE, FALSE]),
    lassos(("p", "q", TICK)),
)
def test_constants_in_time_are_folded_into_the_same(
    shape: str, bound: str, place: int, constant: Formula, word: tuple[Word, Word]
) -> None:
    """`p U[10ms:20ms] true` is no more than that p holds for a time, and not `true`."""
    formula = formula_of(shape.format(bound))
    path = (min(place, len(formula.args) - 1),)
    stem, loop = word[0], [*word[1][:-1], word[1][-1] | {TICK}]
    delays = Clock(Fraction(10)).delays((*stem, *loop))
    folded = replace_subformula(formula, path, constant)
    assert evaluate(folded, stem, loop, delays) == evaluate(put(formula, path, constant), stem, loop, delays)

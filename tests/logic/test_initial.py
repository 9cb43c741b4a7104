"""What is asked of the initial configuration only is found; `initially` says that it is meant, and nothing else."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.checking.doubts import doubts
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.formula import BOOLEAN, apply, atom, atoms, to_text
from llfsm_verify.logic.initial import unguarded, without_initially
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.testing.formulas import formulas, lassos
from tests.quick import examples


def read(text, syntax="llfsm"):
    (line,) = parse_properties([Source("p.ltl", text)], syntax)
    return line


def doubt(text, syntax="llfsm"):
    found = read(text, syntax).doubt
    return None if found is None else (found.code, found.message, found.hint, str(found.span))


@pytest.mark.parametrize(
    ("text", "always", "meant"),
    [
        ("b: speed == 0", "G (speed == 0)", "initially (speed == 0)"),
        ("b: p -> F q", "G (p -> F q)", "initially (p -> F q)"),
        ("b: G p && (q || r) && X r", "G (q || r)", "initially (q || r)"),
        ("assume a: !p", "G !p", "initially !p"),
        ("b: O p", "G O p", "initially O p"),
        ("b: p --> q", "G (p -> F q)", "initially (p -> q)"),
        ("b: p --> F q", "G (p -> F q)", "initially (p -> F q)"),
    ],
)
def test_a_forgotten_operator_is_said_with_its_mend(text, always, meant):
    code, message, hint, place = doubt(text)
    why = "for `leads to`" if "-->" in text else "if it is to be true throughout"
    assert (code, hint) == ("W302", f"write `{always}` {why}, or `{meant}` if the beginning is meant")
    assert message.endswith("so it is about the initial configuration only")
    assert place == f"p.ltl:1:{text.index(':') + 3}"


@pytest.mark.parametrize("syntax", ["spin", "spot", "nusmv"])
def test_other_syntaxes_are_warned_without_our_word(syntax):
    assert "initially" not in doubt("p -> (X q)", syntax)[2]
    assert doubt("X (p -> q)", syntax) is None


@pytest.mark.parametrize(
    "text",
    [
        "G p", "p U q", "p W q && X q", "X p", "X[3] p", "F[0:2] p", "F[<=2s] p", "G (O p)", "true", "G p --> F q",
        "initially p", "initially (p -> F q)", "initially p -> F q", "initially O p && G q", "!initially p || X q",
        "absence of p before q", "q responds to p", "universality of p",
        "enforce r: (p q)*", "forbid r: p", "forbid initially r: p",
    ],
)  # fmt: skip
def test_what_is_meant_is_not_warned_about(text):
    assert doubt(text) is None


def test_a_formula_in_part_about_the_beginning_gets_one_mend() -> None:
    """`initially` binds like `G`: `initially p -> q` is `(initially p) -> q`."""
    (warning,) = doubts(None, parse_properties([Source("p.ltl", "b: initially p -> q")]))
    assert warning.hint == "write `initially (p -> q)` if all of this is about the beginning, or put the rest under `G`"
    assert not doubts(None, parse_properties([Source("p.ltl", "b: initially (p -> q)")]))


def test_a_line_is_warned_about_once() -> None:
    assert len(doubts(None, parse_properties([Source("p.ltl", "for i in 0..20: b: n == i")]))) == 1


def test_initially_is_a_name_where_it_cannot_be_the_word():
    assert read("G (initially -> m.initially)").atoms.keys() == {"initially", "m.initially"}
    assert read('G ("initially" && m@initially)').atoms.keys() == {"initially", "m@initially"}
    assert read("define start: initially p\nx: start && G q").formula is read("initially p && G q").formula
    assert read("for i in 0..0: x: initially n == i").atoms.keys() == {"n == 0"}


def covered(f, chosen):
    """`f` with `initially` before the Boolean positions whose numbers are `chosen`; counted from the top."""
    number = -1

    def visit(g):
        nonlocal number
        number += 1
        here = number in chosen
        inner = apply(g.op, *map(visit, g.args)) if g.op in BOOLEAN and g.args else g
        return apply("initially", inner) if here else inner

    return visit(f)


def bare(f, above=False):
    """By definition: some atom with neither `initially` nor an operator that looks ahead above it."""
    if above:
        return False
    return f.op == "atom" or any(bare(a, above or f.op not in BOOLEAN) for a in f.args)


@settings(max_examples=examples(300), deadline=None)
@given(formulas(), st.sets(st.integers(0, 6)), lassos())
def test_initially_changes_no_meaning_and_ends_every_doubt(f, chosen, word):
    marked = covered(f, chosen)
    line = read(f"x: {to_text(marked)}")
    assert without_initially(marked) is f
    assert (line.doubt is not None) == bare(marked) == (unguarded(marked) is not None)
    assert evaluate(line.formula, *word) == evaluate(f, *word)
    assert read(f"x: initially ({to_text(f)})").doubt is None


@settings(max_examples=examples(300), deadline=None)
@given(formulas(), lassos(), lassos())
def test_what_is_in_doubt_depends_on_the_first_letter_alone(f, one, other):
    """With everything under temporal operators held fixed, no later letter matters."""
    fixed = {}

    def skeleton(g):
        if g.op not in BOOLEAN:
            return fixed.setdefault(g, atom(f"t{len(fixed)}"))
        return apply(g.op, *map(skeleton, g.args)) if g.args else g

    shape = skeleton(f)
    first = frozenset(next(iter([*one[0], *one[1]])))
    letters = first | {name.key for g, name in fixed.items() if evaluate(g, *one)}
    assert evaluate(f, *one) == evaluate(shape, [letters], other[1])
    assert (unguarded(f) is None) == all(key.startswith("t") and key[1:].isdigit() for key in atoms(shape))

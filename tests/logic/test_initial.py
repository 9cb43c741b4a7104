"""What is asked of the initial configuration only is found; `initially` says that it is meant, and nothing else."""

import re
from itertools import count

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.checking.doubts import doubts
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.logic.bounds import repeat
from llfsm_verify.logic.formula import BOOLEAN, apply, atom, atoms, negation, postorder, repetition, to_text
from llfsm_verify.logic.initial import unguarded, without_initially
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.logic.syntaxes import print_in
from llfsm_verify.testing.formulas import formulas, lassos
from tests.automata.finite.test_regular import expressions
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


@pytest.mark.parametrize(
    ("syntax", "text", "mend"),
    [
        ("spin", "p -> (X q)", "[] (p -> X q)"),
        ("nusmv", "p -> (X q)", "G (p -> X q)"),
        ("spot", "p -> (X q)", "G (p -> X q)"),
        ("spot", '{"a"}[]-> "b"', "G ({a}[]->(b))"),
        ("spot", '!{"a"}', "G (!({a}))"),
        ("spot", '{"a"}<>-> F "b"', "G ({a}<>->(F b))"),
        ("spot", '{"a"[*2]}', "G ({{a}[*2]})"),
        ("spot", '{"a"}!', "G ({a}<>->(1))"),
        ("spot", "G a & {a;b}|=>c", "G ({{{a};{b};{1}}}[]->(c))"),
        ("spot", "{a[+]} & X b", "G ({{a}[*1..]})"),
        ("spot", "{1}[]-> b", "G ({1}[]->(b))"),
    ],
)
def test_other_syntaxes_are_warned_without_our_word(syntax, text, mend):
    code, message, hint, _ = doubt(f"x: {text}", syntax)
    meant = "where the beginning is meant, `--accept-vacuity x` lets it pass under `--strict`"
    assert (code, hint) == ("W302", f"write `{mend}` if it is to be true throughout; {meant}")
    about = "it is about" if "{" not in mend else "its matches begin at"
    assert message.endswith(f"stands under no temporal operator, so {about} the initial configuration only")
    assert doubt(mend, syntax) is None
    assert read(mend, syntax).formula in (apply("G", f) for f in postorder(read(text, syntax).formula))


@pytest.mark.parametrize(
    "text",
    [
        "{[*];a}[]-> b",
        "{a[*];b}[]-> c",
        "{1;a}|-> b",
        "{a[->]}[]-> b",
        "{[*]}",
        "{1}[]=> b",
        "G {a}",
        "X {a}!",
        "{[*0]}",
    ],
)
def test_expressions_that_ask_later_are_not_warned_about(text):
    assert doubt(text, "spot") is None


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


@pytest.mark.parametrize(
    ("text", "asked", "mend"),
    [
        ("define w: p && q\nx: w -> F r", "w", "`G (w -> F r)`"),
        ("define w: p && q\nx: G w && (w || n == c) && X w\ndefine c: 3", "w", "`G (w || n == c)`"),
        ("define l: G p\nx: l && q", "q", "`G q`"),
        ("define l: p --> q\nx: l", "p", "`G (p -> F q)` for `leads to`"),
        ("define w: p\nx: w --> q", "w", "`G (w -> F q)` for `leads to`"),
        ("define s: initially p\nx: s -> q", "q", "`initially (s -> q)` if all of this"),
        ("define always: G\nx: p || always q", "p", "`G (p || G q)`"),
        ("for c in {1, 2}: x: n == c", "n == c", "`G (n == c)`"),
    ],
)  # fmt: skip
def test_the_mend_has_the_names_that_the_user_wrote(text, asked, mend):
    (warning,) = doubts(None, parse_properties([Source("p.ltl", text)]))
    assert warning.message.startswith(f"`{asked}` ") and warning.hint.startswith(f"write {mend}")


@pytest.mark.parametrize(
    ("line", "use"),
    [
        ("start && G (start -> q)", "`start` stands for this at p.ltl:4:16"),
        ("G (start)", "`start` stands for this at p.ltl:4:7"),
        ("start U q", "`start` stands for this at p.ltl:4:4"),
        ("G (q -> both)", "`both` stands for this at p.ltl:4:12"),
        ("word p U q", "`word` stands for this at p.ltl:4:4"),
        ("absence of start", "`start` stands for this at p.ltl:4:15"),
        ("G initially p && start", None),
    ],
)
def test_a_definition_with_the_word_says_which_use_is_wrong(line, use):
    text = f"define start: initially p\ndefine both: r && start\ndefine word: initially\nx: {line}"
    with pytest.raises(DiagnosticError) as caught:
        read(text)
    assert [(d.code, d.notes) for d in caught.value.diagnostics] == [("E345", () if use is None else (use,))]


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


MEND = re.compile(r"write `([^`…]*)`(?: if it|; where)(?:.*, or `([^`…]*)` if the beginning)?")


def bound():
    """Formulas with expressions in Boolean places and below others."""
    one = st.builds(apply, st.sampled_from(["[]->", "<>->"]), expressions(max_leaves=3), formulas(("p", "q"), 2))
    one = st.one_of(one, expressions(max_leaves=3).map(lambda r: apply("closure", r)), formulas(("p", "q"), 2))
    two = st.builds(apply, st.sampled_from(["and", "or", "implies", "U"]), one, one)
    return st.one_of(one, one.map(negation), two, two.map(lambda f: apply("G", f)))


@settings(max_examples=examples(300), deadline=None)
@given(st.data(), st.sampled_from(["llfsm", "spot", "spin", "nusmv"]), lassos())
def test_mends_are_accepted_and_mean_what_they_say(data, syntax, word):
    f = data.draw(bound() if syntax == "spot" else formulas())
    line = read(f"x: {print_in(syntax, f)}", syntax)
    found = line.doubt and MEND.match(line.doubt.hint)
    if not found:  # nothing is said, or it is too long to be said
        return
    always = read(f"x: {found[1]}", syntax)
    assert always.doubt is None and always.formula.op == "G"
    parts = line.formula.args if line.formula.op == "and" else (line.formula,)
    assert any(evaluate(always.formula, *word) == evaluate(apply("G", part), *word) for part in parts)
    if syntax == "llfsm":
        assert read(f"x: {found[2]}").doubt is None
        assert read(f"x: {found[2]}").formula is always.formula.args[0]
    else:
        assert found[2] is None


@settings(max_examples=examples(200), deadline=None)
@given(formulas(), formulas(), lassos())
def test_mends_of_formulas_with_definitions_are_accepted_with_them(f, meant, word):
    """One atom is a name that stands for another formula."""
    given = f"define p: {to_text(meant)}"
    try:
        line = read(f"{given}\nx: {to_text(f)}")
    except DiagnosticError:
        return  # too many brackets in brackets
    assert (line.doubt is None) == (unguarded(line.formula) is None)
    found = line.doubt and MEND.match(line.doubt.hint)
    if found:
        asked = re.match(r"`(.*?)`", line.doubt.message)[1]
        assert asked in atoms(f)  # what the user wrote, not what the name stands for
        assert asked != "p" or unguarded(meant)
        always, starts = (read(f"{given}\nx: {mend}") for mend in (found[1], found[2]))
        assert always.doubt is None and starts.doubt is None
        assert evaluate(always.formula, *word) == evaluate(apply("G", starts.formula), *word)
        parts = f.args if f.op == "and" else (f,)
        assert found[1] in {to_text(apply("G", part)) for part in parts}


def relabelled(f, numbers):
    """Every letter of an expression gets an atom of its own, and repetitions at least once their first copy."""
    args = f.args
    if f.op in BOOLEAN:
        return atom(f"a{next(numbers)}")
    if f.op == "repeat":
        low, high = repetition(f)
        if high == 0:
            return apply("empty")
        first = relabelled(args[0], numbers)
        rest = repeat(relabelled(args[0], numbers), max(low - 1, 0), None if high is None else high - 1)
        if low == 0 and high is None:
            return repeat(first, 0, None)
        whole = first if high == 1 else apply("seq", first, rest)
        return whole if low else apply("alt", apply("empty"), whole)
    return apply(f.op, *(relabelled(a, numbers) for a in args)) if args else f


@settings(max_examples=examples(300), deadline=None)
@given(expressions(max_leaves=3), st.sampled_from(["[]->", "<>->", "closure"]), st.data())
def test_what_is_found_in_an_expression_is_asked_at_the_first_letter_alone(r, op, data):
    r = relabelled(r, count())
    f = apply(op, r) if op == "closure" else apply(op, r, apply("X", atom("z")))
    found = unguarded(f)
    if found is None:
        return
    (key, around), keys = (found[0].key, found[1]), atoms(f)
    assert around is f
    (stem, loop) = data.draw(lassos(keys))
    first, *later = [*stem, *loop]
    for change in (lambda letter: letter | {key}, lambda letter: letter - {key}):
        changed = [change(letter) for letter in later], [change(letter) for letter in loop]
        assert evaluate(f, [first, *changed[0]], changed[1]) == evaluate(f, [first, *later], loop)

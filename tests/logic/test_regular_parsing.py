"""Regular properties as users write them: letters, repetitions, and what to write instead."""

import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.logic.bounds import repeat
from llfsm_verify.logic.expressions import letters
from llfsm_verify.logic.formula import FALSE, TRUE, apply, atom, negation, to_text
from llfsm_verify.logic.properties import FEATURES, parse_properties
from tests.logic.wrong import REGULAR_WRONG
from tests.quick import examples

A, B, C = map(atom, "abc")


def read(text):
    (found,) = parse_properties([Source("t", f"enforce x: {text}")], features=FEATURES)
    return found


def seq(*args):
    return apply("seq", *args)


def star(f):
    return repeat(f, 0, None)


CASES = [
    ("a", A),
    ("a b c", seq(A, B, C)),
    ("(a b) c", seq(A, B, C)),
    ("a b | c", apply("alt", seq(A, B), C)),
    ("a (b | c)", seq(A, apply("alt", B, C))),
    ("(ew@RED ew@GREEN)*", star(seq(atom("ew@RED"), atom("ew@GREEN")))),
    ("a b*", seq(A, star(B))),
    ("a+ b? c{3}", seq(repeat(A, 1, None), repeat(B, 0, 1), repeat(C, 3, 3))),
    ("a{2,5} b{2,}", seq(repeat(A, 2, 5), repeat(B, 2, None))),
    ("a*+", repeat(star(A), 1, None)),
    ("a{0}", apply("repeat", A, bound="0:0")),
    ("true{0}", apply("empty")),
    ("true false", seq(TRUE, FALSE)),
    ("[a && !b] [x > 3]", seq(apply("and", A, negation(B)), atom("x > 3"))),
    ("[a[2] == 1] m.ran x.y", seq(atom("a[2] == 1"), atom("m.ran"), atom("x.y"))),
    ('"G" "c ? a : b"', seq(atom("G"), atom("c ? a : b"))),
    ("[a | b] | c", apply("alt", apply("or", A, B), C)),
    ("(a   # comment\n b)", seq(A, B)),
]


@pytest.mark.parametrize(("text", "expression"), CASES, ids=[text for text, _ in CASES])
def test_expressions(text, expression):
    found = read(text)
    assert found.expression is expression and found.formula is None and found.kind == "enforce"
    assert read(to_text(expression)).expression is expression


def test_letters_are_kept_as_written_and_atoms_have_places():
    found = read("([p && q] q | [p && q])*")
    assert letters(found.expression) == [apply("and", atom("p"), atom("q")), atom("q")]
    assert list(found.atoms) == ["p", "q"]
    assert found.atoms["q"].span(0, 1).column == 19
    assert found.text == "([p && q] q | [p && q])*"


def test_kinds_and_lines_that_go_on():
    text = "forbid a: p |\n  q\nforbid   initially b: p q\nenforce c: (p\n q)*\nG p\n"
    found = parse_properties([Source("t", text)], features=FEATURES)
    assert [(p.name, p.kind, p.text) for p in found] == [
        ("a", "forbid", "p | q"),
        ("b", "forbid initially", "p q"),
        ("c", "enforce", "(p q)*"),
        ("L6", "ltl", "G p"),
    ]


@pytest.mark.parametrize(
    ("text", "code", "column", "hint"),
    REGULAR_WRONG,
)
def test_mistakes(text, code, column, hint):
    with pytest.raises(DiagnosticError) as raised:
        read(text)
    found = raised.value.diagnostics[0]
    assert (found.code, found.span.column - len("enforce x: ")) == (code, column), found.message
    assert hint is None or hint in found.hint


@pytest.mark.parametrize("kind", ["forbid", "forbid initially"])
def test_forbidding_the_empty_word_is_refused(kind):
    with pytest.raises(DiagnosticError, match="E342") as raised:
        parse_properties([Source("t", f"{kind} x: a*")], features=FEATURES)
    assert "`+`" in raised.value.diagnostics[0].hint


def test_files_of_automata():
    (found,) = parse_properties([Source("t", 'automaton a: "some where/x-1.hoa" # comment')], features=FEATURES)
    assert (found.kind, found.file, found.text) == ("automaton", "some where/x-1.hoa", "some where/x-1.hoa")
    with pytest.raises(DiagnosticError, match="E365"):
        parse_properties([Source("t", 'automaton a: ""')], features=FEATURES)
    with pytest.raises(DiagnosticError, match="E314"):
        parse_properties([Source("t", "automaton a:")], features=FEATURES)
    for text in ("automaton: x.hoa", "automaton never: x.hoa"):
        with pytest.raises(DiagnosticError, match="E311"):
            parse_properties([Source("t", text)], features=FEATURES)


WORDS = [
    "a",
    "b",
    "m@S",
    "x",
    "true",
    "G",
    "[a && b]",
    "(",
    ")",
    "[",
    "]",
    "{",
    "}",
    "{2,3}",
    "*",
    "+",
    "?",
    "|",
    ",",
    "3",
    '"',
    "!",
    ".",
]


@pytest.mark.parametrize("text", ["a . b", "a. b", "a .b", "m.x . b"])
def test_a_dot_between_letters_is_explained(text):
    with pytest.raises(DiagnosticError) as raised:
        read(text)
    (found,) = raised.value.diagnostics
    assert found.code == "E340" and found.span.text == "."
    first = text[:-1].rstrip(" .")
    assert found.hint == f"write `{first} b`, or `{first}.b` for the variable `b` of `{first}`"
    assert read(f"{first} b").expression == seq(atom(first), B)


@pytest.mark.slow
@given(st.lists(st.sampled_from(WORDS), max_size=15))
@settings(max_examples=examples(600), deadline=None)
def test_garbage(words):
    found = ()
    try:
        read(" ".join(words))
    except DiagnosticError as e:
        found = e.diagnostics
    assert all(d.span is not None and d.code.startswith("E3") for d in found)


@pytest.mark.slow
def test_large_expressions_are_read_or_refused_within_seconds():
    n = 45_000
    texts = [
        "(" * n + "a" + ")" * n,
        "a" + "*" * n,
        "a | " * n + "a",
        "a " * n,
        "(a" * n,
        "[a] " * (n // 2),
        "a{2}" * (n // 4),
    ]
    for text in texts:
        before = time.process_time()
        try:
            read(text)
        except DiagnosticError as e:
            assert e.diagnostics[0].code in ("E306", "E309")  # noqa: PT017
        assert time.process_time() - before < 10, text[:10]

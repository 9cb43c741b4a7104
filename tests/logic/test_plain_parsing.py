"""The quick reader of plain formulas against the grammar, which stays the reference."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.diagnostics import Fragment, Source
from llfsm_verify.logic.formula import to_text
from llfsm_verify.logic.parsing.formulas import parse_by_grammar
from llfsm_verify.logic.parsing.plain import MAX_WORDS, parse_plain
from llfsm_verify.logic.parsing.tokens import tokenise
from llfsm_verify.logic.parsing.words import Words
from llfsm_verify.testing.formulas import formulas
from tests.quick import examples

WORDS = [
    "p", "q", "GF", "G", "F", "X", "U", "W", "S", "O", "!", "!!", "not", "&&", "||", "and", "or", "xor", "->", "<->",
    "(", ")", "(", ")", "true", "false", "1", "m@A", "m.x", "==", "3", '"a b"', '"G"', '""', "@", ".", "[", "]", "-",
    ",", "<", "m.f(", "m.f(A, 0)", "m.entered(G)", "p != 3", "m.x <= q", "p == true", "m@A(q)", "m.f(A)==B.c", "m.f()",
]  # fmt: skip


def words_of(text):
    return Words(Fragment.whole(Source("test", text)), tokenise(text))


def same(text):
    """Whether the quick reader takes `text`; then the grammar reads the same formula, and atoms at the same places."""
    plain = parse_plain(words_of(text))
    if plain is None:
        return False
    expected = parse_by_grammar(words_of(text))
    assert plain[0] is expected.formula, text
    found = [(key, tuple(place.offsets)) for key, place in plain[1].items()]
    assert found == [(key, tuple(place.offsets)) for key, place in expected.atoms.items()], text
    return True


@pytest.mark.slow
@given(st.lists(st.sampled_from(WORDS), min_size=1, max_size=12), st.sampled_from([" ", "  "]))
@settings(max_examples=examples(2000), deadline=None)
def test_words_in_any_order(words, between):
    same(between.join(words))


@pytest.mark.slow
@given(formulas(("p", "q", "m@A", "a.b", "U", "Fp"), 10))
@settings(max_examples=examples(500), deadline=None)
def test_formulas_as_they_are_printed(f):
    assert same(to_text(f))


@pytest.mark.parametrize(
    "text",
    [
        "p && q && (r && s) || t",
        "a xor b xor c <-> d <-> e -> f",
        "(a -> b) -> c",
        "G !p U not !!q",
        '"EW@GREEN" U ns . x',
        "( ( p ) )",
        "G (x == 3 -> m.x != y.z)",
        "!x == true U m . fired(RED , 0)",
        "ns.entered(G) && ns.fired(F, 1) || m.f(a, b) < m@S",
    ],
)
def test_plain_formulas_need_no_grammar(text):
    assert same(text)


@pytest.mark.parametrize(
    "text",
    [
        "p U q U r",
        "p -> q -> r",
        "x == 3 + y",
        "x == y == z",
        "3 == x",
        "F[2:3] p",
        "f(p)",
        "p)",
        "(p",
        "p q",
        '""',
        "1",
    ],
)
def test_the_rest_is_left_to_the_grammar(text):
    assert parse_plain(words_of(text)) is None


def test_long_formulas_are_left_to_the_grammar():
    assert same("X " * (MAX_WORDS - 1) + "p")
    assert parse_plain(words_of("X " * MAX_WORDS + "p")) is None
    assert parse_plain(words_of("(" * 201 + "p" + ")" * 201)) is None
    assert same("(" * 199 + "m.f(A)" + ")" * 199)
    assert parse_plain(words_of("(" * 200 + "m.f(A)" + ")" * 200)) is None
    assert parse_plain(words_of("(" * 200 + "m.f(A) == 3" + ")" * 200)) is None

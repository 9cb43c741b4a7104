"""Words of letters as text: what is no letter is refused, never taken as an atom of that name."""

import pytest

from llfsm_verify.diagnostics import DiagnosticError, Fragment, Source
from llfsm_verify.logic.wordtext import parse_word


def word(text):
    return parse_word(Fragment.whole(Source("t", text)))


@pytest.mark.parametrize(
    ("text", "column"),
    [
        ("cycle{p|q}", 8),
        ("cycle{p || q}", 9),
        ("cycle{(p&q)}", 7),
        ("cycle{p&(q)}", 9),
        ("cycle{p)}", 8),
        ("cycle{f(p}", 7),
        ("p->q;cycle{p}", 2),
        ("p <-> q;cycle{p}", 3),
        ("p => q;cycle{p}", 3),
        ("p ^ q;cycle{p}", 3),
        ("!cycle{p}", 2),
        ("p;!cycle{p}", 4),
    ],
)
def test_operators_are_no_part_of_an_atom(text, column):
    with pytest.raises(DiagnosticError) as raised:
        word(text)
    (found,) = raised.value.diagnostics
    assert (found.code, found.span.column) == ("E353", column)


@pytest.mark.parametrize(
    ("text", "key"),
    [
        ("m.fired(S, 0)", "m.fired(S, 0)"),
        ("refused(m)", "refused(m)"),
        ("x <= 3", "x <= 3"),
        ("x-1 > 3", "x - 1 > 3"),
        ('"p -> q"', "p -> q"),
        ('"p|q"', "p | q"),
        ("m@S", "m@S"),
    ],
)
def test_atoms_may_have_arguments_and_comparisons(text, key):
    stem, loop = word(f"{text}&!p;cycle{{!q&{text}}}")
    assert [set(map(squeezed, letter)) for letter in (*stem, *loop)] == [{squeezed(key)}] * 2


def squeezed(key):
    return key.replace(" ", "")

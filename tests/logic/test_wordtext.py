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
    ("text", "message", "start", "end"),
    [
        ("a b;cycle{p}", "`&` or `;` is missing inside `a b`", 0, 3),
        ("cycle{p q}", "`&` or `;` is missing inside `p q`", 6, 9),
        ("cycle{p};q", "there is text after the end of the loop", 8, 9),
        ("!cycle{p}", "only an atom can be negated in a letter", 1, 7),
        ("p&cycle{q}", "`;` is missing before `cycle`", 2, 8),
        ("cycle{cycle{p}}", "`;` is missing before `cycle`", 6, 12),
        ("p;;cycle{p}", "a letter is missing before `;`", 2, 3),
        ("p}", "this `}` closes nothing", 1, 2),
        ("&& p;cycle{p}", "an atom is missing before `&&`", 0, 2),
        ("p!q;cycle{p}", "`&` is missing before `!`", 1, 2),
        ("!1;cycle{p}", "no letter is false", 1, 2),
        ("0;cycle{p}", "no letter is false", 0, 1),
        ("p", "a word ends in a loop: `cycle{…}`", 0, 1),
        ("cycle{p", "a word ends in a loop: `cycle{…}`", 6, 7),
        ("", "a word ends in a loop: `cycle{…}`", 0, 0),
        ("p&!p;cycle{1}", "a letter in which `p` holds and does not", 0, 13),
        ("cycle{p;}", "a letter is missing before `}`", 8, 9),
        ('cycle{"a" "b"}', '`&` or `;` is missing before `"b"`', 10, 13),
        ('cycle{"a" "bbbbbbbbbbbbbbbbbbbbb"}', '`&` or `;` is missing before `"bbbbbbbbbbbbbbbbbbb`', 10, 33),
        ("cycle{aaaaaaaaaaaaaaaaaaaa b}", "`&` or `;` is missing inside `aaaaaaaaaaaaaaaaaaaa`", 6, 28),
    ],
)
def test_what_is_wrong_and_where(text, message, start, end):
    with pytest.raises(DiagnosticError) as raised:
        word(text)
    (found,) = raised.value.diagnostics
    assert (found.code, found.message, found.span.start, found.span.end) == ("E353", message, start, end)


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

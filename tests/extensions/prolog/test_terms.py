"""Facts and queries as users write them, and data as Prolog reads it."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from llfsm_verify.extensions.prolog.terms import HOLE, NoTerm, datum, quoted, term
from tests.extensions.prolog.asked import bridge, names, number, swipl
from tests.outside import needs

GOOD = {
    "car_waiting": ("car_waiting", True),
    " next( ns ,Value) ": (f"next(ns, {HOLE})", False),
    "at(pos(1, -2), X, 'it''s Value')": ("at(pos(1, -2), X, 'it''s Value')", False),
    "'Two words'": ("'Two words'", True),
    "p(_, Value_, _Value)": ("p(_, Value_, _Value)", False),
}
WRONG = {
    "": "it has no end",
    "Value": "does not begin with a name",
    "12": "does not begin with a name",
    "next(": "it has no end",
    "next(ns": "a bracket is open",
    "next()": "cannot go on with `)`",
    "next(a,)": "cannot go on with `)`",
    "next(a) b": "cannot go on with `b`",
    "a, b": "cannot go on with `,`",
    "a :- b": "cannot go on with `:- b`",
    "next(a). shell(b)": "cannot go on with `. shell(b)`",
    "f(1.5)": "cannot go on with `.5)`",
    "f('a\\'b')": "cannot go on with `'a\\'b')`",
    "f('a.b')": "cannot go on with",
    "f(\0)": "cannot go on with",
    "été": "cannot go on with `été`",
    "f" + "(a" * 300: "too long",
    "f(g(a)(b))": "cannot go on",
}
STRANGE = [
    "", "'", "\\", "a'b", "a\\", "a\nb", "\t", "\0", "RED", "[]", "{}", "a b", "é", "日本", "\u200b", "/*", "%x", "0",
    "a.b", "'). shell('touch x'). p('", "~w~n", "\U0001f600", "end_of_file", ",", "|", "\x7f", "\u2028",
]  # fmt: skip


@pytest.mark.parametrize("text", GOOD)
def test_terms_are_read(text: str) -> None:
    found = term(text)
    assert (found.text, found.bare) == GOOD[text]
    assert (HOLE in found.text) == ("Value" in found.variables)


@pytest.mark.parametrize("text", WRONG)
def test_what_is_no_term_is_told(text: str) -> None:
    with pytest.raises(NoTerm) as caught:
        term(text)
    assert WRONG[text] in str(caught.value)


def test_numbers_are_written_with_the_decimals_of_their_type() -> None:
    assert [datum(5, 0), datum(-5, 1), datum("0.10", 2), datum(True, 0), datum("0.10", 0), datum("a", 2)] == [
        "5", "-5.0", "0.10", "true", "'0.10'", "a",
    ]  # fmt: skip


@needs("swipl")
@pytest.mark.slow
def test_prolog_reads_every_text_as_the_atom_that_it_is(tmp_path: Path) -> None:
    draw = random.Random(45)
    texts = [*STRANGE, *("".join(chr(draw.choice((draw.randrange(128), draw.randrange(0xD800)))) for _ in range(6))
                         for _ in range(500))]  # fmt: skip
    codes = [f"{quoted(text)}-{[ord(c) for c in text]}" for text in texts]
    script = f":- encoding(utf8).\nt([{','.join(codes)}]).\n"
    script += ":- t(L), forall(member(A-C, L), (atom(A), atom_codes(A, C))), length(L, N), write(N), nl, halt.\n"
    done = swipl(tmp_path, script)
    assert done == str(len(texts))


@needs("swipl")
@pytest.mark.slow
def test_no_value_becomes_a_goal_and_no_name_gets_lost_on_both_ways(tmp_path: Path) -> None:
    file = tmp_path / "copy.pl"
    file.write_text("copy(X) :- given(X).\nsame(Y) :- level(X), Y is X.\n", encoding="utf-8")
    facts = {"given(Value)": names(*STRANGE), "level": number(-999, 999, 1)}
    with bridge(file, {**facts, "level(Value)": facts.pop("level")},
                {"copy(Value)": names(*STRANGE), "same(Value)": number(-999, 999, 1)}) as made:  # fmt: skip
        assert made.until("hello") == {"hello": 1}
        for at, text in enumerate(STRANGE):
            answers = made.ask({"given(Value)": text, "level(Value)": f"{at - 9}.{at % 10}"})
            assert answers["copy(Value)"] == text and float(answers["same(Value)"]) == float(f"{at - 9}.{at % 10}")
        assert made.said() == []
    assert sorted(path.name for path in tmp_path.iterdir()) == ["copy.pl"]


@needs("swipl")
@pytest.mark.slow
def test_what_is_read_as_a_term_is_one_for_prolog(tmp_path: Path) -> None:
    draw = random.Random(9)
    pieces = [
        "a",
        "Bc",
        "_",
        "Value",
        "f(",
        "(",
        ")",
        ")",
        ",",
        ", ",
        " ",
        "'x y'",
        "''''",
        "'",
        "-1",
        "12",
        ".",
        "0'a",
        "\n",
        ":-",
        "é",
    ]
    found = {}
    while len(found) < 300:
        text = draw.choice(("a", "f(", "'q'")) + "".join(draw.choice(pieces) for _ in range(draw.randrange(9)))
        try:
            found[text] = term(text)
        except NoTerm:
            continue
    facts = [f"t({quoted(one.text.replace(HOLE, 'Value'))}, {str(one.bare).lower()})." for one in found.values()]
    goal = "forall(t(A, B), (term_to_atom(T, A), callable(T), (B -> atom(T) ; compound(T))))"
    goal += ", aggregate_all(count, t(_, _), N)"
    assert swipl(tmp_path, "\n".join([*facts, f":- {goal}, write(N), nl, halt.", ":- halt(1).", ""])) == "300"

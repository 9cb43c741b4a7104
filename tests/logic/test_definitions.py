"""Definitions and families: the same properties as written out, and mistakes at their places."""

from __future__ import annotations

import pytest

from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.logic.formula import to_text
from llfsm_verify.logic.properties import parse_properties


def read(text: str) -> dict[str, str]:
    found = parse_properties([Source("p", text)])
    return {p.name: to_text(p.formula) if p.formula is not None else p.text for p in found}


def mistakes(text: str) -> list[tuple[str, str, int, str]]:
    with pytest.raises(DiagnosticError) as caught:
        parse_properties([Source("p", text)])
    return [(d.code, d.message, d.span.line, d.span.text) for d in caught.value.diagnostics if d.span is not None]


@pytest.mark.parametrize(
    ("text", "written_out"),
    [
        ("define p: a && b\nx: G !p", "G !(a && b)"),
        ("x: G p\ndefine p: a", "G a"),
        ("define p: q || c\ndefine q: a\nx: p U q", "(a || c) U a"),
        ("define limit: 30\nx: G (n < limit -> m@p)\ndefine p: a", "G (n < 30 -> m@p)"),
        ("define p: a\nx: m.p && p.n == 1 && m@p && p(1) > 0", "m.p && p.n == 1 && m@p && p(1) > 0"),
        ("define A: a\nx: m.entered(A) && m.fired(A, 0) && A", "m.entered(A) && m.fired(A, 0) && a"),
        ("define A: a\nx: m@{A, B} && A", "m@{A, B} && a"),
        ("define p: a -> b\nx: (p) && c", "(a -> b) && c"),
        ("define p: a &&\n  b\nx: rose(p)", '"rose(a && b)"'),
        ("define p: G F a\nx: p -> !p", "G F a -> !G F a"),
        ('define p: a\nx: "p" && p', "p && a"),
    ],
)
def test_a_name_stands_for_its_words(text: str, written_out: str) -> None:
    assert read(text) == {"x": written_out}


def test_rules_and_assumptions_have_definitions_too() -> None:
    found = parse_properties(
        [Source("p", "define p: [a && b]\nenforce x: (p c)*\ndefine q: c\nassume y: G F q\nforbid z: [q]")]
    )
    assert [(p.kind, p.text) for p in found] == [
        ("enforce", "(([a && b]) c)*"),
        ("assume", "G F c"),
        ("forbid", "[c]"),
    ]


def test_families() -> None:
    assert read("for l in {ns, ew}: served: G F l@GREEN") == {"served_ns": "G F ns@GREEN", "served_ew": "G F ew@GREEN"}
    assert read("for s in {A, W}, i in 1..2:\n  x: m@s -> n == i") == {
        "x_A_1": "m@A -> n == 1",
        "x_A_2": "m@A -> n == 2",
        "x_W_1": "m@W -> n == 1",
        "x_W_2": "m@W -> n == 2",
    }
    assert read("for v in {a, b}: G v") == {"L1_a": "G a", "L1_b": "G b"}
    assert read("define p: a\nfor v in {p, b}: x: v U p") == {"x_p": "p U a", "x_b": "b U a"}
    assert read("for v in {a,   # one\n  b}:  # two\n  x: v") == {"x_a": "a", "x_b": "b"}
    assert read("for v in {a}: assume x: v\nfor v in {a}: y: v") == {"x_a": "a", "y_a": "a"}


def test_the_words_of_a_definition_stand_at_its_place() -> None:
    found = parse_properties([Source("p", "define p: drvie && b\nx: G (p -> c)")])
    (only,) = found
    places = {key: fragment.span(0, len(key)) for key, fragment in only.atoms.items()}
    assert {key: (span.line, span.column) for key, span in places.items()} == {
        "drvie": (1, 11),
        "b": (1, 20),
        "c": (2, 12),
    }


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("define p:\nx: a", [("E317", "there is nothing after `define p:`", 1, "p")]),
        ("define p: a\ndefine p: b", [("E317", "there are two definitions of `p`", 2, "p")]),
        ("define p: a && q\ndefine q: !p\nx: q", [("E317", "`q` is defined by itself: q → p → q", 1, "q")]),
        ("define F: a\nx: b", [("E317", "`F` is a word of formulas", 1, "F")]),
        ("define c: a ) || ( b\nx: !c", [("E310", "this `)` closes nothing", 1, ")")]),
        ("for X in {a}: x: X", [("E318", "`X` is a word of formulas", 1, "X")]),
        ("for l in {}: x: l", [("E318", "a value is missing between the commas", 1, "l")]),
        ("for l in {a, a}: x: l", [("E318", "`l` has a value twice", 1, "l")]),
        ("for l in {a b}: x: l", [("E318", "`a b` is not a name or a number", 1, "a b")]),
        ("for l in 3..1: x: l", [("E318", "a range ends before it starts", 1, "l")]),
        ("for i in 0..40, j in 0..40: x: i == j", [("E318", "this is more than 1,000 properties", 1, "j")]),
        ("for l in {a}, l in {b}: x: l", [("E318", "two names of a family are the same", 1, "for")]),
        ("for l in a: x: l", [("E318", "this does not say which values the names have", 1, "for")]),
        ("for l in {a}:", [("E318", "no property follows this", 1, "for")]),
        ("for l in {a, b}: x: G (l", [("E309", "this `(` is not closed", 1, "(")]),
        ("for l in {a, a_b}: x: l\nx_a: b", [("E313", "there are two properties `x_a`", 2, "x_a")]),
    ],
)
def test_mistakes(text: str, expected: list[tuple[str, str, int, str]]) -> None:
    assert mistakes(text) == expected


@pytest.mark.slow
def test_what_grows_too_long_is_refused() -> None:
    doubled = "\n".join(f"define p{i}: p{i - 1} && p{i - 1}" for i in range(1, 40))
    assert [m[0] for m in mistakes(f"define p0: a\n{doubled}\nx: G p39")] == ["E305"]

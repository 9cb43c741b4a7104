"""Property files: names, kinds, places, lines that go on; atoms as ranges of words."""

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from llfsm_verify.diagnostics import DiagnosticError, Fragment, Source
from llfsm_verify.logic.formula import apply, atom, negation, to_text
from llfsm_verify.logic.parsing.formulas import parse_formula
from llfsm_verify.logic.properties import PropertySet, parse_properties
from tests.quick import examples

EXAMPLE = """# comment
assume  fair_cars:   G F (timer.ran && car)
mutual_exclusion:    G !(ns@GREEN && ew@GREEN)
ew-served :          G (timer.ran && car -> F ew@GREEN)  # no starvation

G p && # goes on

   # after a comment and an empty line
   q
brackets: G (p
   || r
   )
count + 1 <= limit
last: F m@F
"""


def read(text):
    return parse_properties([Source("test.ltl", text)])


def parsed(text):
    return parse_formula(Fragment.whole(Source("test", text)))


def test_the_example():
    found = read(EXAMPLE)
    assert [(p.name, p.kind, p.text, p.span.line, p.span.column) for p in found] == [
        ("fair_cars", "assume", "G F (timer.ran && car)", 2, 22),
        ("mutual_exclusion", "ltl", "G !(ns@GREEN && ew@GREEN)", 3, 22),
        ("ew-served", "ltl", "G (timer.ran && car -> F ew@GREEN)", 4, 22),
        ("L6", "ltl", "G p && q", 6, 1),
        ("brackets", "ltl", "G (p || r)", 10, 11),
        ("L13", "ltl", "count + 1 <= limit", 13, 1),
        ("last", "ltl", "F m@F", 14, 7),
    ]
    assert [p.name for p in found.assumptions] == ["fair_cars"]
    assert [p.name for p in found.goals] == [p.name for p in found][1:]
    assert [to_text(p.formula) for p in found] == [
        *(p.text for p in found),
    ]
    assert list(found.atoms)[:4] == ["timer.ran", "car", "ns@GREEN", "ew@GREEN"]
    assert all(set(p.atoms) <= set(found.atoms) for p in found)


def test_several_files_and_none():
    one, two = Source("one", "a: G p"), Source("two", "b: F p")
    assert [p.span.source.name for p in parse_properties([one, two])] == ["one", "two"]
    assert parse_properties([]) == PropertySet() == read("# nothing\n\n")
    with pytest.raises(DiagnosticError, match=r"two:1:1: error\[E313\]") as raised:
        parse_properties([one, Source("two", "a: F p")])
    assert raised.value.diagnostics[0].notes == ("the other one is at one:1:1",)


ATOMS = [
    ("ns@GREEN", "ns@GREEN"),
    ("5==counter", "5 == counter"),
    ("count+1<=limit", "count + 1 <= limit"),
    ("m . fired( RED,0 )", "m.fired(RED, 0)"),
    ("refused(m)", "refused(m)"),
    ("m.n", "m.n"),
    ("a[ 2 ].x>3", "a[2].x > 3"),
    ("-3<x", "-3 < x"),
    ("- 3 < - x", "-3 < -x"),
    ("x - -3 > 0", "x - -3 > 0"),
    ("--x > - -3", "- -x > - -3"),
    ("abs(x-y)<3", "abs(x - y) < 3"),
    ("(a + b)*2>c", "(a + b) * 2 > c"),
    ("((a + b)) > (c)", "((a + b)) > (c)"),
    ("(a == b) == c", "(a == b) == c"),
    ("p == true", "p == true"),
    ("f()", "f()"),
    ("m@G", "m@G"),
    ("x.U > 3", "x.U > 3"),
    ('"G"', "G"),
    ('"G" == 3', "G == 3"),
    ('"c ? a : b"', "c ? a : b"),
    ('"x+1 > 3"', "x + 1 > 3"),
    ('"not p"', "not p"),
    ("Fp0", "Fp0"),
    ("(((p)))", "p"),
]


@pytest.mark.parametrize(("text", "key"), ATOMS, ids=[text for text, _ in ATOMS])
def test_atoms(text, key):
    assert parsed(text).formula is atom(key)
    both = parsed(f"G (q -> X ({text}) && !{text})")
    expected = apply("X", atom(key)), negation(atom(key))
    assert both.formula is apply("G", apply("implies", atom("q"), apply("and", *expected)))
    place = both.atoms[key]
    assert place.text == key and len(place.offsets) == len(key) + 1
    # Every character of the key but blanks is that character of the file.
    for character, offset in zip(key, place.offsets, strict=False):
        assert character == " " or place.source.text[offset] == character
    assert place.span(0, len(key)).start >= text.count('"') // 2 + len("G (q -> X (")


def test_offsets_skip_comments_and_ends_of_lines():
    (found,) = read("a: G (x == 3 + # three\n  4)")
    (place,) = found.atoms.values()
    assert place.text == "x == 3 + 4"
    assert place.span(9, 10).line == 2 and place.span(9, 10).column == 3


@pytest.mark.parametrize(
    ("text", "same"),
    [
        ("! p && q || r xor s -> t <-> u", "(((!p) && q) || (r xor s)) -> t <-> u"),
        ("p U q && r", "(p U q) && r"),
        ("F p U q", "(F p) U q"),
        ("G p -> q", "(G p) -> q"),
        ("G p == q", "G (p == q)"),
        ("!x == 3", "!(x == 3)"),
        ("[] <> p", "G F p"),
        ("□ ◇ ¬p", "G F !p"),
        ("~p /\\ q \\/ r", "!p && q || r"),
        ("p & q | r", "p && q || r"),
        ("p and q or not r", "p && q || !r"),
        ("p ∧ q ∨ r → s ↔ t ⊕ u", "p && q || r -> s <-> t xor u"),
        ("p => q", "p -> q"),
        ("p ==> q", "p --> q"),
        ("p <=> q", "p <-> q"),
        ("p ^ q", "p xor q"),
        ("a<-3 && b<->c", "(a < -3 && b) <-> c"),
        ("!!!p", "!p"),
        ("! ~ not p", "!p"),
        ("p <-> q <-> r", "(p <-> q) <-> r"),
        ("p && (q && r)", "p && q && r"),
        ("true U (false R p)", "(true) U (((false)) R p)"),
    ],
)
def test_spellings_and_precedence(text, same):
    assert parsed(text).formula is parsed(same).formula


SIGNS = '! && || -> <-> xor ( ) [ ] . , @ == < = + - * ? : { " # \n $ \0'
WORDS = st.sampled_from([*SIGNS.split(" "), *"pqx3GFXUWRMé", "true", '"G"', "a:", "assume", "forbid"])


def outcome(text):
    """The properties, or the diagnostics."""
    try:
        return read(text), ()
    except DiagnosticError as e:
        return PropertySet(), e.diagnostics


@pytest.mark.slow
@given(st.lists(WORDS, max_size=25).map(" ".join))
@example("assume\n:")
@example("a:\nb:")
@example("forbid initially")
@example("()")
@example(")(")
@settings(max_examples=examples(1500), deadline=None)
def test_any_text_is_read_or_refused_with_a_place(text):
    found, diagnostics = outcome(text)
    for d in diagnostics:
        assert d.span is not None and 0 <= d.span.start <= d.span.end <= len(text)
        assert d.render()
    for p in found:
        assert parsed(to_text(p.formula)).formula is p.formula


@pytest.mark.slow
@given(st.text(max_size=60))
@settings(max_examples=examples(500), deadline=None)
def test_any_characters_are_read_or_refused(text):
    assert all(d.render() for d in outcome(text)[1])


@pytest.mark.parametrize(
    ("head", "code"),
    [
        ("# format: 1\n", None), ("#format:1\n", None), ("# format: see the manual\n", None), ("", None),
        ("# format: 2\n", "E316"), ("\n# ours\n# format : 0012\n", "E316"), ("# format: 0\n", "E316"),
        ("b: G q\n# format: 2\n", None),
    ],
)  # fmt: skip
def test_a_file_of_a_later_format_is_not_read(head: str, code: str | None) -> None:
    source = Source("p.ltl", f"{head}a: G p\n")
    if code is None:
        assert parse_properties([source]).properties[-1].name == "a"
        return
    with pytest.raises(DiagnosticError) as told:
        parse_properties([source])
    (found,) = told.value.diagnostics
    assert found.code == code and found.span.text.strip("0") in ("2", "12", "")

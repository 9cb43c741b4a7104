"""The syntaxes of other tools: their groupings, what is refused and where, round trips, and SPIN's own reading."""

import random
import subprocess
import time

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.diagnostics import DiagnosticError, Fragment, Source
from llfsm_verify.limits import LimitReached
from llfsm_verify.logic.bounds import rebuilt, without_steps
from llfsm_verify.logic.formula import ARITY, EXTENDED_ARITY, PAST, STEPS, TIMED, apply, atom, negation, postorder
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.properties import FEATURES, parse_properties
from llfsm_verify.logic.syntaxes import SYNTAXES, foreign, parse_in, print_in
from llfsm_verify.testing.formulas import formulas, lassos
from tests.automata.finite.test_regular import expressions
from tests.logic.wrong import SYNTAXES_WRONG
from tests.outside import needs
from tests.quick import examples

P, Q = atom("p"), atom("q")


def read(syntax, text):
    return parse_in(syntax, Fragment.whole(Source("test", text))).formula


# ---------------------------------------------------------------- groupings

READINGS = {
    "spot": [
        ("a U b U c", "a U (b U c)"),
        ("a U b W c R d M e", "a U (b W (c R (d M e)))"),
        ("a -> b <-> c -> d", "a -> (b <-> (c -> d))"),
        ("a xor (b | c & d)", "a xor (b | (c & d))"),
        ("(a | b) xor c -> d", "((a | b) xor c) -> d"),
        ("a | b -> c xor d & e", "(a | b) -> (c xor (d & e))"),
        ("a | {b}[]->c xor d", "a | ({b}[]->(c xor d))"),
        ("a xor b xor c", "(a xor b) xor c"),
        ("!a U b & c", "((!a) U b) & c"),
        ("GFa -> X!b U c", "(G(F a)) -> ((X(!b)) U c)"),
        ("F100ZX & FX100 & Fab", "F100ZX & (F X100) & (F ab)"),
        ("a=0 | !b=1", '(!"a") | (!b)'),
        ("[]<>a --> ()b \\/ c /\\ ~d", "(G(F a)) -> ((X b) | (c & (!d)))"),
        ("(a * b + c) ^ d", "((a & b) | c) xor d"),
        ("X[2]F[1:3]a & G[2:]b & X[!]c", "(X[2](F[1:3]a)) & (X[2](G b)) & (X c)"),
        ("True & FALSE | 1", "(1 & 0) | 1"),
        ("¬a ∧ □b → ◇c", "((!a) & (G b)) -> (F c)"),
        ('"a b" & "x==3"', '"a b" & ("x == 3")'),
        ("{a;b:c|d&&e&f;g}!", "{a;{b:{{c}|{d&&{e&f}}}};g}<>->1"),
        ("a & {b;c}[]->d U e | f", "a & ({b;c}[]->((d U e) | f))"),
        ("F{a;b}<>->c", "F({a;b}<>->c)"),
        ("{a}[]->{b}[]->c", "{a}[]->({b}[]->c)"),
        ("{a;b}(c) & d", "({a;b}[]->c) & d"),
        ("{a;b}|->c", "{a;b}[]->c"),
        ("{a;b}|=>c", "{a;b;1}[]->c"),
        ("{a;b}<>=>c", "{a;b;1}<>->c"),
        ("{a*;b[+];c[*2];d[*1..];e[*..3];[*];[+];[*2];[*0]}",
         "{{a[*]};{b[*1..]};{c[*2..2]};{d[*1:]};{e[*0,3]};{1[*0..]};{1[*1..]};{1[*2]};[*0]}"),
        ("{a[->];b[->2..];c[=2];d[=]}",
         "{ {{!a}[*];a}; {{!b}[*];b}[*2..]; {{!c}[*];c}[*2];{!c}[*]; [*]}"),
        ("{!a[*];(a|b)[*];(a;b)[*2]}", "{{!a}[*];{a|b}[*];{a;b}[*2]}"),
        ("{first_match(a;b[*])}", "{first_match({a;{b[*]}})}"),
        ("{a[*1..$];b[*2 to 3];c[*1,inf]}", "{a[*1..];b[*2..3];c[*1..]}"),
    ],
    "spin": [
        ("a U b U c", "(a U b) U c"),
        ("a V b W c U d", "((a V b) W c) U d"),
        ("a -> b -> c <-> d", "((a -> b) -> c) <-> d"),
        ("a || b && c -> d", "(a || (b && c)) -> d"),
        ("[] a U b", "([] a) U b"),
        ("always a implies eventually b until c", "([] a) -> ((<> b) U c)"),
        ("ltl name { [] (p -> <> q) };", "[] (p -> (<> q))"),
        ("ltl { next p }", "X p"),
        ("x + 1 == y && p[2].x > 3 || proc@label", "({x + 1 == y} && {p[2].x > 3}) || {proc@label}"),
        ("{ a > b } -> p", "{a > b} -> p"),
        ("len(q)==0 stronguntil a weakuntil b release c", "(({len(q) == 0} U a) W b) V c"),
    ],
    "nusmv": [
        ("a U b V c", "(a U b) V c"),
        ("a S b T c", "(a S b) T c"),
        ("a -> b -> c", "a -> (b -> c)"),
        ("a <-> b -> c", "(a <-> b) -> c"),
        ("a -> b <-> c", "a -> (b <-> c)"),
        ("a | b xor c xnor d", "((a | b) xor c) <-> d"),
        ("a & b | c", "(a & b) | c"),
        ("LTLSPEC NAME n-1 := G (state = busy -> F [0,5] x != 3);", 'G ("state == busy" -> (F [0,5] "x != 3"))'),
        ("LTLSPEC O H Y Z p", "O (H (Y (Z p)))"),
        ("TRUE & !FALSE -- a comment", "TRUE & (!FALSE)"),
    ],
    "llfsm": [("p && q || r", "((p && q) || r)"), ("G F p -> p U q", "((G (F p)) -> (p U q))")],
}  # fmt: skip


@pytest.mark.parametrize(("syntax", "text", "same"), [(s, *pair) for s, pairs in READINGS.items() for pair in pairs])
def test_readings(syntax, text, same):
    assert read(syntax, text) is read(syntax, same)


def test_one_formula_in_four_syntaxes():
    expected = apply("G", apply("implies", atom("x == 3"), apply("F", apply("or", P, negation(Q)))))
    texts = {
        "llfsm": "G (x == 3 -> F (p || !q))",
        "spot": 'G("x==3" -> F(p | !q))',
        "spin": "[] (x == 3 -> <> (p || !q))",
        "nusmv": "G (x = 3 -> F (p | !q))",
    }
    assert set(texts) == set(SYNTAXES)
    for syntax, text in texts.items():
        assert read(syntax, text) is expected
    printed = {syntax: print_in(syntax, expected) for syntax in texts}
    assert printed == {
        "llfsm": "G ((x == 3) -> F (p || !q))",
        "spot": 'G ("x == 3" -> F (p | !q))',
        "spin": "[] ({x == 3} -> <> (p || !q))",
        "nusmv": 'G ("x == 3" -> F (p | !q))',
    }


def test_places_of_atoms():
    source = Source("test", "name:\n  G (x = 3 & ok)")
    fragment = Fragment(source.text[8:], source, range(8, len(source.text) + 1))
    atoms = parse_in("nusmv", fragment).atoms
    assert list(atoms) == ["x == 3", "ok"]
    assert atoms["x == 3"].span(0, 6).text == "x = 3"
    assert atoms["x == 3"].offsets[-1] == source.text.index("3") + 1
    assert (atoms["ok"].span(0, 2).line, atoms["ok"].span(0, 2).column) == (2, 14)


# ---------------------------------------------------------------- round trips

KEYS = ("p", "G", "Fp", "x == 3", "ns@GREEN", "true_", "U", "first_match", "until", "p0", "a.b", "TRUE", "X1")


def canonical(f):
    """Two negations cancel when a formula is read."""
    done = {}
    for node in postorder(f):
        args = [done[a] for a in node.args]
        done[node] = negation(args[0]) if node.op == "not" else rebuilt(node, tuple(args))
    return done[f]


@pytest.mark.slow
@given(st.sampled_from(SYNTAXES), formulas(KEYS, 8))
@settings(max_examples=examples(400), deadline=None)
def test_round_trips(syntax, f):
    text = print_in(syntax, f)
    back = read(syntax, text)
    assert read(syntax, print_in(syntax, back)) is back
    if syntax in ("llfsm", "spot"):
        assert back is canonical(f)


@pytest.mark.slow
@given(st.sampled_from(("spin", "nusmv")), formulas(("p", "q"), 6), lassos(("p", "q")))
@settings(max_examples=examples(300), deadline=None)
def test_operators_that_a_syntax_lacks_are_said_by_others(syntax, f, word):
    assert evaluate(read(syntax, print_in(syntax, f)), *word) == evaluate(f, *word)


BOUNDS = {
    "X[]": ("0", "3"), "F[]": ("0:2", "2:5"), "G[]": ("1:1", "0:4"), "F<=": ("500", "0.5"), "G<=": ("2000", "5:"),
    "U<=": ("1", "1:2.5"), "R<=": ("10:20", "3"), "O[]": ("0:3", "2:4"), "H[]": ("1:1", "0:2"), "S[]": ("0:2", "2:3"),
    "T[]": ("1:2", "0:9"), "O<=": ("500", "1:2"), "H<=": ("0.5:", "3"), "S<=": ("1:2.5", "7"), "T<=": ("5:", "1:1"),
}  # fmt: skip


def beyond(ops):
    """Formulas of all operators that property files have; those of `ops` among the extended ones."""

    def larger(inner):
        kinds = [
            st.builds(apply, st.sampled_from(["G", "X", "not"]), inner),
            st.builds(apply, st.just("W"), inner, inner),
        ]
        for op in ops:
            arguments = [inner] * EXTENDED_ARITY[op]
            bound = st.sampled_from(BOUNDS.get(op, ("",)))
            kinds.append(st.builds(lambda *a, op=op: apply(op, *a[:-1], bound=a[-1]), *arguments, bound))
        return st.one_of(kinds)

    return st.recursive(st.sampled_from([P, Q]), larger, max_leaves=6)


@pytest.mark.parametrize(
    ("syntax", "ops"),
    [
        ("llfsm", sorted(PAST | STEPS | TIMED)),
        ("nusmv", sorted(PAST - TIMED)),
        ("spot", sorted(STEPS)),
        ("nusmv", sorted(STEPS)),
        ("spin", sorted(STEPS)),
    ],
)
def test_past_steps_and_time_round_trip(syntax, ops):
    @given(beyond(ops), lassos(("p", "q")))
    @settings(max_examples=examples(100), deadline=None)
    def check(f, word):
        back = read(syntax, print_in(syntax, f))
        if syntax == "llfsm":
            assert back is canonical(f)
        elif syntax == "spot":
            assert without_steps(back) is without_steps(canonical(f))
        assert read(syntax, print_in(syntax, back)) is back
        if not TIMED & set(ops):
            assert evaluate(back, *word) == evaluate(f, *word)

    check()


@pytest.mark.slow
@given(expressions(max_leaves=6), st.sampled_from(["[]->", "<>->", "closure"]))
@settings(max_examples=examples(300), deadline=None)
def test_expressions_round_trip(r, op):
    f = apply(op, r) if op == "closure" else apply(op, r, P)
    words = [
        ([frozenset("p")], [frozenset()]),
        ([], [frozenset("p"), frozenset("q")]),
        ([frozenset("pq")] * 3, [frozenset()]),
    ]
    back = read("spot", print_in("spot", f))
    assert print_in("spot", back) == print_in("spot", read("spot", print_in("spot", back)))
    assert [evaluate(back, *w) for w in words] == [evaluate(f, *w) for w in words]


@pytest.mark.parametrize(
    ("syntax", "formula", "sign"),
    [
        ("spot", apply("O", P), "O"),
        ("spin", apply("S", P, Q), "S"),
        ("nusmv", apply("F<=", P, bound="500"), "F[<=500ms]"),
        ("spin", apply("[]->", apply("seq", P, Q), P), None),
        ("nusmv", apply("closure", P), None),
        ("llfsm", apply("closure", P), None),
        ("llfsm", apply("G", apply("<>->", apply("seq", P, Q), P)), None),
        ("llfsm", apply("seq", P, Q), None),
    ],
)
def test_what_a_syntax_cannot_say(syntax, formula, sign):
    with pytest.raises(DiagnosticError) as raised:
        print_in(syntax, formula)
    (found,) = raised.value.diagnostics
    assert found.code == "E352"
    assert (f"`{sign}`" if sign else "regular expressions") in found.message


@pytest.mark.slow
def test_texts_have_a_limit():
    f = P
    for _ in range(40):
        f = apply("iff", f, apply("X", f))
    with pytest.raises(LimitReached, match="longer than 4 MiB"):
        print_in("spot", f)


def test_extended_operators_in_steps_and_past_print_where_they_exist():
    f = apply("and", apply("G[]", P, bound="1:2"), apply("X[]", apply("Y", Q), bound="2"))
    assert read("nusmv", print_in("nusmv", f)) is apply("and", f.args[0], apply("X", apply("X", apply("Y", Q))))
    assert read("llfsm", print_in("llfsm", f)) is f
    g = apply("U<=", P, apply("F<=", Q, bound="1.5"), bound="20")
    with pytest.raises(DiagnosticError, match="E352"):
        print_in("spot", g)


# ---------------------------------------------------------------- mistakes


@pytest.mark.parametrize(
    ("syntax", "text", "code", "column"),
    SYNTAXES_WRONG,
)
def test_mistakes(syntax, text, code, column):
    with pytest.raises(DiagnosticError) as raised:
        read(syntax, text)
    (found,) = raised.value.diagnostics
    assert (found.code, found.span.column) == (code, column), found.message


WORDS = "a b U V W X G F Y S 0 1 p3 true xor first_match always ltl LTLSPEC NAME"
ALPHABET = [*WORDS.split(), *'!&|()[]{}<>-=;:*+.,"#~@$ \n\\/^%5é']


@pytest.mark.slow
@given(st.sampled_from(SYNTAXES), st.lists(st.sampled_from(ALPHABET), max_size=25), st.sampled_from(["", " "]))
@settings(max_examples=examples(1500), deadline=None)
def test_garbage(syntax, words, between):
    text = between.join(words)
    found = ()
    try:
        f = read(syntax, text)
    except DiagnosticError as e:
        found = e.diagnostics
    else:
        if syntax != "llfsm":
            assert read(syntax, print_in(syntax, f)) is not None
    for d in found:
        assert d.span is not None and d.code.startswith("E3"), d
        assert 0 <= d.span.start <= d.span.end <= len(text)


def large():
    n = 100_000
    for opening, closing in ("()", "{}", "[]"):
        yield opening * n + "a" + closing * n
        yield opening * n
        yield closing * n
        yield (opening + closing) * n
    yield "!" * (1 << 20) + "a"
    yield "a" * (1 << 20)
    for join in ("&", " U ", " -> ", " | ", ";", " xor ", " ", "\n", "\t", '"'):
        yield join.join(["a"] * 60_000)
        yield "{" + join.join(["a"] * 49_000) + "}"
    yield "X " * 60_000 + "a"
    yield "{a" + "[*]" * 60_000 + "}"
    yield "{a" + "[*2]" * 60_000 + "}[]->b"
    yield "{a}[]->" * 30_000 + "a"
    yield "a == " * 60_000
    yield "LTLSPEC " + " " * (1 << 20) + "x"
    yield "ltl x {" + " " * (1 << 20) + "x"
    yield "#" * (1 << 20)
    yield "/*" * (1 << 19)
    yield '"' + "a " * (1 << 19) + '"'


@pytest.mark.long
@pytest.mark.parametrize("syntax", SYNTAXES)
def test_large_texts_are_read_or_refused_within_seconds(syntax):
    for text in large():
        before = time.process_time()
        try:
            read(syntax, text)
        except DiagnosticError as e:
            assert e.diagnostics[0].code.startswith("E3")  # noqa: PT017
        assert time.process_time() - before < 20, text[:20]


# ---------------------------------------------------------------- property files


def test_header_and_option():
    text = '# a file for Spot\n# syntax: spot\nfirst: GFa -> a U b U c\nassume second: {a;b}[]->c\nX[2] "d"\n'
    found = parse_properties([Source("t", text)], features=FEATURES)
    assert [(p.name, p.kind) for p in found] == [("first", "ltl"), ("second", "assume"), ("L5", "ltl")]
    assert found.properties[0].formula is read("spot", "GFa -> a U b U c")
    assert found.properties[2].formula is apply("X", apply("X", atom("d")))
    assert list(found.atoms) == ["a", "b", "c", "d"]
    place = found.atoms["c"]
    assert (place.span(0, 1).line, place.span(0, 1).column) == (3, 23)
    option = parse_properties([Source("t", "p: [] a U b U c")], "spin")
    assert option.properties[0].formula is read("spin", "([] a U b) U c")
    wrapped = parse_properties([Source("t", "# syntax: SPIN\nltl one { [] a }\nltl two { <> a }\n")])
    assert [p.name for p in wrapped] == ["one", "two"]
    spec = parse_properties([Source("t", "LTLSPEC NAME three := G a;\nLTLSPEC F a")], "nusmv")
    assert [p.name for p in spec] == ["three", "L2"]


def test_regular_properties_and_automata_stay_ours_in_other_files():
    found = parse_properties([Source("t", "# syntax: nusmv\nenforce x: (a b)*\nautomaton y: y.hoa")], features=FEATURES)
    assert [(p.kind, p.file) for p in found] == [("enforce", None), ("automaton", "y.hoa")]


def test_unknown_and_late_headers():
    with pytest.raises(DiagnosticError, match=r"t:1:11: error\[E350\]") as raised:
        parse_properties([Source("t", "# syntax: tla\na")])
    assert "llfsm, spot, spin, nusmv" in raised.value.diagnostics[0].hint
    (late,) = parse_properties([Source("t", "a U b\n# syntax: spot\n")])
    assert late.formula is apply("U", atom("a"), atom("b"))


# ---------------------------------------------------------------- SPIN itself

OPERATORS = ["U", "V", "&&", "||", "->", "<->"]
LASSOS = [("a", "b"), ("ab c", "-"), ("", "a bc"), ("b b", "c -"), ("abc", "ac"), ("b a", "a -"), ("c", "b")]


def spin(*arguments, cwd=None):
    return subprocess.run(["spin", *arguments], cwd=cwd, capture_output=True, text=True, check=False).stdout


@pytest.mark.slow
@needs("spin")
def test_spin_groups_alike(tmp_path):
    """SPIN shows how it reads a formula; we read what it shows, which has all parentheses."""
    rng = random.Random(4)
    pairs = [(a, b) for a in OPERATORS for b in OPERATORS]
    texts = [f"{rng.choice(['', '!', '[]', '<>'])}a {x} b {y} c" for x, y in pairs]
    model = "bool a, b, c;\nactive proctype m() { do :: a = !a od }\n"
    model += "".join(f"ltl f{i} {{ {text} }}\n" for i, text in enumerate(texts))
    (tmp_path / "m.pml").write_text(model)
    lines = [line[4:].split(": ", 1) for line in spin("-a", "m.pml", cwd=tmp_path).splitlines() if line[:5] == "ltl f"]
    assert len(lines) == len(texts)
    words = [[[frozenset(x.strip("-")) for x in part.split()] for part in pair] for pair in LASSOS]
    for text, (_, shown) in zip(texts, lines, strict=True):
        ours, theirs = read("spin", text), read("spin", shown)
        assert [evaluate(ours, *w) for w in words] == [evaluate(theirs, *w) for w in words], (text, shown)


@needs("spin")
def test_spin_reads_what_we_print():
    for text in ("p W q", "G (p -> F q)", "p M q xor q R p", "x == 3 U Upper"):
        printed = print_in("spin", read("llfsm", text))
        assert "never  {" in spin("-f", printed), printed


def test_every_operator_of_plain_logic_is_written_everywhere():
    for syntax in SYNTAXES:
        for op, arity in ARITY.items():
            if op != "atom":
                f = apply(op, *[P, Q][: 2 if arity is None else arity])
                assert read(syntax, print_in(syntax, f)) is not None
        if syntax != "llfsm":
            assert foreign(syntax).table.name == syntax

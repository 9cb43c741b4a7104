"""The Hanoi Omega-Automata format: what is read, what is refused and where, and that what is written reads back."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.automata.automaton import Automaton
from llfsm_verify.automata.ltl.translate import translate
from llfsm_verify.automata.omega.products import accepts
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.extensions.hoa import reading as hoa
from llfsm_verify.extensions.hoa.reading import read_hoa, read_one
from llfsm_verify.extensions.hoa.writing import write_hoa
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.testing.formulas import formulas, lassos
from tests.quick import examples

P, Q, NONE = frozenset("p"), frozenset("q"), frozenset()


def read(text):
    return [h.automaton for h in read_hoa(Source("a.hoa", text))]


def wrapped(body, header='Start: 0 AP: 2 "p" "q" acc-name: Buchi Acceptance: 1 Inf(0)'):
    return f"HOA: v1\n{header}\n--BODY--\n{body}\n--END--\n"


@pytest.mark.slow
@given(formulas(("p", "q"), 5), lassos(("p", "q")))
@settings(max_examples=examples(150), deadline=None)
def test_round_trip(f, word):
    before = translate(f, ("p", "q"))
    (found,) = read_hoa(Source("a.hoa", write_hoa(before, 'a "name" \\ of f')))
    assert found.name == 'a "name" \\ of f'
    after = found.automaton
    assert after.atoms == before.atoms and after.acceptance_sets == before.acceptance_sets
    if not before.is_empty:
        assert len(after.edges) == len(before.edges)
    assert accepts(after, *word) == evaluate(f, *word)


def test_several_in_one_stream_and_an_aborted_one():
    one, two = translate_text("p"), Automaton((), ((),), 0)
    text = write_hoa(one, "one") + write_hoa(two)
    aborted = "HOA: v1 Start: 0 AP: 0 Acceptance: 0 t --BODY-- State: 0 [nonsense --ABORT--\n"
    found = read_hoa(Source("a.hoa", aborted + text))
    assert [h.name for h in found] == ["one", None]
    assert [h.name for h in read_hoa(Source("a.hoa", f"--ABORT-- --ABORT-- {text} {aborted}"))] == ["one", None]
    assert found[0].automaton == one
    assert read("") == []
    with pytest.raises(DiagnosticError, match="holds 2 automata") as raised:
        read_one(Source("a.hoa", text))
    (found,) = raised.value.diagnostics
    assert found.span is not None and (found.span.line, found.span.column, found.span.text) == (1, 1, "H")
    with pytest.raises(DiagnosticError, match="holds 0 automata") as raised:
        read_one(Source("a.hoa", ""))
    assert [d.code for d in raised.value.diagnostics] == ["E363"]


def translate_text(text):
    from llfsm_verify.diagnostics import Fragment
    from llfsm_verify.logic.parsing.formulas import parse_formula

    return translate(parse_formula(Fragment.whole(Source("t", text))).formula)


@pytest.mark.parametrize(
    ("text", "accepted", "rejected"),
    [
        # acceptance on states, and on transitions beside it
        (wrapped("State: 0 {0} [0] 0 [!0] 1 State: 1 [t] 1"), ([], [P]), ([P], [NONE])),
        (wrapped("State: 0 [0] 0 {0} [!0] 0"), ([], [P, NONE]), ([P], [NONE])),
        # a label for the state, no labels at all
        (wrapped("State: [0&!1] 0 {0} 0"), ([], [P]), ([P], [P | Q])),
        (wrapped("State: 0 1 0 1 1 State: 1 {0} 1 1 1 1"), ([NONE], [NONE]), ([P], [P])),
        # aliases, comments inside comments, several initial states
        (
            wrapped("State: 0 [@pq] 0 {0} State: 1 [!@pq | 1] 1 {0}",
                    'Start: 0 Start: 1 AP: 2 "p" "q" /* a /* b */ c */ Alias: @pq 0&!1 Acceptance: 1 (Inf(0))'),
            ([], [P]),
            ([P], [P, NONE]),
        ),
        # generalised Büchi, complemented sets, a number of states, unknown headers in lower case
        (
            wrapped("State: 0 [0] 0 {0} [1] 0 {1} [!0&!1] 0 {2}",
                    'States: 1 Start: 0 AP: 2 "p" "q" Acceptance: 3 Inf(0)&Inf(1) & Inf(!2) spot.seed: 3 "x" !y'),
            ([], [P, Q]),
            ([], [P]),
        ),
        # all runs, no runs, no initial state
        (wrapped("State: 0 [0] 0", 'Start: 0 AP: 2 "p" "q" acc-name: all Acceptance: 0 t'), ([], [P]), ([P], [NONE])),
        (wrapped("State: 0 [t] 0", 'Start: 0 AP: 1 "p" acc-name: none Acceptance: 0 f'), None, ([], [P])),
        (wrapped("State: 0 [t] 0", 'AP: 1 "p" Acceptance: 0 t'), None, ([], [P])),
        # `t` and `f` beside sets, brackets around them
        (wrapped("State: 0 [t] 0 {0}", 'Start: 0 AP: 1 "p" Acceptance: 1 Inf(0)&f'), None, ([], [P])),
        (wrapped("State: 0 [0] 0 {0} [!0] 0", 'Start: 0 AP: 1 "p" Acceptance: 1 ((t)&(Inf(0)))'),
         ([], [P]), ([], [NONE])),
    ],
)  # fmt: skip
def test_reading(text, accepted, rejected):
    (automaton,) = read(text)
    if accepted is not None:
        assert accepts(automaton, *accepted)
    assert not accepts(automaton, *rejected)


def test_places_of_propositions():
    source = Source("a.hoa", wrapped("State: 0 [0] 0 {0}", 'Start: 0\nAP: 1 "ns@GREEN" Acceptance: 1 Inf(0)'))
    found = read_one(source)
    assert found.automaton.atoms == ("ns@GREEN",)
    span = found.places["ns@GREEN"]
    assert (span.line, span.column, span.text) == (3, 8, "ns@GREEN")


HEAD = 'HOA: v1 Start: 0 AP: 1 "p" '
BODY = HEAD + "Acceptance: 0 t --BODY-- "
CONVERT = "convert it with the tool that wrote the file, such as `autfilt --generalized-buchi`"
HINTS = {"is not generalised": CONVERT, "alternating": "remove the alternation with the tool that wrote the file"}


@pytest.mark.parametrize(
    ("marked", "message", "code"),
    [
        ("«hello»", "`HOA:` is expected here", "E360"),
        ("HOA: «v2» --END--", "this is version `v2`, and only v1 can be read", "E360"),
        (
            HEAD + "Acceptance: «1 Fin(0)» --BODY-- State: 0 --END--",
            "the acceptance `Fin(0)` is not generalised Büchi",
            "E361",
        ),
        (
            HEAD + "acc-name: Rabin 1 Acceptance: «2 Fin(0)&Inf(1)» --BODY-- State: 0 --END--",
            "the acceptance `Rabin 1` is not generalised Büchi",
            "E361",
        ),
        (
            BODY + "State: 0 [t] «0»&1 State: 1 --END--",
            "alternating automata (states joined by `&`) are not supported",
            "E362",
        ),
        (
            "HOA: v1 Start: «0»&1 Acceptance: 0 t --BODY-- --END--",
            "alternating automata (states joined by `&`) are not supported",
            "E362",
        ),
        (
            HEAD + "Acceptance: 0 t «Weird:» 3 --BODY-- State: 0 --END--",
            "the header `Weird:` is not known, and its capital says that it must be",
            "E362",
        ),
        (BODY + "State: 0 [«1»] 0 --END--", "there is 1 proposition, counted from 0", "E360"),
        (
            'HOA: v1 AP: 2 "p" "q" Acceptance: 0 t --BODY-- State: 0 [«2»] 0 --END--',
            "there are 2 propositions, counted from 0",
            "E360",
        ),
        (BODY + "State: 0 [0] «7» --END--", "state 7 is not defined", "E360"),
        ("HOA: v1 Start: «3» AP: 0 Acceptance: 0 t --BODY-- State: 0 [t] 0 --END--", "state 3 is not defined", "E360"),
        (BODY + "State: 0 [(0«]» 0 --END--", "`)` is missing", "E360"),
        (BODY + "State: 0 State: «0» --END--", "there are two states 0", "E360"),
        (
            BODY + "State: «0» 0 --END--",
            "a state without labels has a transition for each of the 2^1 letters, and this has 1",
            "E360",
        ),
        (BODY + "State: 0 [«@x»] 0 --END--", "there is no alias `@x` before this", "E360"),
        (BODY + "State: 0 [0] 0 {«0»} --END--", "there are 0 acceptance sets, counted from 0", "E360"),
        (
            HEAD + "Acceptance: 2 Inf(0)&Inf(1) --BODY-- State: 0 [0] 0 {«2»} --END--",
            "there are 2 acceptance sets, counted from 0",
            "E360",
        ),
        (HEAD + "Acceptance: 1 Inf(«3») --BODY-- --END--", "there is 1 acceptance set, counted from 0", "E360"),
        (HEAD + "--BODY-- «--END--»", "the header `Acceptance:` is missing", "E360"),
        (BODY + "State: «0»", "`State:` or `--END--` is expected here", "E360"),
        ('HOA: v1 «AP:» 2 "p" Acceptance: 0 t --BODY-- --END--', "`AP:` says 2 propositions, and 1 is named", "E360"),
        ("HOA: v1 «AP:» 1 Acceptance: 0 t --BODY-- --END--", "`AP:` says 1 proposition, and 0 are named", "E360"),
        ('HOA: v1 AP: 2 "p" «"p"» Acceptance: 0 t --BODY-- --END--', 'there are two propositions "p"', "E360"),
        (HEAD + "«/*» never closed", "this comment is not closed", "E360"),
        (HEAD + 'name: «"»open', '`"` opens a string that is not closed', "E360"),
        ("HOA: v1 «§»", "no word of this format", "E360"),
        (HEAD + '«AP:» 1 "q" Acceptance: 0 t --BODY-- --END--', "there are two headers `AP:`", "E360"),
        ('HOA: v1 AP: 1 «""» Acceptance: 0 t --BODY-- --END--', "a proposition needs a name", "E360"),
        (HEAD + "Alias: @a 0 Alias: «@a» !0 Acceptance: 0 t --BODY-- --END--", "there are two aliases `@a`", "E360"),
        (HEAD + "Acceptance: 0 t «Acceptance:» 0 t --BODY-- --END--", "there are two headers `Acceptance:`", "E360"),
        (HEAD + "Acceptance: 0 t «HOA:» v1 --BODY-- --END--", "`--END--` is missing before the next automaton", "E360"),
        ("HOA: v1 Alias: @a «0» Acceptance: 0 t --BODY-- --END--", "there is no header `AP:` before this", "E360"),
        (HEAD + "States: 2 Acceptance: 0 t --BODY-- State: «2» [t] 0 --END--", "there are only 2 states", "E360"),
        (BODY + "State: [0] «0» [0] 0 --END--", "the state has a label, so its transitions have none", "E360"),
        (
            BODY + "State: «0» [0] 0 [!0] 0 0 --END--",
            "some transitions of this state have labels and some have none",
            "E360",
        ),
        (BODY + "«[»0] 0 --END--", "`State:` or `--END--` is expected here", "E360"),
        (BODY + 'State: «"x"» --END--', "the number of a state is expected here", "E360"),
        (BODY + "State: 0 [0&«]» 0 --END--", "a proposition's number, an alias, `t` or `f` is expected here", "E360"),
        (BODY + "State: 0 [0 «0» --END--", "`]` is expected here", "E360"),
        (BODY + 'State: 0 [0] «"x"» --END--', "the number of a state is expected here", "E360"),
        (BODY + "State: 0 [0] 0 {«x»} --END--", "the number of an acceptance set, or `}`, is expected here", "E360"),
        ("HOA: «--END--»", "the version, `v1`, is expected here", "E360"),
        ("HOA: v1 States: «x» --END--", "the number of states is expected here", "E360"),
        ("HOA: v1 Start: «x» --END--", "the number of a state is expected here", "E360"),
        ('HOA: v1 AP: «"p"» --END--', "the number of atomic propositions is expected here", "E360"),
        ("HOA: v1 Alias: «a» 0 --END--", "a name such as `@a` is expected here", "E360"),
        ("HOA: v1 name: «x» --END--", "a name in quotes is expected here", "E360"),
        ("HOA: v1 «x» --END--", "a header such as `States:`, or `--BODY--`, is expected here", "E360"),
        (HEAD + "«States:» 100001 Acceptance: 0 t --BODY-- --END--", "more than 100,000 states", "E360"),
        (HEAD + "Acceptance: «x» --BODY-- --END--", "the number of acceptance sets is expected here", "E360"),
        (HEAD + "Acceptance: 1 Inf «--BODY--» --END--", "`(` is expected here", "E360"),
        (HEAD + "Acceptance: 1 Inf(0 «--BODY--» --END--", "`)` is expected here", "E360"),
        (HEAD + "Acceptance: 1 (Inf(0) «--BODY--» --END--", "`)` is expected here", "E360"),
        (HEAD + "Acceptance: 1 Inf(0) & «--BODY--» --END--", "`Inf(…)`, `Fin(…)`, `t` or `f` is expected here", "E360"),
        (
            HEAD + "Acceptance: 1 Inf(0) «Inf»(0) --BODY-- --END--",
            "a header such as `States:`, or `--BODY--`, is expected here",
            "E360",
        ),
        (HEAD + "Acceptance: 1 «Foo»(0) --BODY-- --END--", "`Inf(…)`, `Fin(…)`, `t` or `f` is expected here", "E360"),
        (BODY + "State: 0 [«0»", "`]` is expected here", "E360"),
        (BODY + "State: 0 [0] 100000 State: «100000» [0] 0 --END--", "there are only 100,000 states", "E360"),
    ],
)
def test_mistakes(marked, message, code):
    """The place stands in « »."""
    text = marked.replace("«", "").replace("»", "")
    with pytest.raises(DiagnosticError) as raised:
        read_hoa(Source("a.hoa", text))
    (found,) = raised.value.diagnostics
    assert (found.code, found.message) == (code, message)
    assert found.hint == next((hint for part, hint in HINTS.items() if part in message), None)
    start, end = found.span.start, found.span.end
    assert f"{text[:start]}«{text[start:end]}»{text[end:]}" == marked


def trees(inner):
    return st.one_of(
        st.tuples(st.just("!"), inner), st.tuples(st.sampled_from("&|"), inner, inner), st.tuples(st.just("("), inner)
    )


LABELS = st.recursive(st.sampled_from(["0", "1", "t", "f"]), trees, max_leaves=8)


def label_text(tree, above=0):
    """As the format reads it: `!` binds more tightly than `&`, and that than `|`."""
    match tree:
        case str():
            return tree
        case ("(", a):
            return f"({label_text(a)})"
        case ("!", a):
            return f"!{label_text(a, 3)}"
        case (sign, a, b):
            level = 2 if sign == "&" else 1
            text = f"{label_text(a, level)} {sign} {label_text(b, level + 1)}"
            return f"({text})" if level < above else text


def label_holds(tree, letter):
    match tree:
        case "t" | "f":
            return tree == "t"
        case str():
            return "pq"[int(tree)] in letter
        case ("(", a):
            return label_holds(a, letter)
        case ("!", a):
            return not label_holds(a, letter)
        case (sign, a, b):
            return (all if sign == "&" else any)(label_holds(part, letter) for part in (a, b))


@given(LABELS)
@settings(max_examples=examples(100), deadline=None)
def test_labels(tree):
    automaton = read_one(Source("a.hoa", wrapped(f"State: 0 [{label_text(tree)}] 0 {{0}}"))).automaton
    for letter in (NONE, P, Q, P | Q):
        assert accepts(automaton, [], [letter]) == label_holds(tree, letter)


@given(st.text(alphabet='HOA:v1 SatesrBDYEN-T{}[]()&|!"0123@/*pqtf', max_size=200))
@settings(max_examples=examples(200), deadline=None)
def test_garbage(text):
    for prefix in ("", "HOA: v1 ", f"{HEAD}Acceptance: 1 Inf(0) --BODY-- State: 0 "):
        found = ()
        try:
            read_hoa(Source("a.hoa", prefix + text))
        except DiagnosticError as e:
            found = e.diagnostics
        assert all(d.span is not None and d.code.startswith("E36") for d in found)


@pytest.mark.slow
def test_deep_labels():
    deep = "(" * 100_000 + "0" + ")" * 100_000
    (automaton,) = read(wrapped(f"State: 0 [{deep}] 0 {{0}} [{'!' * 100_001}0] 0"))
    assert accepts(automaton, [NONE], [P]) and not accepts(automaton, [P], [NONE])
    with pytest.raises(DiagnosticError, match="`\\)` is missing"):
        read(wrapped(f"State: 0 [{'(' * 100_000}0] 0"))


def test_the_transitions_of_a_file_are_limited(monkeypatch):
    monkeypatch.setattr(hoa, "MAX_EDGES", 2)
    header = 'Start: 0 AP: 1 "p" Acceptance: 0 t'
    assert len(read(wrapped("State: 0 [0] 0 [!0] 0", header))) == 1
    with pytest.raises(DiagnosticError, match="more than 2 transitions") as raised:
        read(wrapped("State: 0 [0] 0 [!0] 1 [0] 1 State: 1", header))
    assert [d.span is not None and d.span.text for d in raised.value.diagnostics] == ["0"]


@pytest.mark.parametrize("mark", ["--END--", "--ABORT--", "--BODY--", "State:"])
def test_a_string_is_no_mark_whatever_its_text(mark):
    header = f'name: "{mark}" Start: 0 AP: 1 "{mark}" Acceptance: 0 t'
    text = wrapped(f'State: 0 "{mark}" [0] 0', header)
    found = read_hoa(Source("a.hoa", text + text))
    assert [h.name for h in found] == [mark, mark]
    assert all(h.automaton.atoms == (mark,) and h.automaton.transitions == 1 for h in found)


@pytest.mark.parametrize(
    "acceptance", ['1 (Inf(0) ")"', '1 "Inf"(0)', '1 Inf("!"0)', '1 Inf"("0)', '1 Inf(0")"', '0 "t"', '0 "f"']
)
def test_a_string_is_no_part_of_an_acceptance(acceptance):
    with pytest.raises(DiagnosticError) as raised:
        read(wrapped("State: 0", f"Start: 0 Acceptance: {acceptance}"))
    assert [d.code for d in raised.value.diagnostics] == ["E360"]


def test_control_characters_do_not_get_through():
    text = wrapped("State: 0 [0] 0", 'name: "a\x1b[31m\nb" Start: 0 AP: 1 "p" Acceptance: 0 t')
    (found,) = read_hoa(Source("a.hoa", text))
    assert found.name == "a\N{REPLACEMENT CHARACTER}[31m\N{REPLACEMENT CHARACTER}b"
    with pytest.raises(DiagnosticError) as raised:
        read(text.replace('"p"', '"p\x1b"'))
    (diagnostic,) = raised.value.diagnostics
    assert diagnostic.code == "E360" and "control character" in diagnostic.message

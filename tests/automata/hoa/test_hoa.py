"""The Hanoi Omega-Automata format: what is read, what is refused and where, and that what is written reads back."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.automata.automaton import Automaton
from llfsm_verify.automata.hoa import reading as hoa
from llfsm_verify.automata.hoa.reading import read_hoa, read_one
from llfsm_verify.automata.hoa.writing import write_hoa
from llfsm_verify.automata.ltl.translate import translate
from llfsm_verify.automata.omega.products import accepts
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.testing.formulas import formulas, lassos
from tests.quick import examples

P, Q, NONE = frozenset("p"), frozenset("q"), frozenset()


def read(text):
    return [h.automaton for h in read_hoa(Source("a.hoa", text))]


def wrapped(body, header='Start: 0 AP: 2 "p" "q" acc-name: Buchi Acceptance: 1 Inf(0)'):
    return f"HOA: v1\n{header}\n--BODY--\n{body}\n--END--\n"


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
    assert found[0].automaton == one
    assert read("") == []
    with pytest.raises(DiagnosticError, match="holds 2 automata"):
        read_one(Source("a.hoa", text))


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


HEAD = 'HOA: v1 Start: 0 AP: 1 "p"'


@pytest.mark.parametrize(
    ("text", "code", "column", "message"),
    [
        ("hello", "E360", 1, "`HOA:` is expected"),
        ("HOA: v2 --END--", "E360", 6, "version `v2`"),
        (f"{HEAD} Acceptance: 1 Fin(0) --BODY-- State: 0 --END--", "E361", 40, "`Fin(0)`"),
        (f"{HEAD} acc-name: Rabin 1 Acceptance: 2 Fin(0)&Inf(1) --BODY-- State: 0 --END--", "E361", None, "`Rabin 1`"),
        (f"{HEAD} acc-name: parity max even 2 Acceptance: 2 Fin(1)&Inf(0) --BODY-- --END--", "E361", None, "parity"),
        (f"{HEAD} Acceptance: 2 Inf(0)|Inf(1) --BODY-- State: 0 --END--", "E361", None, "not generalised Büchi"),
        (f"{HEAD} Acceptance: 0 t --BODY-- State: 0 [t] 0&1 State: 1 --END--", "E362", None, "alternating"),
        (f"{HEAD} Acceptance: 0 t Weird: 3 --BODY-- State: 0 --END--", "E362", None, "`Weird:` is not known"),
        (f"{HEAD} Acceptance: 0 t --BODY-- State: 0 [1] 0 --END--", "E360", None, "there is 1 proposition, counted"),
        (f"{HEAD} Acceptance: 0 t --BODY-- State: 0 [0] 7 --END--", "E360", None, "state 7 is not defined"),
        (f"{HEAD} Acceptance: 0 t --BODY-- State: 0 [(0] 0 --END--", "E360", None, "`)` is missing"),
        (f"{HEAD} Acceptance: 0 t --BODY-- State: 0 State: 0 --END--", "E360", None, "two states 0"),
        (f"{HEAD} Acceptance: 0 t --BODY-- State: 0 0 --END--", "E360", None, "each of the 2^1 letters"),
        (f"{HEAD} Acceptance: 0 t --BODY-- State: 0 [@x] 0 --END--", "E360", None, "no alias `@x`"),
        (f"{HEAD} Acceptance: 0 t --BODY-- State: 0 [0] 0 {{0}} --END--", "E360", None, "0 acceptance sets"),
        (f"{HEAD} Acceptance: 1 Inf(3) --BODY-- --END--", "E360", None, "is 1 acceptance set,"),
        (f"{HEAD} --BODY-- --END--", "E360", None, "`Acceptance:` is missing"),
        (f"{HEAD} Acceptance: 0 t --BODY-- State: 0", "E360", None, "`--END--`"),
        ('HOA: v1 AP: 2 "p" Acceptance: 0 t --BODY-- --END--', "E360", 9, "says 2 propositions, and 1 is named"),
        ("HOA: v1 AP: 1 Acceptance: 0 t --BODY-- --END--", "E360", 9, "says 1 proposition, and 0 are named"),
        ('HOA: v1 AP: 2 "p" "p" Acceptance: 0 t --BODY-- --END--', "E360", 19, "two propositions"),
        (f"{HEAD} /* never closed", "E360", 28, "comment is not closed"),
        (f'{HEAD} name: "open', "E360", 34, "not closed"),
        ("HOA: v1 §", "E360", 9, "no word of this format"),
    ],
)  # fmt: skip
def test_mistakes(text, code, column, message):
    with pytest.raises(DiagnosticError) as raised:
        read_hoa(Source("a.hoa", text))
    (found,) = raised.value.diagnostics
    assert (found.code, found.span.line) == (code, 1)
    assert message in found.message
    assert column is None or found.span.column == column


@given(st.text(alphabet='HOA:v1 SatesrBDYEN-T{}[]()&|!"0123@/*pqtf', max_size=200))
@settings(max_examples=examples(200), deadline=None)
def test_garbage(text):
    for prefix in ("", "HOA: v1 ", f"{HEAD} Acceptance: 1 Inf(0) --BODY-- State: 0 "):
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

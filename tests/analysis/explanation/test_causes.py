"""The marks against the definition of causes, tried out on small words."""

from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from llfsm_verify.analysis.explanation.causes import Reading, causes
from llfsm_verify.analysis.explanation.explain import exact_causes
from llfsm_verify.diagnostics import Fragment, Source
from llfsm_verify.logic.bounds import TICK, Clock
from llfsm_verify.logic.formula import Formula, apply, atom
from llfsm_verify.logic.parsing.formulas import parse_formula
from llfsm_verify.testing.formulas import Word, formulas, lassos, letters
from tests.oracle.causes import causes_by_definition
from tests.quick import examples

P, Q, R = (frozenset(x) for x in "pqr")
NONE = frozenset[str]()


def formula_of(text: str) -> Formula:
    return parse_formula(Fragment.whole(Source("", text))).formula


def check(formula: Formula, word: Word, loop: int | None, clock: Clock | None = None) -> None:
    reading = Reading(formula, word, loop, clock)
    assume(reading.fails)
    found, expected = causes(reading), causes_by_definition(formula, word, loop, clock)
    assert expected <= found
    assert all(i < len(word) for i, _ in found)
    assert exact_causes(reading) == (expected, True)


EXAMPLES = settings(max_examples=examples(60), deadline=None)
MANY = settings(max_examples=700, deadline=None)
FORMULAS = formulas(max_leaves=4)
PREFIXES = st.lists(letters(), min_size=1, max_size=3)
LASSOS = lassos(max_stem=1, max_loop=2)


@EXAMPLES
@given(FORMULAS, PREFIXES)
def test_every_cause_of_a_bad_prefix_is_marked(formula: Formula, word: Word) -> None:
    check(formula, word, None)


@EXAMPLES
@given(FORMULAS, LASSOS)
def test_every_cause_on_a_lasso_is_marked(formula: Formula, lasso: tuple[Word, Word]) -> None:
    check(formula, [*lasso[0], *lasso[1]], len(lasso[0]))


@pytest.mark.long
@MANY
@given(FORMULAS, PREFIXES)
def test_every_cause_of_a_bad_prefix_is_marked_at_length(formula: Formula, word: Word) -> None:
    check(formula, word, None)


@pytest.mark.long
@MANY
@given(FORMULAS, LASSOS)
def test_every_cause_on_a_lasso_is_marked_at_length(formula: Formula, lasso: tuple[Word, Word]) -> None:
    check(formula, [*lasso[0], *lasso[1]], len(lasso[0]))


TIMES = st.sampled_from(["<=10ms", "10ms:10ms", "10ms:20ms", ">=10ms", "5ms:25ms"])
TIMED = st.builds(
    lambda shape, a, b: formula_of(shape.format(f"[{a}]", f"[{b}]")),
    st.sampled_from(
        [
            "F{0} p", "G{0} p", "p U{0} q", "p R{0} q", "!(p U{0} q)", "!(p R{0} q)", "G (p -> F{0} q)",
            "p U{0} (q R{1} p)", "G{0} (p -> F{1} q)", "(F{0} p) R{1} q", "G (p -> q U{0} !p)", "F{0} G{1} (p && q)",
            "G (p -> O{0} q)", "X X H{0} p", "G (p -> q S{0} !p)", "G !(p T{0} (q S{1} p))", "G (q S[1:2] p -> X p)",
            "G (p -> O[0:1] q)", "G (p -> q T[0:2] p)", "F G{0} H[1:1] p",
        ]
    ),
    TIMES,
    TIMES,
)  # fmt: skip
TICKING = st.lists(st.frozensets(st.sampled_from(["p", "q", TICK])), min_size=1, max_size=3)


@pytest.mark.slow
@EXAMPLES
@given(TIMED, TICKING)
def test_every_cause_in_time_of_a_bad_prefix_is_marked(formula: Formula, word: Word) -> None:
    check(formula, word, None, Clock(Fraction(10)))


@pytest.mark.slow
@EXAMPLES
@given(TIMED, TICKING, TICKING)
def test_every_cause_in_time_on_a_lasso_is_marked(formula: Formula, stem: Word, loop: Word) -> None:
    loop = [*loop[:1], loop[-1] | {TICK}]
    check(formula, [*stem[:1], *loop], 1, Clock(Fraction(10)))


STEPS = st.recursive(
    st.sampled_from(["{}", "!{}", "X {}"]),
    lambda inner: st.tuples(inner, st.sampled_from(["&&", "||", "->"]), inner).map(lambda x: f"({x[0]} {x[1]} {x[2]})"),
    max_leaves=3,
)


@EXAMPLES
@given(STEPS, PREFIXES)
def test_where_no_literal_stands_twice_every_mark_is_a_cause(shape: str, word: Word) -> None:
    formula = apply("G", formula_of(shape.format(*"pqr")))
    reading = Reading(formula, word, None)
    assume(reading.fails)
    assert causes(reading) == causes_by_definition(formula, word, None)


@pytest.mark.parametrize(
    ("text", "word", "loop", "marked"),
    [
        ("G !(p && q)", [NONE, P, P | Q], None, {(2, "p"), (2, "q")}),
        ("G (p -> X q)", [NONE, P, P], None, {(1, "p"), (2, "q")}),
        ("G (p -> F q)", [Q, P, NONE], 2, {(1, "p"), (1, "q"), (2, "q")}),
        ("G F q", [Q, NONE, P], 1, {(1, "q"), (2, "q")}),
        ("p U q", [P, P, NONE], None, {(0, "q"), (1, "q"), (2, "q"), (2, "p")}),
        ("p W q", [P, NONE], None, {(0, "q"), (1, "q"), (1, "p")}),
        ("p R q", [Q, NONE], None, {(0, "p"), (1, "q")}),
        ("G (q -> O p)", [NONE, R, Q], None, {(0, "p"), (1, "p"), (2, "p"), (2, "q")}),
        ("G (r -> Y p)", [NONE, R], None, {(1, "r"), (0, "p")}),
        ("G (r -> Y p)", [R], None, {(0, "r")}),
        ("G (r -> Z p)", [NONE, R], None, {(1, "r"), (0, "p")}),
        ("G (r -> p S q)", [Q, NONE, P | R], None, {(2, "r"), (2, "q"), (1, "q"), (1, "p")}),
        ("G (r -> p S q)", [P | R], None, {(0, "r"), (0, "q")}),
        ("X X H p", [NONE], None, {(0, "p")}),
        ("G (r -> O[0:1] p)", [NONE, NONE, R], None, {(2, "r"), (1, "p"), (2, "p")}),
        ("G (r -> H[1:2] p)", [NONE, P, R], None, {(2, "r"), (0, "p")}),
        ("G (r -> p S[1:2] q)", [Q, NONE, P | R], None, {(2, "r"), (1, "p"), (1, "q")}),
        ("G (r -> p T q)", [Q, P, Q | R], None, {(2, "r"), (2, "p"), (1, "q")}),
        ("G (r -> !(p S q))", [Q, P, P | R], None, {(2, "r"), (2, "p"), (1, "p"), (0, "q")}),
        ("(p || q) && (!p || r)", [P], None, {(0, "p"), (0, "r")}),
        # Both positions of G fail at once.
        ("G ((p || X X q) && (r || X q))", [R, P, P | R], None, {(0, "p"), (1, "r"), (2, "q")}),
    ],
)
def test_marks_of_common_shapes(text: str, word: Word, loop: int | None, marked: set[tuple[int, str]]) -> None:
    reading = Reading(formula_of(text), word, loop)
    assert reading.fails
    assert causes(reading) == marked


def test_a_deadline_is_missed_at_each_letter_within_it() -> None:
    formula = apply("G", apply("implies", atom("p"), apply("F<=", atom("q"), bound="20")))
    word = [Q, P | {TICK}, frozenset({TICK}), NONE, frozenset({TICK})]
    reading = Reading(formula, word, None, Clock(Fraction(10)))
    assert reading.fails
    assert causes(reading) == {(1, "p"), (1, "q"), (2, "q"), (3, "q"), (4, "q")}
    assert not Reading(formula, word[:-1], None, Clock(Fraction(10))).fails


def test_until_in_time_ends_where_the_first_operand_does() -> None:
    formula = apply("U<=", atom("p"), atom("q"), bound="20")
    word = [P | {TICK}, NONE, P | Q]
    reading = Reading(formula, word, 2, Clock(Fraction(10)))
    assert causes(reading) == {(0, "q"), (1, "p"), (1, "q")}


def test_what_is_too_early_is_no_cause() -> None:
    formula = formula_of("G (p -> F[10ms:20ms] q)")
    word = [P | {TICK}, NONE, frozenset({TICK}), frozenset({TICK}), NONE]
    reading = Reading(formula, word, None, Clock(Fraction(10)))
    assert causes(reading) == {(0, "p"), (1, "q"), (2, "q"), (3, "q")}
    assert not Reading(formula, word[:3], None, Clock(Fraction(10))).fails
    assert not Reading(formula_of("F[20ms:30ms] q"), [P, NONE], None, Clock(Fraction(10))).fails


def test_many_marks_are_not_tried_out() -> None:
    reading = Reading(formula_of("G F q"), [NONE] * 40, 0)
    assert exact_causes(reading) == (frozenset((i, "q") for i in range(40)), False)


def test_what_no_operand_shows_is_not_claimed() -> None:
    # No continuation satisfies it, but nothing in it is false yet.
    assert not Reading(formula_of("X q && X !q"), [P], None).fails


@pytest.mark.parametrize(
    "text",
    [
        "G F O[0:9] p",
        "F G !O[1:9] p",
        "G (p -> q S[2:12] r)",
        "F G (p T[0:9] q)",
        "G O[<=90ms] (p && O[0:9] q)",
        "G F !(p S[20ms:90ms] H[0:4] q)",
    ],
)
@given(lassos(("p", "q", "r"), 4, 3), st.booleans())
@settings(max_examples=examples(20), deadline=None)
def test_of_long_bounds_of_the_past_no_cause_is_missed(text: str, word: tuple[Word, Word], prefix: bool) -> None:
    """As where the loop is unrolled for all of the bound; of a bad prefix they are the same."""
    formula, clock = formula_of(text), Clock(Fraction(10))
    run = [letter | {TICK} for letter in (*word[0], *word[1])]
    found = []
    for turns in (4096, 0):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("llfsm_verify.logic.lasso.ALL_TURNS", turns)
            reading = Reading(formula, run, None if prefix else len(word[0]), clock)
        found.append((reading.fails, causes(reading)))
    (fails, all_of_them), (still, these) = found
    assert fails is still
    assert all_of_them == these if prefix else all_of_them <= these

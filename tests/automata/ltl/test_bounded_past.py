"""Past operators with bounds: the definition letter by letter, evaluation on lassos, automata, and readers of prefixes.

The four share no code: the definition looks at each earlier letter, the evaluator at sums, and automata have counters.
"""

from __future__ import annotations

from collections import Counter
from fractions import Fraction
from itertools import combinations, product

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.ltl.history import Remembering
from llfsm_verify.automata.ltl.translation import (
    Untranslatable,
    automaton_of,
    is_safety_property,
    lazily,
    monitor_of,
    reader_of,
)
from llfsm_verify.automata.omega.emptiness import find_accepting_lasso
from llfsm_verify.automata.omega.moves import moves_of
from llfsm_verify.automata.omega.products import accepts
from llfsm_verify.diagnostics import Fragment, Source
from llfsm_verify.limits import Budget, LimitReached, Limits
from llfsm_verify.logic.bounds import TICK, Clock
from llfsm_verify.logic.formula import (
    BOOLEAN,
    BOUNDED_PAST,
    PAST,
    PAST_STEPS,
    Formula,
    Op,
    apply,
    atom,
    negation,
    operators,
    postorder,
)
from llfsm_verify.logic.lasso import evaluate, truth_of
from llfsm_verify.logic.parsing.formulas import parse_formula
from llfsm_verify.logic.word import CONNECTIVES
from llfsm_verify.testing.formulas import lassos
from tests.quick import FRESH, each, examples, spread

CLOCK = Clock(Fraction(10))
KEYS = ("p", "q")
ORDER = (*KEYS, TICK)
Word = tuple[list[frozenset[str]], list[frozenset[str]]]
STEPS = ["0:0", "0:1", "0:3", "1:1", "1:3", "2:2", "2:5", "3:4", "0:7"]
TIMES = ["0", "9", "10", "20", "25", "40", "10:10", "10:25", "20:30", "5:20", "0:", "5:", "20:", "11:19", "10:40"]
words = lassos(ORDER, 5, 4).filter(lambda word: any(TICK in letter for letter in word[1]))


def parsed(text: str) -> Formula:
    return parse_formula(Fragment.whole(Source("test", text))).formula


def bounded(op: Op, bound: str, *args: Formula) -> Formula:
    return apply(op, *args, bound=bound)


def backwards(ahead: bool = False, timed: bool = True, max_leaves: int = 4) -> st.SearchStrategy[Formula]:
    """Past operators with and without bounds in each other; `ahead`: also around and over those of the future;
    `timed`: also with bounds in time."""

    def larger(inner: st.SearchStrategy[Formula]) -> st.SearchStrategy[Formula]:
        steps, times = st.sampled_from(STEPS), st.sampled_from(TIMES)
        in_time = [
            st.builds(bounded, st.sampled_from(["O<=", "H<="]), times, inner),
            st.builds(bounded, st.sampled_from(["S<=", "T<="]), times, inner, inner),
        ]
        return st.one_of(
            st.builds(bounded, st.sampled_from(["O[]", "H[]"]), steps, inner),
            st.builds(bounded, st.sampled_from(["S[]", "T[]"]), steps, inner, inner),
            st.builds(apply, st.sampled_from(["Y", "Z", "O", "H", *(["X", "F", "G"] if ahead else [])]), inner),
            st.builds(apply, st.sampled_from(["S", "T", "and", "implies", "iff", *"UR"[: 2 * ahead]]), inner, inner),
            *(in_time if timed else []),
            *([st.builds(bounded, st.just("F<="), st.sampled_from(["0", "20"]), inner)] if ahead else []),
            inner.map(negation),
        )

    return st.recursive(st.sampled_from([atom("p"), atom("q")]), larger, max_leaves=max_leaves)


def defined(f: Formula, letters: list[frozenset[str]]) -> list[bool]:
    """The truth of a formula without operators of the future at each letter, from the words of the reference."""
    times = [10 * sum(TICK in letter for letter in letters[:i]) for i in range(len(letters))]
    truth: dict[Formula, list[bool]] = {}
    for node in postorder(f):
        truth[node] = [_now(node, [truth[a] for a in node.args], i, letters, times) for i in range(len(letters))]
    return truth[f]


def _now(node: Formula, args: list[list[bool]], i: int, letters: list[frozenset[str]], times: list[int]) -> bool:
    if node.op == "atom":
        return node.key in letters[i]
    if node.op in CONNECTIVES:
        return CONNECTIVES[node.op]([a[i] for a in args])
    if node.op in ("Y", "Z"):
        return args[0][i - 1] if i else node.op == "Z"
    low, _, high = node.key.rpartition(":")
    least, most = Fraction(low or 0), Fraction(high) if high else None

    def meant(j: int) -> bool:
        apart = i - j if node.op in PAST_STEPS else times[i] - times[j]
        return least <= apart and (most is None or apart <= most)

    earlier = [j for j in range(i + 1) if meant(j)]
    a, b = args[0], args[-1]
    match node.op[0]:
        case "O":
            return any(b[j] for j in earlier)
        case "H":
            return all(b[j] for j in earlier)
        case "S":
            return any(b[j] and all(a[j + 1 : i + 1]) for j in earlier)
    return all(b[j] or any(a[j + 1 : i + 1]) for j in earlier)


def true_on(f: Formula, stem: list[frozenset[str]], loop: list[frozenset[str]]) -> bool:
    return evaluate(f, stem, loop, CLOCK.delays((*stem, *loop)))


def mask(letter: frozenset[str]) -> int:
    return sum(1 << i for i, key in enumerate(ORDER) if key in letter)


def accepted(f: Formula, word: Word, *, negate: bool = False, lazy: bool = False) -> bool:
    """A run of the automaton of `f` accepts the word; `lazy`: of the one whose states are made on demand."""
    made = lazily(negation(f) if negate else f, ORDER, CLOCK) if lazy else reader_of(f, ORDER, CLOCK, negate=negate)
    assert made is not None
    moves = moves_of(made)
    stem, loop = word
    letters = [mask(letter) for letter in (*stem, *loop)]

    def successors(node: tuple[int, int]):  # type: ignore[no-untyped-def]
        at, state = node
        for acceptance, target in moves(state, letters[at]):
            yield None, acceptance, (at + 1 if at + 1 < len(letters) else len(stem), target)

    return not moves.is_empty and find_accepting_lasso([(0, 0)], successors, moves.acceptance_sets) is not None


@pytest.mark.slow
def test_evaluation_and_automata_by_the_definition() -> None:
    seen: Counter[str] = Counter()

    def check(f: Formula, word: Word) -> None:
        seen.update(operators(f) & BOUNDED_PAST)
        stem, loop = word
        delays = CLOCK.delays((*stem, *loop))
        both = [truth_of((f,), stem, loop, delays, sparing=sparing) for sparing in (False, True)]
        more = max(len(along.letters) for along, _ in both) + 3 * len(loop)
        right = defined(f, [*stem, *loop * more][:more])
        for along, truth in both:
            at = 0
            for value in right:
                assert truth[f][at] is value
                at = along.after(at)
        for op in ("F", "G"):
            around = apply(op, f)
            expected = true_on(around, stem, loop)
            assert expected is (any if op == "F" else all)(right)
            assert accepted(around, word) is expected
            assert accepted(around, word, negate=True) is not expected
            if operators(f) & BOUNDED_PAST:
                assert accepted(around, word, lazy=True) is expected
                assert accepted(around, word, negate=True, lazy=True) is not expected

    spread(
        check,
        settings(max_examples=10_000 if FRESH else 120, deadline=None),
        backwards(),
        words,
        until=each(seen, BOUNDED_PAST),
    )


@pytest.mark.slow
@given(backwards(ahead=True), words)
@settings(max_examples=examples(300), deadline=None)
def test_operands_of_the_future(f: Formula, word: Word) -> None:
    expected = true_on(f, *word)
    assert accepted(f, word) is expected
    assert accepted(f, word, negate=True) is not expected


@pytest.mark.parametrize("text", ["O[0:2] p", "H[1:2] p", "p S[1:2] q", "p T[0:1] q", "O[2:2] X p", "p S[0:1] X q"])
def test_each_operator_on_all_short_words(text: str) -> None:
    alphabet = [frozenset(x) for n in range(3) for x in combinations(KEYS, n)]
    for form in ("{}", "X ({})", "G ({})", "F G ({})"):
        f = parsed(form.format(text))
        automaton = automaton_of(f, KEYS)
        for a, b, c in product(alphabet, repeat=3):
            assert accepts(automaton, [a, b], [c]) is evaluate(f, [a, b], [c])


@pytest.mark.slow
@given(backwards(), words)
@settings(max_examples=examples(200), deadline=None)
def test_a_violated_invariant_has_a_bad_prefix_that_ends_there(f: Formula, word: Word) -> None:
    stem, loop = word
    always = apply("G", f)
    letters = [*stem, *loop * 8]
    bad = next((i for i, value in enumerate(defined(f, letters)) if not value), None)
    monitor = monitor_of(always, ORDER, CLOCK)
    state, read = monitor.initial(), 0
    while state is not None and read < len(letters):
        state = monitor.step(state, mask(letters[read]))
        read += 1
    assert is_safety_property(always, ORDER, CLOCK)
    if state is None:  # perhaps earlier: the rest could not be otherwise
        assert bad is None or read <= bad + 1
        assert not true_on(always, letters[:read], [frozenset({TICK})])
    else:
        assert bad is None


def test_near_the_beginning_only_letters_that_exist_count() -> None:
    assert true_on(parsed("!O[1:3] p && H[1:3] q && !(p S[1:3] q) && p T[1:3] q"), [], [frozenset({"p", "q", TICK})])
    assert true_on(parsed("!O[10ms:30ms] p && H[10ms:30ms] q"), [], [frozenset({"p", "q", TICK})])


def test_earlier_letters_of_the_same_time_count() -> None:
    word = [frozenset("p"), frozenset(), frozenset({TICK})], [frozenset({TICK})]
    assert true_on(parsed("X X O[<=0ms] p && X X X !O[<=9ms] p && X X X O[<=10ms] p"), *word)
    assert true_on(parsed("X X !O[10ms:10ms] p && X X X O[10ms:10ms] p && X X X X !O[10ms:10ms] p"), *word)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("O[0:1048576] p", False),
        ("p S[999:1000000] q", False),
        ("H[<=10000s] !p", True),
        ("H[0:1048576] q", True),
        ("O[<=10000s] q && O[500ms:10000s] q", True),
        ("q S[500ms:10000s] q", True),
        ("p T[0:1048576] p", False),
    ],
)
def test_a_long_bound_takes_few_turns_of_a_loop_that_shows_it_all(text: str, value: bool) -> None:
    f, loop = parsed(f"F G ({text})"), [frozenset({"q", TICK})]
    assert true_on(f, [], loop) is value
    for sparing in (True, False) if value else (True,):
        word, truth = truth_of((f,), [], loop, CLOCK.delays(loop), sparing=sparing)
        assert len(word.letters) < 1100 and truth[f][0] is value


def test_what_a_long_bound_shows_in_the_first_turn_needs_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    p, q = ([frozenset({key, TICK})] for key in KEYS)
    monkeypatch.setattr("llfsm_verify.logic.lasso.truth_of", lambda *_, **__: pytest.fail("it unrolls the loop"))
    assert not true_on(parsed("G H[0:1048576] !p"), p, q)
    assert true_on(parsed("F O[<=10000s] p"), p, q)
    monkeypatch.undo()
    assert true_on(parsed("G H[0:100] !p"), q, q) and not true_on(parsed("F O[<=10s] p"), q, q)


def test_the_time_limit_ends_an_evaluation(monkeypatch: pytest.MonkeyPatch) -> None:
    passed = iter(range(10**9))
    monkeypatch.setattr(Budget, "seconds", property(lambda _: next(passed)))
    p, q = ([frozenset({key, TICK})] for key in KEYS)
    for text in ("F G H[<=100s] !p", "F G O[100s:100s] q", "F G (q S[100s:100s] q)", "F G H[0:10000] !p"):
        assert true_on(parsed(text), p, q)
        with Budget(Limits(timeout=100.0)), pytest.raises(LimitReached, match="the time limit of 100 s was reached"):
            true_on(parsed(text), p, q)
        passed = iter(range(10**9))


@pytest.mark.slow
def test_long_bounds_are_counted_on_demand() -> None:
    f = parsed("G (p -> O[0:20000] q) && G (q -> H[<=10s] !p)")
    assert isinstance(reader_of(f, ORDER, CLOCK), Remembering)
    monitor = monitor_of(f, ORDER, CLOCK)
    for steps, good in ((20_000, True), (20_001, False)):
        state = monitor.initial()
        for letter in [{"q"}, *[set()] * (steps - 1), {"p"}]:
            assert state is not None
            state = monitor.step(state, mask(frozenset(letter)))
        assert (state is not None) is good
    assert is_safety_property(f, ORDER, CLOCK)


@pytest.mark.slow
def test_what_is_limited_and_what_is_refused() -> None:
    with pytest.raises(Untranslatable):
        automaton_of(parsed("O[<=10ms] p"), KEYS)
    with pytest.raises(AutomatonTooLarge):  # 2^20 patterns of q in the steps before
        automaton_of(parsed("G (p -> O[20:20] q)"), KEYS)
    assert len(automaton_of(parsed("G (p -> O[0:50] q)"), KEYS).edges) == 51
    assert operators(parsed("O[0:2] p")) - BOOLEAN <= PAST

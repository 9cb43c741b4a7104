"""Automata with counters for bounds in time against evaluation on timed lassos and against bounds written out."""

from fractions import Fraction
from itertools import combinations, product
from operator import ge

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.ltl.counting import Counting, CountingMonitor
from llfsm_verify.automata.ltl.translation import is_safety_property, monitor_of, reader_of
from llfsm_verify.automata.omega.emptiness import find_accepting_lasso
from llfsm_verify.automata.omega.moves import moves_of
from llfsm_verify.automata.safety import BadPrefix
from llfsm_verify.diagnostics import Fragment, Source
from llfsm_verify.logic.bounds import TICK, Clock, rebuilt, time_bound
from llfsm_verify.logic.formula import (
    FALSE,
    TIMED,
    TRUE,
    apply,
    atom,
    atoms,
    conjunction,
    disjunction,
    negation,
    operators,
    postorder,
)
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.parsing.formulas import parse_formula
from llfsm_verify.logic.syntaxes import parse_in
from llfsm_verify.testing.formulas import lassos
from tests.quick import examples

CLOCK = Clock(Fraction(10))
KEYS = ("p", "q")
ORDER = (*KEYS, TICK)
P, Q, PASSES = atom("p"), atom("q"), atom(TICK)


def parsed(text):
    return parse_formula(Fragment.whole(Source("test", text))).formula


def mask(letter):
    return sum(1 << i for i, key in enumerate(ORDER) if key in letter)


def accepted(automaton, stem, loop):
    """A run of an automaton of either form accepts the word."""
    moves = moves_of(automaton)
    word = [mask(letter) for letter in (*stem, *loop)]

    def successors(node):
        at, state = node
        for acceptance, target in moves(state, word[at]):
            yield None, acceptance, (at + 1 if at + 1 < len(word) else len(stem), target)

    return not moves.is_empty and find_accepting_lasso([(0, 0)], successors, moves.acceptance_sets) is not None


def true_on(f, stem, loop):
    return evaluate(f, stem, loop, CLOCK.delays((*stem, *loop)))


def agree(f, stem, loop):
    expected = true_on(f, stem, loop)
    assert accepted(reader_of(f, ORDER, CLOCK), stem, loop) == expected
    assert accepted(reader_of(f, ORDER, CLOCK, negate=True), stem, loop) != expected


BOUNDS = st.sampled_from(
    ["0", "9", "10", "20", "25", "30", "10:10", "10:25", "20:30", "5:20", "0:", "5:", "20:", "11:19", "10:40"]
)


def timed(max_leaves=4, plain=("X", "F", "G"), joining=("and", "or", "implies", "iff", "U", "W", "R", "M", "xor")):
    def larger(inner):
        return st.one_of(
            st.builds(lambda op, b, a: apply(op, a, bound=b), st.sampled_from(["F<=", "G<="]), BOUNDS, inner),
            st.builds(
                lambda op, b, a, c: apply(op, a, c, bound=b), st.sampled_from(["U<=", "R<="]), BOUNDS, inner, inner
            ),
            st.builds(apply, st.sampled_from(plain), inner),
            st.builds(apply, st.sampled_from(joining), inner, inner),
            inner.map(negation),
        )

    return st.recursive(st.sampled_from([P, Q]), larger, max_leaves=max_leaves)


words = lassos(ORDER, 4, 4).filter(lambda word: any(TICK in letter for letter in word[1]))


@pytest.mark.slow
@given(timed(), words)
@settings(max_examples=examples(200))
def test_words_against_evaluation(f, word):
    agree(f, *word)


@pytest.mark.parametrize(
    "text",
    ["G[<=10ms] X p", "F[<=10ms] X p", "(X p) U[<=10ms] X q", "!((X p) U[<=10ms] X q)", "G (p -> F[<=0ms] X q)"],
)
def test_operands_of_the_future_on_all_short_words(text):
    f = parsed(text)
    right, wrong = reader_of(f, ORDER, CLOCK), reader_of(f, ORDER, CLOCK, negate=True)
    alphabet = [frozenset(x) for n in range(4) for x in combinations(ORDER, n)]
    for a, b, c in product(alphabet, alphabet, [x for x in alphabet if TICK in x]):
        expected = true_on(f, [a, b], [c])
        assert accepted(right, [a, b], [c]) is expected
        assert accepted(wrong, [a, b], [c]) is not expected


@pytest.mark.slow
@given(timed(3, ("Y", "O", "H", "X"), ("S", "T", "and", "or", "U")), words)
@settings(max_examples=examples(100))
def test_with_the_past(f, word):
    agree(f, *word)


@pytest.mark.parametrize(
    "text", ["{p[*];q}[]->(X p)", "{p;q}<>->p", "!({p[*];q}[]->(X p))", "{p;q[*]}!", "!{p;q}", "G ({q}|=>p)"]
)
@given(words, BOUNDS, st.sampled_from(["F<=", "G<="]))
@settings(max_examples=examples(15))
def test_beside_expressions(text, word, bound, op):
    f = parse_in("spot", Fragment.whole(Source("t", text))).formula
    agree(apply(op, f, bound=bound), *word)
    if f.op in ("[]->", "<>->"):
        agree(apply(f.op, f.args[0], apply(op, f.args[1], bound=bound)), *word)
    agree(disjunction((f, apply("U<=", P, Q, bound=bound))), *word)


def written_out(f):
    """Bounds in time by the atom TICK: nested as deep as the bound has ticks."""
    done = {}
    for node in postorder(f):
        args = tuple(done[a] for a in node.args)
        if node.op not in TIMED:
            done[node] = negation(args[0]) if node.op == "not" else rebuilt(node, args)
            continue
        dual = node.op in ("G<=", "R<=")
        if dual:
            args = tuple(negation(a) for a in args)
        goal = args[-1]
        before, at_tick = [negation(PASSES), *args[:-1]], [PASSES, *args[:-1]]
        least, most = CLOCK.ticks(time_bound(node.key))
        if most is None:
            result = apply("U", TRUE if len(args) == 1 else args[0], goal)
        elif most < least:
            result = FALSE
        else:
            result = apply("U", conjunction(before), goal)
            for _ in range(most - least):
                later = conjunction((*at_tick, apply("X", result)))
                result = apply("U", conjunction(before), disjunction((goal, later)))
        for _ in range(least):
            result = apply("U", conjunction(before), conjunction((*at_tick, apply("X", result))))
        done[node] = negation(result) if dual else result
    return done[f]


@pytest.mark.slow
@given(timed(3), words)
@settings(max_examples=examples(150))
def test_writing_out_means_the_same(f, word):
    assert evaluate(written_out(f), *word) == true_on(f, *word)


def read(monitor, word):
    """The number of letters after which the prefix is bad; None: it is not."""
    state = monitor.initial()
    for i, letter in enumerate(word):
        if state is None:
            return i
        state = monitor.step(state, mask(letter))
    return len(word) if state is None else None


@pytest.mark.slow
@given(timed(3), st.lists(st.frozensets(st.sampled_from(ORDER)), max_size=8))
@settings(max_examples=examples(120))
def test_bad_prefixes_are_found_at_their_shortest(f, word):
    assume(operators(f) & TIMED)
    monitor = monitor_of(f, ORDER, CLOCK)
    assert isinstance(monitor, CountingMonitor) and monitor.exact
    forever = apply("G", apply("F", PASSES))
    assert read(monitor, word) == read(BadPrefix(conjunction((written_out(f), forever)), ORDER), word)


@pytest.mark.slow
@given(timed(3), words)
@settings(max_examples=examples(200))
def test_a_violated_safety_property_has_a_bad_prefix(f, word):
    stem, loop = word
    if is_safety_property(f, ORDER, CLOCK):
        bad = read(monitor_of(f, ORDER, CLOCK), [*stem, *loop * 40])
        assert (bad is None) == true_on(f, stem, loop)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("G (p -> F[<=30ms] q)", True),
        ("F[<=30ms] q", True),
        ("G (p -> (!q U[<=50ms] q))", True),
        ("G[<=20ms] (p -> F[<=30ms] G q)", True),
        ("G (O p -> F[<=30ms] Y q)", True),
        ("F p && F[<=30ms] q", False),
        ("G[<=20ms] F p", False),
    ],
)
def test_safety(text, expected):
    assert is_safety_property(parsed(text), ORDER, CLOCK) is expected


def states_after(f, letters, key_order=ORDER):
    """The states that a monitor of `f` makes while it reads `letters` again and again."""
    monitor = monitor_of(f, key_order, CLOCK)
    state = monitor.initial()
    seen = set()
    for letter in letters:
        seen.add(state)
        state = monitor.step(state, letter)
        assert state is not None
    return len(seen)


@pytest.mark.slow
def test_a_deadline_takes_a_state_for_each_tick_of_it():
    f = parsed("G (p -> F[<=50000ms] q)")  # 5,000 ticks
    pending = [mask({"p"})] + [mask({TICK})] * 5_000 + [mask({"q"})] + [0, mask({TICK})] * 10
    assert states_after(f, pending) == 5_002
    monitor = monitor_of(f, ORDER, CLOCK)
    assert read(monitor, [{"p"}] + [{TICK}] * 5_002) == 5_002


def test_deadlines_in_deadlines_are_no_products_of_copies():
    f = parsed("G (p -> F[<=300ms] (q && F[<=300ms] (p && G[<=200ms] !q)))")
    reader = reader_of(f, ORDER, CLOCK)
    assert isinstance(reader, Counting)
    assert len(reader.steps) <= 4
    assert len(reader.counters) == 3


def test_levels_that_demand_more_are_left_out():
    f = parsed("G (p -> F[<=50ms] q)")
    reader = reader_of(f, ORDER, CLOCK)
    # Choosing to start without need leads to the same state with more to do.
    assert len(reader(0, mask({TICK}))) == 1
    moves = reader(0, mask({"p"}))
    assert [reader.states[target][1] for _, target in moves] == [(1,)]


def test_subsets_keep_the_least_levels_only():
    """Waiting for one step or for two leads to the same state, with levels of which the lower simulate the others."""
    f = parsed("G (p -> (X F[<=50ms] q || X X F[<=50ms] q))")
    monitor = monitor_of(f, ORDER, CLOCK)
    state = monitor.initial()
    for letter in [{"p"}, {TICK}, set(), {TICK}, {"p"}, {TICK}, {"p", TICK}, {TICK}]:
        state = monitor.step(state, mask(letter))
    kept = [monitor._counting.states[number] for number in monitor._sets[state]]
    for q, levels in kept:
        assert not any(p == q and other != levels and all(map(ge, levels, other)) for p, other in kept)
    assert len({q for q, _ in kept}) == len(kept)


def test_too_many_states_are_refused(monkeypatch):
    monkeypatch.setattr("llfsm_verify.automata.ltl.counting.MAX_STATES", 10)
    monkeypatch.setattr("llfsm_verify.automata.ltl.counting.MAX_LOOKED", 0)
    monitor = monitor_of(parsed("G (p -> F[<=500ms] q)"), ORDER, CLOCK)
    with pytest.raises(AutomatonTooLarge, match="10 states"):
        read(monitor, [{"p"}] + [{TICK}] * 30)


def test_large_automata_find_bad_prefixes_late_but_all_of_them(monkeypatch):
    """`F[<=20ms] p` cannot be met where `p` never holds again: known at once, or when the time is over."""
    f = parsed("F[<=20ms] p && X G !p")
    word = [set(), {TICK}, {TICK}, {TICK}, set()]
    exact = monitor_of(f, ORDER, CLOCK)
    assert exact.exact and read(exact, word) == 1
    monkeypatch.setattr("llfsm_verify.automata.ltl.counting.MAX_LOOKED", 0)
    late = monitor_of(f, ORDER, CLOCK)
    assert not late.exact and read(late, word) == 4


def test_counters_need_the_tick():
    with pytest.raises(ValueError, match="time passes"):
        reader_of(parsed("F[<=20ms] p"), KEYS, CLOCK)


def test_an_unsatisfiable_demand_is_bad_from_the_start():
    assert monitor_of(parsed("F[<=30ms] p && G[<=40ms] !p"), ORDER, CLOCK).initial() is None
    assert monitor_of(parsed("F[<=40ms] p && G[<=30ms] !p"), ORDER, CLOCK).initial() is not None
    assert atoms(parsed("F[<=30ms] p")) == ("p",)

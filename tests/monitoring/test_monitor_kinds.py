"""Monitors of the past, of expressions, under assumptions and of regular properties: definition, minimality, tables."""

from fractions import Fraction
from itertools import product

import pytest
from hypothesis import given, reject, settings
from hypothesis import strategies as st

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.finite.monitor import EmptyWordForbidden, NoWord, RegularMonitor
from llfsm_verify.automata.ltl.translation import Untranslatable, automaton_of
from llfsm_verify.automata.ltl.translation import monitor_of as bad_prefixes
from llfsm_verify.automata.safety import BadPrefix
from llfsm_verify.diagnostics import DiagnosticError, Fragment, Source
from llfsm_verify.logic.bounds import TICK, Clock
from llfsm_verify.logic.formula import apply, atom, conjunction, disjunction, negation
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.properties import FEATURES, parse_properties
from llfsm_verify.logic.syntaxes import parse_in
from llfsm_verify.monitoring.json import monitor_table
from llfsm_verify.monitoring.monitor import Monitorability, MonitorVerdict, monitor
from llfsm_verify.monitoring.properties import monitor_properties
from llfsm_verify.monitoring.regular import regular_to_monitor
from llfsm_verify.testing.formulas import formulas
from tests.automata.finite.test_regular import REGULAR, SIMPLE, expressions
from tests.automata.ltl.test_psl import bound, past
from tests.outside import load
from tests.quick import examples

KEYS = ("p", "q")
LETTERS = [frozenset(), frozenset("p"), frozenset("q"), frozenset("pq")]
words = st.lists(st.sampled_from(LETTERS), max_size=3)
KINDS = st.sampled_from(["enforce", "forbid", "forbid initially"])


def prefix(word):
    """The formula of the words that begin so."""
    parts = []
    for i, letter in enumerate(word):
        now = conjunction(atom(k) if k in letter else negation(atom(k)) for k in KEYS)
        for _ in range(i):
            now = apply("X", now)
        parts.append(now)
    return conjunction(parts)


def has_word(*parts):
    return not automaton_of(conjunction(parts), KEYS).is_empty


def by_definition(f, word, given_):
    """The first verdict along the word, by emptiness of automata of formulas that fix the prefix."""
    for length in range(len(word) + 1):
        start = prefix(word[:length])
        if not has_word(start, given_, negation(f)):
            return MonitorVerdict.TRUE
        if not has_word(start, given_, f):
            return MonitorVerdict.FALSE
    return MonitorVerdict.NOT_YET


TRUE = negation(conjunction([atom("p"), negation(atom("p"))]))


@given(past(), words)
@settings(max_examples=examples(60))
def test_the_past_by_the_definition(f, word):
    assert monitor(f, KEYS).verdict(word) is by_definition(f, word, TRUE)


@pytest.mark.slow
@given(bound(2), st.sampled_from(["", "G", "F", "not"]), words)
@settings(max_examples=examples(50))
def test_expressions_by_the_definition(f, around, word):
    f = apply(around, f) if around else f
    try:
        m = monitor(f, KEYS)
    except AutomatonTooLarge:
        reject()
    assert m.verdict(word) is by_definition(f, word, TRUE)


@given(formulas(KEYS, max_leaves=4), formulas(KEYS, max_leaves=3), words)
@settings(max_examples=examples(80))
def test_assumptions_by_the_definition(f, given_, word):
    assert monitor(f, KEYS, given=given_).verdict(word) is by_definition(f, word, given_)


CLOCK = Clock(Fraction(1000))
TIMED_KEYS = (*KEYS, TICK)


def timed():
    """Formulas with bounds in time."""
    inner = formulas(KEYS, max_leaves=2)
    ms = st.sampled_from(["0", "1000", "2500", "1000:2000", "1500:2500", "1000:"])
    one = st.builds(lambda op, f, t: apply(op, f, bound=t), st.sampled_from(["F<=", "G<="]), inner, ms)
    two = st.builds(lambda op, f, g, t: apply(op, f, g, bound=t), st.sampled_from(["U<=", "R<="]), inner, inner, ms)
    bounded = st.one_of(one, two)
    around = st.sampled_from(["G", "F", "X", "O"])
    return st.one_of(
        bounded,
        st.builds(apply, around, bounded),
        st.builds(lambda f, g: apply("G", apply("implies", f, g)), inner, bounded),
    )


@pytest.mark.slow
@given(timed(), st.lists(st.integers(0, 7), max_size=6))
@settings(max_examples=examples(80))
def test_bounds_in_time_by_counters_made_lazily(f, word):
    m = monitor(f, TIMED_KEYS, clock=CLOCK)
    bad = bad_prefixes(f, TIMED_KEYS, CLOCK)
    good = bad_prefixes(negation(f), TIMED_KEYS, CLOCK)
    if not (getattr(bad, "exact", True) and getattr(good, "exact", True)):
        reject()
    here, wrong, right = 0, bad.initial(), good.initial()
    for letter in [None, *word]:
        if letter is not None:
            here = m.step(here, letter)
            wrong = None if wrong is None else bad.step(wrong, letter)
            right = None if right is None else good.step(right, letter)
        expected = (
            MonitorVerdict.FALSE if wrong is None else MonitorVerdict.TRUE if right is None else MonitorVerdict.NOT_YET
        )
        assert m.verdicts[here] is expected
        if expected is not MonitorVerdict.NOT_YET:
            return


@pytest.mark.slow
@given(timed(), st.lists(st.integers(0, 3), max_size=6))
@settings(max_examples=examples(60))
def test_time_that_passes_behind_every_letter(f, word):
    """The monitor without TICK goes where the one with it goes when it is always there."""
    ticking = monitor(f, TIMED_KEYS, clock=CLOCK, every_letter_ticks=True)
    plain = monitor(f, TIMED_KEYS, clock=CLOCK)
    assert not ticking.used >> 2
    here, there = 0, 0
    for letter in word:
        here, there = ticking.step(here, letter), plain.step(there, letter | 4)
        if plain.verdicts[there] is not MonitorVerdict.NOT_YET:
            assert ticking.verdicts[here] is plain.verdicts[there]


def test_deadlines():
    f = parse_in("llfsm", Fragment.whole(Source("test", "G (p -> F[<=2s] q)"))).formula
    m = monitor(f, clock=CLOCK, every_letter_ticks=True)
    p, q, none = {"p"}, {"q"}, set()
    assert m.verdict([p, none, q, p, none]) is MonitorVerdict.NOT_YET
    assert m.verdict([p, none, none]) is MonitorVerdict.FALSE
    m = monitor(f, clock=CLOCK)
    # Without a tick no time passes, however many letters there are.
    assert m.verdict([p, none, none, none, none]) is MonitorVerdict.NOT_YET
    assert m.verdict([{"p", TICK}, {TICK}, none, q]) is MonitorVerdict.NOT_YET
    assert m.verdict([{"p", TICK}, {TICK}, {TICK}]) is MonitorVerdict.FALSE


CONTINUATIONS = [
    (list(stem), list(loop))
    for n in range(2)
    for stem in product(LETTERS, repeat=n)
    for m in (1, 2)
    for loop in product(LETTERS, repeat=m)
]


@given(formulas(KEYS, max_leaves=6), words)
@settings(max_examples=examples(60))
def test_no_small_lasso_contradicts_a_verdict(f, word):
    """Brute force: after `true` all continuations satisfy, after `false` none does."""
    verdict = monitor(f, KEYS).verdict(word)
    found = {evaluate(f, [*word, *stem], loop) for stem, loop in CONTINUATIONS}
    if verdict is MonitorVerdict.TRUE:
        assert found == {True}
    elif verdict is MonitorVerdict.FALSE:
        assert found == {False}


def smallest_size(symbols, start, step, output):
    """The states of the smallest automaton with these outputs, minimised by automata-lib.

    An automaton with outputs becomes one that accepts: an output is a symbol that leads to acceptance.
    """
    numbers, queue, transitions = {start: 0}, [start], {}
    for state in queue:
        row = {}
        for symbol in symbols:
            following = step(state, symbol)
            if following not in numbers:
                numbers[following] = len(queue)
                queue.append(following)
            row[f"letter{symbol}"] = numbers[following]
        for verdict in MonitorVerdict:
            row[verdict.value] = "accepted" if output(state) is verdict else "lost"
        transitions[numbers[state]] = row
    names = [*(f"letter{s}" for s in symbols), *(v.value for v in MonitorVerdict)]
    lost = dict.fromkeys(names, "lost")
    automaton = load("automata-lib", "automata.fa.dfa").DFA(
        states={*transitions, "accepted", "lost"},
        input_symbols=set(names),
        transitions={**transitions, "accepted": lost, "lost": lost},
        initial_state=0,
        final_states={"accepted"},
    )
    return len(automaton.minify().states) - 2


@given(formulas(KEYS, max_leaves=7))
@settings(max_examples=examples(60))
def test_sizes_are_those_of_a_partition_refinement_by_automata_lib(f):
    """From the pairs of bad-prefix monitors of the formula and of its negation, which nothing has made smaller."""
    good, bad = BadPrefix(f, KEYS), BadPrefix(negation(f), KEYS)

    def step(pair, letter):
        if None in pair:
            return pair
        return good.step(pair[0], letter), bad.step(pair[1], letter)

    def output(pair):
        return (
            MonitorVerdict.FALSE
            if pair[0] is None
            else MonitorVerdict.TRUE
            if pair[1] is None
            else MonitorVerdict.NOT_YET
        )

    start = (good.initial(), bad.initial())
    assert len(monitor(f, KEYS).verdicts) == smallest_size(range(4), start, step, output)


def regular(kind, f, keys=KEYS):
    """The monitor and the reader of words that checks it; None when the property is void."""
    try:
        reader = RegularMonitor(kind, f, keys)
    except (NoWord, EmptyWordForbidden) as reason:
        with pytest.raises(type(reason)):
            regular_to_monitor(kind, f, keys)
        return None
    return regular_to_monitor(kind, f, keys), reader


def endangered(reader, state, letters):
    """Whether a bad prefix can still come."""
    queue, seen = [state], {state}
    for now in queue:
        for letter in letters:
            following = reader.step(now, letter)
            if following is None:
                return True
            if following not in seen:
                seen.add(following)
                queue.append(following)
    return False


def verdict_of(reader, state, letters):
    if state is None:
        return MonitorVerdict.FALSE
    return MonitorVerdict.NOT_YET if endangered(reader, state, letters) else MonitorVerdict.TRUE


@given(KINDS, expressions(REGULAR, SIMPLE, 6), st.lists(st.integers(0, 3), max_size=6))
@settings(max_examples=examples(150))
def test_regular_monitors_follow_the_words_read_one_by_one(kind, f, word):
    pair = regular(kind, f)
    if pair is None:
        return
    m, reader = pair
    state, here = 0, 0
    for letter in word:
        state = None if state is None else reader.step(state, letter)
        here = m.step(here, letter)
        assert sum(e.allows(letter) for e in m.edges[here]) >= 1
        assert len({e.target for e in m.edges[here] if e.allows(letter)}) == 1
        assert m.verdicts[here] is verdict_of(reader, state, range(4))


@given(KINDS, expressions(REGULAR, SIMPLE, 6))
@settings(max_examples=examples(60))
def test_regular_monitors_are_as_small_as_automata_lib_makes_them(kind, f):
    pair = regular(kind, f)
    if pair is None:
        return
    m, reader = pair
    known = {}

    def output(state):
        if state not in known:
            known[state] = verdict_of(reader, state, range(4))
        return known[state]

    def step(state, letter):
        # States that are safe forever count as one, as the verdict ends the reading.
        following = None if state is None else reader.step(state, letter)
        return state if state is None or output(state) is MonitorVerdict.TRUE else following

    assert len(m.verdicts) == smallest_size(range(4), 0, step, output)


def lines_of(text):
    return parse_properties([Source("test", text)], features=FEATURES)


def found(text):
    lines = lines_of(text)
    return monitor_properties(lines.goals[0], lines.assumptions).monitor


def test_a_machine_is_in_one_state_at_a_time():
    m = found("enforce order: (ew@RED ew@GREEN ew@AMBER)*")
    red, green, amber = ({f"ew@{c}"} for c in ("RED", "GREEN", "AMBER"))
    assert m.verdict([red, red, green, amber, amber, red]) is MonitorVerdict.NOT_YET
    assert m.verdict([red, amber]) is MonitorVerdict.FALSE
    assert m.verdict([green]) is MonitorVerdict.FALSE
    assert len(m.verdicts) == 5
    # The letters of an edge need not rule out what cannot be.
    assert all((e.positive | e.negative).bit_count() <= 2 for row in m.edges for e in row)


@pytest.mark.parametrize("line", ["forbid l: p q", "enforce l: (p q)*", "l: G (p -> X q)"])
def test_nothing_is_left_to_happen_under_assumptions_that_contradict_each_other(line):
    assert found(f"assume always: G p\nassume never: F !p\n{line}").verdicts == (MonitorVerdict.TRUE,)


@pytest.mark.slow
def test_valuations_are_not_enumerated():
    keys = [f"p{i}" for i in range(40)]
    m = regular_to_monitor("enforce", apply("repeat", disjunction(map(atom, keys)), bound="0:"), keys)
    assert len(m.verdicts) == 2
    many = [f"m@S{i}" for i in range(40)]
    order = apply("repeat", apply("seq", *map(atom, many)), bound="0:")
    assert len(regular_to_monitor("enforce", order, many).verdicts) == 42


def test_blow_ups_are_stopped():
    order = apply("repeat", apply("seq", *map(atom, ["m@A", "m@B", "m@C"])), bound="0:")
    with pytest.raises(AutomatonTooLarge, match="3 states"):
        regular_to_monitor("enforce", order, ["m@A", "m@B", "m@C"], max_states=3)
    with pytest.raises(AutomatonTooLarge, match="4 transitions"):
        regular_to_monitor("enforce", order, ["m@A", "m@B", "m@C"], max_edges=4)


def test_bounds_in_time_need_a_clock():
    f = parse_in("llfsm", Fragment.whole(Source("test", "F[<=2s] p"))).formula
    with pytest.raises(Untranslatable, match="bound in time"):
        monitor(f)


@pytest.mark.parametrize(
    ("text", "word", "verdict", "monitorability"),
    [
        # A fair environment: the violation counts although it could be followed by an unfair end.
        ("assume a: G F p\ng: G !q", [{"q"}], MonitorVerdict.FALSE, Monitorability.ALWAYS),
        ("assume a: G p\ng: G !q", [{"p"}, set()], MonitorVerdict.TRUE, Monitorability.ALWAYS),
        ("assume a: G p\ng: G !q", [{"p", "q"}, set()], MonitorVerdict.FALSE, Monitorability.ALWAYS),
        ("assume a: G (p -> X q)\nenforce g: (p q)*", [{"p"}, {"q"}], MonitorVerdict.NOT_YET, Monitorability.ALWAYS),
        ("assume a: G p\nforbid g: q", [{"p", "q"}], MonitorVerdict.FALSE, Monitorability.ALWAYS),
        ("assume a: F G p\ng: G F p", [], MonitorVerdict.TRUE, Monitorability.ALWAYS),
        ("assume a: G F p\nforbid g: q r", [{"q"}, {"r"}], MonitorVerdict.FALSE, Monitorability.ALWAYS),
        ("g: G F p", [{"p"}], MonitorVerdict.NOT_YET, Monitorability.NEVER),
    ],
)
def test_examples(text, word, verdict, monitorability):
    m = found(text)
    assert m.verdict(word) is verdict
    assert m.monitorability is monitorability


def hoa(tmp_path, text):
    (tmp_path / "a.hoa").write_text(text)
    return str(tmp_path / "a.hoa")


SAFE = """HOA: v1
States: 1
Start: 0
AP: 1 "p"
Acceptance: 0 t
--BODY--
State: 0
[0] 0
--END--
"""
GUESSING = """HOA: v1
States: 2
Start: 0
AP: 1 "p"
Acceptance: 1 Inf(0)
--BODY--
State: 0
[t] 0
[0] 1
State: 1 {0}
[0] 1
--END--
"""


def test_automata_from_files(tmp_path):
    path = hoa(tmp_path, SAFE)
    m = found(f"automaton g: {path}")
    assert m.verdict([{"p"}]) is MonitorVerdict.NOT_YET and m.verdict([{"p"}, set()]) is MonitorVerdict.FALSE
    m = found(f"automaton never g: {path}")
    assert m.verdict([{"p"}]) is MonitorVerdict.NOT_YET and m.verdict([{"p"}, set()]) is MonitorVerdict.TRUE
    m = found(f"assume a: G F p\nautomaton g: {path}")
    assert m.verdict([set()]) is MonitorVerdict.FALSE
    path = hoa(tmp_path, GUESSING)
    with pytest.raises(DiagnosticError, match="E364"):
        found(f"automaton never g: {path}")


@given(st.one_of(formulas(KEYS, max_leaves=7), past()))
@settings(max_examples=examples(80))
def test_tables(f):
    m = monitor(f, ("z", *KEYS))
    table = monitor_table(m)
    bits = [m.atoms.index(key) for key in table.atoms]
    for letter in range(8):
        narrow = sum(1 << i for i, bit in enumerate(bits) if letter >> bit & 1)
        inside = [
            c for c, cubes in enumerate(table.classes) if any(p & ~narrow == 0 and n & narrow == 0 for p, n in cubes)
        ]
        assert len(inside) == 1
        for q, row in enumerate(table.rows):
            assert row[inside[0]] == m.step(q, letter)
    columns = list(zip(*table.rows, strict=True))
    assert len(set(columns)) == len(columns)

"""Finite automata of regular expressions against the definition, automata-lib and pyformlang; regular monitors."""

from itertools import pairwise, product

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.boolean import Guards
from llfsm_verify.automata.finite.expressions import (
    DeterministicAutomaton,
    _first_and_rest,
    explore_subsets,
    minimise,
    nondeterministic,
)
from llfsm_verify.automata.finite.monitor import EmptyWordForbidden, NoWord, RegularMonitor, allowed_words
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.bounds import repeat
from llfsm_verify.logic.expressions import derivative, has_word, letters, nullable
from llfsm_verify.logic.formula import FALSE, TRUE, apply, atom, atoms, negation, repetition
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.properties import FEATURES, parse_properties
from llfsm_verify.logic.regular_evaluate import is_bad, is_violated
from tests.oracle.regular import RegularReference, Void
from tests.outside import demand, load
from tests.quick import examples

P, Q = atom("p"), atom("q")
KEYS = ("p", "q")
LETTERS = [frozenset(), frozenset("p"), frozenset("q"), frozenset("pq")]


def determinise(automaton, max_states=20_000):
    """The same language by the subset construction."""

    def following(states):
        leaving = [edge for q in sorted(states) for edge in automaton.edges[q]]
        for part, inside in automaton.guards.partition(guard for guard, _ in leaving).items():
            if targets := frozenset(target for guard, target in leaving if guard in inside):
                yield part, targets

    subsets, edges = explore_subsets(frozenset((0,)), following, max_states)
    accepting = tuple(any(automaton.accepting[q] for q in states) for states in subsets)
    return DeterministicAutomaton(automaton.guards, edges, accepting)


def matches(f, word):
    """The table of the definition (Spot's temporal logic formulas, 2.5.1), by trying all ways to cut the word."""
    n = len(word)
    match f.op:
        case "empty":
            return n == 0
        case "seq":
            head, *tail = f.args
            rest = tail[0] if len(tail) == 1 else apply("seq", *tail)
            return any(matches(head, word[:k]) and matches(rest, word[k:]) for k in range(n + 1))
        case "fuse":
            *init, last = f.args
            first = init[0] if len(init) == 1 else apply("fuse", *init)
            return any(matches(first, word[: k + 1]) and matches(last, word[k:]) for k in range(n))
        case "alt":
            return any(matches(a, word) for a in f.args)
        case "inter":
            return all(matches(a, word) for a in f.args)
        case "nlm":
            longest = [[k for k in range(n + 1) if matches(a, word[:k])] for a in f.args]
            return all(longest) and any(row[-1] == n for row in longest)
        case "repeat":
            low, high = repetition(f)
            if low == 0 and n == 0:
                return True
            if high == 0:
                return n == 0
            body, rest = f.args[0], repeat(f.args[0], max(0, low - 1), None if high is None else high - 1)
            if low > 0 and n == 0:
                return matches(body, word) and (high == 1 or matches(rest, word))
            # An empty turn helps only to count.
            if low > 0 and matches(body, []) and matches(rest, word):
                return True
            return any(matches(body, word[:k]) and matches(rest, word[k:]) for k in range(1, n + 1))
        case "first_match":
            return matches(f.args[0], word) and not any(matches(f.args[0], word[:k]) for k in range(n))
    return n == 1 and evaluate(f, (), (word[0],))


BOOLEANS = [P, Q, negation(P), apply("and", P, Q), apply("or", P, Q), TRUE, FALSE]


def expressions(ops=("seq", "alt", "inter", "nlm", "fuse", "first_match", "repeat"), leaves=BOOLEANS, max_leaves=5):
    def larger(inner):
        def build(op):
            if op == "repeat":
                bounds = st.sampled_from([(0, None), (1, None), (0, 1), (2, 2), (1, 3), (2, None)])
                return st.tuples(inner, bounds).map(lambda x: repeat(x[0], *x[1]))
            if op == "first_match":
                return inner.map(lambda a: apply("first_match", a))
            return st.lists(inner, min_size=2, max_size=3).map(lambda args: apply(op, *args))

        return st.sampled_from(ops).flatmap(build)

    return st.recursive(st.sampled_from([*leaves, apply("empty")]), larger, max_leaves=max_leaves)


words = st.lists(st.sampled_from(LETTERS), max_size=5)


def mask(letter):
    return sum(1 << i for i, key in enumerate(KEYS) if key in letter)


def runs(automaton, word):
    """Whether a nondeterministic automaton accepts."""
    states = {0}
    for letter in word:
        states = {t for q in states for g, t in automaton.edges[q] if automaton.guards.holds(g, mask(letter))}
    return any(automaton.accepting[q] for q in states)


def steps(automaton, word):
    state = 0
    for letter in word:
        state = automaton.step(state, mask(letter))
        if state is None:
            return False
    return automaton.accepting[state]


def derived(f, word):
    for letter in word:
        f = derivative(f, lambda g, letter=letter: evaluate(g, (), (letter,)))
    return nullable(f)


@pytest.mark.slow
@given(expressions(), words)
@settings(max_examples=examples(400))
def test_derivatives_and_automata_follow_the_definition(f, word):
    expected = matches(f, word)
    assert derived(f, word) == expected
    automaton = nondeterministic(f, Guards(KEYS))
    assert runs(automaton, word) == expected
    deterministic = determinise(automaton)
    assert steps(deterministic, word) == expected
    assert steps(minimise(deterministic), word) == expected


def test_states_that_lead_to_the_same_set_by_different_letters():
    f = apply("alt", apply("seq", P, P, Q), apply("seq", Q, negation(P), Q))
    deterministic = determinise(nondeterministic(f, Guards(KEYS)))
    for word in product(LETTERS, repeat=3):
        assert steps(deterministic, word) == matches(f, word)


@given(expressions())
@settings(max_examples=examples(150))
def test_emptiness(f):
    smallest = minimise(determinise(nondeterministic(f, Guards(KEYS))))
    assert has_word(f, {}) == (smallest.accepting != (False,))


def test_minimal_sizes_and_guards_that_partition_the_letters():
    f = apply("seq", repeat(TRUE, 0, None), P, repeat(TRUE, 3, 3))
    guards = Guards(KEYS)
    smallest = minimise(determinise(nondeterministic(f, guards)))
    assert len(smallest.edges) == 16  # it remembers the last four letters
    for row in smallest.edges:
        for i, (guard, _) in enumerate(row):
            assert guard and not any(guard & other for other, _ in row[:i])


def test_long_expressions_are_stopped(monkeypatch):
    long = apply("seq", *[P] * 12_000)
    monkeypatch.setattr("llfsm_verify.automata.finite.expressions.MAX_EFFORT", 100_000)
    with pytest.raises(AutomatonTooLarge, match="operands"):
        nondeterministic(long, Guards(KEYS))
    assert len(nondeterministic(apply("seq", *[P] * 300), Guards(KEYS)).edges) == 301


def test_blow_up_is_stopped():
    f = apply("seq", repeat(TRUE, 0, None), P, repeat(TRUE, 30, 30))
    automaton = nondeterministic(f, Guards(KEYS))
    assert len(automaton.edges) == 32
    with pytest.raises(AutomatonTooLarge, match="more than 500 states"):
        determinise(automaton, max_states=500)
    # Forty letters leave one state: no state's letters are told apart all at once.
    keys = [f"p{i}" for i in range(40)]
    chain = apply("seq", *map(atom, keys))
    assert len(minimise(determinise(nondeterministic(chain, Guards(keys)))).edges) == 41


# ---------------------------------------------------------------- other libraries

PLAIN = [P, Q]  # disjoint letters: as characters, of which exactly one holds


def to_regex(f):
    match f.op:
        case "atom":
            return f.key
        case "seq":
            return "(" + "".join(map(to_regex, f.args)) + ")"
        case "alt":
            return "(" + "|".join(map(to_regex, f.args)) + ")"
        case "inter":
            return "(" + "&".join(map(to_regex, f.args)) + ")"
        case "repeat":
            low, high = repetition(f)
            return f"({to_regex(f.args[0])}){{{low},{'' if high is None else high}}}"
        case "empty":
            return "()"
    raise AssertionError(f.op)


def single_letters(automaton):
    """The words over single letters `p`, `q`: the size of the minimal complete automaton, and the acceptance."""
    return lambda text: steps(automaton, [frozenset(c) for c in text])


@given(expressions(("seq", "alt", "repeat", "inter"), PLAIN))
@settings(max_examples=examples(120), deadline=None)
def test_automata_lib_agrees(f):
    lib = load("automata-lib", "automata.fa.nfa")
    theirs = lib.NFA.from_regex(to_regex(f), input_symbols={"p", "q"})
    ours = single_letters(minimise(determinise(nondeterministic(f, Guards(KEYS)))))
    for n in range(6):
        for text in map("".join, product("pq", repeat=n)):
            assert theirs.accepts_input(text) == ours(text), (to_regex(f), text)


def to_formlang(f):
    match f.op:
        case "atom":
            return f.key
        case "seq":
            return "(" + " ".join(map(to_formlang, f.args)) + ")"
        case "alt":
            return "(" + "|".join(map(to_formlang, f.args)) + ")"
        case "repeat":
            low, high = repetition(f)
            inner = to_formlang(f.args[0])
            copies = [inner] * low + ([f"({inner}*)"] if high is None else [f"({inner}|$)"] * (high - low))
            return "(" + " ".join(copies or ["$"]) + ")"
        case "empty":
            return "$"
    raise AssertionError(f.op)


@given(expressions(("seq", "alt", "repeat"), PLAIN))
@settings(max_examples=examples(60), deadline=None)
def test_pyformlang_agrees_on_words_and_on_the_minimal_size(f):
    formlang = load("pyformlang", "pyformlang.regular_expression")
    theirs = formlang.Regex(to_formlang(f)).to_epsilon_nfa().to_deterministic().minimize()
    smallest = minimise(determinise(nondeterministic(f, Guards(KEYS))))
    ours = single_letters(smallest)
    for n in range(5):
        for text in product("pq", repeat=n):
            assert theirs.accepts(list(text)) == ours("".join(text))


# ---------------------------------------------------------------- regular properties


def monitored(kind, f, word, keys=KEYS):
    """The number of letters after which the monitor says that the prefix is bad; None: never."""
    monitor = RegularMonitor(kind, f, keys)
    state = monitor.initial()
    for i, letter in enumerate(word):
        state = monitor.step(state, sum(1 << k for k, key in enumerate(keys) if key in letter))
        if state is None:
            return i + 1
    return None


def by_definition(kind, f, word):
    return next((n for n in range(1, len(word) + 1) if is_bad(kind, f, word[:n])), None)


REGULAR = ("seq", "alt", "repeat")
SIMPLE = [P, Q, apply("and", P, Q), apply("or", P, negation(Q)), TRUE]


@pytest.mark.slow
@given(st.sampled_from(["enforce", "forbid", "forbid initially"]), expressions(REGULAR, SIMPLE, 6), words)
@settings(max_examples=examples(600), deadline=None)
def test_monitors_follow_the_definition(kind, f, word):
    try:
        found = monitored(kind, f, word)
    except EmptyWordForbidden:
        assert kind != "enforce" and nullable(f)
    except NoWord:
        assert is_bad("enforce", f, [])
    else:
        assert not is_bad("enforce", f, [])
        assert found == by_definition(kind, f, word)


KINDS = st.sampled_from(["enforce", "forbid", "forbid initially"])
LITTLE = [P, Q, apply("and", P, Q), negation(P), FALSE, atom("m@A"), atom("m@B")]
THREE = ("p", "m@A", "m@B")


@pytest.mark.slow
@given(KINDS, expressions(REGULAR, [x for x in LITTLE if "q" not in atoms(x)], 5), st.data())
@settings(max_examples=examples(150), deadline=None)
def test_monitors_follow_automata_lib(kind, f, data):
    """The words of the property, those without equal neighbours, as automata-lib makes them of its own parts."""
    demand("automata-lib")
    try:
        theirs = RegularReference(kind, f)
    except Void:
        with pytest.raises((NoWord, EmptyWordForbidden)):
            RegularMonitor(kind, f, THREE)
        return
    letter = st.sampled_from([frozenset(x) for x in ((), ("p",), ("m@A",), ("m@B",), ("p", "m@A"), ("p", "m@B"))])
    for word in data.draw(st.lists(st.lists(letter, max_size=6), min_size=4, max_size=4)):
        bad = [n for n in range(1, len(word) + 1) if theirs.is_bad(word[:n])]
        assert monitored(kind, f, word, THREE) == (bad[0] if bad else None)
        assert bad == list(range(bad[0], len(word) + 1)) if bad else True


@given(expressions(REGULAR, [P, Q, TRUE], 5))
@settings(max_examples=examples(60), deadline=None)
def test_the_words_of_a_property_are_those_of_pyformlang(f):
    """All words of up to four valuations: what `enforce` allows begins a word of the intersection they compute."""
    formlang = load("pyformlang", "pyformlang.regular_expression")
    finite = load("pyformlang", "pyformlang.finite_automaton")
    alphabet = letters(f)
    shown = {frozenset(g for g in alphabet if evaluate(g, (), (x,))): x for x in LETTERS}
    symbols = {valuation: f"v{i}" for i, valuation in enumerate(shown)}

    def text(node):
        match node.op:
            case "seq":
                return "(" + " ".join(map(text, node.args)) + ")"
            case "alt":
                return "(" + "|".join(map(text, node.args)) + ")"
            case "repeat":
                low, high = repetition(node)
                inner = text(node.args[0])
                more = [f"({inner}*)"] if high is None else [f"({inner}|$)"] * (high - low)
                return "(" + " ".join([inner] * low + more or ["$"]) + ")"
            case "empty":
                return "$"
        return "(" + "|".join(s for v, s in symbols.items() if node in v) + ")"

    apart = finite.DeterministicFiniteAutomaton()
    apart.add_start_state(finite.State("start"))
    for state in ("start", *symbols.values()):
        apart.add_final_state(finite.State(state))
        for s in symbols.values():
            if s != state:
                apart.add_transition(finite.State(state), finite.Symbol(s), finite.State(s))
    words_of_property = formlang.Regex(text(f)).to_epsilon_nfa().to_deterministic().get_intersection(apart)
    if words_of_property.is_empty():
        with pytest.raises(NoWord):
            RegularMonitor("enforce", f, KEYS)
        return
    longest = words_of_property.to_deterministic().minimize()
    live = {s for s in longest.states if not from_state(finite, longest, s).is_empty()}
    for n in range(4):
        for word in product(shown, repeat=n):
            if all(a != b for a, b in pairwise(word)):
                state = longest.start_state
                for v in word:
                    state = next(iter(longest(state, finite.Symbol(symbols[v]))), None) if state is not None else None
                allowed = state in live
                assert (monitored("enforce", f, [shown[v] for v in word]) is None) == allowed


def from_state(finite, automaton, state):
    """The same automaton begun elsewhere."""
    copy = finite.DeterministicFiniteAutomaton()
    copy.add_start_state(state)
    for s in automaton.final_states:
        copy.add_final_state(s)
    for source, symbol, target in automaton:
        copy.add_transition(source, symbol, target)
    return copy


@pytest.mark.slow
@given(
    expressions(REGULAR, [atom("m@A"), atom("m@B"), P], 5),
    st.lists(st.sampled_from(["A", "B", "pA", "p", ""]), max_size=5),
)
@settings(max_examples=examples(300), deadline=None)
def test_a_machine_is_in_one_state_at_a_time(f, texts):
    word = [frozenset([f"m@{c}" if c in "AB" else c for c in text]) for text in texts]
    try:
        found = monitored("enforce", f, word, ("m@A", "m@B", "p"))
    except NoWord:
        assert is_bad("enforce", f, [])
    else:
        assert found == by_definition("enforce", f, word)


@pytest.mark.slow
@given(KINDS, expressions(REGULAR, SIMPLE, 6), words, words.filter(bool))
@settings(max_examples=examples(300), deadline=None)
def test_runs_that_go_on_for_ever(kind, f, stem, loop):
    """A run is violated when one of its beginnings is bad; so far as twelve turns show it."""
    if kind != "enforce" and nullable(f):
        return
    assert is_violated(kind, f, stem, loop) == is_bad(kind, f, [*stem, *loop * 12])


def regular(text):
    (found,) = parse_properties([Source("t", text)], features=FEATURES)
    return found.kind, found.expression


@pytest.mark.parametrize(
    ("text", "word", "bad"),
    [
        ("enforce x: p*", [{"p"}, {"p"}, set()], 3),  # enforce f* is G f
        ("enforce x: [p || q]*", [{"p"}, {"q"}, {"p", "q"}], None),
        ("forbid x: p", [set(), {"q"}, {"p"}], 3),  # forbid f is G !f
        ("forbid initially x: p q", [{"p"}, {"p"}, {"q"}], 3),
        ("forbid initially x: p q", [set(), {"p"}, {"q"}], None),
        ("forbid x: p q", [set(), {"p"}, {"p"}, {"q"}], 4),
        ("enforce x: (m@A m@B)*", [{"m@A"}, {"m@A"}, {"m@B"}, {"m@A"}], None),
        ("enforce x: (m@A m@B)*", [{"m@B"}], 1),
        ("enforce x: (m@A m@B)*", [{"m@A"}, set()], 2),
        ("enforce x: p p q", [{"p"}, {"p"}, {"p", "q"}], None),  # a change of q lets p stand twice
        ("enforce x: p q true", [{"p"}, {"q"}, set(), {"p"}], 4),  # the words have an end
        ("forbid x: true true", [{"p"}], None),
        # A letter that is repeated no times still tells configurations apart.
        ("forbid x: p q{0} p", [{"p"}, {"p", "q"}], 2),
        ("forbid x: p q{0,1} p", [{"p"}, {"p", "q"}], 2),
        ("forbid initially x: p (q q){0} p", [{"p"}, {"p", "q"}], 2),
        ("enforce x: p q{0} p", [{"p", "q"}, {"p"}, {"p"}], None),
        ("enforce x: p q{0} p", [{"p", "q"}, {"p"}, {"p", "q"}], 3),
    ],
)
def test_examples(text, word, bad):
    kind, f = regular(text)
    keys = ("m@A", "m@B", "p", "q")
    if text.endswith("true true"):
        # One letter that always holds has no two different neighbours.
        with pytest.raises(NoWord):
            RegularMonitor(kind, f, keys)
        return
    assert monitored(kind, f, word, keys) == bad
    assert by_definition(kind, f, word) == bad
    assert allowed(kind, f, word, keys) == bad


@pytest.mark.parametrize("kind", ["enforce", "forbid", "forbid initially"])
@given(st.lists(st.sampled_from(LETTERS), max_size=6))
@settings(max_examples=examples(60), deadline=None)
def test_letters_under_no_repetition_agree_with_automata_lib(kind, word):
    f = regular("enforce x: p q{0} p")[1]
    reference = RegularReference(kind, f)
    bad = next((i for i in range(1, len(word) + 1) if reference.is_bad(word[:i])), None)
    assert monitored(kind, f, word) == by_definition(kind, f, word) == allowed(kind, f, word, KEYS) == bad


def test_traffic_lights():
    kind, f = regular("enforce ew_order: (ew@RED ew@GREEN ew@AMBER)*")
    red, green, amber = ({f"ew@{c}"} for c in ("RED", "GREEN", "AMBER"))
    keys = ("ew@RED", "ew@GREEN", "ew@AMBER")
    assert monitored(kind, f, [red, red, green, amber, amber, red, green], keys) is None
    assert monitored(kind, f, [red, green, red], keys) == 3
    assert monitored(kind, f, [green], keys) == 1
    monitor = RegularMonitor(kind, f, keys)
    assert monitor.initial() == 0
    state = monitor.step(0, 1)
    assert monitor.step(state, 1) == state  # an equal neighbour changes nothing


def allowed(kind, f, word, keys):
    """As `monitor_properties`, by the smallest deterministic automaton and leaving out equal neighbours."""
    guards = Guards(keys)
    automaton = allowed_words(kind, f, guards)
    alphabet = [guards.of(g) for g in letters(f)]
    state, before = 0, None
    for i, letter in enumerate(word):
        code = sum(1 << k for k, key in enumerate(keys) if key in letter)
        valuation = [guards.holds(g, code) for g in alphabet]
        if valuation != before:
            state, before = automaton.step(state, code), valuation
        if state is None:
            return i + 1
    return None


@pytest.mark.slow
@given(st.sampled_from(["enforce", "forbid", "forbid initially"]), expressions(REGULAR, SIMPLE, 6), words)
@settings(max_examples=examples(300), deadline=None)
def test_smallest_automata_of_allowed_words_agree_with_monitors(kind, f, word):
    try:
        expected = monitored(kind, f, word)
    except (EmptyWordForbidden, NoWord) as reason:
        with pytest.raises(type(reason)):
            allowed_words(kind, f, Guards(KEYS))
    else:
        assert allowed(kind, f, word, KEYS) == expected


@pytest.mark.slow
def test_the_size_is_that_of_the_order_however_many_letters_there_are():
    colours = ["RED", "GREEN", "AMBER"]
    keys = [f"ew@{c}" for c in colours]
    f = repeat(apply("seq", *map(atom, keys)), 0, None)
    assert len(allowed_words("enforce", f, Guards(keys)).edges) == 3
    many = [f"m@S{i}" for i in range(60)]
    f = repeat(apply("seq", *map(atom, many)), 0, None)
    assert len(allowed_words("enforce", f, Guards(many)).edges) == 60
    assert len(allowed_words("forbid", apply("seq", atom("m@S3"), atom("m@S1")), Guards(many)).edges) == 2


@pytest.mark.parametrize("op", ["fuse", "inter", "nlm"])
def test_operators_of_several_operands_are_taken_apart_from_the_left(op):
    a, b, c = (apply("seq", P, letter) for letter in (P, Q, negation(Q)))
    whole = apply(op, a, b, c)
    first, rest = _first_and_rest(whole.op, whole.args)
    assert (whole.op, len(whole.args)) == (op, 3)
    assert (first, rest) == (whole.args[0], apply(op, *whole.args[1:]))
    assert _first_and_rest(op, whole.args[:2]) == whole.args[:2]


@settings(max_examples=examples(400), deadline=None)
@given(st.sampled_from(["enforce", "forbid", "forbid initially"]), expressions())
def test_a_bad_prefix_is_found_where_some_short_word_is_one(kind, f):
    """Against the definition, on all words of up to four letters."""
    try:
        monitor = RegularMonitor(kind, f, KEYS)
    except (NoWord, EmptyWordForbidden):
        return
    found = monitor.bad_prefix()
    words_by_length = ([LETTERS[i] for i in word] for n in range(1, 5) for word in product(range(4), repeat=n))
    first = next((word for word in words_by_length if is_bad(kind, f, word)), None)
    assert found is not None or first is None
    if found is not None:
        word = [frozenset(k for i, k in enumerate(KEYS) if letter >> i & 1) for letter in found]
        assert is_bad(kind, f, word)
        assert len(word) == len(first) if first is not None else len(word) > 4


@pytest.mark.parametrize(
    ("text", "always"),
    [
        ("enforce t: ([p] | [!p])*", True),
        ("enforce t: ([!p]* [p])*", True),
        ("enforce t: ([p && q] | [!p] | [!q])*", True),
        ("enforce t: true*", True),
        ("enforce t: m@A | [!m@A] true*", False),  # after A comes something else
        ("enforce t: (m@A | [!m@A])+", True),
        ("enforce t: (p [!p])*", False),
        ("enforce t: p? [!p]?", False),
        ("forbid t: p [!p]", False),
    ],
)
def test_rules_that_every_run_satisfies(text, always):
    (line,) = parse_properties([Source("p.ltl", text)], features=FEATURES)
    monitor = RegularMonitor(line.kind, line.expression, sorted(line.atoms))
    assert (monitor.bad_prefix() is None) == always

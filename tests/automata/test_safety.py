"""Safety and bad prefixes agree with their definitions on short words."""

from itertools import product

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.ltl.translate import translate
from llfsm_verify.automata.omega.subsets import monitor_rows
from llfsm_verify.automata.safety import BadPrefix, is_safety, looks_safe, never_bad, safety
from llfsm_verify.diagnostics import Fragment, Source
from llfsm_verify.logic.formula import apply, atom, atoms, conjunction, negation
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.parsing.formulas import parse_formula
from llfsm_verify.logic.progression import evaluate_prefix, progress
from llfsm_verify.logic.rewriting.normal_form import nnf
from llfsm_verify.testing.formulas import formulas, letters
from tests.quick import examples

KEYS = ("p", "q")
LETTERS = [frozenset(k for k, on in zip(KEYS, bits, strict=True) if on) for bits in product((0, 1), repeat=2)]


def parsed(text):
    return parse_formula(Fragment.whole(Source("test", text))).formula


def extendable(f, prefix):
    """Some continuation satisfies `f`: decided on the formula that progression leaves."""
    rest = nnf(f)
    for letter in prefix:
        rest = progress(rest, letter)
    return not translate(rest, KEYS).is_empty


def read(reader, prefix):
    """The number of letters after which the prefix is bad; None: it is not."""
    state = reader.initial()
    if state is None:
        return 0
    for i, letter in enumerate(prefix):
        state = reader.step(state, sum(1 << k for k, key in enumerate(KEYS) if key in letter))
        if state is None:
            return i + 1
    return None


@pytest.mark.slow
@given(formulas(KEYS, max_leaves=5), st.lists(letters(KEYS), max_size=4))
@settings(max_examples=examples(300), deadline=None)
def test_bad_prefixes_are_found_at_their_shortest(f, word):
    bad = read(BadPrefix(f, KEYS), word)
    expected = next((n for n in range(len(word) + 1) if not extendable(f, word[:n])), None)
    assert bad == expected
    if bad is not None:  # by the definition, on all continuations with short stems and loops
        for tail in product(LETTERS, repeat=2):
            assert not evaluate(f, [*word, tail[0]], [tail[1]])
            assert not evaluate(f, word, list(tail))
    for n in range(len(word) + 1):
        if evaluate_prefix(f, word[:n]) is False:
            assert bad is not None and bad <= n


@pytest.mark.slow
@given(formulas(KEYS, max_leaves=6))
@settings(max_examples=examples(200), deadline=None)
def test_written_out_it_reads_the_same(f):
    """In every pair of states that one word leads to, both say the same of every letter."""
    reader = BadPrefix(f, KEYS)
    first = reader.initial()
    if first is None:
        return
    rows = monitor_rows(reader.closure, 1_000, 1_000)
    seen, queue = {(first, 0)}, [(first, 0)]
    for state, row in queue:
        for letter in range(4):
            targets = {t for t, cubes in rows[row] if any(letter & p == p and not letter & n for p, n in cubes)}
            (target,), following = targets, reader.step(state, letter)
            assert (target is None) == (following is None)
            if target is not None and (following, target) not in seen:
                seen.add((following, target))
                queue.append((following, target))


def test_written_out_over_many_atoms():
    names = [f"a{i}" for i in range(40)]
    never = apply("G", negation(conjunction([atom(n) for n in names])))
    ((lost, kept),) = monitor_rows(BadPrefix(never, names).closure, 10, 100)
    if kept[0] is None:
        lost, kept = kept, lost
    assert lost == (None, [((1 << 40) - 1, 0)])
    assert kept[0] == 0 and len(kept[1]) == 40
    with pytest.raises(AutomatonTooLarge):
        monitor_rows(BadPrefix(never, names).closure, 10, 40)


@pytest.mark.slow
@given(formulas(KEYS, max_leaves=5))
@settings(max_examples=examples(200), deadline=None)
def test_safety_by_its_definition_on_short_lassos(f):
    """A lasso that violates a safety property has a bad prefix, at most as long as the closure can tell apart."""
    reader = BadPrefix(f, KEYS)
    known_safe = is_safety(f)
    for stem, loop in product(LETTERS, LETTERS):
        violated = not evaluate(f, [stem], [loop])
        bad = read(reader, [stem] + [loop] * (2 ** max(1, len(translate(f, KEYS).edges)) + 1))
        assert violated or bad is None
        if known_safe and violated:
            assert bad is not None
        if violated and bad is None:
            assert not known_safe
    if looks_safe(f):
        assert known_safe


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("G p", True),
        ("p W q", True),
        ("G (p -> X q)", True),
        ("F p", False),
        ("G (p -> F q)", False),
        ("p U q", False),
        ("G F p", False),
        ("F p -> (!q U p)", True),  # dac-patterns 2: a safety property that does not look so
        ("F p && !p && G !p", True),  # unsatisfiable
        ("F p || G !p", True),  # valid
        ("(p U q) || G p", True),
        ("X X !q && G q", True),
    ],
)
def test_safety(text, expected):
    assert is_safety(parsed(text)) is expected
    assert safety(parsed(text)).exact


def test_an_unsatisfiable_formula_is_bad_from_the_start():
    reader = BadPrefix(conjunction((apply("G", atom("p")), apply("F", negation(atom("p"))))), ["p"])
    assert reader.initial() is None


def test_states_are_remembered_and_irrelevant_atoms_ignored():
    reader = BadPrefix(parsed("G (p -> X q)"), ["p", "q", "z"])
    start = reader.initial()
    assert reader.step(start, 0b101) == reader.step(start, 0b001) != start
    assert reader.step(reader.step(start, 0b001), 0b001) is None


def test_beyond_the_limit_only_the_form_counts():
    text = "(" + " && ".join(f"G F p{i}" for i in range(3)) + ") -> F q"
    assert not safety(parsed(text), max_pairs=0).exact
    assert not safety(parsed(text), max_pairs=0).holds
    assert safety(parsed("p W q"), max_pairs=0).exact


@pytest.mark.parametrize(
    ("text", "answer"),
    [("G F a", True), ("G (a -> F b)", True), ("F G a", True), ("G a", False), ("a U b", False), ("false", False)],
)
def test_liveness_has_no_bad_prefixes(text, answer):
    formula = parsed(text)
    names = sorted(atoms(formula))
    assert never_bad(BadPrefix(formula, names), len(names)) is answer

"""The evaluator on lassos agrees with a definition by unrolling, and normal forms keep the meaning."""

import pytest
from hypothesis import given, settings

from llfsm_verify.logic.formula import FALSE, TRUE, apply, atom, negation
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.progression import evaluate_prefix, progress
from llfsm_verify.logic.rewriting.normal_form import nnf
from llfsm_verify.testing.formulas import formulas, lassos
from tests.quick import examples

P, Q = atom("p"), atom("q")
p, q, none = frozenset("p"), frozenset("q"), frozenset()


def unrolled(f, stem, loop):
    """The textbook semantics on positions: a temporal operator looks at all positions up to one full turn later."""
    letters, back = [*stem, *loop], len(stem)

    def at(i):
        return letters[i] if i < len(letters) else letters[back + (i - back) % len(loop)]

    def fold(i):
        return i if i < len(letters) else back + (i - back) % len(loop)

    memo = {}

    def holds(g, i):
        i = fold(i)
        if (g, i) not in memo:
            memo[g, i] = compute(g, i)
        return memo[g, i]

    def until(a, b, i):
        # A first position where b holds is less than stem and loop away.
        return any(b(k) and all(a(j) for j in range(i, k)) for k in range(i, i + len(letters) + 1))

    def compute(g, i):
        sub = [lambda k, x=x: holds(x, k) for x in g.args]
        match g.op:
            case "true" | "false":
                return g.op == "true"
            case "atom":
                return g.key in at(i)
            case "not":
                return not sub[0](i)
            case "and":
                return all(s(i) for s in sub)
            case "or":
                return any(s(i) for s in sub)
            case "xor":
                return sub[0](i) != sub[1](i)
            case "iff":
                return sub[0](i) == sub[1](i)
            case "implies":
                return not sub[0](i) or sub[1](i)
            case "X":
                return sub[0](i + 1)
            case "F":
                return until(lambda _: True, sub[0], i)
            case "G":
                return not until(lambda _: True, lambda k: not sub[0](k), i)
            case "U":
                return until(sub[0], sub[1], i)
            case "W":
                return until(sub[0], sub[1], i) or not until(lambda _: True, lambda k: not sub[0](k), i)
            case "R":
                return not until(lambda k: not sub[0](k), lambda k: not sub[1](k), i)
            case "M":
                return until(sub[1], lambda k: sub[0](k) and sub[1](k), i)
        raise AssertionError(g.op)

    return holds(f, 0)


@pytest.mark.slow
@given(formulas(max_leaves=8), lassos())
@settings(max_examples=examples(400), deadline=None)
def test_evaluation_agrees_with_unrolling(f, word):
    assert evaluate(f, *word) == unrolled(f, *word)


@pytest.mark.slow
@given(formulas(max_leaves=8), lassos())
@settings(max_examples=examples(400), deadline=None)
def test_normal_form_means_the_same(f, word):
    value = evaluate(f, *word)
    assert evaluate(nnf(f), *word) == value
    assert evaluate(nnf(f, True), *word) != value


@pytest.mark.slow
@given(formulas(max_leaves=8), lassos())
@settings(max_examples=examples(300), deadline=None)
def test_progression_over_the_stem_leaves_the_loop(f, word):
    stem, loop = word
    rest = nnf(f)
    for letter in stem:
        rest = progress(rest, letter)
    assert evaluate(rest, [], loop) == evaluate(f, stem, loop)
    decided = evaluate_prefix(f, stem)
    assert decided is None or decided == evaluate(f, stem, loop)


@pytest.mark.parametrize(
    ("f", "word", "value"),
    [
        (apply("G", P), [p, p], None),
        (apply("G", P), [p, none], False),
        (apply("F", P), [none, p], True),
        (apply("U", P, Q), [p, none], False),
        (apply("G", apply("implies", P, apply("X", Q))), [p, p], False),
        (apply("and", apply("G", P), apply("F", negation(P))), [], None),  # unsatisfiable, but does not look it
        (apply("and", P, negation(P)), [], False),
        (TRUE, [], True),
        (FALSE, [], False),
    ],
)
def test_prefixes_that_decide(f, word, value):
    assert evaluate_prefix(f, word) is value


def test_mappings_must_be_complete_and_loops_not_empty():
    assert evaluate(apply("G", P), [], [{"p": True}])
    assert not evaluate(apply("G", P), [{"p": False}], [{"p": True}])
    with pytest.raises(KeyError):
        evaluate(apply("G", P), [], [{"q": True}])
    with pytest.raises(ValueError, match="loop"):
        evaluate(P, [p], [])
    with pytest.raises(ValueError, match="negation normal form"):
        progress(apply("iff", P, Q), p)

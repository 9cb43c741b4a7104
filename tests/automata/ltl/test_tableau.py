"""The reference is right, and the translation agrees with it, with SPIN and with the definition on all short lassos."""

import re
import subprocess
from itertools import product

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from llfsm_verify.automata.automaton import Automaton, Edge
from llfsm_verify.automata.ltl.translate import translate
from llfsm_verify.automata.omega.products import accepts, disjoint
from llfsm_verify.logic.formula import FALSE, TRUE, apply, atom, conjunction, disjunction, negation, postorder
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.rewriting.normal_form import nnf
from llfsm_verify.testing.formulas import formulas
from tests.automata.ltl.tableau import TEMPORAL, tableau
from tests.outside import needs
from tests.quick import examples

KEYS = ("p", "q")
LETTERS = [frozenset(k for k, on in zip(KEYS, bits, strict=True) if on) for bits in product((0, 1), repeat=2)]
LASSOS = [
    (list(stem), list(loop))
    for n, m in ((0, 1), (1, 1), (2, 1), (0, 2), (1, 2))
    for stem in product(LETTERS, repeat=n)
    for loop in product(LETTERS, repeat=m)
]


@st.composite
def recurrences(draw):
    """Conjunctions and disjunctions of `G F`, `F G`, `G` and `F` of something with `X`, where promises matter most."""
    literals = st.sampled_from([atom("p"), negation(atom("p")), atom("q"), negation(atom("q"))])

    def delayed(f):
        for _ in range(draw(st.integers(0, 2))):
            f = apply("X", f)
        return f

    def part():
        f = apply(draw(st.sampled_from(["and", "or", "U", "R"])), draw(literals), delayed(draw(literals)))
        for op in reversed(draw(st.sampled_from(["GF", "FG", "G", "F", "GF", "XF"]))):
            f = apply(op, f)
        return f

    parts = [part() for _ in range(draw(st.integers(1, 3)))]
    return draw(st.sampled_from([conjunction, disjunction]))(parts)


def small(f, most):
    return sum(node.op in TEMPORAL for node in postorder(f)) <= most


@given(formulas(KEYS, max_leaves=5))
@settings(max_examples=examples(60), deadline=None)
def test_the_reference_is_the_definition(f):
    assume(small(f, 4))
    reference = tableau(f, KEYS)
    for stem, loop in LASSOS[::7]:
        assert accepts(reference, stem, loop) == evaluate(f, stem, loop)


@pytest.mark.slow
@given(st.one_of(formulas(KEYS, max_leaves=6), recurrences()))
@settings(max_examples=examples(150), deadline=None)
def test_the_translation_agrees_with_the_reference(f):
    assume(small(f, 5))
    own, opposite = tableau(f, KEYS), tableau(negation(f), KEYS)
    for generalised in (True, False):
        assert disjoint(translate(f, KEYS, generalised=generalised), opposite)
        assert disjoint(translate(f, KEYS, negate=True, generalised=generalised), own)


@pytest.mark.slow
@given(st.one_of(formulas(KEYS, max_leaves=8), recurrences()))
@settings(max_examples=examples(100), deadline=None)
def test_all_short_lassos(f):
    automata = [translate(f, KEYS), translate(f, KEYS, generalised=False)]
    for stem, loop in LASSOS[::3]:
        expected = evaluate(f, stem, loop)
        for automaton in automata:
            assert accepts(automaton, stem, loop) == expected


@pytest.mark.slow
@given(st.one_of(formulas(KEYS, max_leaves=8), recurrences()))
@settings(max_examples=examples(200), deadline=None)
def test_plain_automata_are_plain(f):
    plain = translate(f, KEYS, generalised=False)
    assert plain.acceptance_sets <= 1
    assert all(len({edge.acceptance for edge in row}) <= 1 for row in plain.edges)


# ---------------------------------------------------------------- SPIN


def promela(f):
    """A formula in negation normal form in SPIN's syntax, `W` and `M` written out."""
    text = {}
    for node in postorder(f):
        args = [text[a] for a in node.args]
        match node.op:
            case "true" | "false":
                text[node] = node.op
            case "atom":
                text[node] = node.key
            case "not":
                text[node] = f"(! {args[0]})"
            case "and" | "or":
                text[node] = "(" + (" && " if node.op == "and" else " || ").join(args) + ")"
            case "X" | "F" | "G":
                text[node] = f"({ {'X': 'X', 'F': '<>', 'G': '[]'}[node.op] } {args[0]})"
            case "U" | "R":
                text[node] = f"({args[0]} {'U' if node.op == 'U' else 'V'} {args[1]})"
            case "W":
                text[node] = f"(({args[0]} U {args[1]}) || ([] {args[0]}))"
            case "M":
                text[node] = f"({args[1]} U ({args[0]} && {args[1]}))"
    return text[f]


def never_claim(text):
    """The automaton of a never claim: several labels can name one state; one that begins with accept makes it so."""
    numbers, guards, accepting = {}, [], []
    fresh = True
    for line in text.splitlines()[1:]:
        if label := re.match(r"(\w+):$", line):
            if fresh:
                guards.append([])
                accepting.append(False)
                fresh = False
            numbers[label[1]] = len(guards) - 1
            accepting[-1] |= label[1].startswith("accept")
            continue
        fresh = True
        if line.strip() == "skip":
            guards[-1].append(("(1)", "accept_all"))
        elif leave := re.search(r"atomic \{ \((.*)\) -> assert", line):
            guards[-1].append((leave[1], "accept_all"))
        elif step := re.search(r":: \((.*)\) -> goto (\w+)$", line):
            guards[-1].append(step.groups())
    rows = [
        tuple(
            Edge(positive, negative, numbers[target], int(accepting[k]))
            for guard, target in row
            for positive, negative in cubes(guard)
        )
        for k, row in enumerate(guards)
    ]
    return Automaton(KEYS, tuple(rows), 1)


def cubes(guard):
    """The letters that satisfy a guard of SPIN's."""
    text = guard.replace("!", " not ").replace("&&", " and ").replace("||", " or ")
    assert re.fullmatch(r"(?:not|and|or|[pq1() ])*", text), guard
    for letter in range(1 << len(KEYS)):
        if eval(text, {key: bool(letter >> i & 1) for i, key in enumerate(KEYS)}):
            yield letter, ~letter & 3


def spin_claim(f):
    """The never claim that SPIN makes of `f`; None: it gives up, or takes more than 5 s of processor time."""
    command = ["sh", "-c", 'ulimit -t 5; exec spin -f "$1"', "sh", promela(f)]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    return run.stdout if run.returncode == 0 and run.stdout.startswith("never") else None


SPIN_LASSOS = LASSOS[::3]


def spin_agrees(f):
    """Languages, not only words: ours of the negation shares nothing with theirs, nor theirs of it with ours."""
    sides = nnf(f), nnf(f, negate=True)
    assume(FALSE not in sides)
    claims = [spin_claim(side) for side in sides]
    assume(None not in claims)
    for side, claim in zip(sides, claims, strict=True):
        theirs = never_claim(claim)
        assert disjoint(theirs, translate(side, KEYS, negate=True)), promela(side)
        for word in SPIN_LASSOS:
            assert accepts(theirs, *word) == evaluate(side, *word), promela(side)


def without_next(f):
    done = {}
    for node in postorder(f):
        args = tuple(done[a] for a in node.args)
        if node.op == "X":
            done[node] = args[0]
        else:
            done[node] = negation(*args) if node.op == "not" else apply(node.op, *args) if args else node
    return done[f]


@pytest.mark.slow
@needs("spin")
@given(formulas(KEYS, 6))
@settings(max_examples=examples(150), deadline=None)
def test_spin_agrees_on_random_formulas(f):
    spin_agrees(without_next(f))


@needs("spin")
@given(formulas(KEYS, 5))
@settings(max_examples=examples(100), deadline=None)
def test_spin_agrees_on_random_formulas_with_next(f):
    if spin_claim(apply("X", atom("p"))) is None:
        pytest.skip("this build of SPIN has no operator X (it takes -DNXT when SPIN is compiled)")
    spin_agrees(f)


@pytest.mark.slow
@needs("spin")
def test_spin_agrees(tmp_path):
    """A grid without `X`, which most builds of SPIN lack."""
    p, q = atom("p"), atom("q")
    x = [apply("U", p, q), apply("R", p, q), apply("F", p), apply("G", q), apply("M", p, q), apply("W", q, p)]
    cases = [apply(op, a, b) for op in ("and", "or", "U", "R", "W") for a in x for b in (*x, p) if a is not b]
    cases += [apply("G", apply("F", a)) for a in x] + [TRUE, conjunction((p, negation(q)))]
    checked = 0
    for f in cases[::3]:
        for g in (nnf(f), nnf(f, negate=True)):
            if g is FALSE:
                continue
            run = subprocess.run(["spin", "-f", promela(g)], capture_output=True, text=True, cwd=tmp_path, check=True)
            theirs = never_claim(run.stdout)
            assert disjoint(theirs, translate(g, KEYS, negate=True)), promela(g)
            ours = translate(g, KEYS)
            for word in LASSOS[::5]:
                assert accepts(theirs, *word) == accepts(ours, *word), run.stdout
            checked += 1
    assert checked > 50

"""Past operators, step and time bounds, regular expressions: how they are written, and their truth on lassos."""

import pickle
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.diagnostics import DiagnosticError, Fragment, Source
from llfsm_verify.logic import expressions
from llfsm_verify.logic.bounds import step_bound, without_steps
from llfsm_verify.logic.formula import ARITY, PAST, TRUE, Formula, apply, atom, is_plain, negation, to_text
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.parsing.formulas import parse_formula
from llfsm_verify.logic.properties import PLAIN, parse_properties
from llfsm_verify.testing.formulas import formulas, lassos
from tests.quick import examples

P, Q = atom("p"), atom("q")


def parsed(text):
    return parse_formula(Fragment.whole(Source("test", text))).formula


# ---------------------------------------------------------------- writing


@pytest.mark.parametrize(
    ("text", "formula"),
    [
        ("Y p", apply("Y", P)),
        ("p S q", apply("S", P, Q)),
        ("H O Z p T q", apply("T", apply("H", apply("O", apply("Z", P))), Q)),
        ("X[3] p", apply("X[]", P, bound="3")),
        ("F[2:5] p", apply("F[]", P, bound="2:5")),
        ("G [0:0] p", apply("G[]", P, bound="0:0")),
        ("F[<=500ms] p", apply("F<=", P, bound="500")),
        ("G[<=2s] p", apply("G<=", P, bound="2000")),
        ("G[<= 0.5 ms] p", apply("G<=", P, bound="0.5")),
        ("p U[<=1.25s] q", apply("U<=", P, Q, bound="1250")),
        ("F[<=1min] p", apply("F<=", P, bound="60000")),
        ("F[1s:2s] p", apply("F<=", P, bound="1000:2000")),
        ("G[500ms:1.5s] p", apply("G<=", P, bound="500:1500")),
        ("p U[ 1s : 1min ] q", apply("U<=", P, Q, bound="1000:60000")),
        ("p R[1s:1s] q", apply("R<=", P, Q, bound="1000:1000")),
        ("p R[<=1s] q", apply("R<=", P, Q, bound="1000")),
        ("F[>=1s] p", apply("F<=", P, bound="1000:")),
        ("p U[>=0.5ms] q", apply("U<=", P, Q, bound="0.5:")),
        ("F[0s:2s] p", apply("F<=", P, bound="2000")),
        ("O[0:10] p", apply("O[]", P, bound="0:10")),
        ("H[2:5] p", apply("H[]", P, bound="2:5")),
        ("p S[0:1048576] q", apply("S[]", P, Q, bound="0:1048576")),
        ("p T [1:1] q", apply("T[]", P, Q, bound="1:1")),
        ("O[<=3s] p", apply("O<=", P, bound="3000")),
        ("H[1s:2s] p", apply("H<=", P, bound="1000:2000")),
        ("p S[>=0.5ms] q", apply("S<=", P, Q, bound="0.5:")),
        ("p T[<=1min] q", apply("T<=", P, Q, bound="60000")),
    ],
)
def test_spellings(text, formula):
    assert parsed(text) is formula
    assert parsed(to_text(formula)) is formula
    assert pickle.loads(pickle.dumps(formula)) is formula
    assert not is_plain(formula) and all(op in ARITY for op in ("X", "U"))


@pytest.mark.parametrize(
    ("text", "code", "column", "hint"),
    [
        ("F[500ms] p", "E334", 2, "F[<=500ms]"),
        ("F[1s:] p", "E334", 2, "F[>=1s]"),
        ("G[:2s] p", "E334", 2, "G[<=2s]"),
        ("p U[2s] q", "E334", 4, "U[<=2s]"),
        ("G[:3] p", "E334", 2, "G[0:3]"),
        ("F[3] p", "E334", 2, "F[0:3]"),
        ("F[3:] p", "E334", 2, "X[3] F"),
        ("Y[2] p", "E334", 1, 'write `Y Y` for two steps back, and `"Y"[2]` for an element'),
        ("G O[2]", "E334", 3, '`"O"[2]` for an element of a variable'),
        ("F[<500ms] p", "E334", 2, "F[<=500ms]"),
        ("O[5:2] p", "E334", 2, "write `O[2:5]`"),
        ("H[0:1000000000] p", "E334", 2, "write a smaller number, or `H` without a bound"),
        ("O[0:1048577] p", "E334", 2, "write `O[2:5]`"),
        ("O[1001:2000] p", "E334", 2, "write `O[2:5]`"),
        ("p S[3] q", "E334", 3, 'write `S[0:3]`, or `"S"[3]` for an element'),
        ("H[3:] p", "E334", 2, "write `Z Z Z H`"),
        ("p T[3:] q", "E334", 4, "write `p T[0:10] q` for steps"),
        ("p S[0..3] q", "E334", 3, "write `S[0:3]`"),
        ("O[<=3] p", "E334", 2, "write `O[<=3s]` for seconds, or `O[0:3]` for steps"),
        ("Z[<=3s] p", "E334", 1, "write `H[<=3s]`"),
        ("G[5:2] p", "E334", 2, "G[2:5]"),
        ("X[2:3] p", "E334", 2, "X[3]"),
        ("X[<=3s] p", "E334", 2, "X[3]"),
        ("p U[1:2] q", "E334", 4, "p U[<=500ms] q"),
        ("F[0:2000] p", "E334", 2, None),
        ("F[0:1000] G[0:1000] " * 26 + "p", "E334", 1, "write several properties"),
        ("p U[<=1s] q U r", "E325", 13, "`(p U[<=1s] q) U r` or `p U[<=1s] (q U r)`"),
        ("p S q T r", "E325", 7, "(p S q) T r"),
        ("YO p", "E323", 1, "Y O p"),
        ("Y > 3", "E324", 1, '"Y"'),
        ("Y (F<= 1.5 s p)", "E324", 4, '`"F"` for a variable of that name, or `F[<=1.5s]`'),
        ("p since q", "E322", 3, "write `S`"),
        ("always(p)", "E322", 7, "write `G`"),
        ("AG p", "E322", 4, "`AG` is an operator of CTL; every property here is about all runs, so write `G`"),
        ("AF (p && X q)", "E322", 4, "so write `F`"),
        ("A X p", "E322", 3, "so write `X`"),
        ("EF(p)", "E322", 3, "`llfsm query ARRANGEMENT p` tells whether a run reaches p"),
        ("E G p", "E322", 3, "`E G` is an operator of CTL"),
    ],
)
def test_mistakes(text, code, column, hint):
    with pytest.raises(DiagnosticError) as raised:
        parsed(text)
    (found,) = raised.value.diagnostics
    assert (found.code, found.span.column) == (code, column)
    assert hint is None or hint in found.hint


def test_variables_called_like_operators_are_quoted():
    assert parsed('"Y" > 3 && m@S && m.T') is apply("and", atom("Y > 3"), atom("m@S"), atom("m.T"))
    assert to_text(atom("O")) == '"O"'


def test_property_files_refuse_what_is_not_taken():
    text = "a: O p\nb: F[<=5ms] p\nc: F[1:2] p\nd: enforce\ne: automaton\nenforce f: p q\nautomaton g: x.hoa\n"
    with pytest.raises(DiagnosticError) as raised:
        parse_properties([Source("t", text)], features=PLAIN)
    found = [(d.code, d.span.line) for d in raised.value.diagnostics]
    assert found == [("E335", 1), ("E335", 2), ("E315", 6), ("E335", 7)]
    properties = parse_properties([Source("t", text)])
    assert [p.kind for p in properties] == ["ltl"] * 5 + ["enforce", "automaton"]
    assert is_plain(properties.properties[2].formula)


# ---------------------------------------------------------------- truth


def unrolled(f, stem, loop, delays=None, turns=8):
    """The definitions over an explicit stretch of the word; right at the start of it if the stretch is long enough."""
    letters = [*stem, *loop * turns]
    n = len(letters)
    base = len(stem)
    times = [Fraction(0)]
    for i in range(n):
        k = i if i < base else base + (i - base) % len(loop)
        times.append(times[-1] + (delays[k] if delays else 0))

    def holds(g, i):
        sub = [lambda k, x=x: holds(x, k) for x in g.args]
        match g.op:
            case "atom":
                return g.key in letters[i]
            case "not":
                return not sub[0](i)
            case "and":
                return all(s(i) for s in sub)
            case "or":
                return any(s(i) for s in sub)
            case "Y":
                return i > 0 and sub[0](i - 1)
            case "Z":
                return i == 0 or sub[0](i - 1)
            case "O":
                return any(sub[0](k) for k in range(i + 1))
            case "H":
                return all(sub[0](k) for k in range(i + 1))
            case "S":
                return any(sub[1](k) and all(sub[0](j) for j in range(k + 1, i + 1)) for k in range(i + 1))
            case "T":
                return all(sub[1](k) or any(sub[0](j) for j in range(k + 1, i + 1)) for k in range(i + 1))
            case "X":
                return sub[0](i + 1)
            case "X[]":
                return sub[0](i + step_bound(g)[0])
            case "F[]" | "G[]":
                first, last = step_bound(g)
                found = [sub[0](i + k) for k in range(first, last + 1)]
                return any(found) if g.op == "F[]" else all(found)
        least, _, most = g.key.rpartition(":")
        low, high = Fraction(least or 0), Fraction(most) if most else None
        near = [
            k
            for k in range(i, n if low else min(n, i + 3 * (base + len(loop))))
            if low <= times[k] - times[i] and (high is None or times[k] - times[i] <= high)
        ]
        if g.op == "F<=":
            return any(sub[0](k) for k in near)
        if g.op == "G<=":
            return all(sub[0](k) for k in near)
        if g.op == "R<=":
            return all(sub[1](k) or any(sub[0](j) for j in range(i, k)) for k in near)
        assert g.op == "U<="
        return any(sub[1](k) and all(sub[0](j) for j in range(i, k)) for k in near)

    return holds(f, 0)


def future_of_past(max_leaves=5):
    """Past operators and `X`: what a short stretch decides."""

    def larger(inner):
        unary = st.builds(apply, st.sampled_from(["Y", "Z", "O", "H", "X"]), inner)
        binary = st.builds(apply, st.sampled_from(["S", "T", "and", "or"]), inner, inner)
        return st.one_of(unary, binary, inner.map(negation))

    return st.recursive(st.sampled_from([P, Q]), larger, max_leaves=max_leaves)


@pytest.mark.slow
@given(future_of_past(), st.integers(0, 12), lassos(("p", "q")))
@settings(max_examples=examples(400), deadline=None)
def test_past_agrees_with_the_definition_at_every_position(f, steps, word):
    late = f
    for _ in range(steps):
        late = apply("X", late)
    assert evaluate(late, *word) == unrolled(late, *word, turns=30)


@pytest.mark.slow
@given(future_of_past(3), lassos(("p", "q")), st.sampled_from(["G", "F"]))
@settings(max_examples=examples(300), deadline=None)
def test_past_under_always_looks_at_all_turns_that_differ(f, word, op):
    stem, loop = word
    seen = []
    late = f
    for _ in range(len(stem) + len(loop) * (past_depth(f) + 1)):
        seen.append(unrolled(late, stem, loop, turns=40))
        late = apply("X", late)
    assert evaluate(apply(op, f), stem, loop) == (all(seen) if op == "G" else any(seen))


def test_what_has_been_differs_for_two_turns_of_a_loop():
    # `O p` is settled in the second turn, what looks back at it from `r` in the third.
    f = parsed("F G (r -> (O p) S q)")
    assert evaluate(f, [], [{"r"}, {"q"}, set(), {"p"}])
    assert not evaluate(parsed("X X X X (r -> (O p) S q)"), [], [{"r"}, {"q"}, set(), {"p"}])


@pytest.mark.slow
@given(
    formulas(("p", "q"), 3).filter(lambda f: f.op not in ("true", "false")),
    st.sampled_from([("X[]", "0"), ("X[]", "4"), ("F[]", "1:3"), ("G[]", "0:2"), ("G[]", "7:9")]),
    lassos(("p", "q")),
)
@settings(max_examples=examples(200), deadline=None)
def test_steps_mean_what_they_are_written_out_as(f, bound, word):
    g = apply(bound[0], f, bound=bound[1])
    assert is_plain(without_steps(g))
    assert evaluate(g, *word) == evaluate(without_steps(g), *word)


@pytest.mark.slow
def test_large_step_bounds_stay_small():
    f = P
    for _ in range(3):
        f = apply("G[]", f, bound="0:1000")
    plain = without_steps(f)
    assert evaluate(plain, [], [{"p"}]) and not evaluate(f, [{"p"}] * 2500, [set()])


timed_words = st.tuples(lassos(("p", "q"), 3, 3), st.lists(st.sampled_from([0, 50, 100, Fraction(1, 2)]), min_size=6))


@pytest.mark.slow
@given(
    st.sampled_from([("F<=", 1), ("G<=", 1), ("U<=", 2), ("R<=", 2)]),
    st.sampled_from(["0", "50", "99.5", "100", "250", "0:", "1:", "50:50", "50:250", "99.5:100", "0.5:1.5", "120:"]),
    st.integers(0, 3),
    timed_words,
)
@settings(max_examples=examples(400), deadline=None)
def test_time_agrees_with_the_definition(op, bound, steps, word):
    (stem, loop), delays = word
    f = apply(op[0], *(P, Q)[: op[1]], bound=bound)
    for _ in range(steps):
        f = apply("X", f)
    used = delays[: len(stem) + len(loop)]
    turns = 300 if ":" in bound else 8  # a turn of the loop may take half a millisecond
    assert evaluate(f, stem, loop, used) == unrolled(f, stem, loop, used, turns)


def test_time_needs_delays():
    with pytest.raises(ValueError, match="delays"):
        evaluate(apply("F<=", P, bound="5"), [], [{"p"}])
    with pytest.raises(ValueError, match="one delay for each"):
        evaluate(P, [], [{"p"}], [1, 2])


def test_a_deadline():
    f = parsed("G (p -> F[<=200ms] q)")
    request = [{"p"}, set(), {"q"}]
    assert evaluate(f, request, [set()], [100, 100, 100, 100])
    assert not evaluate(f, request, [set()], [100, 101, 100, 100])


LONG = apply("seq", *[P] * 12_000)
NESTED = apply("repeat", apply("repeat", P, bound="1000:1000"), bound="1000:1000")


@pytest.mark.parametrize(
    "f",
    [apply("closure", NESTED), apply("<>->", NESTED, TRUE), apply("[]->", LONG, P), apply("closure", LONG)],
    ids=["nested closure", "nested", "long", "long closure"],
)
def test_expressions_that_go_on_too_long_are_given_up(f, monkeypatch):
    monkeypatch.setattr(expressions, "MAX_EFFORT", 200_000)
    monkeypatch.setattr(expressions, "MAX_DERIVATIVES", 1_000)
    with pytest.raises(expressions.ExpressionTooLarge, match="continuations"):
        evaluate(f, [], [{"p"}])


@pytest.mark.slow
def test_a_long_expression_is_read_to_its_end():
    f = apply("<>->", apply("seq", *[P] * 500), Q)
    assert evaluate(f, [{"p"}] * 499, [{"p", "q"}])
    assert not evaluate(f, [{"p"}] * 498 + [set()], [{"p", "q"}])


def test_the_effort_counts_each_rest_of_a_sequence():
    maybe = apply("repeat", P, bound="0:1")
    assert expressions.effort(apply("seq", *[maybe] * 50)) > 50 * 50
    assert expressions.effort(apply("seq", *[P] * 50)) < 3 * 50


def test_wrong_nodes_are_not_made():
    for op, args, bound in (
        ("X[]", (P,), ""),
        ("X", (P,), "3"),
        ("S", (P,), ""),
        ("repeat", (P,), ""),
        ("seq", (P,), ""),
    ):
        with pytest.raises(ValueError, match=op.replace("[", r"\[").replace("]", r"\]")):
            apply(op, *args, bound=bound)


def past_depth(f: Formula) -> int:
    """How many past operators are nested inside each other."""
    return max((past_depth(a) for a in f.args), default=0) + (f.op in PAST)

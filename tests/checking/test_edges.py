"""Edges as past in searches: the verdicts are those with hidden variables, and users see their own words."""

from __future__ import annotations

import re
from collections import Counter
from itertools import pairwise

import pytest
from hypothesis import HealthCheck, Phase, reject, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.loader import build_arrangement, load_arrangement_text
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking import edges
from llfsm_verify.checking.edges import MOST, with_edges_as_past
from llfsm_verify.checking.groups import groups_of
from llfsm_verify.checking.problem import Problem, bind
from llfsm_verify.checking.trace import Trace
from llfsm_verify.checking.verdict import Options, Verdict
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.engines.unrolled.options import UnrolledOptions
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.testing.arrangements import arrangements
from llfsm_verify.testing.properties import state_formulas
from llfsm_verify.verification.verify import checker, verify
from tests.quick import FRESH, each, spread

ENGINES = ("explicit", "bmc", "induction", "pdr")
SOLVERS = ("bmc", "bmc", "induction", "bmc", "bmc", "pdr")
"""Those that take most of the time, each for a part of the pairs."""
LIMITS = Limits(max_states=2_000, max_steps=200_000)
EFFORT = 200_000
DEPTHS = {"bmc": 8, "induction": 5, "pdr": 5}
_UNARY = ("G ({})", "F ({})", "X ({})", "!({})", "Y ({})", "O[0:2] ({})", "G F ({})")
_BINARY = ("({}) && ({})", "({}) || ({})", "({}) -> ({})", "({}) U ({})", "({}) S ({})", "({}) R ({})")


@st.composite
def problems(draw: st.DrawFn) -> tuple[Arrangement, Problem]:
    """One or two formulas with edges, now and then an assumption or a rule."""
    arrangement = build_arrangement(draw(arrangements(max_machines=2, max_states=3)))
    plain = [text for text in state_formulas(arrangement) if not re.match("rose|fell|changed", text)]
    some = st.sampled_from(draw(st.lists(st.sampled_from(plain), min_size=1, max_size=3, unique=True)))
    edge = st.builds("{}({})".format, st.sampled_from(("rose", "fell", "changed")), some)
    shapes = ("rose({1})", "fell({0} && {1})", '"{0} && {1}"', '"({0} == {1}) || !({1})"', "changed({0})")
    larger = st.builds(lambda shape, a, b: shape.format(a, b), st.sampled_from(shapes), some, edge)
    whole = [f"changed({w.variable.name})" for w in arrangement.whiteboard] or ["true"]
    atom = st.one_of(edge, edge, some, larger, st.sampled_from(whole))
    formulas = st.recursive(
        atom,
        lambda inner: st.one_of(
            st.builds(str.format, st.sampled_from(_UNARY), inner),
            st.builds(str.format, st.sampled_from(_BINARY), inner, inner),
        ),
        max_leaves=4,
    )
    texts = draw(st.lists(formulas, min_size=1, max_size=2))
    lines = [f"p{i}: {text}" for i, text in enumerate(texts)]
    if draw(st.integers(0, 3)) == 0:
        lines.append(f"forbid r: [{draw(edge)}] [{draw(some)}]")
    if draw(st.integers(0, 3)) == 0:
        lines.append(f"assume a: {draw(formulas)}")
    try:
        return arrangement, bind(arrangement, parse_properties([Source("random.ltl", "\n".join(lines))]))
    except DiagnosticError:
        reject()


def is_shown(trace: Trace, atoms: set[str]) -> None:
    """The edges that a trace shows are what the letters beside them say."""
    letters = [dict(trace.initial_atoms), *(dict(step.atoms) for step in trace.steps if step.observed)]
    for key in atoms:
        match = re.fullmatch(r"(rose|fell|changed)\((.*)\)", key)
        if match is None or match[2] not in letters[0]:
            continue
        kind, operand = match.groups()
        values = [letter[operand] for letter in letters]
        expected = [
            before != now and (kind == "changed" or now is (kind == "rose")) for before, now in pairwise(values)
        ]
        assert [letter[key] for letter in letters] == [False, *expected], key


def agree(problem: Problem, tally: Counter[str]) -> None:
    """Each engine decides the same with edges as past as with hidden variables, as far as it decides both."""
    past = with_edges_as_past(problem)
    assert {a.name for a in problem.atoms} <= {a.name for a in past.atoms}
    tally["changed" if past.shown else "same"] += 1
    tally["pairs"] += 1
    for name in ENGINES if FRESH else ("explicit", SOLVERS[tally["pairs"] % len(SOLVERS)]):
        options = Options(LIMITS, effort=EFFORT, own=(UnrolledOptions(depth=DEPTHS.get(name)),))
        before, after = (checker(name)(p, options) for p in (problem, past))
        for old, new in zip(before.properties, after.properties, strict=True):
            decided = Verdict.UNKNOWN not in (old.verdict, new.verdict)
            assert not decided or old.verdict is new.verdict, (name, old, new)
            tally[f"{name} {new.verdict.value}"] += decided and bool(past.shown)
            for trace in (new.trace, new.witness):
                if trace is not None:
                    line = next(p for p in problem.properties if p.name == new.name)
                    assert set(line.atoms) <= {key for key, _ in trace.initial_atoms} <= {a.name for a in problem.atoms}
                    is_shown(trace, set(line.atoms))


@pytest.mark.long
@pytest.mark.parametrize("most", [MOST, 1])
def test_random_edges(most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """With `most` 1, lines with edges as past stand beside lines with hidden variables."""
    monkeypatch.setattr(edges, "MOST", most)
    tally: Counter[str] = Counter()
    amount = settings(
        max_examples=500 if FRESH else 60,
        deadline=None,
        suppress_health_check=list(HealthCheck),
        phases=[Phase.generate, Phase.shrink],
    )
    kinds = ("changed", "explicit holds", "explicit violated", "bmc violated", "induction holds", "pdr violated")
    spread(lambda p: agree(p[1], tally), amount, problems(), size=10, until=each(tally, kinds))


BUTTONS = """
name: buttons
cycle_ms: 100
whiteboard:
  a: {type: bool, role: input}
  b: {type: bool, role: input}
  n: {type: 0..3, init: 0}
  lit: {type: bool, init: false}
machines:
  m:
    inline:
      machine: M
      states:
        - {name: OFF, on_entry: lit = false;, transitions: [{when: a, to: ON}]}
        - {name: ON, on_entry: "lit = true; n = (n + 1) % 4;", transitions: [{when: b, to: OFF}]}
schedule: [m]
"""


def past_of(*lines: str) -> Problem:
    return with_edges_as_past(bind(load_arrangement_text(BUTTONS), parse_properties([Source("p", "\n".join(lines))])))


@pytest.mark.parametrize(
    ("formula", "written"),
    [
        ("rose(a)", "a && Y !a"),
        ("fell(a && b)", '!"a && b" && Y "a && b"'),
        ("changed(lit)", "(lit && Y !lit) || (!lit && Y lit)"),
        ("rose(fell(a))", "!a && Y a && Y !(!a && Y a)"),
        ('"m.ran && rose(m@ON)"', "m.ran && m@ON && Y !m@ON"),
        ("rose(a) == b", "(a && Y !a) <-> b"),
        ('"!rose(n > 1) || b"', "!(n > 1 && Y !(n > 1)) || b"),
    ],
)
def test_an_edge_is_past_of_its_operands(formula: str, written: str) -> None:
    problem = past_of(f"p: G ({formula})")
    (line,) = problem.properties
    ((_, found),) = line.edges.items()
    (meant,) = parse_properties([Source("p", written)])
    assert str(found) == str(meant.formula)
    assert {v.name for v in problem.program().vars if v.name.startswith("$before")} == set()
    assert {v.name for v in problem.performed().vars if v.name.startswith("$before")}


@pytest.mark.parametrize(
    "lines",
    [
        ("p: G changed(n)",),
        ("forbid p: [rose(a)] [b]",),
        ("# syntax: spot", 'G({"rose(a)"; b}|->X"lit")'),
        ("p: G (" + " || ".join(f"rose(n == {i}) || fell(n == {i})" for i in range(MOST)) + ")",),
        ("p: G (changed(n) || b)",),
    ],
)
def test_an_edge_stays_a_hidden_variable(lines: tuple[str, ...]) -> None:
    problem = past_of(*lines)
    assert problem.program().vars
    assert any(v.name.startswith("$before") for v in problem.program().vars)


def test_a_rule_keeps_the_hidden_variable_that_formulas_do_without() -> None:
    problem = past_of("p: G !rose(a)", "forbid q: [rose(a)] [b]")
    assert "rose(a)" in {a.name for a in problem.program().atoms} >= {"a", "b"}
    assert not problem.shown


MANY = " || ".join(f"rose(n == {i})" for i in range(4)) + " || rose(a)"
"""More edges than a formula may remember."""


@pytest.mark.parametrize("first", [True, False])
def test_a_formula_with_many_edges_does_not_change_how_others_are_read(first: bool) -> None:
    lines = ["few: G (rose(a) -> !fell(b))", "other: G (rose(b) -> !rose(n == 1))"]
    many = f"many: G ({MANY} || !lit)"
    problem = past_of(*([many, *lines] if first else [*lines, many]))
    own = {line.name: (set(line.edges), set(line.searched)) for line in problem.properties}
    assert own["few"] == ({"rose(a)", "fell(b)"}, {"a", "b"})
    assert own["other"] == ({"rose(b)", "rose(n == 1)"}, {"b", "n == 1"})
    hidden = {"rose(a)", *(f"rose(n == {i})" for i in range(4))}
    assert own["many"] == (set(), {*hidden, "lit"})
    assert problem.shown == {"fell(b)", "rose(b)"}
    assert {a.name for a in problem.searched} == {*hidden, "lit", "a", "b", "n == 1"}


def test_an_assumption_with_many_edges_keeps_them_for_itself() -> None:
    problem = past_of("p: G (rose(a) -> !fell(b))", f"assume e: G ({MANY} || !b)")
    assert [set(line.edges) for line in (*problem.properties, *problem.assumptions)] == [{"rose(a)", "fell(b)"}, set()]
    assert problem.shown == {"fell(b)"}


@pytest.mark.parametrize("kept", [f"many: G (({MANY}) || !lit)", "forbid rule: [rose(a) && rose(b)] [rose(n == 1)]"])
def test_a_group_has_hidden_variables_for_its_own_properties_only(kept: str) -> None:
    problem = past_of("p: G (rose(a) -> !fell(a))", "q: G (rose(b) -> !fell(b))", kept)
    groups = [group.problem for group in groups_of(problem, 0)]
    names = [{p.name for p in group.properties} for group in groups]
    assert sorted(map(len, names)) == [1, 1, 1]
    for group in groups:
        (line,) = group.properties
        hidden = {v.name for v in group.program().vars if v.name.startswith("$before")}
        assert bool(hidden) is (line.name not in ("p", "q")), line.name
        assert set(line.searched) == {a.name for a in group.searched}
        assert set(line.atoms) <= {a.name for a in group.performed().atoms}


def test_members_of_a_family_have_operands_of_their_own() -> None:
    problem = past_of("for i in 0..1: p: G (rose(n == i) == b)")
    assert [str(line.edges[key]) for line in problem.properties for key in line.atoms] == [
        "n == i && Y !(n == i) <-> b",
        "n == i (2) && Y !(n == i (2)) <-> b",
    ]


def test_traces_speak_the_words_of_the_user() -> None:
    (found,) = verify(load_arrangement_text(BUTTONS), parse_properties([Source("p", "p: G !rose(lit)")])).properties
    assert found.text == "G !rose(lit)"
    assert found.trace is not None
    assert {key for key, _ in found.trace.initial_atoms} == {"rose(lit)"}
    assert [cause.atom for step in found.trace.steps for cause in step.causes] == ["rose(lit)"]
    assert found.trace.because == "`rose(lit)` is true at step 2"


def test_an_edge_that_never_happens_is_found() -> None:
    lines = "p: G (rose(n == 3 && lit && m@OFF && n == 0) -> b)\nq: F G !b || G !(rose(lit && !lit) && a)"
    p, q = verify(load_arrangement_text(BUTTONS), parse_properties([Source("p", lines)])).properties
    never = "rose(n == 3 && lit && m@OFF && n == 0)"
    assert [(v.kind, v.subject) for v in p.vacuity.findings] == [("antecedent", f'"{never}"')]
    assert [(v.kind, v.subject) for v in q.vacuity.findings] == [("letter", "rose(lit && !lit)")]
    assert (p.vacuity.never, q.vacuity.never) == ((never,), ("rose(lit && !lit)",))


@pytest.mark.parametrize("assumption", ["", "\nassume e: G F b", "\nassume e: G !rose(lit)"])
def test_an_edge_that_no_configuration_shows_is_found_under_assumptions_too(assumption: str) -> None:
    """An edge that only the assumptions leave out is not among these."""
    lines = f"p: F G !b || G (rose(n == 3 && m@OFF && n == 0) || F b) && G (!rose(lit) || n < 9){assumption}"
    (p,) = verify(load_arrangement_text(BUTTONS), parse_properties([Source("p", lines)])).properties
    assert p.verdict is Verdict.HOLDS
    assert p.vacuity.never == ("rose(n == 3 && m@OFF && n == 0)",)


def test_a_formula_under_an_assumption_says_that_an_edge_never_holds() -> None:
    text = BUTTONS.replace("lit = true; ", "").replace("lit = false;", "")
    lines = "assume e: G F a\nq: G (changed(lit) || m@ON || m@OFF)"
    (q,) = verify(load_arrangement_text(text), parse_properties([Source("p", lines)])).properties
    said = [(v.kind, v.message) for v in q.vacuity.findings]
    assert said == [("letter", "`changed(lit)` never holds in any configuration reached")]

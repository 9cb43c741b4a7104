"""Whole checks: findings beside verdicts, strictness, and witnesses."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, assume, event, given, settings

from llfsm_verify.analysis.vacuity.check import Letters
from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.checking.goals.kinds import goals_of
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.trace import Trace
from llfsm_verify.checking.verdict import NO_RUN, Options, PropertyResult, Result, Verdict
from llfsm_verify.engines.explicit.explored import ExploredGraph, Schedules
from llfsm_verify.engines.explicit.options import ExplicitOptions
from llfsm_verify.engines.explicit.search import Search
from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.limits import Budget, Limits
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.report.wording import verdict_text
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.verification.verify import verify
from tests.checking.replaying import Problem, again, lines_of, problems
from tests.quick import examples, many

LIGHTS = load_arrangement("models/traffic_lights/arrangement.yaml")
LIMITS = Limits(max_states=1_000)
ALL = Options(LIMITS, vacuity="all", witnesses=True)
SLOW = [HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.filter_too_much]
EMPTY = "G (ns@GREEN && ew@GREEN -> F car)"


def checked(text: str, options: Options = ALL) -> Result:
    return verify(LIGHTS, lines_of(text), options, engine="explicit")


def only(text: str, options: Options = ALL) -> PropertyResult:
    (found,) = checked(text, options).properties
    return found


def check(problem: Problem) -> None:
    """Every witness of a finding holds by itself; every witness run has the property when it is run again."""
    arrangement, lines = problem
    result = verify(arrangement, lines, ALL, engine="explicit")
    (found,) = result.properties
    assume(found.verdict is Verdict.HOLDS)
    event(f"findings: {sorted({f.kind for f in found.vacuity.findings})}")
    assert found.vacuity.looked == "all"
    assumed = "".join(f"\nassume {p.name}: {p.text}" for p in lines.assumptions)
    for finding in found.vacuity.findings:
        if finding.witness is not None:
            (stronger,) = verify(
                arrangement, lines_of(f"s: {finding.witness}{assumed}"), Options(LIMITS), engine="explicit"
            ).properties
            assert stronger.verdict is Verdict.HOLDS
    if found.witness is not None:
        event("witness")
        assert again(arrangement, lines, found.witness).outcome == "passes"
    else:
        assert found.notes or found.vacuity.findings
    smaller = replace(ALL, witnesses=False, own=(ExplicitOptions(cone="on", compression="on"),))
    reduced = verify(arrangement, lines, smaller, engine="explicit").properties[0].vacuity
    assert (reduced.findings, reduced.never, reduced.always) == (
        found.vacuity.findings, found.vacuity.never, found.vacuity.always
    )  # fmt: skip
    cheap = verify(arrangement, lines, Options(LIMITS), engine="explicit").properties[0].vacuity
    kinds = ("antecedent", "valid", "assumptions")
    assert cheap.looked == "antecedents"
    outermost = {f.witness for f in found.vacuity.findings}
    assert all(f in cheap.findings for f in found.vacuity.findings if f.kind in kinds)
    assert all(f.witness in outermost or f.kind in ("antecedent", "letter") for f in cheap.findings if f.witness)


@pytest.mark.slow
@settings(max_examples=6, deadline=None, suppress_health_check=SLOW)
@given(problems())
def test_what_is_found_holds_and_witnesses_do_too(problem: Problem) -> None:
    check(problem)


@pytest.mark.long
@settings(max_examples=many(500), deadline=None, suppress_health_check=SLOW)
@given(problems())
def test_what_is_found_holds_and_witnesses_do_too_at_length(problem: Problem) -> None:
    check(problem)


@pytest.mark.parametrize(
    ("line", "kind", "message"),
    [
        (
            f"v: {EMPTY}",
            "antecedent",
            "`ns@GREEN && ew@GREEN` is never true in any run: `G !(ns@GREEN && ew@GREEN)` also holds",
        ),
        ("v: G (car -> car)", "valid", "every run of any arrangement satisfies it"),
        ("v: G (ns_turn -> !(ns@GREEN && ew@GREEN))", "subformula", "does not matter"),
        ("forbid v: [ns@GREEN && ew@GREEN] ns@RED", "letter", "matches no configuration reached"),
        ("enforce v: (ns@RED ns@GREEN ns@AMBER | [ns@GREEN && ew@RED && ew@AMBER])*", "letter", "matches no"),
        ("forbid v: [ns@GREEN && ew@GREEN && car]", "subformula", "`car` does not matter"),
        ("v: ns_turn -> G (ew@GREEN -> ns@RED || ns_turn && ew_turn)", "subformula", "does not matter"),
    ],
)
def test_empty_passes(line: str, kind: str, message: str) -> None:
    found = only(line)
    assert found.verdict is Verdict.HOLDS
    assert (kind, True) in [(f.kind, message in f.message) for f in found.vacuity.findings]


@pytest.mark.slow
def test_rules_that_say_something_have_no_finding() -> None:
    rules = checked(
        "enforce o: (ns@RED ns@GREEN ns@AMBER)*\nforbid b: [ns@GREEN && ew@GREEN]\nm: G !(ns@GREEN && ew@GREEN)\n"
        "forbid s: ns@GREEN ns@RED | ew@GREEN ew@RED\nt: G (timer.ran && car -> F[<=16s] ew@GREEN)"
    )
    assert all(p.verdict is Verdict.HOLDS and not p.vacuity.findings for p in rules.properties)


def test_an_unsatisfiable_formula_is_said_to_be_so_beside_its_violation() -> None:
    found = only("c: F (car && X !car) && G car")
    assert found.verdict is Verdict.VIOLATED
    assert [f.kind for f in found.vacuity.findings] == ["unsatisfiable"]


def test_what_never_happens_under_assumptions_is_said_so() -> None:
    (finding,) = only("assume x: G !car\na: G (car -> F ew@GREEN)").vacuity.findings
    assert finding.message == "`car` is never true in any run under the assumptions: `G !car` also holds"


def test_a_witness_takes_steps_where_it_can() -> None:
    witness = only("a: G F ns@GREEN || G car").witness
    assert witness is not None and any(dict(step.atoms).get("ns@GREEN") for step in witness.steps)
    witness = only("a: ns@RED").witness
    assert witness is not None and not witness.steps


def test_assumptions_that_no_run_satisfies() -> None:
    impossible = "assume x: F (ns@GREEN && ew@GREEN)"
    assert [f.message for f in only(f"{impossible}\na: G !ns@GREEN").vacuity.findings] == [NO_RUN]
    both = only("assume x: G car\nassume y: F !car\na: G !ns@GREEN").vacuity.findings
    assert [f.message for f in both] == [f"{NO_RUN}: the assumptions contradict each other, whatever the arrangement"]
    one = only("assume x: F (ns@GREEN && ns@RED)\na: G !ns@GREEN").vacuity.findings
    assert [f.message for f in one] == [f"{NO_RUN}: nothing ever satisfies x, whatever the arrangement"]


def test_such_a_pass_is_unknown_unless_somebody_asks_for_it() -> None:
    def said(text: str, *, allow: bool) -> tuple[str, int]:
        result = verify(LIGHTS, lines_of(text), Options(allow_contradiction=allow), "explicit")
        return verdict_text(result, result.properties[0]), result.exit_code

    none, some = "assume x: G car\nassume y: F !car\na: G !ns@GREEN", "assume x: G F car\na: G !(ns@GREEN && ew@GREEN)"
    assert (said(none, allow=False), said(none, allow=True)) == (("unknown", 4), ("holds vacuously", 0))
    assert said(some, allow=False) == said(some, allow=True) == ("holds", 0)


@pytest.mark.slow
def test_atoms_that_never_hold_are_listed_and_found_unless_that_is_the_claim() -> None:
    claim = only("a: G !(ns_light == RED && ew_light == RED && ns@GREEN && ew@GREEN)")
    assert claim.vacuity.never == ()
    slow = load_arrangement("models/komodo_stroll/arrangement.yaml")
    lines = lines_of("a: G !stroll@STOP\nb: G (F stroll@STROLL -> (stroll@STOP <-> F stroll@STOP))")
    dead, other = verify(slow, lines, ALL, engine="explicit").properties
    assert dead.vacuity.never == ("stroll@STOP",) and not dead.vacuity.findings
    assert "stroll@STOP" in other.vacuity.never
    assert [f.kind for f in other.vacuity.findings] == ["subformula"]


def test_strict_fails_what_is_empty_and_not_what_is_accepted() -> None:
    strict = replace(ALL, strict=True, witnesses=False)
    assert checked(f"v: {EMPTY}", strict).exit_code == 1
    assert checked(f"v: {EMPTY}", replace(strict, accepted=frozenset({"v"}))).exit_code == 0
    assert checked(f"v: {EMPTY}").exit_code == 0
    assert checked("m: G !(ns@GREEN && ew@GREEN)", strict).exit_code == 0


@pytest.mark.slow
def test_what_a_limit_leaves_unlooked_at_is_unknown_to_strict(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("llfsm_verify.analysis.vacuity.check.ASKED_LEAST", -1e9)
    result = checked("m: G !(ns@GREEN && ew@GREEN)", replace(ALL, strict=True))
    (found,) = result.properties
    assert found.vacuity.looked == "no" and "not checked for vacuity" in str(found.vacuity.reason)
    assert result.exit_code == 4
    assert checked("m: G !(ns@GREEN && ew@GREEN)").exit_code == 0


def witness(text: str) -> Trace:
    found = only(text).witness
    assert found is not None
    assert again(LIGHTS, lines_of(text), found).outcome == "passes"
    return found


def shows(trace: Trace, *atoms: str) -> bool:
    return any(set(atoms) <= {name for name, value in step.atoms if value} for step in trace.steps)


@pytest.mark.slow
def test_a_witness_shows_antecedent_and_consequent() -> None:
    trace = witness("assume fair: G F (timer.ran && car)\nserved: G (timer.ran && car -> F ew@GREEN)")
    assert trace.loop is not None
    assert shows(trace, "timer.ran", "car") and shows(trace, "ew@GREEN")
    short = witness("next: G (ns@GREEN -> ns@GREEN W ns@AMBER)")
    assert shows(short, "ns@GREEN")


@pytest.mark.slow
def test_a_witness_without_an_implication_shows_what_matters() -> None:
    trace = witness("m: G !(ns@GREEN && ew@GREEN)")
    assert trace.loop is None and trace.witness and trace.because is None
    assert shows(trace, "ew@GREEN") or shows(trace, "ns@GREEN")
    rule = witness("enforce o: (ns@RED ns@GREEN ns@AMBER)*")
    assert all(shows(rule, f"ns@{state}") for state in ("GREEN", "AMBER"))


def test_what_never_happens_has_no_witness() -> None:
    found = only(f"v: {EMPTY}")
    assert found.witness is None
    assert found.notes == ("no witness is shown: what it speaks of never happens",)


@pytest.mark.slow
def test_every_model_holds_for_its_properties_with_known_findings_only() -> None:
    """The property files of the case studies that nothing is found in at all, and what is known of others."""
    path = Path("properties/traffic_lights.ltl")
    lines = lines_of(path.read_text(encoding="utf-8"))
    assert isinstance(lines, PropertySet)
    findings = {
        p.name: p.vacuity.findings for p in verify(LIGHTS, lines, Options(vacuity="all"), engine="explicit").properties
    }
    assert {name: [f.witness for f in found] for name, found in findings.items() if found} == {
        "car_served": ["G F ew@GREEN"]
    }


def letters_decide(problem: Problem) -> None:
    """What letters alone tell is what a search finds."""
    arrangement, lines = problem
    assume(not lines.assumptions)
    (line,) = lines.properties
    assert line.formula is not None
    bound = bind(arrangement, lines)
    budget = Budget(LIMITS)
    explorer = Explorer(lower(arrangement, bound.atoms), budget)
    search = Search(explorer, bound, goals_of(bound))
    search.run()
    assume(search.graph.complete)
    told = Letters(ExploredGraph(search, Schedules(explorer))).decide(line.formula)
    assume(told is not None)
    event(f"told: {told}")
    assert told == (search.tasks[0].violation is None)


@pytest.mark.slow
@settings(max_examples=examples(12), deadline=None, suppress_health_check=SLOW)
@given(problems())
def test_whether_a_violation_exists_is_told_as_by_the_search_for_a_run(problem: Problem) -> None:
    arrangement, lines = problem
    bound = bind(arrangement, lines)
    explorer = Explorer(lower(arrangement, bound.atoms), Budget(LIMITS))
    search = Search(explorer, bound, goals_of(bound))
    search.run()
    for task in search.tasks:
        found = search.violation(task.goal) is not None
        event(f"violated: {found}, assumed: {bool(lines.assumptions)}")
        assert search.violates(task.goal) == found


@pytest.mark.slow
@settings(max_examples=examples(8), deadline=None, suppress_health_check=SLOW)
@given(problems("G !({})"))
def test_letters_alone_tell_what_a_search_finds(problem: Problem) -> None:
    letters_decide(problem)


@pytest.mark.long
@settings(max_examples=many(500), deadline=None, suppress_health_check=SLOW)
@given(problems("G !({})"))
def test_letters_alone_tell_what_a_search_finds_at_length(problem: Problem) -> None:
    letters_decide(problem)


def test_a_time_limit_leaves_time_for_the_findings():
    for timeout in (None, 600):
        found = only(EMPTY, Options(Limits(timeout=timeout)))
        assert found.vacuity.looked == "antecedents" and found.vacuity.findings


@pytest.mark.slow
@pytest.mark.parametrize("text", ["enforce t: ([car] | [!car])*", "enforce t: ([!car]* [car])*"])
def test_a_rule_that_every_run_satisfies_is_valid(text):
    for extent in ("antecedents", "all"):
        found = only(text, Options(LIMITS, vacuity=extent))
        assert [(f.kind, f.message) for f in found.vacuity.findings] == [
            ("valid", "every run of any arrangement satisfies it")
        ]
    assert verify(LIGHTS, lines_of(text), replace(ALL, strict=True), engine="auto").exit_code == 1
    meant = verify(LIGHTS, lines_of("enforce t: (ew@RED ew@GREEN ew@AMBER)*"), replace(ALL, strict=True), engine="auto")
    assert meant.exit_code == 0


def test_proofs_are_looked_at_where_only_some_have_edges() -> None:
    lines = lines_of("one: G (car && !car -> X car)\nother: G (changed(car && !car) -> car)")
    result = verify(LIGHTS, lines, Options(LIMITS), engine="induction")
    assert [p.verdict for p in result.properties] == [Verdict.HOLDS, Verdict.HOLDS]

"""How empty proved passes are: what the explicit engine says in a graph, without one."""

from __future__ import annotations

from collections import Counter

import pytest
from hypothesis import HealthCheck, settings

from llfsm_verify.analysis.vacuity.proved import mark_unexamined
from llfsm_verify.arrangement.loader import load_arrangement, load_arrangement_text
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.verdict import NO_RUN, Options, PropertyResult, Result, Verdict
from llfsm_verify.diagnostics import Source
from llfsm_verify.engines.unrolled.options import UnrolledOptions
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.verification.verify import verify
from tests.checking.problems import problems
from tests.quick import each, many, spread

KINDS = ("antecedent", "subformula", "valid", "assumptions")
"""What is looked for in proofs."""

TWO = """
name: two
whiteboard:
  go: {type: bool, role: input}
machines:
  m:
    inline:
      machine: M
      states:
        - {name: A, transitions: [{when: go, to: B}]}
        - {name: B, transitions: [{when: "true", to: A}]}
schedule: [m]
"""


def kinds(result: PropertyResult) -> list[tuple[str, str]]:
    return [(f.kind, f.subject) for f in result.vacuity.findings if f.kind in KINDS]


def compare(problem: tuple[Arrangement, PropertySet], tally: Counter[str]) -> None:
    arrangement, lines = problem
    explicit = verify(arrangement, lines, Options(Limits(max_states=600), vacuity="all"), engine="explicit")
    if not explicit.complete:
        return
    proved = verify(
        arrangement, lines, Options(effort=20_000_000, vacuity="all", own=(UnrolledOptions(depth=12),)), "pdr"
    )
    for ours, theirs in zip(proved.properties, explicit.properties, strict=True):
        if ours.verdict is not Verdict.HOLDS or theirs.verdict is not Verdict.HOLDS:
            continue
        if ours.vacuity.reason is not None or theirs.vacuity.reason is not None:
            tally["not looked"] += 1
            continue
        assert kinds(ours) == kinds(theirs), ours.text
        tally["empty" if kinds(ours) else "not empty"] += 1


def run(count: int) -> None:
    """Compare that many, and more until both answers have come."""
    tally: Counter[str] = Counter()
    amount = settings(max_examples=count, deadline=None, suppress_health_check=list(HealthCheck))
    met = each(tally, ["empty", "not empty"])
    spread(lambda problem: compare(problem, tally), amount, problems(), size=5, until=met)


@pytest.mark.slow
def test_a_proof_of_what_never_happens_says_so() -> None:
    text = "v: G (m@A && m@B -> F go)\nf: G (m@B -> X !m@B)\n"
    arrangement = load_arrangement_text(TWO, "two.yaml")
    lines = parse_properties([Source("two.ltl", text)])
    result = verify(arrangement, lines, Options(vacuity="all"), "pdr")
    assert [p.verdict for p in result.properties] == [Verdict.HOLDS] * 2
    empty, fine = result.properties
    assert ("antecedent", "m@A && m@B") in kinds(empty) and empty.vacuity.reason is None
    assert kinds(fine) == [] and fine.vacuity.reason is None


@pytest.mark.long
def test_many_random_arrangements() -> None:
    run(many(150))


def lights(*lines: str, vacuity: str = "antecedents") -> Result:
    arrangement = load_arrangement("models/traffic_lights/arrangement.yaml")
    properties = parse_properties([Source("test.ltl", "\n".join(lines))])
    return verify(arrangement, properties, Options(vacuity=vacuity), "pdr")  # type: ignore[arg-type]


@pytest.mark.slow
def test_an_antecedent_that_is_never_true() -> None:
    result = lights("a: G (ns@GREEN && ew@GREEN -> car)", "b: G (ns@GREEN -> !ew@GREEN)")
    assert [kinds(p) for p in result.properties] == [[("antecedent", "ns@GREEN && ew@GREEN")], []]
    assert [(p.vacuity.looked, p.vacuity.reason) for p in result.properties] == [("antecedents", None)] * 2


@pytest.mark.slow
def test_assumptions_that_contradict_each_other() -> None:
    (result,) = lights("assume x: G car", "assume y: F !car", "a: G (ns@GREEN -> car)").properties
    assert kinds(result) == [("assumptions", "x, y")]
    assert result.verdict is Verdict.UNKNOWN and not result.proofs


@pytest.mark.slow
def test_assumptions_that_no_run_of_this_arrangement_satisfies() -> None:
    """They do not contradict each other: that no run satisfies them takes a proof."""
    lines = parse_properties([Source("test.ltl", "assume x: F (m@B && X m@B)\na: G m@A")])
    (result,) = verify(load_arrangement_text(TWO, "two.yaml"), lines, engine="pdr").properties
    assert (result.verdict, result.reason, result.notes) == (Verdict.UNKNOWN, NO_RUN, ())


@pytest.mark.slow
def test_a_limit_is_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where it ends the building of the stronger formulas' search: what was proved is not lost."""

    def ends(*_: object) -> dict[str, bool | None]:
        raise MemoryError

    monkeypatch.setattr("llfsm_verify.verification.harness._Check._decided", ends)
    (result,) = lights("a: G (ns@GREEN -> !ew@GREEN)").properties
    assert result.verdict is Verdict.HOLDS and result.proofs
    assert result.vacuity.reason == "not checked for vacuity: whether `G !ns@GREEN` also holds is not known"
    (late,) = mark_unexamined((result,), "interrupted")
    assert late.vacuity.reason == "not checked for vacuity: interrupted"


@pytest.mark.slow
def test_what_is_not_known_is_said() -> None:
    (result,) = lights("forbid a: [ns@GREEN] [ew@GREEN]").properties
    assert (result.vacuity.looked, result.vacuity.findings) == ("no", ())
    assert result.vacuity.reason == "not checked for vacuity: pdr explores no configurations"


def test_edges_of_stronger_formulas_are_atoms_again() -> None:
    arrangement = load_arrangement_text(TWO)
    lines = parse_properties([Source("p.ltl", "one: G !(m@A && m@B)\ntwo: G (rose(go && m@A) -> go)\n")])
    result = verify(arrangement, lines, Options(effort=1_000_000, own=(UnrolledOptions(depth=6),)), "pdr")
    assert [p.verdict for p in result.properties] == [Verdict.HOLDS, Verdict.HOLDS]

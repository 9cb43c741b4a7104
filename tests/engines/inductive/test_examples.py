"""What enumeration cannot end with: numbers without bounds, proved, with invariants that can be read."""

from __future__ import annotations

import re
import time

import pytest

from llfsm_verify.arrangement.loader import load_arrangement, load_arrangement_text
from llfsm_verify.backends.smt.solver import SolverBudget
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.verdict import NO_RUN, Options, Result, Verdict
from llfsm_verify.diagnostics import Source
from llfsm_verify.engines.inductive import certify as cvc
from llfsm_verify.engines.inductive import engine
from llfsm_verify.engines.inductive.engine import InductiveSession
from llfsm_verify.engines.inductive.system import Answer, System, Undecided
from llfsm_verify.engines.unrolled.options import UnrolledOptions
from llfsm_verify.limits import Budget, LimitReached, Limits
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.verification import harness
from llfsm_verify.verification.verify import verify
from tests.outside import needs

COUNTER = """
name: counter
cycle_ms: 100
whiteboard:
  up: {type: bool, init: false, role: input}
  count: {type: int, init: 0}
  step: {type: int, init: 1}
machines:
  c:
    inline:
      machine: C
      states:
        - name: RUN
          internal: if (up) { count = count + step; step = step + 2; }
          transitions: [{when: count > 1000000, to: DRAIN}]
        - {name: DRAIN, on_entry: step = 1;, internal: count = count - 1;, transitions: [{when: count <= 0, to: RUN}]}
schedule: [c]
"""
WAIT = """
name: wait
cycle_ms: 100
whiteboard:
  go: {type: bool, init: false, role: input}
  served: {type: int, init: 0}
machines:
  c:
    inline:
      machine: C
      variables: {n: {type: 0..5, init: 0}}
      states:
        - {name: IDLE, on_entry: n = 0;, transitions: [{when: go, to: BUSY}]}
        - {name: BUSY, internal: n += 1;, transitions: [{when: n == 5, to: DONE}]}
        - {name: DONE, on_entry: served = served + 1;, transitions: [{when: served > 0, to: IDLE}]}
schedule: [c]
"""  # fmt: skip
RUN_DOWN = "G (c@DRAIN -> F c@RUN)"


def check(text: str, lines: str, name: str, **limits: float) -> Result:
    arrangement = load_arrangement(text) if text.startswith("models/") else load_arrangement_text(text, "test.yaml")
    options = Options(
        Limits(timeout=limits.get("timeout")), own=(UnrolledOptions(depth=int(limits.get("depth", 0)) or None),)
    )
    return verify(arrangement, parse_properties([Source("test.ltl", lines)]), options, name)


def invariants(result: Result) -> list[set[str]]:
    return [set(p.invariant) for item in result.properties for p in item.proofs]


@pytest.mark.slow
def test_mutual_exclusion_of_the_traffic_lights() -> None:
    result = check("models/traffic_lights/arrangement.yaml", "G !(ns@GREEN && ew@GREEN)", "pdr")
    assert result.exit_code == 0 and result.complete
    (lines,) = invariants(result)
    # Such as !(ew@GREEN && ns@GREEN), or ew@RED || ns@RED, by the version of Z3.
    assert set(re.findall(r"\w+@", " ".join(lines))) >= {"ew@", "ns@"}
    (proof,) = result.faults.proofs
    assert proof.invariant == () and proof.k == 0 and proof.unit == "cycle"


@pytest.mark.slow
def test_a_counter_without_bounds(monkeypatch: pytest.MonkeyPatch) -> None:
    """Step by step it cannot be seen that the count stays positive: that takes what is known of `step`."""
    result = check(COUNTER, "count: G count >= 0", "pdr")
    assert invariants(result) == [{"count >= 0", "step >= 1"}] or invariants(result) == [{"count >= 0", "step >= 0"}]
    assert check(COUNTER, "step: G step >= 1", "induction").exit_code == 0
    monkeypatch.setattr(engine, "DEPTH", 0)
    monkeypatch.setattr(engine, "EFFORTS", (1,))
    other = check(COUNTER, "count: G count >= 0", "induction", depth=3)
    assert "not k-inductive for k up to 3" in str(other.properties[0].reason)


@pytest.mark.slow
def test_liveness_beside_a_counter_without_bounds() -> None:
    result = check(WAIT, "G (c@BUSY -> F c@DONE)", "pdr")
    (proof,) = result.properties[0].proofs
    assert proof.shows == "rounds" and proof.bound == 16
    assert "rounds" in dict(proof.legend)


@pytest.mark.slow
def test_violations_are_runs() -> None:
    result = check(WAIT, "a: G served <= 2\nb: G (c@BUSY -> F c@IDLE && served > 1)\nc: G F c@BUSY", "pdr")
    assert [p.verdict for p in result.properties] == [Verdict.VIOLATED] * 3
    traces = [p.trace for p in result.properties]
    assert all(t is not None for t in traces) and traces[2] is not None and traces[2].loop is not None


@pytest.mark.slow
def test_what_is_not_known_has_a_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine, "EFFORTS", (1,))
    monkeypatch.setattr(engine, "DEPTH", 14)
    result = check(COUNTER, RUN_DOWN, "induction", depth=2)
    assert result.properties[0].verdict is Verdict.UNKNOWN
    assert "no run of up to 14 steps violates it" in str(result.properties[0].reason)
    assert result.faults.verdict is Verdict.HOLDS


class Stuck:
    """A prover that knows nothing, and remembers how much work it was asked for."""

    name, depth, effort, integers = "pdr", 1_000, 1_000, True

    def __init__(self) -> None:
        self.asked: list[int] = []

    def ask(
        self, system: System, budget: Budget, depth: int, effort: int, total: SolverBudget, known: object
    ) -> Answer:
        self.asked.append(effort)
        return Undecided("it is stuck")


@pytest.mark.parametrize("stop", [None, "so much"])
def test_what_is_hard_does_not_keep_the_rest_waiting(stop: str | None, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every property has a short attempt and a look at longer runs before any has a long attempt."""
    monkeypatch.setattr(engine, "FIRST_STEPS", 2)
    monkeypatch.setattr(engine, "BETWEEN_STEPS", 4)
    monkeypatch.setattr(engine, "DEPTH", 4)
    monkeypatch.setattr(engine, "REACHED_DEPTH", 4)
    prover = Stuck()

    class Ended(InductiveSession):
        def search(self) -> None:
            super().search()
            if stop is not None:
                raise LimitReached(stop)

    lines = parse_properties([Source("p", "hard: G count >= 0\neasy: G step != 7")])
    problem = bind(load_arrangement_text(COUNTER, "test.yaml"), lines)
    result = harness.check("pdr", lambda given: Ended(given, prover), problem, Options())
    hard, easy = result.properties
    assert (hard.verdict, easy.verdict) == (Verdict.UNKNOWN, Verdict.VIOLATED)
    efforts = prover.asked
    assert efforts == sorted(efforts) and set(efforts) == {20, 1_000, 4_000}
    assert efforts.count(20) == efforts.count(1_000) + 1 == efforts.count(4_000) + 1
    assert hard.reason is not None and "it is stuck" in hard.reason
    assert stop is None or hard.reason.startswith("so much; before that, ")


@pytest.mark.slow
def test_time_is_up() -> None:
    used = time.process_time()
    result = check(COUNTER, RUN_DOWN, "pdr", timeout=1.0)
    assert "time limit of 1 s" in str(result.properties[0].reason)
    assert time.process_time() - used < 60


@pytest.mark.slow
@pytest.mark.parametrize("name", ["induction", "pdr"])
def test_time_is_up_with_a_monitor_of_a_thousand_states(name: str) -> None:
    """Writing it for the solver, and the solver's reading it, took minutes that no limit ended."""
    used = time.process_time()
    result = check(WAIT, "G (c@BUSY -> F[<=100000ms] c@DONE)", name, timeout=1.0)
    assert [p.verdict for p in result.properties] == [Verdict.UNKNOWN]
    assert time.process_time() - used < 60


@pytest.mark.slow
def test_without_a_second_solver(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cvc, "is_installed", lambda: False)
    result = check(COUNTER, "step: G step >= 1", "pdr")
    assert [len(p.checked_by) for p in result.properties[0].proofs] == [1]


DIVISIONS = """
name: divisions
whiteboard:
  a: {type: uint8, init: 7, role: input}
  b: {type: -9..9, init: 0, role: input}
  n: {type: uint8, init: 3}
  m: {type: -20..20, init: 0}
machines:
  c:
    inline:
      machine: C
      states:
        - name: RUN
          internal: n = (n * 5 + a) % 7; m = n / 3 - b / 4 + m % 5;
          transitions: [{when: n == 6 && m == 1, to: RUN}]
schedule: [c]
"""


@pytest.mark.slow
@needs("cvc5")
@pytest.mark.parametrize("name", ["induction", "pdr"])
def test_a_second_solver_reads_divisions(name: str, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level("INFO", cvc.__name__):
        result = check(DIVISIONS, "small: G n < 7\nnear: G m <= 8", name)
    assert not caplog.records
    assert result.exit_code == 0
    assert [len(p.checked_by) for r in result.properties for p in r.proofs] == [2, 2]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["induction", "pdr"])
def test_more_atoms_than_letters_can_be_listed(name: str) -> None:
    text = """
name: bits
whiteboard:
  go: {type: bool, init: false, role: input}
  on: {type: {array: bool, size: 24}}
  at: {type: 0..23, init: 0}
machines:
  c:
    inline:
      machine: C
      states:
        - name: RUN
          internal: on[at] = go; on[5] = false; if (at < 23) at += 1; else at = 0;
          transitions: [{when: go && at == 23, to: RUN}]
schedule: [c]
"""
    every = " && ".join(f"on[{i}]" for i in range(24))
    result = check(text, f"never: G !({every})\nfirst: !on[0] W on[5] || {every}", name)
    assert [r.verdict for r in result.properties] == [Verdict.HOLDS, Verdict.VIOLATED]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "count"), [("induction", 2), ("pdr", 3)])
def test_the_microwave(name: str, count: int) -> None:
    lines = [
        "G (time_left == 0 -> X X !motor)",
        "G (time_left > 121 -> X time_left <= timer.before)",
        "G (motor -> lamp)",
    ]
    result = check("models/microwave/arrangement.yaml", "\n".join(lines[:count]), name)
    assert result.exit_code == 0


@pytest.mark.slow
def test_k_induction_is_certified_over_what_matters() -> None:
    """Its runs go through states that differ; in the whole, states differ that are equal in what matters."""
    result = check("models/distance_sensor/arrangement.yaml", "G (speed == 0 -> X speed <= 1)", "induction")
    assert result.exit_code == 0
    (proof,) = result.properties[0].proofs
    assert proof.k > 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("assumed", "said"),
    [
        ("assume a: G F c@IDLE", (Verdict.HOLDS, None)),
        (
            "assume a: G go\nassume b: F !go && F c@IDLE",
            (Verdict.UNKNOWN, f"{NO_RUN}: the assumptions contradict each other, whatever the arrangement"),
        ),
    ],
)
def test_whether_any_run_satisfies_the_assumptions(assumed: str, said: tuple[Verdict, str | None]) -> None:
    result = check(WAIT, f"{assumed}\nn: G c.n <= 5", "pdr")
    assert [(p.verdict, p.reason) for p in result.properties] == [said]
    assert result.properties[0].notes == ()

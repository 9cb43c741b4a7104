"""What proves a property is accepted, and nothing else: by enumeration of every state where there are few."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import pytest
import z3

from llfsm_verify.arrangement.loader import load_arrangement, load_arrangement_text
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.backends.reference import Interpreter, evaluate
from llfsm_verify.backends.smt.arithmetic import Integers
from llfsm_verify.backends.smt.solver import SolverBudget
from llfsm_verify.checking.goals.kinds import goals_of
from llfsm_verify.checking.problem import Problem as Asked
from llfsm_verify.checking.problem import bind
from llfsm_verify.diagnostics import Source
from llfsm_verify.engines.inductive import certify
from llfsm_verify.engines.inductive.certify import BASE, STEP, Certifier, CheckedProof, Rejection, is_installed
from llfsm_verify.engines.inductive.invariant import Invariant
from llfsm_verify.engines.inductive.observers import Prefixes
from llfsm_verify.engines.inductive.provers import Induction, Spacer
from llfsm_verify.engines.inductive.recheck import Rechecking, Saved, read_saved, saved_text
from llfsm_verify.engines.inductive.system import Proved, System, plan_of
from llfsm_verify.engines.unrolled.runs import BAD, Table
from llfsm_verify.kripke.observing import observed_outputs
from llfsm_verify.limits import Budget, Limits
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.program.program import Expr, Get, Int, Program
from llfsm_verify.program.terms import FALSE, TRUE
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.verification.verify import verify
from tests.engines.inductive.corrupting import corrupted
from tests.outside import needs

SMALL = """
name: small
cycle_ms: 100
whiteboard:
  go: {type: bool, init: false, role: input}
  n: {type: 0..3, init: 0}
machines:
  a:
    inline:
      machine: A
      states:
        - {name: IDLE, on_entry: n = 0;, transitions: [{when: go, to: BUSY}]}
        - {name: BUSY, internal: if (n < 3) n += 1;, transitions: [{when: n == 3, to: IDLE}]}
  b:
    inline:
      machine: B
      states:
        - {name: "OFF", transitions: [{when: a@BUSY && n >= 1, to: "ON"}]}
        - {name: "ON", transitions: [{when: a@IDLE, to: "OFF"}]}
schedule: [a, b]
"""
STEADY = "G (n == 2 -> X n >= 2)"
LIGHTS = "models/traffic_lights/arrangement.yaml"
EXCLUSION = "G !(ns@GREEN && ew@GREEN)"
BUDGET = Budget(Limits())
State = tuple[int, ...]


class Problem:
    """One property of bad prefixes, with the conditions of its proofs and one invariant."""

    def __init__(self, arrangement: Arrangement, text: str) -> None:
        self.lines: PropertySet = parse_properties([Source("test.ltl", f"p: {text}")])
        self.arrangement = arrangement
        self.bound: Asked = bind(arrangement, self.lines)
        self.program: Program = lower(arrangement, self.bound.atoms)
        (goal,) = goals_of(self.bound)
        target = plan_of(goal, [], self.program).prefixes
        assert target is not None
        self.target: Prefixes = target
        self.certifier = Certifier(self.program, target)

    def invariant(self) -> Invariant:
        answer = Spacer().ask(System(self.program, self.target, Integers()), BUDGET, 100, Spacer.effort, SolverBudget())
        assert isinstance(answer, Proved)
        return answer.invariant

    def accepts(self, invariant: Invariant, *, others: bool = False) -> bool:
        return isinstance(self.certifier.check(invariant, BUDGET, others=others), CheckedProof)


class Enumerated:
    """Every state between two cycles of a small arrangement beside its monitor, and what can follow in a cycle."""

    def __init__(self, problem: Problem) -> None:
        self.scalars = problem.certifier.system.scalars
        program = problem.program
        self._interpreter = Interpreter(program)
        self._program = program
        self._outputs = dict(observed_outputs(program))
        table = problem.target.table
        assert problem.certifier.system.unit == 2
        self._inner = [s for s in self.scalars if isinstance(s, Get)]
        ranges = [range(s.type.low, s.type.high + 1) for s in self._inner if isinstance(s.type, Int)]
        monitor = range(table.states)
        self.states: list[tuple[State, int]] = [(s, m) for s in product(*ranges) for m in monitor]
        fresh = {v.name: v.init for v in program.vars if not v.output}
        self.first = tuple(fresh[s.var] for s in self._inner), _moved(table, 0, frozenset(_first_letter(program)))
        self.after = {(s, m): set(self._cycle(s, m, table)) for s, m in self.states}

    def _cycle(self, state: State, monitor: int, table: Table) -> Iterator[tuple[State, int] | None]:
        """What is behind a cycle; None: it is bad."""
        values = {v.name: v.init for v in self._program.vars if not v.output}
        outputs = {v.name: v.init for v in self._program.vars if v.output}
        values |= {s.var: x for s, x in zip(self._inner, state, strict=True)}
        now = [(values, monitor)]
        for _ in range(2):
            following = []
            for here, q in now:
                for _, outcome in self._interpreter.successors(here, outputs):
                    letter = frozenset(n for n, o in self._outputs.items() if outcome.outputs[o])
                    reached = _moved(table, q, letter)
                    if reached == BAD:
                        yield None
                    else:
                        following.append((outcome.values, reached))
            now = following
        for here, q in now:
            yield tuple(here[s.var] for s in self._inner), q

    def proves(self, formula: Expr) -> bool:
        """Initiation, consecution and implication, state by state."""
        inside = {s for s in self.states if self._holds(formula, s)}
        return self.first in inside and all(t in inside for s in inside for t in self.after[s])

    def _holds(self, formula: Expr, state: tuple[State, int]) -> bool:
        values = {s.var: x for s, x in zip(self._inner, state[0], strict=True)}
        beside = {s.name: 0 for s in self.scalars if not isinstance(s, Get)} | {f"monitor={state[1]}": 1}
        return bool(evaluate(formula, values, beside))


def _first_letter(program: Program) -> Iterator[str]:
    variables = {v.name: v.init for v in program.vars}
    inputs = {f"input:{i.name}": i.init for i in program.inputs}
    return (a.name for a in program.atoms if evaluate(a.expression, variables, inputs))


def _moved(table: Table, state: int, letter: frozenset[str]) -> int:
    mask = sum(1 << i for i, a in enumerate(table.atoms) if a in letter)
    moves = (m for m in table.moves if m.source == state)
    (target,) = {m.target for m in moves if any(mask & p == p and not mask & n for p, n in m.cubes)}
    return target


@pytest.fixture
def small() -> Problem:
    return Problem(load_arrangement_text(SMALL, "small.yaml"), STEADY)


def against_enumeration(problem: Problem, count: int) -> Counter[bool]:
    """Corrupted invariants, some of which are still good, until `count` are rejected."""
    every, invariant = Enumerated(problem), problem.invariant()
    assert every.proves(invariant.formula)
    tally: Counter[bool] = Counter()
    for formula in corrupted(invariant.conjuncts, problem.certifier.system.scalars, 1):
        accepted = problem.accepts(Invariant(problem.target, formula))
        assert accepted == every.proves(formula)
        tally[accepted] += 1
        if tally[False] == count:
            break
    return tally


@pytest.mark.slow
def test_what_is_accepted_is_inductive(small: Problem) -> None:
    assert against_enumeration(small, 60)[True] > 5


@pytest.mark.long
def test_500_corrupted_invariants_are_rejected(small: Problem) -> None:
    assert against_enumeration(small, 500)[True] > 20


@pytest.mark.long
def test_500_corrupted_invariants_of_the_traffic_lights_are_rejected() -> None:
    problem = Problem(load_arrangement(LIGHTS), EXCLUSION)
    invariant = problem.invariant()
    assert problem.accepts(invariant, others=True)
    rejected = accepted = 0
    for formula in corrupted(invariant.conjuncts, problem.certifier.system.scalars, 2):
        good = problem.accepts(replace(invariant, formula=formula))
        rejected, accepted = rejected + (not good), accepted + good
        if rejected == 500:
            break
    assert accepted < 500


@pytest.mark.slow
def test_induction_needs_its_k(small: Problem) -> None:
    """The least k is accepted, with any larger one; a smaller one is not, nor one without the invariant."""
    answer = Induction().ask(System(small.program, small.target), BUDGET, 20, Induction.effort, SolverBudget())
    assert isinstance(answer, Proved)
    least = answer.invariant.k
    assert least > 0
    assert [small.accepts(replace(answer.invariant, k=k)) for k in range(least + 2)] == [False] * least + [True] * 2
    assert small.accepts(replace(small.invariant(), k=2))
    assert not small.accepts(Invariant(small.target, FALSE, least))
    assert not small.accepts(Invariant(small.target, TRUE, 0))


@pytest.mark.slow
@pytest.mark.parametrize("text", ["G n < 3", "G (n == 2 -> X n >= 2)"])
def test_what_a_certifier_keeps_changes_no_answer(text: str) -> None:
    """One that has checked others says the same as a fresh one."""
    reasons = set()
    shared = Problem(load_arrangement_text(SMALL, "small.yaml"), text)
    for k in (1, 2, 12, 3, 9, 4, 5):
        found = shared.certifier.check(Invariant(shared.target, TRUE, k), BUDGET)
        fresh = Certifier(shared.program, shared.target).check(Invariant(shared.target, TRUE, k), BUDGET)
        assert found == fresh
        reasons.add(found.reason.partition(" fails")[0] if isinstance(found, Rejection) else "")
    assert reasons == ({BASE, STEP} if text == "G n < 3" else {""})


def test_where_the_base_fails_nothing_else_is_asked() -> None:
    violated = Problem(load_arrangement_text(SMALL, "small.yaml"), "G n < 3")
    found = violated.certifier.check(Invariant(violated.target, TRUE, 100_000), BUDGET)
    assert isinstance(found, Rejection) and found.reason.startswith(BASE)
    assert len(violated.certifier._going._stages) < 5


@pytest.mark.slow
@pytest.mark.parametrize("nested", [1, 2, 500])
def test_the_base_may_be_in_several_formulas(small: Problem, monkeypatch: pytest.MonkeyPatch, nested: int) -> None:
    """What another solver reads is impossible; and possible where the base fails."""
    monkeypatch.setattr(certify, "MOST_NESTED", nested)
    base = [*(small.certifier._base(Invariant(small.target, TRUE, 4), BUDGET) or ())]
    assert base
    assert [_is_possible(terms) for terms in base] == [False] * len(base)
    violated = Problem(load_arrangement_text(SMALL, "small.yaml"), "G n < 3").certifier
    stages = [stage for unit in range(12) for stage in violated._begun.stages(unit)]
    found = [_is_possible(violated._somewhere(stages, i)) for i in range(0, len(stages), nested)]
    assert any(found) and (nested == 500 or not all(found))


def _is_possible(terms: list[z3.BoolRef]) -> bool:
    solver = z3.Solver()
    solver.add(*terms)
    return bool(solver.check() == z3.sat)


@pytest.mark.slow
@needs("cvc5")
def test_a_hard_question_costs_only_the_second_opinion(small: Problem, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(certify, "CVC_EFFORT", 1)
    found = small.certifier.check(small.invariant(), BUDGET)
    assert isinstance(found, CheckedProof)
    assert len(found.checked_by) == 1


@pytest.mark.slow
def test_the_second_solver_is_named(small: Problem) -> None:
    found = small.certifier.check(small.invariant(), BUDGET)
    assert isinstance(found, CheckedProof)
    assert len(found.checked_by) == (2 if is_installed() else 1)


NAMESAKE = """
name: clash
whiteboard:
  done: {type: bool}
  rounds: {type: 0..1}
  saved: {type: bool}
  loop: {type: bool}
machines:
  m:
    inline:
      machine: M
      states:
        - {name: A, internal: done = rounds == 1 || saved; loop = true;, transitions: [{when: "false", to: A}]}
schedule: [m]
"""


@pytest.mark.slow
def test_variables_may_be_called_as_what_we_count_with() -> None:
    """`G F done` is false; an invariant for runs in which our counter is theirs proves nothing."""
    arrangement = load_arrangement_text(NAMESAKE, "clash.yaml")
    lines = parse_properties([Source("p.ltl", "served: G F done\ndark: G !loop")])
    for engine in ("pdr", "bmc"):
        assert [p.verdict.value for p in verify(arrangement, lines, engine=engine).properties] == ["violated"] * 2
    text = json.dumps({
        "format": "llfsm-invariants 1", "arrangement": "clash",
        "proved": [{"name": "served", "text": "G F done",
                    "proofs": [{"shows": "rounds", "bound": 1, "k": 0, "says": [], "smt": "true"}]}],
    })  # fmt: skip
    bound = bind(arrangement, parse_properties([Source("p.ltl", "served: G F done")]))
    first = next(iter(Rechecking(bound, BUDGET).check(read_saved(text, "x.json").proved)))
    assert (first.accepted, first.reason) == (False, "implication fails: the invariant does not exclude the violation")


@pytest.mark.slow
def test_saved_invariants_may_need_the_assumptions() -> None:
    """Of `p` it does, of `q` it does not."""
    lines = "assume idle: G !go\np: G a@IDLE\nq: G n <= 3"
    problem = load_arrangement_text(SMALL, "small.yaml"), parse_properties([Source("test.ltl", lines)])
    saved = read_saved(saved_text(verify(*problem, engine="pdr")), "x.json").proved
    found = list(Rechecking(bind(*problem), BUDGET).check(saved))
    assert [(f.name, f.accepted, f.wrong) for f in found] == [
        ("p", True, False), ("q", True, False), (None, True, False)
    ]  # fmt: skip
    alone = parse_properties([Source("test.ltl", "p: G a@IDLE\nq: G n <= 3")])
    found = list(Rechecking(bind(problem[0], alone), BUDGET).check(saved))
    assert [(f.name, f.accepted, f.wrong) for f in found] == [
        ("p", False, True), ("q", True, False), (None, True, False)
    ]  # fmt: skip


@pytest.mark.slow
def test_saved_invariants_are_checked_again(small: Problem) -> None:
    result = verify(small.arrangement, small.lines, engine="pdr")
    file = read_saved(saved_text(result), "x.json")
    assert file.arrangement == small.arrangement.name
    saved = file.proved
    found = list(Rechecking(small.bound, BUDGET).check(saved))
    assert [(f.name, f.accepted) for f in found] == [("p", True), (None, True)]
    (one, faults) = saved
    others: list[tuple[Saved, str]] = [
        (replace(one, text="G true"), "another property"),
        (replace(one, proofs=(replace(one.proofs[0], smt="true"),)), "fails"),
        (replace(one, proofs=(replace(one.proofs[0], smt="(< n 0 "),)), "not one term"),
        (replace(one, proofs=(replace(one.proofs[0], smt="(< n zero)"),)), "cannot be read"),
        (replace(one, proofs=(replace(one.proofs[0], smt="(forall ((x Int)) (> x n))"),)), "quantifier"),
        (replace(one, proofs=(replace(one.proofs[0], shows="faults"),)), "does not show"),
    ]
    for wrong, why in others:
        found = list(Rechecking(small.bound, BUDGET).check([wrong, faults]))
        assert not found[0].accepted and found[0].wrong and why in found[0].reason, found[0]
    missing = list(Rechecking(small.bound, BUDGET).check([]))
    assert not any(f.accepted or f.wrong for f in missing)

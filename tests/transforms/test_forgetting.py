"""Forgetting: what examples keep, and that random arrangements lose nothing that letters, faults and runs show."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, reject, settings
from hypothesis import strategies as st

from llfsm_verify.analysis.certificates.making import certificate
from llfsm_verify.arrangement import build_arrangement, load_arrangement_text
from llfsm_verify.certificate import checked
from llfsm_verify.checking.problem import Problem, Programs, bind
from llfsm_verify.checking.verdict import Options, Result
from llfsm_verify.diagnostics import DiagnosticError, Fragment, Source
from llfsm_verify.engines.explicit.options import ExplicitOptions
from llfsm_verify.engines.unrolled.options import UnrolledOptions
from llfsm_verify.language.atoms import PropertyScope, check_atom
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.program import liveness
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Block
from llfsm_verify.semantics.letters import Observed
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.testing.arrangements import Document
from llfsm_verify.testing.properties import state_formulas
from llfsm_verify.transforms import forgetting as transform
from llfsm_verify.transforms.forgetting import Forgetting, forgetting
from llfsm_verify.verification.verify import checker
from tests.quick import FRESH, each, spread
from tests.transforms.forgotten import Differs, compare, storing

COUNT = 500 if FRESH else 60


def stays(document: Document, tally: Counter[str]) -> None:
    """A random arrangement shows the same where it forgets."""
    try:
        arrangement = build_arrangement(document)
    except DiagnosticError:  # such as a plant that would write an input that does not change
        reject()
    scope = PropertyScope.of(arrangement)
    texts = state_formulas(arrangement)
    for share in (3, 12):
        chosen = texts[int(arrangement.digest[:8], 16) % share :: share]
        atoms = [Observed(t, check_atom(Fragment.whole(Source("<atom>", t)), scope)) for t in chosen]
        full = lower(arrangement, atoms, keep_all_bits=True)
        found = forgetting(lower(arrangement, atoms))
        compare(full, found, 15, tally)
        tally["moved"] += bool(found.moved)
        tally["late"] += bool(found.late)
    tally["processes"] += len(arrangement.processes) > 1
    tally["cycles"] += arrangement.observe == "cycle"
    tally["plants"] += bool(arrangement.plants)


KINDS = ("draws saved", "forgotten", "ended", "faults", "moved", "late", "carried", "processes", "cycles", "plants")


@pytest.mark.long
def test_what_is_forgotten_does_not_show() -> None:
    tally: Counter[str] = Counter()
    phases = (Phase.explicit, Phase.reuse, Phase.generate, Phase.shrink)
    chosen = settings(max_examples=COUNT, deadline=None, suppress_health_check=list(HealthCheck), phases=phases)
    spread(lambda document: stays(document, tally), chosen, storing(), size=10, until=each(tally, KINDS))


# ---------------------------------------------------------------- verdicts of all engines


def agrees(document: Document, formula: int, tally: Counter[str]) -> None:
    """Engines come to the verdicts to which they come without forgetting; their runs are performed."""
    try:
        arrangement = build_arrangement(document)
    except DiagnosticError:
        reject()
    texts = state_formulas(arrangement)
    one, two = texts[formula % len(texts)], texts[formula // 7 % len(texts)]
    lines = (f"G ({one})", f"G (({one}) -> F ({two}))", f"({one}) U ({two})", f"G F ({two})")
    problem = bind(arrangement, parse_properties([Source("p.ltl", "\n".join(lines))]))
    tally["asked"] += 1
    for engine in ("explicit", *((("bmc", "pdr")[tally["asked"] % 2],) if tally["asked"] % 4 < 2 else ())):
        cut = tally["asked"] % 3 == 0
        results = [
            said(replace(problem, programs=Programs(forget=forget)), engine, cut=cut) for forget in (True, False)
        ]
        verdicts = [
            [*((p.text, p.verdict.value) for p in r.properties), ("faults", r.faults.verdict.value)] for r in results
        ]
        for mine, other in zip(*verdicts, strict=True):
            if "unknown" in (mine[1], other[1]):
                tally[f"{engine} unknown"] += 1
                continue
            assert mine == other, (engine, document)
            tally[f"{engine} {mine[1]}"] += 1
        counts = [r.exploration.states for r in results]
        complete = engine == "explicit" and all(r.exploration.complete for r in results)
        assert not complete or counts[0] <= counts[1], (counts, document)
        tally["fewer"] += complete and counts[0] < counts[1]


def said(problem: Problem, engine: str, *, cut: bool = False) -> Result:
    """`cut`: the explicit engine searches the cone of influence."""
    own = (UnrolledOptions(depth=4),) if engine != "explicit" else (ExplicitOptions(cone="on" if cut else "auto"),)
    return checker(engine)(problem, Options(Limits(max_states=2_000), effort=50_000, own=own))


@pytest.mark.long
def test_engines_agree_with_those_that_forget_nothing() -> None:
    tally: Counter[str] = Counter()
    phases = (Phase.explicit, Phase.reuse, Phase.generate, Phase.shrink)
    chosen = settings(max_examples=COUNT, deadline=None, suppress_health_check=list(HealthCheck), phases=phases)
    kinds = ("explicit holds", "explicit violated", "bmc violated", "pdr holds", "fewer")
    spread(
        lambda document, n: agrees(document, n, tally), chosen, storing(2), st.integers(0, 10_000), size=10,
        until=each(tally, kinds),
    )  # fmt: skip


# ---------------------------------------------------------------- examples


def machine(name: str, *states: str, variables: str = "{}") -> str:
    more = f"machine: {name.upper()}, variables: {variables}, states: [{', '.join(states)}]"
    return f"  {name}: {{inline: {{{more}}}}}\n"


def state(name: str, *moves: tuple[str, str], **actions: str) -> str:
    made = ", ".join(f"{{when: '{when}', to: {to}}}" for when, to in moves)
    return f"{{name: {name}" + (f", transitions: [{made}]" if made else "") + "".join(
        f", {key}: '{text}'" for key, text in actions.items()
    ) + "}"  # fmt: skip


HELD = "x: {type: bool, role: input, changes: cycle}, y: {type: 0..3, role: input, changes: cycle}"
DRIVEN = "x: {type: bool, role: input}, y: {type: 0..3, role: input}"
PLANT = "environment: {inline: {machine: P, states: [{name: R, internal: 'x = choose(bool); y = choose(0..3);'}]}}\n"
M = machine("m", state("A", ("x && y > 1", "B")), state("B", ("!x", "A")))
K = machine("k", state("A", ("y == 3", "B")), state("B", ("y == 0", "A")))
IDLE, LAST = machine("i", state("A", ("false", "A"))), machine("l", state("A", ("false", "A")))


def text_of(machines: str, turns: str, inputs: str = HELD, more: str = "") -> str:
    turns = turns if ":" in turns else f"schedule: [{turns}]"
    return f"name: t\n{more}whiteboard: {{{inputs}}}\nmachines:\n{machines}{turns}\n"


ENDED = text_of(machine("m", state("A", ("x && y > 1", "B")), state("B")), "m"), "G (m@B -> G y != 2)"
LATER = text_of(IDLE + M + K, "i, m, k"), "G F (m@A && k@A)"
CASES: dict[str, tuple[tuple[str, str], int, int]] = {
    "a guard reads it": ((text_of(M, "m"), "G m@A"), 2, 10),
    "a letter reads it": ((text_of(M, "m"), "G y < 3"), 2, 10),
    "a letter after each cycle reads it": ((text_of(IDLE + M, "i, m", more="observe: cycle\n"), "G y < 3"), 2, 10),
    "snapshot: cycle": ((text_of(M, "m", DRIVEN, "profile: {snapshot: cycle}\n"), "G m@A"), 2, 10),
    "a later machine reads it": ((text_of(IDLE + M + LAST, "i, m, l"), "G F m@A"), 6, 36),
    "two later machines read it": (LATER, 24, 67),
    "the model of the surroundings overwrites it": ((text_of(M, "m", DRIVEN, PLANT), "G m@A"), 2, 10),
    "a machine that is suspended reads it": (
        (
            text_of(
                machine("c", state("A", ("false", "A"), internal="if (x) suspend(k); else resume(k);")) + K, "c, k"
            ),
            "G k@A",
        ),
        12,
        46,
    ),
    "a counter begins anew": (
        (
            text_of(
                machine(
                    "m",
                    state("A", ("x", "B")),
                    state("B", ("n == 3", "A"), on_entry="n = 0;", internal="n = n + 1;"),
                    variables="{n: {type: 0..3}}",
                ),
                "m",
            ),
            "G F m@A",
        ),
        7,
        44,
    ),
    "the last one of an ended arrangement is shown": (ENDED, 6, 16),
    "two processes sample it": ((text_of(M + IDLE, "processes: {p: [m], q: [i]}"), "G F m@A"), 16, 16),
}


def problem_of(case: tuple[str, str]) -> Problem:
    text, line = case
    return bind(load_arrangement_text(text), parse_properties([Source("p.ltl", f"p: {line}")]))


@pytest.mark.parametrize("case", CASES)
def test_configurations_with_and_without_forgetting(case: str) -> None:
    given, fewer, more = CASES[case]
    problem = problem_of(given)
    results = [said(replace(problem, programs=Programs(forget=forget)), "explicit") for forget in (True, False)]
    assert [r.exploration.states for r in results] == [fewer, more]
    assert results[0].properties[0].verdict is results[1].properties[0].verdict


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_certificates_of_programs_that_forget(case: str, tmp_path: Path) -> None:
    problem = problem_of(CASES[case][0])
    result = said(problem, "explicit")
    lines = PropertySet(problem.properties)
    made = certificate(problem.arrangement, lines, result, tmp_path)
    (tmp_path / "proof.json").write_text(made.text)
    assert not made.missing
    checked(tmp_path / "proof.json", tmp_path)


def shows_the_same(case: tuple[str, str]) -> None:
    problem = problem_of(case)
    found = forgetting(lower(problem.arrangement, problem.atoms))
    compare(problem.program(keep_all_bits=True), found, 200, Counter())


def too_early(self: liveness.Liveness, index: int) -> dict[int, liveness.Turns]:
    """What is live one step later."""
    found = analysed(self, index)
    return {i: replace(turns, live=turns.after) for i, turns in found.items()}


analysed = liveness.Liveness._process


def test_forgotten_one_step_too_early_shows(monkeypatch: pytest.MonkeyPatch) -> None:
    shows_the_same(LATER)
    monkeypatch.setattr(liveness.Liveness, "_process", too_early)
    with pytest.raises(Differs):
        shows_the_same(LATER)


def test_forgotten_in_an_ended_process_shows(monkeypatch: pytest.MonkeyPatch) -> None:
    def at_once(ended: str, forget: Block, shown: Block) -> Block:
        return forget

    shows_the_same(ENDED)
    monkeypatch.setattr(transform, "while_running", at_once)
    with pytest.raises(Differs):
        shows_the_same(ENDED)


def test_a_value_that_a_later_slot_draws_is_given_where_its_cycle_began() -> None:
    program = lower(load_arrangement_text(text_of(M, "m")))
    found = Forgetting(program, frozenset({"x", "y"}), {"x": 0})
    moves = [Move(0, {}), Move(0, {"x": 1}), Move(0, {"y": 2}), Move(1, {}), Move(0, {})]
    assert [move.choices for move in found.whole(moves, None)] == [
        {"x": 1, "y": 0}, {"x": 1, "y": 0}, {"x": 0, "y": 2}, {"x": 0, "y": 0}, {"x": 0, "y": 0}
    ]  # fmt: skip
    assert found.whole(moves, 1)[-1].choices == {"x": 1, "y": 0}, "the loop goes on with its first moves"


def test_a_run_of_a_cone_gives_values_that_are_drawn_late() -> None:
    machines = (
        "  a: {inline: {machine: K, states: [{name: S, internal: 'n++;', stays: true}]}}\n"
        "  b: {inline: {machine: L, states: [{name: S, transitions: [{when: x, to: T}]}, "
        "{name: T, transitions: [{when: x, to: S}]}]}}\n"
    )
    text = text_of(machines, "a, b", "x: {type: bool, role: input, changes: cycle}, n: {type: uint8}")
    arrangement = load_arrangement_text(text)
    problem = bind(arrangement, parse_properties([Source("p.ltl", "p: G !b@T\nq: G F b@T")]))
    assert problem.forgetting.moved
    result = said(problem, "explicit", cut=True)
    assert [p.verdict.value for p in result.properties] == ["violated", "violated"] and result.exploration.left_out


def test_with_all_bits_nothing_is_forgotten() -> None:
    problem = problem_of(LATER)
    assert problem.program(keep_all_bits=True) == lower(problem.arrangement, problem.atoms, keep_all_bits=True)


def test_what_forgets_nothing_is_the_same_program() -> None:
    program = lower(
        load_arrangement_text(text_of(machine("m", state("A", ("x", "A"))), "m", "x: {type: bool, role: input}"))
    )
    assert forgetting(program).program == program

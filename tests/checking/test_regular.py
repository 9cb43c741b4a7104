"""Regular properties and automata from files through the engine, against brute force by other automata."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import pytest
from hypothesis import HealthCheck, event, given, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.loader import build_arrangement, load_arrangement_text
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.automata.automaton import Automaton, Edge
from llfsm_verify.automata.boolean import Guards
from llfsm_verify.automata.finite import expressions as regular
from llfsm_verify.automata.ltl.translate import translate
from llfsm_verify.backends.native.layout import Layout
from llfsm_verify.backends.reference import evaluate as truth
from llfsm_verify.checking.goals.kinds import CHECKED
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.replay.confirm import Schedule
from llfsm_verify.checking.trace import Trace
from llfsm_verify.checking.verdict import Options, Verdict
from llfsm_verify.diagnostics import DiagnosticError, Disagreement, Source
from llfsm_verify.engines.explicit import search as searching
from llfsm_verify.engines.explicit.options import ExplicitOptions
from llfsm_verify.engines.unrolled.options import UnrolledOptions
from llfsm_verify.extensions.hoa.writing import write_hoa
from llfsm_verify.kripke.product_search import Walk
from llfsm_verify.limits import Limits
from llfsm_verify.logic.expressions import letters
from llfsm_verify.logic.formula import apply, atom, atoms
from llfsm_verify.logic.properties import Property, PropertySet, parse_properties
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Program
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.testing.arrangements import arrangements
from llfsm_verify.testing.properties import atoms as state_formulas
from llfsm_verify.testing.properties import properties, regular_properties
from llfsm_verify.verification.replay import replay
from llfsm_verify.verification.verify import verify
from tests.kripke.test_random import LARGEST, Naive, TooLarge, naive
from tests.oracle.regular import RegularReference, Void
from tests.quick import examples, many

Letter = frozenset[str]
CHECKS = [HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large, HealthCheck.large_base_example]
LIMITS = Limits(max_states=4 * LARGEST)
REDUCTIONS = {
    "none": Options(LIMITS, own=(ExplicitOptions(cone="off", compression="off"),)),
    "cone": Options(LIMITS, own=(ExplicitOptions(cone="on", compression="off"),)),
    "chains": Options(LIMITS, own=(ExplicitOptions(cone="off", compression="on"),)),
    "both": Options(LIMITS, own=(ExplicitOptions(cone="on", compression="on"),)),
}


def read(*lines: str) -> PropertySet:
    return parse_properties([Source("regular.ltl", "\n".join(lines))], features=CHECKED)


def roots(program: Program, graph: Naive) -> list[tuple[bytes, Letter]]:
    """The initial configurations with what holds in them."""
    layout = Layout.of(program)
    outputs = {v.name: v.init for v in program.vars if v.output}
    inputs = {f"input:{i.name}": i.init for i in program.inputs}
    found = []
    for root in graph.roots:
        values = layout.decode(root) | outputs
        found.append((root, frozenset(a.name for a in program.atoms if truth(a.expression, values, inputs))))
    return found


@st.composite
def problems(draw: st.DrawFn, most: int = 2) -> tuple[Arrangement, list[str]]:
    arrangement = build_arrangement(draw(arrangements(max_machines=2, max_states=3)))
    drawn = draw(st.lists(regular_properties(arrangement), min_size=1, max_size=most))
    return arrangement, [f"{kind} p{i}: {text}" for i, (kind, text) in enumerate(drawn)]


def answered_like_brute_force(problem: tuple[Arrangement, list[str]], reduction: str) -> None:
    arrangement, lines = problem
    try:
        bound = bind(arrangement, read(*lines))
    except DiagnosticError as error:
        event("forbids the empty word")
        if {d.code for d in error.diagnostics} != {"E342"}:
            raise
        return
    program = lower(arrangement, bound.atoms, keep_all_bits=True)
    try:
        graph = naive(program)
    except TooLarge:
        event("too large to search naively")
        return
    references: list[tuple[Property, RegularReference]] = []
    for line in bound.properties:
        assert line.expression is not None
        try:
            references.append((line, RegularReference(line.kind, line.expression)))
        except Void:
            event("void")
            with pytest.raises(DiagnosticError, match=r"E34[24]"):
                verify(arrangement, read(*lines), REDUCTIONS[reduction], engine="explicit")
            return
    result = verify(arrangement, read(*lines), REDUCTIONS[reduction], engine="explicit")
    first = roots(program, graph)
    for p, (line, reference) in zip(result.properties, references, strict=True):
        expected = reference.shortest(first, graph.edges)
        event(f"{p.verdict.value} {line.kind}")
        if expected is None:
            assert p.verdict is (Verdict.UNKNOWN if graph.overflow else Verdict.HOLDS)
            continue
        assert p.verdict is Verdict.VIOLATED
        assert p.trace is not None
        assert p.trace.loop is None
        assert sum(s.observed for s in p.trace.steps) == expected
        assert replayed(arrangement, line, p.trace) == "fails"


def replayed(arrangement: Arrangement, line: Property, trace: Trace) -> str:
    program = lower(arrangement, bind(arrangement, PropertySet((line,))).atoms)
    names = {process.name: i for i, process in enumerate(program.processes)}
    moves = [
        Move(None if s.process is None else names[s.process], {x.choice: x.value for x in s.choices})
        for s in trace.steps
    ]
    return replay(arrangement, PropertySet((line,)), Schedule(trace.initial_free, tuple(moves), trace.loop)).outcome


@pytest.mark.slow
@settings(max_examples=examples(60), deadline=None, suppress_health_check=CHECKS)
@given(problems(), st.sampled_from(list(REDUCTIONS)))
def test_shortest_violations(problem: tuple[Arrangement, list[str]], reduction: str) -> None:
    answered_like_brute_force(problem, reduction)


@pytest.mark.long
@settings(max_examples=many(1_500), deadline=None, suppress_health_check=CHECKS)
@given(problems(3), st.sampled_from(list(REDUCTIONS)))
def test_shortest_violations_many(problem: tuple[Arrangement, list[str]], reduction: str) -> None:
    answered_like_brute_force(problem, reduction)


@pytest.mark.slow
@settings(max_examples=examples(25), deadline=None, suppress_health_check=CHECKS)
@given(st.data())
def test_letters_alone_are_ltl(data: st.DataObject) -> None:
    """`enforce f*` is `G f` and `forbid f` is `G !f`, also under an assumption, with traces of the same length."""
    arrangement = build_arrangement(data.draw(arrangements(max_machines=2, max_states=3)))
    f, assumed = data.draw(state_formulas(arrangement)), data.draw(properties(arrangement))
    lines = [f"enforce a: [{f}]*", f"b: G ({f})", f"forbid c: [{f}]", f"d: G !({f})"]
    if data.draw(st.booleans()):
        lines.append(f"assume x: {assumed}")
    result = verify(
        arrangement, read(*lines), REDUCTIONS[data.draw(st.sampled_from(list(REDUCTIONS)))], engine="explicit"
    )
    a, b, c, d = result.properties
    event(f"{a.verdict.value}, {c.verdict.value}")
    for left, right in ((a, b), (c, d)):
        assert left.verdict is right.verdict
        assert (left.trace is None) == (right.trace is None)
        if left.trace is not None and right.trace is not None:
            assert len(left.trace.steps) == len(right.trace.steps)
            assert left.notes == right.notes


def bad_runs(line: Property) -> Automaton:
    """The runs that violate a regular property, as an automaton over its atoms, from automata-lib's."""
    assert line.expression is not None
    reference = RegularReference(line.kind, line.expression)
    keys = atoms(*letters(line.expression))
    guards = Guards(keys)
    shows = {}
    for valuation, symbol in reference.symbols.items():
        shown = guards.always
        for f in reference.alphabet:
            shown = shown & (guards.of(f) if f in valuation else ~guards.of(f))
        shows[symbol] = shown
    dfa = reference.bad
    start = (dfa.initial_state, "")
    numbers, queue, rows = {start: 0}, [start], []
    for state, last in queue:
        row = []
        for symbol, shown in shows.items():
            after = state if symbol == last else dfa.transitions[state][symbol]
            target = (after, symbol)
            if target not in numbers:
                numbers[target] = len(queue)
                queue.append(target)
            bad = int(after in dfa.final_states)
            row += [Edge(p, n, numbers[target], bad) for p, n in guards.cubes(shown)]
        rows.append(tuple(row))
    return Automaton(keys, tuple(rows), 1)


def agrees_with_automata(arrangement: Arrangement, regular: str, assumed: str, reduction: str, folder: Path) -> None:
    """A regular property, the automaton of its violations, and, as it is deterministic, that of the others."""
    try:
        (line,) = read(regular)
        bad = bad_runs(line)
    except (DiagnosticError, Void):
        event("void")
        return
    (folder / "bad.hoa").write_text(write_hoa(bad))
    good = replace(bad, edges=tuple(tuple(replace(e, acceptance=1 - e.acceptance) for e in row) for row in bad.edges))
    (folder / "good.hoa").write_text(write_hoa(good))
    text = f"{regular}\nautomaton never bad: bad.hoa\nautomaton good: good.hoa\n{assumed}"
    lines = parse_properties([Source(str(folder / "x.ltl"), text)], features=CHECKED)
    result = verify(arrangement, lines, REDUCTIONS[reduction], engine="explicit")
    first, *others = result.properties
    event(f"{first.verdict.value}{' under an assumption' if assumed else ''}")
    for other in others:
        assert other.verdict is first.verdict
        if first.trace is not None and other.trace is not None:
            assert len(first.trace.steps) == len(other.trace.steps)
            goal = next(x for x in lines if x.name == other.name)
            if not assumed:
                assert replayed(arrangement, goal, other.trace) == "fails"


@pytest.mark.slow
@settings(max_examples=examples(30), deadline=None, suppress_health_check=CHECKS)
@given(data=st.data())
def test_automata_of_files_agree(data: st.DataObject, tmp_path_factory: pytest.TempPathFactory) -> None:
    arrangement = build_arrangement(data.draw(arrangements(max_machines=2, max_states=3)))
    kind, text = data.draw(regular_properties(arrangement))
    assumed = f"assume x: {data.draw(properties(arrangement))}" if data.draw(st.booleans()) else ""
    reduction = data.draw(st.sampled_from(list(REDUCTIONS)))
    agrees_with_automata(arrangement, f"{kind} p: {text}", assumed, reduction, tmp_path_factory.mktemp("hoa"))


@pytest.mark.long
@settings(max_examples=many(1_000), deadline=None, suppress_health_check=CHECKS)
@given(data=st.data())
def test_automata_of_files_agree_many(data: st.DataObject, tmp_path_factory: pytest.TempPathFactory) -> None:
    arrangement = build_arrangement(data.draw(arrangements(max_machines=2, max_states=3)))
    kind, text = data.draw(regular_properties(arrangement))
    assumed = f"assume x: {data.draw(properties(arrangement))}"
    reduction = data.draw(st.sampled_from(list(REDUCTIONS)))
    agrees_with_automata(arrangement, f"{kind} p: {text}", assumed, reduction, tmp_path_factory.mktemp("hoa"))


# ---------------------------------------------------------------- one by one

LIGHT = """
name: light
whiteboard:
  go: {type: bool, role: input}
machines:
  m:
    inline:
      machine: Light
      states:
        - {name: RED, transitions: [{when: go, to: GREEN}]}
        - {name: GREEN, transitions: [{when: not go, to: AMBER}]}
        - {name: AMBER, transitions: [{when: go, to: RED}, {when: "true", to: GREEN}]}
schedule: [m]
"""


@pytest.mark.parametrize(
    ("line", "steps"),
    [
        ("enforce a: (m@RED m@GREEN m@AMBER)*", 3),
        ("enforce a: (m@RED (m@GREEN m@AMBER)+)*", None),
        ("enforce a: m@RED m@GREEN m@AMBER true*", None),
        ("enforce a: m@RED m@GREEN", 2),
        ("forbid a: m@AMBER m@GREEN", 3),
        ("forbid a: m@AMBER m@RED m@AMBER", None),
        ("forbid a: m@GREEN m@AMBER m@GREEN m@AMBER m@RED", 5),
        ("forbid initially a: m@RED m@GREEN", 1),
        ("forbid initially a: m@GREEN m@AMBER", None),
        ("forbid initially a: m@RED", 0),
        ("enforce a: m@GREEN true*", 0),
    ],
)
def test_lights(check_light, line: str, steps: int | None) -> None:
    (found,) = check_light(line).properties
    assert found.kind == line.partition(" a:")[0]
    assert found.verdict is (Verdict.HOLDS if steps is None else Verdict.VIOLATED)
    assert (None if found.trace is None else len(found.trace.steps)) == steps


@pytest.fixture
def check_light():
    arrangement = load_arrangement_text(LIGHT, "light.yaml")
    return lambda *lines: verify(arrangement, read(*lines), engine="explicit")


def test_a_bad_prefix_counts_only_when_the_assumptions_can_still_hold(check_light) -> None:
    order = "enforce order: (m@RED m@GREEN m@AMBER)*"
    (found,) = check_light(order, "assume never_back: G !(m@AMBER && X m@GREEN)").properties
    assert (found.verdict, found.notes) == (Verdict.HOLDS, ())
    (found,) = check_light(order, "assume green_at_last: F G m@GREEN").properties
    assert found.verdict is Verdict.VIOLATED
    assert found.trace is not None and found.trace.loop is not None
    assert found.notes == (
        "after step 3 nothing can satisfy it any more; the rest shows that the assumptions can hold",
    )
    (found,) = check_light(order, "assume nonsense: G m@GREEN").properties
    assert found.verdict is Verdict.UNKNOWN
    assert "no run satisfies the assumptions" in (found.reason or "")


def test_void_properties_are_all_named_before_anything_is_searched(check_light) -> None:
    with pytest.raises(DiagnosticError) as raised:
        check_light("good: G m@RED", "enforce one: m@RED m@RED", "forbid two: [m@RED && m@GREEN]")
    assert [(d.code, d.span.line, d.span.column) for d in raised.value.diagnostics if d.span] == [
        ("E344", 2, 14), ("E344", 3, 13)
    ]  # fmt: skip


def test_growth_ends_with_unknown(check_light, monkeypatch: pytest.MonkeyPatch) -> None:
    from llfsm_verify.automata.finite import expressions as regular
    from llfsm_verify.automata.finite import monitor as regular_monitor

    text = "forbid wide: [go] true{12} [m@RED && go] m@AMBER m@RED"
    monkeypatch.setattr(regular_monitor, "MAX_MONITOR_STATES", 50)
    (found,) = check_light(text).properties
    assert (found.verdict, found.reason) == (Verdict.UNKNOWN, "the automaton has more than 50 states")
    monkeypatch.setattr(regular, "MAX_EDGES", 10)
    (found,) = check_light(text).properties
    assert (found.verdict, found.reason) == (Verdict.UNKNOWN, "the automaton has more than 10 transitions")


def test_what_the_definition_does_not_confirm_is_refused(check_light, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(searching, "shortest_bad_prefix", lambda *_: Walk((0,), ()))
    with pytest.raises(Disagreement, match="does not violate the property"):
        check_light("enforce a: (m@RED m@GREEN m@AMBER)*")
    monkeypatch.undo()
    found = searching.continued_bad_prefix
    monkeypatch.setattr(searching, "continued_bad_prefix", lambda r, m, *rest: found(r, Early(m), *rest))
    with pytest.raises(Disagreement, match="satisfies the property"):
        check_light("enforce a: (m@RED (m@GREEN m@AMBER)+)*", "assume go: G F go")


class Early:
    """A monitor that cries at the second letter."""

    def __init__(self, monitor) -> None:
        self.initial = monitor.initial

    def step(self, state: int, letter: int) -> int | None:
        return 1 if state == 0 else None


def test_automata_that_are_not_deterministic(tmp_path: Path) -> None:
    arrangement = load_arrangement_text(LIGHT, "light.yaml")
    at_last = apply("F", apply("G", atom("m@RED")))
    (tmp_path / "at_last.hoa").write_text(write_hoa(translate(at_last)))

    def checked(text: str):
        return verify(
            arrangement, parse_properties([Source(str(tmp_path / "x.ltl"), text)], features=CHECKED), engine="explicit"
        )

    (found,) = checked("automaton never stuck: at_last.hoa").properties
    assert (found.kind, found.text, found.verdict) == ("automaton never", "at_last.hoa", Verdict.VIOLATED)
    assert found.trace is not None and found.trace.loop is not None
    (found,) = checked("automaton never stuck: at_last.hoa\nassume moving: G F m@GREEN").properties
    assert found.verdict is Verdict.HOLDS
    with pytest.raises(DiagnosticError, match=r"x\.ltl:2:15: error\[E364\]"):
        checked("# first\nautomaton it: at_last.hoa")


COUNTER = """
name: counter
cycle_ms: 10
whiteboard:
  n: {type: 0..9}
machines:
  m:
    inline:
      machine: M
      states:
        - name: S
          internal: "n = (n + 1) % 10;"
          transitions: [{when: "false", to: S}]
schedule: [m]
"""


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["explicit", "bmc", "pdr", "induction"])
@pytest.mark.parametrize(
    "line", ["forbid a: ([n == 1] [n == 2]{1,9}){1,9}", "enforce a: (true | [n == 1] [n == 2]){1,9}{1,9}"]
)
def test_a_rule_whose_automaton_is_too_large_is_unknown_to_every_engine(line: str, engine: str) -> None:
    """It has nothing but bad prefixes, and no engine says of runs that it did not look at that none violates it."""
    counter = load_arrangement_text(COUNTER)
    options = Options(own=(UnrolledOptions(depth=None if engine == "explicit" else 4),))
    with patch.object(regular, "MAX_EDGES", 50):
        (found,) = verify(counter, read(line), options, engine=engine).properties
    assert found.verdict is Verdict.UNKNOWN
    assert set((found.reason or "").split("; and ")) == {"the automaton has more than 50 transitions"}

"""What the explorer finds and what the engine answers, against naive searches by the reference interpreter."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import pytest
from hypothesis import HealthCheck, Phase, event, given, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.backends.native.layout import Layout
from llfsm_verify.backends.reference import Interpreter, evaluate
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.verdict import Options, Verdict
from llfsm_verify.diagnostics import Source
from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.limits import Budget, Limits
from llfsm_verify.logic import lasso
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.program.program import Program
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.testing.arrangements import arrangements
from llfsm_verify.testing.properties import properties
from llfsm_verify.verification.verify import verify
from tests.quick import examples, many

LARGEST = 150
"""Configurations: larger spaces are left to others, naive search is slow."""
LONGEST = 7
"""Steps of the lassos that are enumerated."""

Letter = frozenset[str]


@dataclass
class Naive:
    """A search by the reference interpreter; edges carry the names of the true atoms and of true fairness outputs."""

    roots: list[bytes] = field(default_factory=list)
    edges: dict[bytes, set[tuple[bytes, Letter]]] = field(default_factory=dict)
    faults: set[int] = field(default_factory=set)
    overflow: bool = False


class TooLarge(Exception):
    pass


def naive(program: Program) -> Naive:
    layout, interpreter = Layout.of(program), Interpreter(program)
    names = [(a.name, a.output) for a in program.atoms]
    names += [(x, x) for f in program.fairness for x in (f.premise, f.goal) if x is not None]
    found = Naive(roots=[r[: layout.configuration_bytes] for r in layout.initial(LARGEST)])
    todo = list(found.roots)
    while todo:
        key = todo.pop()
        if key in found.edges:
            continue
        found.edges[key] = set()
        if len(found.edges) > LARGEST:
            raise TooLarge
        visited = 0
        inner = [(layout.decode(key), layout.initial_outputs())]
        while inner:
            values, outputs = inner.pop()
            for process, outcome in interpreter.successors(values, outputs):
                visited += 1
                if visited > 3_000:
                    raise TooLarge
                if outcome.fault is not None:
                    found.faults.add(outcome.fault)
                elif outcome.overflow:
                    found.overflow = True
                elif program.observe == "cycle" and process is not None and not outcome.outputs[program.cycle]:
                    inner.append((outcome.values, outcome.outputs))
                else:
                    target = layout.encode(outcome.values)
                    letter = frozenset(name for name, output in names if outcome.outputs[output])
                    found.edges[key].add((target, letter))
                    todo.append(target)
    return found


@st.composite
def problems(draw: st.DrawFn) -> tuple[Arrangement, PropertySet]:
    arrangement = build_arrangement(draw(arrangements(max_machines=2, max_states=3)))
    texts = draw(st.lists(properties(arrangement), min_size=1, max_size=2))
    lines = [f"p{i}: {text}" for i, text in enumerate(texts)]
    if draw(st.booleans()):
        lines.append(f"assume a: {draw(properties(arrangement))}")
    return arrangement, parse_properties([Source("random.ltl", "\n".join(lines))])


def explored_like_the_reference(problem: tuple[Arrangement, PropertySet], keep_all_bits: bool) -> None:
    arrangement, lines = problem
    program = lower(arrangement, bind(arrangement, lines).atoms, keep_all_bits=keep_all_bits)
    try:
        expected = naive(program)
    except TooLarge:
        event("too large to search naively")
        return
    event("searched")
    explorer = Explorer(program, Budget(Limits(max_states=4 * LARGEST)))
    explorer.explore(None)
    graph = explorer.graph
    assert graph.stopped is None
    keys = {node: graph.key(node) for node in range(len(graph)) if not graph.in_cycle(node)}
    assert len(keys) == len(set(keys.values())) == graph.configurations
    assert set(keys.values()) == set(expected.edges)
    assert [keys[root] for root in range(graph.roots)] == expected.roots
    for node, key in keys.items():
        edges = [
            (keys[t], frozenset(n for i, n in enumerate(explorer.observed) if x >> i & 1)) for t, x in graph.steps(node)
        ]
        assert len(set(edges)) == len(edges)
        assert set(edges) == expected.edges[key]
        assert len(graph.path_to(node)) <= len(graph)
    assert graph.transitions == sum(len({t for t, _ in edges}) for edges in expected.edges.values())
    assert set(graph.faults) == expected.faults
    assert (graph.overflow is not None) == expected.overflow
    assert graph.complete is not expected.overflow


def lassos(graph: Naive, first: dict[bytes, Letter]) -> Iterator[tuple[list[Letter], int]]:
    """Short lassos as letters with the first one, and the index where the loop starts (at most 3,000 paths)."""
    paths = [([root], [first[root]]) for root in graph.roots]
    for nodes, letters in paths[:]:
        assert len(nodes) == len(letters)
    count = 0
    while paths and count < 3_000:
        nodes, letters = paths.pop(0)
        count += 1
        for i, node in enumerate(nodes[:-1]):
            if node == nodes[-1]:
                yield letters, i + 1
        if len(nodes) <= LONGEST:
            paths += [([*nodes, t], [*letters, x]) for t, x in sorted(graph.edges[nodes[-1]], key=repr)]


def answered_like_brute_force(problem: tuple[Arrangement, PropertySet]) -> None:
    arrangement, lines = problem
    bound = bind(arrangement, lines)
    program = lower(arrangement, bound.atoms, keep_all_bits=True)
    try:
        graph = naive(program)
    except TooLarge:
        event("too large to search naively")
        return
    event("searched")
    result = verify(
        arrangement, lines, Options(Limits(max_states=4 * LARGEST), allow_contradiction=True), engine="explicit"
    )
    assert (result.faults.verdict is Verdict.VIOLATED) == bool(graph.faults)
    layout = Layout.of(program)
    outputs = {v.name: v.init for v in program.vars if v.output}
    inputs = {f"input:{i.name}": i.init for i in program.inputs}
    first = {
        root: frozenset(a.name for a in program.atoms if evaluate(a.expression, layout.decode(root) | outputs, inputs))
        for root in graph.roots
    }
    undecided = {
        p.name: line.formula
        for p, line in zip(result.properties, bound.properties, strict=True)
        if p.verdict is not Verdict.VIOLATED
    }
    for p in result.properties:
        assert p.verdict is not Verdict.HOLDS or not graph.overflow
        assert (
            p.verdict is not Verdict.UNKNOWN
            or graph.overflow
            or "too large" in str(p.reason)
            or "more than" in str(p.reason)
        )
    for letters, loop in lassos(graph, first):
        shown = frozenset().union(*letters[loop:])
        if any((f.premise is None or f.premise in shown) and f.goal not in shown for f in program.fairness):
            continue
        word = letters[:loop], letters[loop:]
        if all(a.formula is not None and lasso.evaluate(a.formula, *word) for a in bound.assumptions):
            for name, formula in undecided.items():
                assert formula is not None
                assert lasso.evaluate(formula, *word), (name, letters, loop)


CHECKS = [HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large, HealthCheck.large_base_example]
FAST = settings(
    max_examples=examples(40), deadline=None, suppress_health_check=CHECKS, phases=[Phase.generate, Phase.shrink]
)
SLOW = settings(FAST, max_examples=many(600))


@pytest.mark.slow
@FAST
@given(problems(), st.booleans())
def test_explored_graph(problem: tuple[Arrangement, PropertySet], keep_all_bits: bool) -> None:
    explored_like_the_reference(problem, keep_all_bits)


@pytest.mark.slow
@FAST
@given(problems())
def test_verdicts(problem: tuple[Arrangement, PropertySet]) -> None:
    answered_like_brute_force(problem)


@pytest.mark.long
@SLOW
@given(problems(), st.booleans())
def test_explored_graph_many(problem: tuple[Arrangement, PropertySet], keep_all_bits: bool) -> None:
    explored_like_the_reference(problem, keep_all_bits)


@pytest.mark.long
@SLOW
@given(problems())
def test_verdicts_many(problem: tuple[Arrangement, PropertySet]) -> None:
    answered_like_brute_force(problem)

"""What the tests of models for other checkers share: specifications of the models and of random arrangements."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path

from hypothesis import HealthCheck, Phase, reject, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement import build_arrangement, load_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.verdict import Result, Verdict
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.kripke.export.specification import Specification
from llfsm_verify.kripke.structure import Structure, structure
from llfsm_verify.limits import Budget, Limits
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.logic.reading import read_source
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.testing.arrangements import arrangements
from llfsm_verify.testing.properties import properties
from tests.quick import examples, many

MODELS = sorted(
    str(path)
    for folder in ("komodo_stroll", "traffic_lights")  # small enough to be compared step by step
    for path in Path("models", folder).glob("*.yaml")
    if not path.name.endswith((".machine.yaml", ".trace.yaml"))
)
SHIPPED = sorted(str(p) for p in Path("models").glob("*/*.yaml") if "\nmachines:" in p.read_text(encoding="utf-8"))
LARGEST = 300
"""Configurations: larger random arrangements are left out."""

CHECKS = [HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large, HealthCheck.large_base_example]
FAST = settings(max_examples=examples(4), deadline=None, suppress_health_check=CHECKS, phases=[Phase.generate])
SLOW = settings(FAST, max_examples=many(200))

Problem = tuple[Arrangement, PropertySet]


def model(path: str) -> Problem:
    """A model with its property file."""
    return load_arrangement(path), parse_properties([read_source(f"properties/{Path(path).parent.name}.ltl")])


def problem(document: dict[str, object], *lines: str) -> Problem:
    return build_arrangement(document), parse_properties([Source("test.ltl", "\n".join(lines))])


@st.composite
def problems(draw: st.DrawFn) -> Problem:
    """A random arrangement with properties and sometimes an assumption."""
    arrangement = build_arrangement(draw(arrangements(max_machines=2, max_states=3)))
    texts = draw(st.lists(properties(arrangement), min_size=1, max_size=2))
    lines = [f"p{i}: {text}" for i, text in enumerate(texts)]
    if draw(st.integers(0, 3)) == 3:
        lines.append(f"assume a: {draw(properties(arrangement, 2))}")
    return arrangement, parse_properties([Source("random.ltl", "\n".join(lines))])


NUMBERS = ("x", "n", "k", "0", "1", "2", "3", "-1", "7")


def _number(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    pairs = st.tuples(inner, inner)
    signs = st.sampled_from(["/", "/", "%", "%", "+", "-", "*"])
    return st.one_of(
        st.tuples(pairs, signs).map(lambda t: f"({t[0][0]} {t[1]} {t[0][1]})"),
        st.tuples(pairs, st.sampled_from(["min", "max"])).map(lambda t: f"{t[1]}({t[0][0]}, {t[0][1]})"),
        pairs.flatmap(lambda t: st.sampled_from(["go", "x > n", "k == 0"]).map(lambda c: f"({c} ? {t[0]} : {t[1]})")),
        inner.map(lambda t: f"abs({t})"),
    )


@st.composite
def divisions(draw: st.DrawFn) -> Problem:
    """A random arrangement whose actions divide, by branches of conditions among others, with two properties."""
    numbers = st.recursive(st.sampled_from(NUMBERS), _number, max_leaves=8)
    guard = draw(st.sampled_from(["true", "n != 0", "n > 0", "x > n"]))
    texts = [
        f"n = max(-3, min(3, {draw(numbers)}));",
        f"if ({guard}) {{ x = max(-9, min(9, {draw(numbers)} {draw(st.sampled_from('/%'))} {draw(numbers)})); }}",
    ]
    more = {"n": {"type": "-3..3", "init": draw(st.integers(-3, 3))}, "k": {"type": "-2..2", "role": "input"}}
    document = counter("-9..9", " ".join(draw(st.permutations(texts))), **more)
    low, high = draw(st.integers(-9, 0)), draw(st.integers(1, 9))
    try:
        return problem(document, f"p: G (x >= {low} && x <= {high})", f"q: G F (n == {low // 3})")
    except DiagnosticError as error:
        if {d.code for d in error.diagnostics if d.is_error} == {"E130"}:  # a divisor that is 0 as it is written
            reject()
        raise


def specification(arrangement: Arrangement, lines: PropertySet, *, keep_all_bits: bool = False) -> Specification:
    bound = bind(arrangement, lines)
    program = lower(arrangement, bound.atoms, keep_all_bits=keep_all_bits)
    goals = tuple((p.name, p.formula) for p in bound.properties if p.formula is not None)
    assumptions = tuple((p.name, p.formula) for p in bound.assumptions if p.formula is not None)
    return Specification(program, goals, assumptions)


def explored(
    arrangement: Arrangement, lines: PropertySet, *, keep_all_bits: bool = False, limit: int | None = LARGEST
) -> Structure | None:
    """The structure; None when it is too large for these tests, or leaves 64 bits."""
    budget = Budget(Limits(max_states=limit))
    found = structure(arrangement, bind(arrangement, lines), keep_all_bits=keep_all_bits, budget=budget)
    return found if found.complete else None


def agreement(result: Result, found: Mapping[str, bool | None]) -> Counter[str]:
    """Compare our verdicts on the properties of `found` with another checker's: True for one that holds, None: open.

    `hidden`: violated before a fault by letters that do not show it, so that the other says that it holds
    (docs/kripke.md).
    """
    tally = Counter[str]()
    faults = result.faults.verdict is Verdict.VIOLATED
    for p in result.properties:
        if p.name not in found:
            continue
        theirs = found[p.name]
        if theirs is None or p.verdict is Verdict.UNKNOWN:
            tally["open"] += 1
        elif theirs is (p.verdict is Verdict.HOLDS):
            tally["alike"] += 1
        else:
            cut = faults and theirs and p.trace is not None and p.trace.loop is None
            tally["hidden" if cut else "different"] += 1
    assert tally.total() == len(found)
    return tally


NOTHING = PropertySet(())


def written(export: Callable[[Specification], str], of: Specification) -> str | None:
    """The model; None when its numbers are refused."""
    try:
        return export(of)
    except DiagnosticError as error:
        if {d.code for d in error.diagnostics} <= {"E420", "E421"}:
            return None
        raise


def counter(kind: object, text: str, **more: object) -> dict[str, object]:
    """A machine that does `text` in each ringlet."""
    machine = {
        "machine": "M",
        "states": [{"name": "S", "internal": text, "transitions": [{"when": "false", "to": "S"}]}],
    }
    board: dict[str, object] = {"x": {"type": kind}, "go": {"type": "bool", "role": "input"}, **more}
    return {"name": "counter", "whiteboard": board, "machines": {"m": {"inline": machine}}, "schedule": ["m"]}


ARITHMETIC = [
    counter("0..5", "x = (x + 1) % 4;"),
    counter("int8", "x = x * 3 + 1;"),
    counter("uint16", "if (x < 9) { x = 65535 - x; } else { x = x / 7; }"),
    counter("-3..3", "x = (x - 5) % 4 / -2;"),
    counter("0..5", "x++;"),  # a fault
    counter("0..5", "if (go) { x = (x + 1) % 6; }"),
    counter("0..5", "x = n;", n={"type": "0..5", "role": "input", "changes": "never"}),  # several roots
    counter({"array": "-1..2", "size": 3}, "x[abs(x[0])] = (x[1] + 2) % 3;"),
    {**counter("0..3", "if (go) { x = (x + 1) % 4; }"), "observe": "cycle"},
    counter("0..200", "x = max(min(x + 3, 100), abs(x - max(x, 50)));"),
]

SMALL: dict[str, object] = {"type": "0..3"}
DIVISIONS = [
    counter("0..9", "n = max(0, min(3, k)); if (n > 0) x = 4 / n;", n=SMALL, k={"type": "-1..4", "role": "input"}),
    counter("0..9", "n = go ? 0 : 3; if (n > 0) { x = (x + 4) % n; }", n=SMALL),
    counter("0..9", "x = 9 / (go ? 0 : x);"),  # a fault
    counter("0..9", "x = 9 / max(1, go ? 0 : x);"),  # never a division by 0
    counter("-9..9", "x = 9 / ((go ? -1 : 1) + (x > 0 ? 1 : 2));"),  # a sum of branches is 0
    counter("-9..9", "x = (x - 3) / min(-1, go ? 0 : x - 2);"),
    counter("bool", "x = 12 / max(1, go ? 0 : x ? 1 : 2) == 6;"),  # no number is stored
    counter("bool", "x = 12 % (go ? 0 : x ? 1 : 2) == 0;"),
    counter("0..99", "n = go ? 0 : 3; if (n > 0) { x = (99 - x) / (n * n); }", n=SMALL),
    {**counter("0..9", "x = (x + 7) / max(1, go ? 0 : 2);"), "observe": "cycle"},
]
"""A branch of a divisor is the literal 0, mostly one that is never taken."""

"""Labels: satisfiable, disjoint from their siblings, covering; by the solver and by enumeration."""

from __future__ import annotations

from itertools import product
from typing import Literal

import pytest
import z3
from hypothesis import HealthCheck, Phase, given, settings

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.backends.reference import evaluate
from llfsm_verify.backends.smt import classes as solving
from llfsm_verify.checking.problem import Problem, bind
from llfsm_verify.diagnostics import Source
from llfsm_verify.kripke.labels import reaching, sizes
from llfsm_verify.kripke.labels.labels import Labels
from llfsm_verify.kripke.labels.planning import Planner, Split, filled_in
from llfsm_verify.kripke.labels.wide import labels_of
from llfsm_verify.kripke.steps import Steps
from llfsm_verify.kripke.structure import structure
from llfsm_verify.limits import Budget, Limits
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.program import outcomes
from llfsm_verify.program.outcomes import PREFIX, Place
from llfsm_verify.program.program import Choice, Get, Int
from llfsm_verify.program.trees import rebuilt
from llfsm_verify.semantics.lowering import lower
from tests.kripke.labels.sensors import NARROW, WIDE, Width, sensors
from tests.quick import examples, many

CHECKS = [HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large, HealthCheck.large_base_example]


def partition(planner: Planner, decided, *, by_enumeration: bool) -> int:
    """Checks the classes of every table; how many there were."""
    checked = 0
    for split, classes in decided.classes.items():
        group = planner.group(split)
        inside = [planner._terms.arithmetic.within(k) for k in group.constants]
        for valuation in list(classes.rows)[:3]:
            found = planner.classes(split, valuation)
            assert found
            solver = z3.Solver()
            solver.add(*inside)
            for one in found:
                assert solver.check(one.label) == z3.sat
                assert group.has(one.label, one.member)
                for other in found:
                    assert one is other or solver.check(one.label, other.label) == z3.unsat
            assert solver.check(z3.Not(z3.Or([c.label for c in found]))) == z3.unsat
            checked += len(found)
            if by_enumeration:
                enumerated(split, valuation, [c.member for c in found])
    return checked


def enumerated(split, valuation: tuple[int, ...], members: list[tuple[int, ...]]) -> None:
    """The members are the first valuations of each outcome, in order."""
    keys = dict(zip(split.keys, valuation, strict=True))
    asked = [rebuilt(e, lambda n: filled_in(n, keys)) for e in split.asked]

    def values(choice: Choice) -> range:
        return range(choice.type.low, choice.type.high + 1)

    first: dict[tuple[int, ...], tuple[int, ...]] = {}
    for tried in product(*map(values, split.choices)):
        given_ = {PREFIX + c.name: x for c, x in zip(split.choices, tried, strict=True)}
        try:
            outcome = tuple(evaluate(e, {}, given_) for e in asked)
        except OverflowError:
            return
        first.setdefault(outcome, tried)
    assert list(first.values()) == members


def partitions(count: int, width: Width) -> int:
    total = 0

    @settings(max_examples=count, deadline=None, suppress_health_check=CHECKS, phases=[Phase.generate, Phase.shrink])
    @given(sensors(width))
    def checked(problem: tuple[Arrangement, Problem]) -> None:
        nonlocal total
        arrangement, bound = problem
        program = lower(arrangement, bound.atoms)
        if any(map(sizes.is_wide, program.choices)):
            planner = Planner(program, lambda: None)
            total += partition(planner, planner.decide(), by_enumeration=width is NARROW)

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(sizes, "WIDE", 2)
        checked()
    return total


@pytest.mark.slow
def test_labels_part_the_values() -> None:
    assert partitions(examples(3), NARROW) > 5


@pytest.mark.long
@pytest.mark.parametrize("width", [NARROW, WIDE], ids=["narrow", "wide"])
def test_labels_of_many_part_the_values(width: Width) -> None:
    assert partitions(many(100), width) > 10


# ---------------------------------------------------------------- one arrangement at a time


def reading(*transitions: str, variables: str = "", entry: str = "", internal: str = "", **more: object) -> Arrangement:
    """A machine that reads two sensors of 16 bits."""
    whiteboard = {
        "left": {"type": "uint16", "init": "0", "role": "input"},
        "right": {"type": "uint16", "init": "0", "role": "input"},
        "limit": {"type": "uint16", "init": "7"},
        "kept": {"type": "uint16", "init": "0"},
        "gain": {"type": "0..9", "init": "1"},
        "steps": {"type": "0..5000", "init": "0"},
        "flag": {"type": "bool", "init": "false"},
    }
    states = [
        {"name": "A", "on_entry": entry, "internal": internal,
         "transitions": [{"when": t, "to": "B"} for t in transitions]},
        {"name": "B", "transitions": [{"when": "true", "to": "A"}]},
    ]  # fmt: skip
    return build_arrangement(
        {
            "name": "reading",
            "whiteboard": whiteboard,
            "machines": {"m": {"inline": {"machine": "M", "states": states}}},
            "schedule": ["m"],
            **more,
        }
    )


def labels(arrangement: Arrangement, properties: str = "") -> Labels:
    bound = bind(arrangement, parse_properties([Source("p.ltl", properties)]))
    found = labels_of(lower(arrangement, bound.atoms), Budget(Limits()))
    assert found is not None
    return found


def told(arrangement: Arrangement, properties: str = "") -> dict[str, int | str | None]:
    """The classes of each input, or why there are none."""
    return {", ".join(n.inputs): n.classes or n.reason for n in labels(arrangement, properties).notes}


def words(arrangement: Arrangement, properties: str = "") -> list[str]:
    """The labels of the steps from the initial configuration."""
    bound = bind(arrangement, parse_properties([Source("p.ltl", properties)]))
    found = Steps(structure(arrangement, bound)).of(0)
    return [label for steps in found.values() for step in steps for label in step.labels]


@pytest.mark.parametrize(
    ("guard", "text"),
    [
        ("y > 0.25", "y in 0.3..5.0"),
        ("y == 0.5", "y == 0.5"),
        ("y < z", "y < z"),
        ("y + z > 0.25", "(y + z) > 0.25"),
        ("y * 2 < z", "(y * 2) < z"),
        ("y * z > 0.5", "(y * z) > 0.500"),
        ("n * 10 < y * 10", "n < y"),
        ("n * 10 + 3 < y", "(n + 0.3) * 10 < y"),
        ("min(y, z) >= 1", "min(y, z) >= 1.00"),
        ("y * 10 < n + 5", "y * 10 < (n + 5)"),
    ],
)
def test_labels_of_decimals(guard: str, text: str) -> None:
    whiteboard = {
        "y": {"type": {"decimal": "0.1", "range": "-5.0..5.0"}, "role": "input"},
        "z": {"type": {"decimal": "0.01", "range": "-5.0..5.0"}, "role": "input"},
        "n": {"type": "-100..100", "role": "input"},
    }
    states = [{"name": "A", "transitions": [{"when": guard, "to": "A"}]}]
    machine = {"inline": {"machine": "M", "states": states}}
    document = {"whiteboard": whiteboard, "machines": {"m": machine}, "schedule": ["m"]}
    assert text in words(build_arrangement(document))


@pytest.mark.slow
def test_thresholds_are_classes() -> None:
    assert told(reading("left < 100", "left < 500 || left == 9000")) == {"left": 3}
    assert words(reading("left < 100", "left < 500 || left == 9000")) == [
        "left in 0..99", "left in 100..499 or 9000", "left in 500..8999 or 9001..65535"
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("guard", "holding"),
    [
        ("left * right > 1000", "(left * right) > 1000"),
        ("-left < right - 300", "-left < (right - 300)"),
        ("left % 100 == right", "(left % 100) == right"),
        ("left / 3 == right", "(left / 3) == right"),
        ("min(left, right) > 5", "min(left, right) > 5"),
        ("abs(left - right) > 4", "abs(left - right) > 4"),
        ("left + right == gain * 3", "(left + right) == (gain * 3)"),
        ("(left < right) == flag", "left < right"),
    ],
)
def test_labels_of_several_inputs_say_what_holds(guard: str, holding: str) -> None:
    assert set(words(reading(guard))) == {holding, f"!({holding})"}


@pytest.mark.slow
def test_labels_of_one_input_are_its_values() -> None:
    assert set(words(reading("left == 3"))) == {"left == 3", "left in 0..2 or 4..65535"}
    assert words(reading("left >= 0")) == ["any left"]
    assert "left in 1 or 5 or 9 or 20" in words(reading(" || ".join(f"left == {k}" for k in (1, 5, 9, 20))))


def test_classes_come_in_the_order_of_their_members() -> None:
    """A set of these thresholds is not ascending when it is read."""
    planner = Planner(lower(reading("left < 20", "left < 33"), ()), lambda: None)
    ((split, _),) = planner.decide().classes.items()
    found = planner.classes(split, ())
    assert found is not None and [c.member for c in found] == [(0,), (20,), (33,)]


def test_a_property_splits_further() -> None:
    assert told(reading("left < 100"), "p: G (left > 50)") == {"left": 3}
    assert told(reading("left < 100"), "p: G (right > 50)") == {"left": 2, "right": 2}


def test_inputs_that_are_compared_are_split_together() -> None:
    assert told(reading("left < right")) == {"left, right": 2}
    assert words(reading("left < right")) == ["!(left < right)", "left < right"]


@pytest.mark.slow
def test_what_is_stored_is_enumerated_and_said() -> None:
    assert told(reading("left > 3", internal="kept = left;")) == {"left": "it is stored in `kept`"}
    assert told(reading("flag", internal="kept = left / 10000;")) == {"left": 7}
    assert told(reading("flag", internal="kept = left / 100;")) == {"left": "more than 256 classes are told apart"}


STORED = "it is stored (it changes with the cycle, or the profile's snapshot is one for all machines)"


@pytest.mark.parametrize(
    ("keys", "entry", "properties", "expected"),
    [
        ({}, "", "p: G (sampled(left) > limit)", {"left": "a property asks for the value that was sampled last"}),
        ({}, "", "p: G !changed(left)", {"left": "a property asks whether it has changed"}),
        ({"observe": "cycle"}, "", "p: G (left > limit)", {"left": "its value is kept for a letter that comes later"}),
        ({"profile": {"base": "llfsm", "snapshot": "cycle"}}, "", "", {"left": STORED, "right": STORED}),
        (
            {"profile": {"base": "llfsm", "snapshot": "after_entry"}},
            "flag = left > 3;",
            "",
            {"left": "it is kept for the next `on_entry` (the profile's snapshot comes after that)"},
        ),
    ],
)
def test_why_an_input_is_enumerated(
    keys: dict[str, object], entry: str, properties: str, expected: dict[str, str]
) -> None:
    assert told(reading("left > 3", entry=entry, **keys), properties) == expected


@pytest.mark.parametrize(("high", "kind", "wide"), [(15, "input", False), (16, "read", True), (999, "age", False)])
def test_an_input_of_more_than_sixteen_values_is_wide(
    high: int, kind: Literal["input", "read", "age"], wide: bool
) -> None:
    choice = Choice("x", Int(0, high), kind, "x")
    assert sizes.size(choice) == high + 1
    assert sizes.is_wide(choice) is wide


def test_an_input_that_is_compared_with_a_clock_has_no_classes() -> None:
    program = lower(reading("after(3) && left > 3", timing="untimed"), ())
    choices = {c.kind: c for c in program.choices}
    planner = Planner(program, lambda: None)
    refused = planner._refusal(Split(Place(0, 0), (choices["input"], choices["age"]), (), ()))
    assert refused == "it is compared with a clock"


def test_only_wide_inputs_are_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(outcomes, "MOST_NODES", 1)
    found = Planner(lower(reading("left * right > 3"), ()), lambda: None).decide()
    assert [(place, why) for place, _, why in found.refused] == [(Place(0, 0), "what depends on it is too large")]
    assert [c.name for c in found.refused[0][1]] == ["left", "right"]
    monkeypatch.setattr(sizes, "WIDE", 1 << 16)
    found = Planner(lower(reading("left * right > 3"), ()), lambda: None).decide()
    assert not found.refused


@pytest.mark.slow
def test_the_threshold_is_a_variable() -> None:
    """Of any value: the representatives are computed."""
    arrangement = reading("left < limit", internal="limit = limit + 1;")
    found = labels(arrangement)
    assert [n.classes for n in found.notes] == [3]  # 0, limit and limit + 1 are tried
    (plan,) = {id(c): c for _, c in found._by_name.values()}.values()
    assert plan.candidates and not plan.rows
    assert words(arrangement) == ["left in 7..65535", "left in 0..6"] or words(arrangement) == [
        "left in 0..6", "left in 7..65535"
    ]  # fmt: skip


def test_the_threshold_is_set_by_the_arrangement() -> None:
    """Few constants are stored: a table."""
    arrangement = reading("left < limit", internal="limit = flag ? 300 : 4000; flag = not flag;")
    (plan,) = {id(c): c for _, c in labels(arrangement)._by_name.values()}.values()
    assert sorted(plan.rows) == [(7,), (300,), (4000,)] and not plan.partial


@pytest.mark.slow
def test_valuations_that_are_met() -> None:
    """A product of input and variable is for no expression; of 5,001 values of `steps` five are met."""
    arrangement = reading("left * steps > 1000 && left != 3", internal="steps = steps < 40 ? steps + 10 : steps;")
    found = labels(arrangement)
    (plan,) = {id(c): c for _, c in found._by_name.values()}.values()
    assert plan.partial and sorted(plan.rows) == [(0,), (10,), (20,), (30,), (40,)]
    assert [n.classes for n in found.notes] == [3]
    assert len(structure(arrangement)) == len(structure(arrangement, labels=False))


def test_too_many_valuations_are_enumerated_and_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reaching, "MOST_ROUNDS", 4)
    arrangement = reading("left * steps > 1000", internal="steps = steps < 4900 ? steps + 49 : steps;")
    assert told(arrangement) == {"left": "its classes depend on `steps`, of which too many values can be reached"}


def test_questions_that_are_too_hard(monkeypatch: pytest.MonkeyPatch) -> None:
    """Factors of a number of 32 bits, for a solver that may not work long."""
    monkeypatch.setattr(solving, "EFFORT", 5_000)
    why = told(reading("left * right == 4294049777 && left > 1 && right > 1"))
    assert why == dict.fromkeys(("left", "right"), "the solver finds no answer with 5,000 units of work")


def narrow(*actions: str) -> Arrangement:
    """One input of 256 values."""
    whiteboard = {"i": {"type": "int8", "role": "input"}, "n": {"type": "0..2"}, "k": {"type": "-99..99"}}
    states = [{"name": "A", "internal": " ".join(actions), "transitions": [{"when": "n - 2 != i * n", "to": "A"}]}]
    machine = {"inline": {"machine": "M", "states": states}}
    return build_arrangement(
        {"name": "narrow", "whiteboard": whiteboard, "machines": {"m": machine}, "schedule": ["m"]}
    )


def test_few_values_are_counted_before_the_solver_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    """With hardly fewer classes than values there is nothing to gain."""

    def asked(*_: object) -> None:
        raise AssertionError("the solver is asked")

    monkeypatch.setattr(solving, "model_of", asked)
    diverse = narrow("k = (i / 3 + n) % 100;", "n = abs(i % 2) + (i > 50 ? 1 : 0);")
    assert told(diverse) == {"i": "more than 64 classes are told apart"}


def test_few_values_in_few_classes_are_split() -> None:
    assert told(narrow("n = i > 50 ? 1 : 0;")) == {"i": 3}


def test_small_arrangements_do_not_load_the_solver() -> None:
    arrangement = build_arrangement(
        {
            "name": "small",
            "whiteboard": {"n": {"type": "0..15", "init": "0", "role": "input"}},
            "machines": {"m": {"inline": {"machine": "M", "states": [
                {"name": "A", "transitions": [{"when": "n > 3", "to": "A"}]}]}}},
            "schedule": ["m"],
        }
    )  # fmt: skip
    assert labels_of(lower(arrangement), Budget(Limits())) is None


def test_valuations_of_outputs_are_not_looked_for() -> None:
    planner = Planner(lower(reading("left < limit"), ()), lambda: None)
    kept = Get("limit", None, Int(0, 65535))
    shown = next(Get(v.name, None, v.type) for v in planner.program.vars if v.output)
    answers = [reaching._can_be_met(planner, Split(Place(0, 0), (), (), keys)) for keys in ((kept,), (kept, shown))]
    assert answers == [True, False]

"""Which properties are searched together."""

from __future__ import annotations

from dataclasses import replace

import pytest

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.groups import groups_of
from llfsm_verify.checking.problem import Problem, bind
from llfsm_verify.logic.bounds import TICK
from tests.checking.replaying import lines_of


def inputs(**keys: object) -> Arrangement:
    """One machine, and inputs of all kinds."""
    board = {f"s{i}": {"type": "bool", "role": "input"} for i in range(6)}
    board |= {
        "held": {"type": "0..3", "role": "input", "changes": "cycle"},
        "fixed": {"type": "0..3", "role": "input", "changes": "never"},
        "wide": {"type": "0..1000", "role": "input"},
        "pair": {"type": {"array": "bool", "size": 2}, "role": "input"},
        "out": {"type": "0..100", "role": "output"},
    }
    go = [{"when": "s0 || s1", "to": "B"}]
    machine = {"machine": "M", "states": [{"name": "A", "transitions": go}, {"name": "B", "on_entry": "out = 1;"}]}
    return build_arrangement(
        {"name": "x", "cycle_ms": "10", "whiteboard": board, "machines": {"m": {"inline": machine}}, "schedule": ["m"]}
        | keys
    )


def problem(*lines: str, **keys: object) -> Problem:
    return bind(inputs(**keys), lines_of("\n".join(lines)))


def names(given: Problem, most: int = 3) -> list[tuple[str, str]]:
    """The properties of each group, and what it needs."""
    return [
        (" ".join(p.name for p in group.problem.properties), " ".join(group.needs)) for group in groups_of(given, most)
    ]


def needs(text: str, **keys: object) -> str:
    """What a property needs, as the one of two that is alone."""
    return dict(names(problem(f"p: {text}", "q: G F (s4 && s5)", **keys), 0))["p"]


def test_what_fits_together_is_the_problem_as_it_is() -> None:
    for lines in ([], ["a: G m@A"], ["a: G s0", "b: G !s1", "c: F s2"], ["assume e: G (s0 && s1)", "a: G (s2 || s3)"]):
        given = problem(*lines)
        (group,) = groups_of(given)
        assert group.problem is given


def test_small_needs_are_put_together_and_what_needs_nothing_joins() -> None:
    given = problem("n: G m@A", *(f"p{i}: G s{i}" for i in range(5)), "o: F m@B")
    assert names(given) == [("n p3 p4 o", "s3 s4"), ("p0 p1 p2", "s0 s1 s2")]
    assert names(given, 0) == [("n p0 o", "s0"), *((f"p{i}", f"s{i}") for i in range(1, 5))]
    assert [g.problem.atoms for g in groups_of(given)] == [g.problem.atoms for g in groups_of(given)]


def test_a_group_has_the_atoms_of_its_properties_and_of_the_assumptions() -> None:
    given = problem("assume e: G F s5", "t: F[<=50ms] s0", *(f"p{i}: G (s{i} -> m@A)" for i in range(1, 5)))
    first, second = groups_of(given)
    assert names(given) == [("p3 p4", "s3 s4"), ("t p1 p2", "s0 s1 s2")]
    assert {a.name for a in first.problem.atoms} == {TICK, "s3", "s4", "s5", "m@A"}
    assert {a.name for a in second.problem.atoms} == {TICK, "s0", "s1", "s2", "s5", "m@A"}
    assert first.problem.assumptions == second.problem.assumptions == given.assumptions


def test_a_property_is_searched_where_it_costs_least() -> None:
    lines = (
        "big: G (s0 && s1 && s2 && s3)",
        "large: F (s1 && s2 && s3 && s0)",
        "some: G (s0 && s1)",
        "other: F (s4 || s5)",
    )
    given = problem(*lines, "none: G m@A")
    assert names(given) == [("other none", "s4 s5"), ("big large some", "s0 s1 s2 s3")]


def test_what_is_left_is_put_into_groups_anew() -> None:
    given = problem(*(f"p{i}: G s{i}" for i in range(6)), "n: G m@A")
    left = replace(given, properties=given.properties[:2])
    assert names(left) == [("p0 p1", "s0 s1")]
    assert len(groups_of(left)[0].problem.atoms) == 2
    (nothing,) = groups_of(replace(given, properties=()))
    assert nothing.problem.properties == nothing.problem.atoms == ()


@pytest.mark.parametrize(
    ("text", "plain", "cycle", "snapshot"),
    [
        ("G (held > 1)", "held", "held", "held"),
        ("G (fixed > 1)", "", "", ""),
        ("G (out > 1)", "", "", ""),
        ("G pair[1]", "pair[1]", "pair[1]", "pair[1]"),
        ("G sampled(s0)", "sampled s0", "sampled s0", "s0"),
        ("G (m.sampled(wide) > 3)", "m.sampled wide", "m.sampled wide", "wide"),
        ("G m.read(s0)", "", "", ""),
        ("G m.entered", "m.entered", "m.entered", "m.entered"),
        ("G changed(out)", "changed(out)", "changed(out)", "changed(out)"),
        ("F m.finished", "m.finished", "m.finished", "m.finished"),
        ("G m.ran", "", "", ""),
        ("G m.fired(A, 0)", "", "", ""),
    ],
)
def test_what_a_property_needs(text: str, plain: str, cycle: str, snapshot: str) -> None:
    """Also where whole cycles are observed, and where all inputs are sampled at their beginning."""
    assert needs(text) == plain
    assert needs(text, observe="cycle") == cycle
    assert needs(text, profile={"base": "llfsm", "snapshot": "cycle"}) == snapshot


def test_wide_values_count_as_three_bits() -> None:
    assert names(problem("a: G (wide > 3)", "b: G m@A")) == [("a b", "wide")]
    assert names(problem("a: G (wide > 3)", "b: G s0")) == [("b", "s0"), ("a", "wide")]
    assert names(problem("a: G (held > 1)", "b: G s0", "c: F s1")) == [("c", "s1"), ("a b", "held s0")]

"""Verdicts about random arrangements with records, arrays and `after_entry`, by another way than the checker's own."""

from __future__ import annotations

from collections import Counter

import pytest
from hypothesis import given, settings

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.verdict import Verdict
from llfsm_verify.diagnostics import DiagnosticError, Fragment, Source
from llfsm_verify.language.atoms import PropertyScope, check_atom
from tests.oracle import judging
from tests.oracle.formulas import Tree, regular_text, text
from tests.oracle.graph import explore
from tests.oracle.rules import Rule
from tests.oracle.temporal import Search
from tests.quick import examples, many


@pytest.mark.slow
def test_verdicts_follow_from_the_page() -> None:
    seen = judging.run(examples(10))
    assert seen["arrangements"] > 0 and sum(n for key, n in seen.items() if key.endswith(("holds", "violated"))) > 0


@pytest.mark.long
def test_verdicts_follow_from_the_page_in_many_arrangements() -> None:
    kinds = [f"{kind} {answer}" for kind in ("enforce", "forbid", "LTL") for answer in ("holds", "violated")]
    kinds.append("after_entry")
    judging.run(many(1_000), kinds=kinds)


@pytest.mark.long
def test_all_engines_together_say_what_explicit_says() -> None:
    """`--engine all`, each engine in a process of its own: what it decides is the same, also of faults."""
    seen: Counter[str] = Counter()

    @settings(judging.QUIET, max_examples=many(60))
    @given(judging.problems())
    def checked(problem: judging.Problem) -> None:
        arrangement, rules = problem.arrangement, [(k, r) for k, r in problem.rules if Rule(k, r).void is None]
        lines = [f"p{i}: {text(f)}" for i, f in enumerate(problem.ltl)]
        lines += [f"{kind} r{i}: {regular_text(r)}" for i, (kind, r) in enumerate(rules)]
        lines += [] if problem.assumption is None else [f"assume a: {text(problem.assumption)}"]
        alone, together = judging.ask(arrangement, lines), judging.ask(arrangement, lines, "all", depth=6)
        for one, other in zip(alone.properties, together.properties, strict=True):
            # Others may prove what `explicit` cannot: with integers of any size, or more configurations than its limit.
            assert one.verdict is other.verdict or one.verdict is Verdict.UNKNOWN, one.text
            seen[other.verdict.value] += 1
        assert alone.faults.verdict in (together.faults.verdict, Verdict.UNKNOWN)

    checked()
    assert min(seen["holds"], seen["violated"]) > 0, seen


# ---------------------------------------------------------------- the oracles themselves, on answers known by hand

LIGHT: judging.drawing.Document = {
    "name": "light",
    "types": {"Pair": {"record": {"x": "0..1", "f": "bool"}}},
    "whiteboard": {"go": {"type": "Pair", "role": "input"}, "saw": {"type": "bool"}},
    "machines": {
        "m": {
            "inline": {
                "machine": "Light",
                "states": [
                    {"name": "RED", "transitions": [{"when": "go.f", "to": "GREEN"}]},
                    {
                        "name": "GREEN",
                        "on_entry": "saw = go.f;",
                        "transitions": [{"when": "go.x == 1", "to": "AMBER"}],
                    },
                    {"name": "AMBER", "transitions": [{"when": "go.f", "to": "RED"}, {"when": "true", "to": "GREEN"}]},
                ],
            }
        }
    },
    "schedule": ["m"],
}
NAMES = ("m@RED", "m@GREEN", "m@AMBER", "saw", "go.f")


def light(snapshot: str) -> tuple[Arrangement, judging.Graph]:
    arrangement = build_arrangement({**LIGHT, "profile": {"base": "llfsm", "snapshot": snapshot}})
    scope = PropertyScope.of(arrangement)
    atoms = {n: check_atom(Fragment.whole(Source("<atom>", n)), scope) for n in NAMES}
    return arrangement, explore(arrangement, atoms, 1_000, 10_000)


RED, GREEN, AMBER = (("letter", ("atom", f"m@{name}")) for name in ("RED", "GREEN", "AMBER"))
CYCLE = ("repeat", ("seq", RED, ("seq", GREEN, AMBER)), 0, None)
BACK = ("repeat", ("seq", RED, ("repeat", ("seq", GREEN, AMBER), 1, None)), 0, None)


@pytest.mark.parametrize(
    ("kind", "expression", "steps"),
    [
        ("enforce", CYCLE, 3),
        ("enforce", BACK, None),
        ("forbid", ("seq", AMBER, GREEN), 3),
        ("forbid", ("seq", AMBER, ("seq", RED, AMBER)), None),
        ("forbid initially", ("seq", RED, GREEN), 1),
        ("forbid initially", ("seq", GREEN, AMBER), None),
        ("forbid initially", RED, 0),
    ],
)
def test_rules_by_hand(kind: str, expression: Tree, steps: int | None) -> None:
    rule = Rule(kind, expression)
    assert rule.void is None and rule.shortest(light("ringlet")[1]) == steps


@pytest.mark.parametrize(
    ("kind", "expression", "code"),
    [
        ("forbid", ("repeat", RED, 0, None), "E342"),
        ("enforce", ("seq", RED, RED), "E344"),
        ("forbid", ("letter", ("&&", ("atom", "m@RED"), ("atom", "m@GREEN"))), "E344"),
    ],
)
def test_rules_that_are_errors(kind: str, expression: Tree, code: str) -> None:
    assert Rule(kind, expression).void == code
    with pytest.raises(DiagnosticError, match=code):
        judging.ask(light("ringlet")[0], [f"{kind} r: {regular_text(expression)}"])


def test_formulas_by_hand() -> None:
    graph = light("ringlet")[1]
    red, green = ("atom", "m@RED"), ("atom", "m@GREEN")

    def some_run(formula: Tree) -> bool:
        return Search(formula, graph, fair=True).found()

    assert some_run(("G", red)) and some_run(("F", green)) and some_run(("U", red, green))
    assert not some_run(("X", ("atom", "m@AMBER"))) and not some_run(("F", ("&&", red, green)))
    assert some_run(("G", ("F", ("&&", green, ("X", red))))) is False
    assert some_run(("G", ("F", green))) and some_run(("M", red, ("!", green))) and some_run(("W", red, green))
    assert not some_run(("R", green, ("!", red)))


@pytest.mark.slow
def test_what_is_read_on_entry_is_an_older_sample_after_entry() -> None:
    """The comparison sees the profile: with `after_entry`, GREEN is entered with the sample that RED has seen."""
    red, green, saw = ("atom", "m@RED"), ("atom", "m@GREEN"), ("atom", "saw")
    told = ("G", ("->", ("&&", red, ("X", ("&&", green, ("X", green)))), ("X", ("X", saw))))
    for snapshot, holds in (("after_entry", True), ("ringlet", False)):
        arrangement, graph = light(snapshot)
        (found,) = judging.ask(arrangement, [f"p: {text(told)}"]).properties
        assert (found.verdict is Verdict.HOLDS) is holds
        assert Search(("!", told), graph, fair=True).found() is not holds


@pytest.mark.parametrize("fairness", ["processes", "none"])
def test_a_process_that_never_steps(fairness: str) -> None:
    """Of two processes, one may be left out forever only where nothing is fair."""
    states = [
        {"name": "A", "transitions": [{"when": "true", "to": "B"}]},
        {"name": "B", "transitions": [{"when": "true", "to": "A"}]},
    ]
    machines = {name: {"inline": {"machine": f"Kind_{name}", "states": states}} for name in ("a", "b")}
    document = {"name": "two", "machines": machines, "processes": {"p": ["a"], "q": ["b"]}, "fairness": fairness}
    arrangement = build_arrangement(document)
    there = ("atom", "b@B")
    atoms = {there[1]: check_atom(Fragment.whole(Source("<atom>", there[1])), PropertyScope.of(arrangement))}
    left_out = Search(
        ("!", ("F", there)), explore(arrangement, atoms, 100, 1_000), fair=fairness == "processes"
    ).found()
    (found,) = judging.ask(arrangement, [f"p: {text(('F', there))}"]).properties
    assert left_out is (found.verdict is Verdict.VIOLATED) is (fairness == "none")

"""Random arrangements: what can be covered, by exploration, against truth tables over all runs."""

from __future__ import annotations

from collections import Counter
from random import Random

import pytest
from hypothesis import HealthCheck, Phase, given, seed, settings

from llfsm_verify.analysis.coverage.measure import coverage
from llfsm_verify.analysis.coverage.result import Coverage
from llfsm_verify.arrangement import build_arrangement
from llfsm_verify.limits import Limits
from llfsm_verify.testing.arrangements import Document, arrangements
from tests.analysis.coverage.truth_tables import Runs
from tests.quick import examples

TALLY: Counter[str] = Counter()


ATOMS = (
    "a",
    "b",
    "p",
    "level > 0",
    "level > 1",
    "n == 2",
    "6 / (n + 1) > level",
    "6 / n > level",
    "m@S1",
    "after(1)",
    "true",
    "false",
)


def tree(random: Random, depth: int = 2) -> str:
    """A decision with conditions that depend on each other."""
    if depth == 0 or random.random() < 0.2:
        return random.choice(ATOMS)
    left, right = tree(random, depth - 1), tree(random, depth - 1)
    return random.choice(
        [f"({left} && {right})", f"({left} || {right})", f"not ({left})", f"(({left}) == ({right}))",
         f"(({left}) != ({right}))", f"({left} && {right} || {right})", f"(a ? {left} : {right})"]
    )  # fmt: skip


def action(random: Random) -> str:
    """Decisions whose sides decide what later ones are."""
    inner = f"if ({tree(random, 1)}) {{ p = {tree(random, 1)}; }}"
    loop = f"for (i in 0..1) {{ if (a && i == n || p) {{ n = i; }} else {{ {inner} }} }}"
    return random.choice(
        ["n = (n + 1) % 4;", f"if ({tree(random)}) {{ n = 2; }} else {{ {inner} }}", loop, "p = not p;"]
    )


def decisive(random: Random) -> Document:
    """An arrangement that is about decisions."""
    kinds = ("on_entry", "internal", "on_exit")
    states = [
        {
            "name": f"S{i}",
            **{kind: action(random) for kind in kinds if random.random() < 0.6},
            "transitions": [
                {"when": tree(random), "to": f"S{random.randrange(3)}"} for _ in range(random.randint(1, 3))
            ],
        }
        for i in range(3)
    ]
    board = {"a": {"type": "bool", "role": "input"}, "b": {"type": "bool", "role": "input"}}
    board |= {"level": {"type": "0..2", "role": "input"}, "p": {"type": "bool"}, "n": {"type": "0..3"}}
    inline = {"machine": "M", "states": states}
    profile = {"base": "llfsm", "snapshot": random.choice(["ringlet", "after_entry", "cycle"])}
    return {
        "name": "decisive", "cycle_ms": "1000", "whiteboard": board, "machines": {"m": {"inline": inline}},
        "schedule": ["m"], "profile": profile,
    }  # fmt: skip


def compare(found: Coverage, runs: Runs, states: dict[tuple[str, int], str]) -> None:
    """Reachable is what a run shows; all else is unreachable."""
    for judged in found.goals:
        goal = judged.goal
        TALLY[f"{goal.kind} {judged.status}"] += 1
        owner = f"{states[goal.machine, goal.state]} {goal.number}" if goal.state >= 0 else " -1"
        if goal.kind == "branch":
            shown = (goal.machine, f"{goal.span} {owner}", goal.outcome) in runs.branches()
        elif goal.kind == "condition":
            shown = (goal.machine, f"{goal.span} {owner}") in places(runs)
        else:
            continue
        assert judged.status == ("reachable" if shown else "unreachable"), (goal.span.source.text, goal)


def places(runs: Runs) -> set[tuple[str, str]]:
    """The independent conditions by where they stand, and the state and transition of their guard."""
    return {
        (machine, f"{runs.leaf(machine, decision, number).span} {decision.split(' ', 1)[1]}")
        for machine, decision, number in runs.independent()
    }


def agrees(document: Document) -> None:
    arrangement = build_arrangement(document)
    runs = Runs(arrangement)
    found = coverage(arrangement, limits=Limits(max_states=5_000))
    if runs.complete and found.complete:
        names = {(m.name, i): s.name for m in arrangement.machines for i, s in enumerate(m.states)}
        compare(found, runs, names)


@pytest.mark.slow
@seed(7)
@settings(
    max_examples=examples(100), deadline=None, database=None, phases=(Phase.generate,),
    suppress_health_check=list(HealthCheck),
)  # fmt: skip
@given(arrangements())
def test_what_is_reachable_is_what_truth_tables_say(document):
    agrees(document)


@pytest.mark.slow
def test_what_is_reachable_of_decisions_is_what_truth_tables_say():
    TALLY.clear()
    for number in range(examples(40)):
        agrees(decisive(Random(number)))
    assert min(TALLY[f"condition {status}"] for status in ("reachable", "unreachable")) > 20


if __name__ == "__main__":
    test_what_is_reachable_of_decisions_is_what_truth_tables_say()

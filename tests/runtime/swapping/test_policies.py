"""What a policy may not give that comes into a run, against the table of all rights."""

from __future__ import annotations

from collections import Counter
from typing import Any

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.draft import Draft
from llfsm_verify.arrangement.formats import Given, read_arrangement
from llfsm_verify.arrangement.granting import rights_given
from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.arrangement.replacing import NewPolicy, with_change
from llfsm_verify.arrangement.resolve.arrangement import resolve
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.report.access import rights
from tests.quick import AtLeast, many, spread

LEVELS = ["low", "middle", "high"]
NAMES, SLOTS = ["a", "b", "c"], ["x", "y"]


def table(names: list[str]) -> st.SearchStrategy[dict[str, str]]:
    return st.dictionaries(st.sampled_from(names), st.sampled_from(LEVELS))


POLICIES = st.fixed_dictionaries({
    "levels": st.just(LEVELS), "machines": table(NAMES), "write": table(SLOTS), "command": table(NAMES),
    "users": table(["alice"]),
})  # fmt: skip


def governed(policy: dict[str, Any]) -> Arrangement:
    return build_arrangement({
        "name": "t", "cycle_ms": 1, "whiteboard": {name: {"type": "bool"} for name in SLOTS},
        "machines": {n: {"inline": {"machine": "M", "states": [{"name": "S", "stays": True}]}} for n in NAMES},
        "schedule": NAMES, "access": policy,
    })  # fmt: skip


def test_no_machine_gets_a_right_or_a_clearance() -> None:
    tally: Counter[bool] = Counter()

    def check(before: dict[str, Any], after: dict[str, Any]) -> None:
        first, following = governed(before), governed(after)
        had, has = ({(r.who, r.what, r.target) for r in rights(a) if r.may} for a in (first, following))
        raised = any(
            LEVELS.index(after["machines"].get(name, "low")) > LEVELS.index(before["machines"].get(name, "low"))
            for name in NAMES
        )
        found = list(rights_given(first, following))
        assert bool(found) == (raised or not has <= had)
        assert all(one.code == "E165" and one.span is not None for one in found)
        tally[bool(found)] += 1

    amount = settings(max_examples=many(100), deadline=None, suppress_health_check=list(HealthCheck))
    spread(check, amount, POLICIES, POLICIES, size=100, until=AtLeast(tally, {True: 10, False: 5}))


TEXT = """\
name: t
cycle_ms: 1
whiteboard: {x: {type: bool}}
machines: {a: {inline: {machine: A, states: [{name: S, internal: x = true;, stays: true}]}}}
schedule: [a]
access: {levels: [low, high]}
"""


@pytest.fixture
def draft() -> Draft:
    return read_arrangement(Given("t.yaml", TEXT))


def test_a_policy_is_read_from_its_text_alone(draft: Draft) -> None:
    policy = NewPolicy("p.yaml", "levels: [low, high]\nwrite: {x: high}\non_violation: refuse\n")
    changed = with_change(draft, policy)
    access = resolve(changed).access
    assert access is not None
    assert access.refuses and access.write_class("x") == 1
    assert changed.digest not in (draft.digest, with_change(draft, policy._replace(text=policy.text + " ")).digest)
    assert [source.name for source in changed.sources] == ["t.yaml", "p.yaml"]
    assert resolve(draft).digest == draft.digest


@pytest.mark.parametrize(
    ("name", "text", "code", "where"),
    [
        ("p.yaml", "levels: [high, low]\n", "E165", "p.yaml:1:9"),
        ("p.yaml", "levels: [low, high\n", "E010", "p.yaml:"),
        ("p.yaml", "levels: [low, high]\nwrite: {y: high}\n", "E099", "p.yaml:2:9"),
        ("p.yaml", "levels: [low, high]\nwrite: {x: high}\n", "E157", "t.yaml:4:"),
        ("/etc/passwd", "secret", "E019", "/etc/passwd:1:1"),
        ("", "", "E019", ""),
    ],
)
def test_a_wrong_policy_is_told_with_its_place(draft: Draft, name: str, text: str, code: str, where: str) -> None:
    with pytest.raises(DiagnosticError) as wrong:
        resolve(with_change(draft, NewPolicy(name, text)))
    found = wrong.value.diagnostics[0]
    assert found.code == code and str(found.span).startswith(where)
    assert "secret" not in str(wrong.value)

"""Plants of requests: what is proved with them, what users write, and what becomes of it."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from llfsm_verify.arrangement import build_arrangement, load_arrangement
from llfsm_verify.arrangement.requests import Request
from llfsm_verify.arrangement.resolve import arrangement as resolver
from llfsm_verify.checking.verdict import Options
from llfsm_verify.diagnostics import Source
from llfsm_verify.language.trees import of_kind
from llfsm_verify.language.typed import Choose
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.verification.verify import verify
from tests.distributions import Site

HERE = Path("tests/arrangement/requests")
PICKING = HERE / "picking.yaml"
TEXT = PICKING.read_text(encoding="utf-8")


def verdicts(text: str, properties: str) -> dict[str, str]:
    from llfsm_verify.arrangement.loader import load_arrangement_text

    lines = parse_properties([Source("p", properties)])
    result = verify(load_arrangement_text(text), lines, Options(), "explicit")
    return {p.name: p.verdict.value for p in result.properties}


def test_a_robot_is_proved_with_the_other_sides_of_its_requests() -> None:
    asked = (HERE / "picking.ltl").read_text(encoding="utf-8")
    assert verdicts(TEXT, asked) == dict.fromkeys(("grips", "ends", "apart", "again"), "holds")


def test_mistakes_of_a_robot_are_found() -> None:
    """It may not leave before the port has seen that it asks; without a time-out no end is promised."""
    hasty = TEXT.replace("arm_state != IDLE && (halt ||", "(halt || arm_state != IDLE &&")
    asked = "apart: G (rose(reach) -> arm_state == IDLE)\nagain: G F robot@LOCATE"
    assert verdicts(hasty, asked) == {"apart": "violated", "again": "holds"}
    assert verdicts(TEXT.replace(", timeout: 2s", ""), asked) == {"apart": "holds", "again": "violated"}


def test_ports_can_read_what_is_asked() -> None:
    locate, arm = load_arrangement(PICKING).plants
    assert (locate.name, arm.name) == ("locate_plant", "arm")  # `locate` is a slot
    assert locate.request == Request(
        "locate", "service", "locate", "locate_state", answers={"fruits": "fruits"}, timeout=1.0
    )
    assert arm.request == Request("arm", "action", "reach", "arm_state", timeout=2.0)


def test_answers_have_any_values_of_their_types() -> None:
    kinds = {
        "flag": ("bool", 2),
        "byte": ("int8", 256),
        "range": ("-2..5", 8),
        "colour": ("Colour", 3),
        "speed": ({"decimal": "0.1", "range": "-1.0..1.0"}, 21),
        "row": ({"array": "0..4", "size": 2}, 0),
        "both": ({"record": {"x": "0..2", "y": "bool"}}, 0),
    }
    states = ["IDLE", "WAITING", "DONE", "FAILED", "TIMED_OUT"]
    inputs = {name: {"type": kind, "role": "input"} for name, (kind, _) in kinds.items()}
    (plant,) = build_arrangement({
        "types": {"State": states, "Colour": ["RED", "AMBER", "GREEN"]},
        "whiteboard": {"ask": {"type": "bool"}, "state": {"type": "State", "role": "input"}, **inputs},
        "machines": {"m": {"inline": {"machine": "M", "states": [{"name": "A", "internal": "ask = true;"}]}}},
        "environment": {"p": {"use": "service", "ask": "ask", "state": "state", "answers": list(kinds)}},
        "schedule": ["m"],
    }).plants  # fmt: skip
    found = {c.target: len(c.values) for c in of_kind(plant.actions, Choose)}
    fed = {name for name, _ in kinds.items()} - {"row", "both"}
    assert {name: found[name] for name in fed} == {name: kinds[name][1] for name in fed}
    assert (found["row[0]"], found["row[1]"], found["both.x"], found["both.y"]) == (5, 5, 3, 2)


def test_a_slot_may_have_the_names_that_the_plant_wants() -> None:
    text = TEXT.replace("halt", "seen").replace("grip", "waited")
    assert verdicts(text, "again: G F robot@LOCATE\nseen: G !(locate_plant.seen_ && !locate_plant.seen_)") == {
        "again": "holds", "seen": "holds",
    }  # fmt: skip


def test_a_state_may_stand_for_another() -> None:
    text = TEXT.replace("PREEMPTED, RECALLED, REJECTED, ABORTED, LOST, SUCCEEDED", "ABORTED, SUCCEEDED").replace(
        "timeout: 2s}",
        "timeout: 2s, values: {PREEMPTED: ABORTED, RECALLED: ABORTED, REJECTED: ABORTED, LOST: ABORTED}}",
    ).replace("[IDLE, PENDING, ACTIVE", "[IDLE, ACTIVE").replace("values: {", "values: {PENDING: ACTIVE, ").replace(
        "(halt || arm_state != PENDING && arm_state != ACTIVE)", "(halt || arm_state != ACTIVE)"
    )  # fmt: skip
    asked = (HERE / "picking.ltl").read_text(encoding="utf-8")
    assert verdicts(text, asked) == dict.fromkeys(("grips", "ends", "apart", "again"), "holds")
    assert verdicts(text, "x: G arm_state != SUCCEEDED\ny: G arm_state != ABORTED") == {
        "x": "violated",
        "y": "violated",
    }


OTHERS = """
from llfsm_verify.plug import PLANTS, Entry

class Late:
    table = PLANTS.load("service").table
    def use(self, site):
        return PLANTS.load("service").use(site)

class Broken(Late):
    def use(self, site):
        raise RuntimeError("it is broken")

LATE, BROKEN = Late(), Broken()
ENTRIES = [Entry("late", "others:LATE"), Entry("broken", "others:BROKEN"), Entry("gone", "others:GONE")]
(FIRST, SECOND, THIRD) = ENTRIES
"""


@pytest.mark.slow
def test_plants_of_other_packages_are_used_and_their_failures_said(tmp_path: Path) -> None:
    site = Site(tmp_path)
    points = {"late": "others:FIRST", "broken": "others:SECOND", "gone": "others:THIRD"}
    site.install("other-plants", {"llfsm_verify.plants": points}, others=OTHERS)
    said = {}
    for name in points:
        file = tmp_path / f"{name}.yaml"
        file.write_text(TEXT.replace("use: service", f"use: {name}"), encoding="utf-8")
        done = site.llfsm("check", str(file))
        said[name] = done.returncode, done.stdout + done.stderr
    assert said["late"][0] == 0, said["late"]
    assert [code for code, _ in said.values()] == [0, 3, 3], said
    place = f":{1 + TEXT[: TEXT.index('use: service')].count(chr(10))}:17: error[E533]: the plant "
    assert f"broken.yaml{place}`broken` of another package has failed (RuntimeError: it is broken)" in said["broken"][1]
    assert f"gone.yaml{place}`gone` of another package cannot be used (AttributeError: " in said["gone"][1]


def test_a_plant_is_not_taken_for_one_that_is_gone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its draft is made for it, so another may get the place in memory, and with it the number."""
    kept: list[object] = []

    def number(of: object) -> int:
        """As `id`, which gives a number again as soon as nobody has what had it."""
        for i in range(len(kept)):
            if kept[i] is of:
                return i
        free = next((i for i in range(len(kept)) if sys.getrefcount(kept[i]) == 2), len(kept))
        kept[free:] = [of, *kept[free + 1 :]]
        return free

    monkeypatch.setattr(resolver, "id", number, raising=False)
    kind = ["IDLE", "WAITING", "DONE", "FAILED", "TIMED_OUT"]
    board: dict[str, object] = {}
    for i in range(3):
        board |= {
            f"a{i}": {"type": "bool", "init": False}, f"s{i}": {"type": "S", "init": "IDLE", "role": "input"},
        }  # fmt: skip
    found = build_arrangement({
        "name": "many", "types": {"S": kind}, "whiteboard": board, "schedule": ["m"],
        "environment": {f"p{i}": {"use": "service", "ask": f"a{i}", "state": f"s{i}"} for i in range(3)},
        "machines": {"m": {"inline": {"machine": "M", "states": [{"name": "A", "stays": True}]}}},
    })  # fmt: skip
    assert [{name for name, _ in plant.writes()} for plant in found.plants] == [{"s0"}, {"s1"}, {"s2"}]

"""The case studies whose guards are theories: the guards that stood there before do the same in every step."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from llfsm_verify.arrangement.loader import load_arrangement
from llfsm_verify.checking.problem import bind
from llfsm_verify.kripke.structure import Structure, structure
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.logic.reading import read_source
from tests.cli.running import llfsm

BALL = "not badProportionXY && not badProportionYX && not badDensityVsDensityTolerance"
STUDIES = {
    "microwave": ("cooking", "cook", "time_left > 0 && not door_open", "C2: doorOpen => ~cook. C2 > C1."),
    "ball_conditions": ("recogniser", "is_it_a_ball", BALL, "BC2: badProportionYX => ~is_it_a_ball. BC2 > BC0."),
}  # fmt: skip
"""Model: the machine, the entry of its knowledge, the guard by hand, a rule of its theory."""


@pytest.fixture(params=STUDIES)
def study(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[str, Path]:
    """A model, and a copy of its folder."""
    for file in filter(Path.is_file, Path("models", request.param).iterdir()):
        (tmp_path / file.name).write_text(file.read_text("utf-8"), "utf-8")
    return request.param, tmp_path


def whole(path: Path, model: str) -> Structure:
    arrangement = load_arrangement(path / "arrangement.yaml")
    return structure(
        arrangement, bind(arrangement, parse_properties([read_source(Path("properties", f"{model}.ltl"))]))
    )


def same(one: Structure, other: Structure) -> bool:
    """Whether both have the same configurations, steps and letters, in the same order."""
    return one.propositions == other.propositions and all(
        np.array_equal(getattr(one, part), getattr(other, part)) for part in ("indptr", "targets", "labels", "alphabet")
    )


@pytest.mark.slow
def test_the_guard_by_hand_has_the_same_steps(study: tuple[str, Path]) -> None:
    model, copy = study
    machine, name, guard, rule = STUDIES[model]
    given = whole(Path("models", model), model)
    file, theory = copy / f"{machine}.machine.yaml", next(copy.glob("[A-Z]*.d"))
    text = file.read_text("utf-8")
    # Without one of its rules, the theory is another one.
    forgotten = theory.read_text("utf-8").replace(rule, "")
    assert forgotten != theory.read_text("utf-8")
    theory.write_text(forgotten, "utf-8")
    assert not same(given, whole(copy, model))
    by_hand = re.sub(r"^knowledge:\n(?:  .*\n)+", "", text, flags=re.MULTILINE)
    by_hand, guards = re.subn(rf"when: (not )?{name}\b", lambda m: f"when: {m[1] or ''}({guard})", by_hand)
    assert "knowledge:" not in by_hand and guards >= 1
    file.write_text(by_hand, "utf-8")
    assert same(given, whole(copy, model))


def test_the_guard_by_hand_is_proved_equal(study: tuple[str, Path]) -> None:
    model, _ = study
    machine, name, guard, _ = STUDIES[model]
    guard = re.sub(r"\bnot (\w+)", rf"!{machine}.\1" if model == "ball_conditions" else r"!\1", guard)
    done = llfsm(
        "knowledge", "equivalent", f"{machine}.{name}", guard, "--arrangement", f"models/{model}/arrangement.yaml"
    )
    assert done.returncode == 0 and done.stdout.startswith("equal: proved"), done


FORGOTTEN = {"": 0, "C0: .*": 3, "C1: .*": 3, " C1 > C0[.]": 1, "C2: .*": 1, " C2 > C1[.]": 0}
"""What is forgotten of the theory of the oven, and what `equivalent` says: still equal, told apart, not a theory. Where
two rules have no priority, nothing is proved, and what is not proved is false: `C2 > C1` makes no difference."""


@pytest.mark.parametrize(("forgotten", "code"), FORGOTTEN.items())
def test_what_may_be_forgotten_of_a_theory(forgotten: str, code: int, tmp_path: Path) -> None:
    theory = tmp_path / "changed.d"
    theory.write_text(re.sub(forgotten, "", Path("models/microwave/MicrowaveCook.d").read_text("utf-8")), "utf-8")
    assert llfsm("knowledge", "equivalent", str(theory), "timeLeft && !doorOpen").returncode == code

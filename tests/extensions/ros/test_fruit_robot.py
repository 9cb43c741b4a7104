"""The robot of `examples/fruit_robot/`: verified first, with mistakes that are found, and then run beside ROS."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import llfsm_verify as lv
from tests.extensions.ros.conftest import LIMIT, Graph

ROBOT = Path(__file__).parents[3] / "examples" / "fruit_robot"
PROPERTIES = ROBOT / "properties.ltl"
NAMES = ["arrangement.yaml", "pauser.machine.yaml", "picker.machine.yaml"]
STOPS = "    on_suspend: reach = false;"
MISTAKES = [
    ("nothing stops the arm in a pause", STOPS, "    #", "paused_still"),
    ("a state that others set leaves the arm as it is", "on_entry: reach = false; locate = false;", "#", "stands"),
    ("a goal is sent while another one has not ended", "if (reached == IDLE && !pause) reach", "reach", "one_goal"),
    ("the end of an older goal is taken", " && at == FRUIT", "", "gripped"),
    ("the end of an older request is taken", "located == DONE && fruits > 0", "fruits > 0", "order"),
    ("nothing follows when the arm is preempted", "reached == PREEMPTED", "false", "reach_ends"),
    ("nothing follows when the service fails", "located == FAILED", "false", "located_ends"),
    ("what somebody sets in a pause begins to move", " && !pause", "", "paused_still"),
]


def robot(folder: Path, before: str = "", after: str = "") -> lv.Model:
    """The robot, with a mistake in its state machine."""
    for name in NAMES:
        shutil.copy(ROBOT / name, folder)
    picker = folder / "picker.machine.yaml"
    text = picker.read_text(encoding="utf-8")
    assert before in text
    picker.write_text(text.replace(before, after) if before else text, encoding="utf-8")
    return lv.load(folder / "arrangement.yaml")


@pytest.mark.long
def test_its_properties_hold(tmp_path: Path) -> None:
    result = robot(tmp_path).check(PROPERTIES)
    assert {str(found.verdict) for found in result} == {"holds"}


@pytest.mark.long
@pytest.mark.parametrize(("before", "after", "violated"), [of[1:] for of in MISTAKES], ids=[of[0] for of in MISTAKES])
def test_a_mistake_is_found(before: str, after: str, violated: str, tmp_path: Path) -> None:
    lines = PROPERTIES.read_text(encoding="utf-8").splitlines(keepends=True)
    (tmp_path / "one.ltl").write_text(
        "".join(line for line in lines if line.startswith(("define", "assume", f"{violated}:"))), encoding="utf-8"
    )
    result = robot(tmp_path, before, after).check(tmp_path / "one.ltl")
    assert {found.name: str(found.verdict) for found in result}[violated] == "violated"


@pytest.mark.long
def test_it_picks_fruits_beside_ros_and_is_what_was_verified(alone: Graph, tmp_path: Path) -> None:
    recording = tmp_path / "robot.rec"
    around = alone.master.surroundings | {"PATH": os.environ["PATH"]}
    show = (sys.executable, str(ROBOT / "show.py"), "--drops", "2", "--pause-after", "1", "--then", "2")
    run = subprocess.Popen(
        (*show, "--record", str(recording)), env=around, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    try:
        said, _ = run.communicate(timeout=5 * LIMIT)
    finally:
        run.terminate()
        run.communicate()
    assert run.returncode == 0, said
    assert "frames, the same bit for bit, and then stopped" in said
    assert "the run keeps to `fruit_request`, `move_box_arm` of `environment`" in said
    assert "pauses 1, changes of state 1" in said
    assert "violated" not in said and "malformed" not in said and "the ROS master" not in said


@pytest.mark.slow
def test_its_states_in_python_pick_fruits_beside_ros(alone: Graph, tmp_path: Path) -> None:
    """By a transition file of CROPS. The second fruit is dropped, and nothing but a change of state ends that."""
    recording = tmp_path / "states.rec"
    around = alone.master.surroundings | {"PATH": os.environ["PATH"]}
    show = (sys.executable, str(ROBOT / "show.py"), "--states", "3", "--drops", "2", "--record", str(recording))
    done = subprocess.run(show, env=around, capture_output=True, text=True, timeout=5 * LIMIT, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "Exit: 3 fruits in the basket, pauses 0, changes of state 1" in done.stdout
    assert "frames, the same bit for bit, and then ended" in done.stdout


@pytest.mark.slow
def test_its_transition_file_can_be_verified() -> None:
    formulas = "picked: G (sm.fired(Fruit_to_basket, 1) -> sm@Select_fruit)\never: G !sm@Exit\n"
    result = lv.load(ROBOT / "transfile.yaml").check(formulas)
    assert {found.name: str(found.verdict) for found in result} == {"picked": "holds", "ever": "violated"}

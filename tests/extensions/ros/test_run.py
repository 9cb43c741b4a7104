"""`llfsm run` of a robot whose start, service, action and parameter are those of ROS."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.extensions.ros.conftest import HERE, LIMIT, Graph

SEEN = {"fruit_list": [{}]}
ANSWERS = [SEEN, None, SEEN, SEEN, SEEN, {"fruit_list": []}]
"""Of the localisation: the second time it fails, and the last time no fruit is left."""
PICKED = ["set_accepted", "set_succeeded"]
ENDS = [PICKED, ["set_rejected"], ["set_accepted", "set_aborted"], PICKED]


@pytest.mark.slow
def test_a_robot_picks_by_services_and_actions(graph: Graph, tmp_path: Path):
    eyes, arm = graph.peer(), graph.peer()
    eyes.do("parameter", name="/picker/row", value=7)
    eyes.do("publisher", topic="/sm_ready_msg", of="std_msgs/String")
    eyes.do("service", name="/fruit_request", of="crops_msgs/Fruits_req", answers=ANSWERS)
    arm.do("action", name="/move_box_arm_action", of="crops_msgs/moveArm")
    arm.do("subscriber", topic="/report", of="geometry_msgs/Point")
    recording = tmp_path / "robot.rec"
    command = [sys.executable, "-m", "llfsm_verify", "run", str(HERE / "robot.yaml"), "--ports"]
    surroundings = graph.master.surroundings | {"PATH": os.environ["PATH"]}
    run = subprocess.Popen(
        [*command, str(HERE / "robot.ports.yaml"), "--record", str(recording)],
        env=surroundings, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        arm.until(topic="/report")  # the run has begun
        eyes.begin("publish", topic="/sm_ready_msg", values=[{"data": "wait"}, {"data": "Start state machine"}])
        for acts in ENDS:
            assert arm.until("goal")["goal"]["target"]["x"] == 0.25
            *first, last = acts
            for act in first:
                arm.do("act", name="/move_box_arm_action", act=act)
                arm.do("act", name="/move_box_arm_action", act="feedback", values={"distance": 1 / 3})
            arm.do("act", name="/move_box_arm_action", act=last, values={"reached": True})
        said, problems = run.communicate(timeout=LIMIT)
        assert run.returncode == 0, problems
    finally:
        run.kill()
        run.communicate()
    asked = [line for line in [*eyes.lines.all, *eyes.lines.now()] if line.get("service") == "/fruit_request"]
    assert [line["request"] for line in asked] == [{"row": 7}] * 6
    reports = [line["values"] for line in [*arm.lines.all, *arm.lines.now()] if line.get("topic") == "/report"]
    assert reports[-1] == {"x": 2.0, "y": 2.0, "z": 1.0}
    told = problems + said
    assert "locate: /fruit_request has failed: service [/fruit_request] responded with an error" in told
    assert "port robot: a value is refused: " in told  # "wait" is not a start

"""`llfsm run` of a robot whose start, service, action and parameter are those of ROS."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from llfsm_verify.arrangement.requests import ACTION_STATES, SERVICE_STATES
from tests.cli.running import llfsm
from tests.extensions.ros.conftest import HERE, LIMIT, Graph

SEEN = {"fruit_list": [{}]}
ANSWERS = [SEEN, None, SEEN, SEEN, SEEN, {"fruit_list": []}]
"""Of the localisation: the second time it fails, and the last time no fruit is left."""
PICKED = ["set_accepted", "set_succeeded"]
ENDS = [PICKED, ["set_rejected"], ["set_accepted", "set_aborted"], PICKED]


@contextmanager
def running(graph: Graph, name: str, recording: Path) -> Iterator[subprocess.Popen[str]]:
    """`llfsm run` of the arrangement of this name."""
    command = [sys.executable, "-m", "llfsm_verify", "run", str(HERE / f"{name}.yaml"), "--record", str(recording)]
    run = subprocess.Popen(
        [*command, "--ports", str(HERE / f"{name}.ports.yaml")],
        env=graph.master.surroundings | {"PATH": os.environ["PATH"]},
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        yield run
    finally:
        run.kill()
        run.communicate()


@pytest.mark.long
def test_a_robot_picks_by_services_and_actions(graph: Graph, tmp_path: Path):
    eyes, arm = graph.peer(), graph.peer()
    eyes.do("parameter", name="/picker/row", value=7)
    eyes.do("publisher", topic="/sm_ready_msg", of="std_msgs/String")
    eyes.do("service", name="/fruit_request", of="crops_msgs/Fruits_req", answers=ANSWERS)
    arm.do("action", name="/move_box_arm_action", of="crops_msgs/moveArm")
    arm.do("subscriber", topic="/report", of="geometry_msgs/Point")
    recording = tmp_path / "robot.rec"
    with running(graph, "robot", recording) as run:
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
    eyes.begin("connections", topic="/sm_ready_msg")
    eyes.until("connections")  # before it, all was told
    asked = [line for line in eyes.lines.all if line.get("service") == "/fruit_request"]
    assert [line["request"] for line in asked] == [{"row": 7}] * 6
    arm.until(topic="/report", values={"x": 2.0, "y": 2.0, "z": 1.0})
    checked = llfsm("check-recording", str(recording), "--arrangement", str(HERE / "robot.yaml"))
    assert checked.returncode == 0, checked.stdout + checked.stderr
    assert "the run keeps to `locate`, `arm` of `environment`" in checked.stdout
    told = problems + said
    assert "locate: /fruit_request has failed: service [/fruit_request] responded with an error" in told
    assert "port robot: a value is refused: " in told  # "wait" is not a start


@pytest.mark.long
def test_whatever_servers_do_the_recording_is_a_run_of_the_plants(graph: Graph, tmp_path: Path):
    peer = graph.peer()
    peer.do("publisher", topic="/halt", of="std_msgs/Bool")
    for name in ("asked", "sent"):
        peer.do("subscriber", topic=f"/{name}", of="std_msgs/String")
    peer.do(
        "whims", service="/whims", service_of="crops_msgs/Fruits_req", action="/moods", action_of="crops_msgs/moveArm"
    )
    recording = tmp_path / "nervous.rec"
    missing = {("asked", state) for state in SERVICE_STATES} | {("sent", state) for state in ACTION_STATES}
    with running(graph, "nervous", recording) as run:
        while missing:
            line = peer.until("topic")
            missing.discard((line["topic"][1:], line["values"]["data"]))
        run.send_signal(signal.SIGINT)
        _, problems = run.communicate(timeout=LIMIT)
    patient = tmp_path / "nervous.yaml"  # a supervisor that has waited for a processor is later than time-outs allow
    patient.write_text((HERE / "nervous.yaml").read_text().replace(", timeout: 300ms", ""))
    checked = llfsm("check-recording", str(recording), "--arrangement", str(patient))
    assert checked.returncode == 0, checked.stdout + checked.stderr + problems
    assert "the run keeps to `service`, `action` of `environment`" in checked.stdout

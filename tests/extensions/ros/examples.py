"""Commands that make the program say what a port of ROS needs."""

from __future__ import annotations

from tests.outputs.provoking import LAMP, Provoked

PORTS = """\
ports:
  robot:
    kind: ros1
    python: /nowhere/python3
    topics: {/start: std_msgs/Bool}
    inputs: {go: /start.data}
    on_failure: stale
"""
PROVOKED = {"E536": Provoked(("llfsm run a.yaml --ports robot.ports.yaml",), LAMP | {"robot.ports.yaml": PORTS})}

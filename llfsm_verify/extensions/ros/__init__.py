"""Ports that are nodes of ROS."""

from __future__ import annotations

from llfsm_verify.plug import Entry, Package

ENTRIES = {
    "llfsm_verify.codes": (Entry("ros", f"{__name__}.codes:CODES", "Ports of ROS"),),
    "llfsm_verify.ports": (
        Entry("ros1", f"{__name__}.ros1:KIND", "topics, services, actions, parameters of ROS 1"),
        Entry(
            "ros2",
            f"{__name__}.ros2:KIND",
            "topics of ROS 2, by DDS",
            package=Package("cyclonedds", "cyclonedds", "ros2"),
        ),
    ),
}

"""Ports that are topics of ROS."""

from __future__ import annotations

from llfsm_verify.plug import Entry, Package

ENTRIES = {
    "llfsm_verify.ports": (
        Entry(
            "ros2",
            f"{__name__}.ros2:KIND",
            "topics of ROS 2, by DDS",
            package=Package("cyclonedds", "cyclonedds", "ros2"),
        ),
    ),
}

"""MCAP, the container of logs that Foxglove and ROS 2 use: read as a log, written as a timeline."""

from __future__ import annotations

from llfsm_verify.plug import Entry, Package

MCAP = Package("mcap", "mcap", "trace")
ENTRIES = {
    "llfsm_verify.logs": (
        Entry("mcap", f"{__name__}.reading:read_mcap", "messages in JSON, of a topic", (".mcap",), package=MCAP),
    ),
    "llfsm_verify.timelines": (
        Entry(
            "mcap",
            f"{__name__}.writing:write_mcap",
            "for Foxglove and robotics tools",
            (".mcap",),
            binary=True,
            package=MCAP,
        ),
    ),
}

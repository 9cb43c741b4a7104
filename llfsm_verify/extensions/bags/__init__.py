"""Logs of robots: MCAP, the container of Foxglove and ROS 2 (also written, as a timeline), and rosbags.

What a user writes, and what that prints:

    $ llfsm check-recording run.bag safe.ltl --arrangement door.yaml --mapping door.mapping.yaml
    violated  safe  G (open -> speed == 0)
                    at row 41, at time 1700000004100000000

A bag of ROS 2 is a folder: `--from rosbag` reads it, and so does the name of its `.db3`. A column is a field of the
mapping's `topic`, such as `pose.position.x`, or `TOPIC:FIELD`, the last one on another topic. Mistakes:

    run.bag: error[E497]: the log cannot be read: ReaderError: File magic is invalid.
    door.mapping.yaml:1:1: error[E496]: there is no topic `/dor` in run.bag
    error[E464]: this needs the package rosbags, which is not installed
"""

from __future__ import annotations

from llfsm_verify.plug import Entry, Package

MCAP = Package("mcap", "mcap", "trace")
ROSBAGS = Package("rosbags", "rosbags", "rosbags")
ENTRIES = {
    "llfsm_verify.logs": (
        Entry("mcap", f"{__name__}.mcap_reading:read_mcap", "messages in JSON, of a topic", (".mcap",), package=MCAP),
        Entry(
            "rosbag", f"{__name__}.rosbag:read_rosbag", "messages of ROS, of a topic", (".bag", ".db3"), package=ROSBAGS
        ),
    ),
    "llfsm_verify.timelines": (
        Entry(
            "mcap",
            f"{__name__}.mcap_writing:write_mcap",
            "for Foxglove and robotics tools",
            (".mcap",),
            binary=True,
            package=MCAP,
        ),
    ),
}

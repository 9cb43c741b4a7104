"""Packages of messages that Debian has: `ros-std-msgs` their files, `python3-std-msgs` their classes for rospy."""

PACKAGES = frozenset({
    "actionlib_msgs", "diagnostic_msgs", "geometry_msgs", "map_msgs", "move_base_msgs", "nav_msgs", "pcl_msgs",
    "rosgraph_msgs", "sensor_msgs", "shape_msgs", "std_msgs", "std_srvs", "stereo_msgs", "tf2_msgs",
    "trajectory_msgs", "visualization_msgs",
})  # fmt: skip


def named(package: str, before: str) -> str:
    """How Debian installs a package of messages, in brackets; nothing where it does not have it."""
    return f" (on Debian: apt-get install {before}-{package.replace('_', '-')})" if package in PACKAGES else ""

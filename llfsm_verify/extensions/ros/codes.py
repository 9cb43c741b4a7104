"""What can be wrong with a port of ROS, beside what can be wrong with any port."""

from __future__ import annotations

from typing import Final

NO_ROS: Final = "E536"
CODES: Final = {NO_ROS: "A port needs a package of ROS that is not installed."}

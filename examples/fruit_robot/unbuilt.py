"""Runs a node of this package although nothing was built: its types are made in memory, as the port makes them.

/usr/bin/python3 unbuilt.py FOLDER_OF_ROS1_NODE scripts/arm.py _seconds:=0.2
"""

import runpy
import sys
from pathlib import Path

here = Path(__file__).resolve().parent
sys.path.insert(0, sys.argv[1])

from ros1_node.messages import Types  # noqa: E402

types = Types([str(here.parent)])
types.message("fruit_robot/Fruit")
types.service("fruit_robot/Fruits_req")
types.action("fruit_robot/moveArm")
sys.argv = sys.argv[2:]
runpy.run_path(sys.argv[0], run_name="__main__")

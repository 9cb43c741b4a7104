"""`python3 ros1_node` serves a port; `python3 ros1_node check` says what is wrong with types and fields."""

import importlib
import os
import sys

sys.path[0:1] = []
sys.path.append(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))  # noqa: PTH100, PTH120 - as the rest
importlib.import_module("ros1_node.check" if sys.argv[1:] == ["check"] else "ros1_node.node").run()

"""The page on robots runs beside a master of ROS 1: each `console` block shows what its commands print."""

from __future__ import annotations

import os
import re
import subprocess
import threading
import xmlrpc.client
from contextlib import ExitStack
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from tests.extensions.ros.conftest import LIMIT, PYTHON, Graph
from tests.forked import forks
from tests.project.test_documents import BACKGROUND, Background, compare, transcripts

PAGE = "docs/robots.md"
APPEND = re.compile(r"cat (\S+) >> (\S+)")
ROBOT = f"{PYTHON} robot.py > robot.txt 2>&1 &"
OURS = ("rosmaster --core > master.txt 2>&1 &", "sleep 2", "sleep 5")
"""What is done already, or waited for otherwise."""
ENDED = "kill %3; wait %3"


def subscribed(graph: Graph, topic: str) -> bool:
    """Whether a node has subscribed to it, as the last thing that `robot.py` does."""
    with xmlrpc.client.ServerProxy(graph.master.surroundings["ROS_MASTER_URI"]) as master:
        _, _, state = master.getSystemState("/test")  # type: ignore[misc]
    return any(name == topic for name, _ in state[1])  # type: ignore[index, union-attr, misc]


@pytest.mark.long
def test_ten_steps_lead_to_a_graph_of_ros(alone: Graph, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    steps = re.findall(r"^\*\*(\d+)\. ", Path(PAGE).read_text(encoding="utf-8"), re.MULTILINE)
    assert steps == [str(number) for number in range(1, 11)]
    for name, value in alone.master.surroundings.items():
        monkeypatch.setenv(name, value)
    boards = tmp_path / "boards"
    boards.mkdir()
    monkeypatch.setenv("LLFSM_WHITEBOARDS", str(boards))
    with ExitStack() as left:
        forked = left.enter_context(forks())
        background = Background(tmp_path, left)
        background.files.add("picked")  # a recording in real time, of states on threads
        for command, shown in transcripts(PAGE):
            if command.startswith("# "):
                (tmp_path / command[2:]).write_text(shown, encoding="utf-8")
            elif found := APPEND.fullmatch(command):
                with (tmp_path / found[2]).open("a", encoding="utf-8") as file:
                    file.write((tmp_path / found[1]).read_text(encoding="utf-8"))
            elif command == ROBOT:
                kept = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
                said = left.enter_context((tmp_path / "robot.txt").open("wb"))
                robot = left.enter_context(
                    subprocess.Popen([PYTHON, "robot.py"], cwd=tmp_path, env=kept, stdout=said, stderr=said)
                )
                left.callback(robot.kill)
                while not subscribed(alone, "/holding"):
                    assert robot.poll() is None, (tmp_path / "robot.txt").read_text()
                    threading.Event().wait(0.05)
            elif BACKGROUND.fullmatch(command):
                background.start(command)
            elif command == ENDED:
                background.end()
            elif command not in OURS:
                compare(command, shown, tmp_path, forked, background)
        assert background.run is None and robot.poll() is None
        robot.terminate()
        robot.wait(LIMIT)


def test_the_package_is_xml():
    text = Path(PAGE).read_text(encoding="utf-8")
    package, launch = map(ET.fromstring, re.findall(r"^```xml\n(.*?)^```$", text, re.MULTILINE | re.DOTALL))
    assert package.findtext("name") == launch.find("node").get("pkg") == "picker"  # type: ignore[union-attr]

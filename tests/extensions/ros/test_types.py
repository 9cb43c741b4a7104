"""Types of files are those that ROS generates, and what is wrong with types and fields is told."""

from __future__ import annotations

import ast
import json
import os
import subprocess
from pathlib import Path

import pytest

from tests.extensions.ros.conftest import HERE, NODE, PYTHON
from tests.outside import needs


def test_the_child_is_written_for_the_python_of_ros_noetic():
    assert all(ast.parse(path.read_text(), path.name, feature_version=(3, 8)).body for path in NODE.glob("*.py"))


def run(*command: str, given: str = "") -> str:
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run([PYTHON, *command], input=given, env=kept, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@needs("rospy")
@pytest.mark.slow
def test_types_of_files_have_the_checksums_of_those_installed(tmp_path: Path):
    lines = run(str(HERE / "regenerated.py"), str(tmp_path)).splitlines()
    assert not [line for line in lines if line.startswith("DIFFERENT")]
    assert {"msg std_msgs/Header", "msg geometry_msgs/TwistWithCovarianceStamped", "srv roscpp/GetLoggers"} <= set(
        lines
    )
    assert "action actionlib/Test" in lines and len(lines) > 80


WRONG = {
    ("topic", "Float64", "data"): "`Float64` is not the name of a type | write PACKAGE/TYPE, such as std_msgs/Float64",
    ("topic", "std_msgs/Flot64", "data"): "package std_msgs has no message `Flot64` | did you mean `std_msgs/Float64`?",
    ("topic", "crop_msgs/Fruit", "data"): "there is no package `crop_msgs` with messages"
    " | install it, source its workspace, or name the folder that has crop_msgs/msg/Fruit.msg under `messages`",
    ("service", "pcl_msgs/UpdateFilename", "x"): "there is no package `pcl_msgs` with services"
    " | install it (on Debian: apt-get install python3-pcl-msgs), source its workspace, or name the folder that has "
    "pcl_msgs/srv/UpdateFilename.srv under `messages`",
    ("action", "crop_msgs/Pick", "x"): "there is no package `crop_msgs` with actions"
    " | install it, source its workspace, or name the folder that has crop_msgs/action/Pick.action under `messages`",
    ("service", "crops_msgs/Fruit", "row"): "package crops_msgs has no service `Fruit`"
    " | did you mean `crops_msgs/Fruits_req`?",
    ("action", "crops_msgs/moveHand", "x"): "package crops_msgs has no action `moveHand` | it has moveArm",
    ("topic", "broken/Types", "x"): "{}/broken/msg/Types.msg cannot be read: Invalid declaration: float64"
    " | correct the file",
    ("topic", "broken/Loop", "x"): "{}/broken/msg/Loop.msg cannot be read: {}/broken/msg/Back.msg cannot be read: "
    "broken/Loop contains itself | a message cannot contain itself",
    (
        "topic",
        "broken/Nowhere",
        "x",
    ): "{}/broken/msg/Nowhere.msg cannot be read: package broken has no message `Missing`"
    " | it has Back, Loop, Nowhere, Types",
    ("action", "broken/Half", "x"): "{}/broken/action/Half.action cannot be read: an action has goal, result and "
    "feedback, with `---` between them | correct the file",
    ("topic", "std_msgs/Float64", "dat"): "std_msgs/Float64 has no field `dat` | did you mean `data`?",
    ("topic", "std_msgs/Float64", "data.x"): "float64 has no fields, so it has no `x` | leave out `.x`",
    ("topic", "geometry_msgs/Twist", "linear"): "`linear` is a message, geometry_msgs/Vector3"
    " | name one of its fields: x, y, z",
    ("topic", "std_msgs/Float64", ""): "this is a message, std_msgs/Float64 | name one of its fields: data",
    ("topic", "crops_msgs/Fruits", "fruits"): "fruits is an array, crops_msgs/Fruit[]"
    " | write its element or its length: `.0`, `.count`",
    ("topic", "crops_msgs/Fruits", "fruits.kind"): "crops_msgs/Fruit[] is an array, in which `kind` is not an element"
    " | write `.0`, `.1` or `.count`",
    ("topic", "crops_msgs/Fruits", "raw.4"): "uint8[4] has no element 4 | write a number below 4",
    ("topic", "std_msgs/Empty", "data"): "std_msgs/Empty has no field `data` | it has none",
}


@needs("rospy")
@pytest.mark.slow
def test_what_is_wrong_is_told(tmp_path: Path):
    for name, text in {
        "msg/Types.msg": "float64\n", "msg/Loop.msg": "Back[] more\n", "msg/Back.msg": "Loop more\n",
        "msg/Nowhere.msg": "Missing x\n", "action/Half.action": "int8 x\n---\nint8 y\n",
    }.items():  # fmt: skip
        place = tmp_path / "broken" / name
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(text)
    part = {"topic": "in", "service": "request", "action": "goal"}
    asked = [{"kind": kind, "type": of, "fields": [[part[kind], path]]} for kind, of, path in WRONG]
    asked.append(
        {"kind": "topic", "type": "crops_msgs/Fruits", "fields": [["out", "fruits.count"], ["in", "fruits.count"]]}
    )
    given = {"messages": [str(HERE / "msgs"), str(tmp_path)], "asked": asked}
    *found, last = json.loads(run(str(NODE), "check", given=json.dumps(given)))["found"]
    said = [" | ".join(of or fields[0]) for of, fields in found]
    assert said == [text.replace("{}", str(tmp_path)) for text in WRONG.values()]
    assert last == [
        None,
        [["the length of crops_msgs/Fruit[] cannot be written", "write its elements: `.0`, `.1`"], None],
    ]

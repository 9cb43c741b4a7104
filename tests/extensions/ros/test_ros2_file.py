"""What a file of ports says of topics of ROS 2 is checked before the run, at its places."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import jsonschema
import pytest
import yaml

from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.extensions.ros import ros2
from llfsm_verify.runtime.ports.file import schema
from tests.extensions.ros.dds import write_types
from tests.runtime.ports.bench import bench, declared

GOOD = """\
ports:
  door:
    kind: ros2
    domain: 7
    peers: [127.0.0.1]
    interface: lo
    messages: [msgs]
    topics: {/door: std_msgs/msg/Bool, /cmd_vel: {type: geometry_msgs/msg/Twist, reliability: best_effort, depth: 3}}
    inputs: {go: /door.data}
    outputs: {speed: /cmd_vel.linear.x}
    on_failure: stale
    patience: 20s
"""
WRONG = [
    ("/door.data", "§/dor.data", "E493", "did you mean `/door`"),
    ("/door.data", "§/door.date", "E493", "its fields are data"),
    ("/door.data", "§/door", "E493", "another name"),
    ("/door.data", "§door.data", "E493", "another name"),
    ("/cmd_vel.linear.x", "§/cmd_vel.linear.w", "E493", "its fields are x, y, z"),
    ("/cmd_vel.linear.x", "§/cmd_vel.linear", "E493", "write one of `geometry_msgs/msg/Twist.linear.x`"),
    ("/cmd_vel.linear.x", "§/cmd_vel.linear.x.y", "E493", "write `geometry_msgs/msg/Twist.linear.x`"),
    ("std_msgs/msg/Bool", "§std_msgs/Bool", "E493", "write `std_msgs/msg/Bool`"),
    ("std_msgs/msg/Bool", "§std_msgs/msg/Bol", "E493", "name a folder with std_msgs/msg/Bol.msg"),
    ("std_msgs/msg/Bool", "§nav_msgs/msg/Bol", "E493", "(on Debian: apt-get install ros-nav-msgs)"),
    ("{/door: std", "{§door: std", "E493", "the first one before"),
    ("depth: 3", "depth: §0", "E493", "from 1 to 10000"),
    ("best_effort", "§best", "E035", "`best_effort`"),
    ("{type: geometry_msgs/msg/Twist, ", "§{", "E034", "type"),
    ("domain: 7", "domain: §232", "E493", "from 0 to 231"),
    ("peers: [127.0.0.1]", "peers: [§'']", "E032", "write a value"),
    ("peers: [127.0.0.1]", "peers: [127.0.0.1, §'a<b']", "E493", "such as `192.168.0.7`"),
    ("interface: lo", "interface: §'l o'", "E493", "or `lo`"),
    ("domain: 7", "domain: §1e999999999", "E493", "from 0 to 231"),
    ("/cmd_vel.linear.x", "§/cmd_vel.linear.x.count", "E493", "write `geometry_msgs/msg/Twist.linear.x`"),
    ("[msgs]", "[§msg]", "E493", "write one with"),
    ("[msgs]", '[§"ms\\0gs"]', "E493", "write one with"),
    ("    topics: ", "    topic: ", "E034", "topics"),
    ("    patience: 20s", "    requests: §{a: {service: /a}}", "E493", "remove them"),
]


@pytest.mark.parametrize(("old", "new", "code", "hint"), WRONG)
def test_what_is_wrong_is_said_at_its_place(old: str, new: str, code: str, hint: str, tmp_path: Path) -> None:
    write_types(tmp_path / "msgs")
    text = GOOD.replace(old, new)
    with pytest.raises(DiagnosticError) as caught:
        declared(text.replace("§", ""), tmp_path)
    found = caught.value.diagnostics[0]
    assert (found.code, hint in (found.hint or "")) == (code, True), found
    if "§" in text:
        place = Source("x", text.replace("§", "")).position(text.index("§"))
        assert found.span is not None and (found.span.line, found.span.column) == place


def test_a_wrong_type_is_said_with_the_line_of_its_file(tmp_path: Path) -> None:
    write_types(tmp_path / "msgs", {"std_msgs/msg/Bool.msg": "bool data\nbool data\n"})
    with pytest.raises(DiagnosticError) as caught:
        declared(GOOD, tmp_path)
    assert caught.value.diagnostics[0].notes == (f"its file is {tmp_path / 'msgs/std_msgs/msg/Bool.msg'}:2",)


def test_the_schema_takes_what_the_reader_takes(tmp_path: Path) -> None:
    write_types(tmp_path / "msgs")
    (spec,) = declared(GOOD, tmp_path)
    assert spec.inputs == {"go": "/door.data"} and spec.outputs == {"speed": "/cmd_vel.linear.x"}
    jsonschema.Draft202012Validator(schema("ports")).validate(yaml.safe_load(GOOD))


def test_it_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_types(tmp_path / "msgs")
    monkeypatch.setattr(ros2, "find_spec", lambda name: None if name == "cyclonedds" else find_spec(name))
    with pytest.raises(ModuleNotFoundError) as caught, bench(*declared(GOOD, tmp_path)):
        pass
    assert caught.value.name == "cyclonedds"

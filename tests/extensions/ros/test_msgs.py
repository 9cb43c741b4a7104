"""Types of ROS 2 are read from `.msg` and `.idl`, and what is wrong with a file is said at its line."""

from __future__ import annotations

from pathlib import Path

import pytest

from llfsm_verify.extensions.ros import msgs
from llfsm_verify.extensions.ros.msgs import (
    EMPTY,
    Many,
    Messages,
    Named,
    Plain,
    Text,
    Unreadable,
    read_idl,
    read_msg,
    starting,
)
from tests.extensions.ros.dds import write_types
from tests.extensions.ros.everything import IDL, MSG

EVERYTHING = Named("demo/msg/Everything")
WRONG = [
    ("int8[1000001] a\n", 1, "more than 1,000,000 elements"),
    ("bool x\nint8[<=99999999999999999999] a\n", 2, "more than 1,000,000 elements"),
    ("string<=0 s\n", 1, "has no size from 1 to"),
    ("float32 f 1e400\n", 1, "is not from -1.8e308"),
    ("int64 n 1e999999999\n", 1, "cannot be its default"),
    ("bool\n", 1, "is not a field"),
    ("\n\nbool open\nint8 open\n", 4, "two fields `open`"),
    ("wstring name\n", 1, "on which all vendors agree"),
    ("time stamp\n", 1, "of ROS 1"),
    ("Header header\n", 1, "of ROS 1"),
    ("uint8[0] none\n", 1, "no size above 0"),
    ("uint8[<=] none\n", 1, "no size above 0"),
    ("int8<=3 x\n", 1, "only strings"),
    ("uint8 x 256\n", 1, "from 0 to 255"),
    ("int8 x -129\n", 1, "from -128 to 127"),
    ("bool x maybe\n", 1, "cannot be its default"),
    ("uint8[2] x [1]\n", 1, "cannot be its default"),
    ("uint8[<=2] x [1, 2, 3]\n", 1, "cannot be its default"),
    ("string<=2 x abc\n", 1, "cannot be its default"),
    ("Twist t 3\n", 1, "only plain fields"),
    ("a/b/c/D x\n", 1, "is not a type"),
]
WRONG_IDL = [
    ("struct A { long x; long x; };", "two fields `x`"),
    ("struct A { long x[99999999999]; };", "is not a size"),
    (f"struct A {{ {'sequence<' * 5000}long x; }};", "more types within it"),
    ("struct A { bool x; };", "there is no type `bool`"),
    ("module a {\n struct A { long x };\n};", "`}` is not expected"),
    ("module a { struct A { @key long x; }; };", "`@key` is not a part"),
    ("module a { struct A { wstring x; }; };", "on which all vendors agree"),
    ("module a { struct A { long x[0]; }; };", "`0` is not a size"),
    ("module a { enum E { A, B }; };", "`enum` is not expected"),
    ("module a {", "a module has no end"),
    ("module a { struct A { long", "ends too early"),
]


def test_types_of_msg_have_defaults_bounds_and_places(tmp_path: Path) -> None:
    messages = Messages([str(write_types(tmp_path, MSG))])
    found = {member.name: member for member in messages.find("demo/msg/Everything").members}
    assert found["few"].type == Many(Plain("int64"), most=4) and found["octets"].type == Many(Plain("uint8"), 3)
    assert found["short_text"].type == Text(10) and found["both"].type == Many(Named("demo/msg/Inner"), 2)
    assert (found["b"].default, found["pair"].default, found["text"].default) == (16, [1.5, -2.0], 'as "it" was')
    value = starting(messages, EVERYTHING)
    assert isinstance(value, dict) and value["both"][1] == {"small": -3, "large": 2.5, "name": "in # it"}
    assert messages.at("demo/msg/Everything", ["both", "1", "name"]) == Text()


def test_an_idl_of_the_same_means_the_same() -> None:
    text = IDL.replace("module dds_ {", "", 1).replace("}; }; };", "}; };")
    for name in ("Inner", "Count", "Everything"):
        text = text.replace(f"{name}_", f"demo::msg::{name}" if name == "Inner" else name)
    text = text.replace("struct demo::msg::Inner", "struct Inner").replace("double pair[2]", "double__2 pair")
    text = text.replace("struct Count", "typedef double double__2[2];\nmodule C { const uint8 X = 7; };\nstruct Count")
    text = text.replace("boolean flag", '@verbatim (language="comment", text="a; b")\n boolean flag')
    text = f'#include "x.idl"\n/* two\nlines */\n{text}'
    read = read_idl(text, "demo.idl")["demo/msg/Everything"]
    ours = read_msg(MSG["demo/msg/Everything.msg"], "demo/msg/Everything", "x.msg")
    same = {"byte": "byte", "char": "uint8"}
    assert [(m.name, m.type) for m in read.members] == [
        (m.name, Plain(same[m.type.name]) if isinstance(m.type, Plain) and m.type.name in same else m.type)
        for m in ours.members
    ]


@pytest.mark.parametrize(("text", "line", "why"), WRONG)
def test_a_wrong_msg_is_said_at_its_line(text: str, line: int, why: str) -> None:
    with pytest.raises(Unreadable) as caught:
        read_msg(text, "demo/msg/X", "X.msg")
    assert why in str(caught.value) and caught.value.place == f"X.msg:{line}" and caught.value.hint


@pytest.mark.parametrize(("text", "why"), WRONG_IDL)
def test_a_wrong_idl_is_said_at_its_line(text: str, why: str) -> None:
    with pytest.raises(Unreadable) as caught:
        read_idl(text, "X.idl")
    assert why in str(caught.value) and caught.value.place.startswith("X.idl:") and caught.value.hint


def test_every_beginning_of_a_file_is_read_or_refused() -> None:
    """And nothing else is raised."""
    refused = 0
    for text in (IDL, MSG["demo/msg/Everything.msg"]):
        for end in range(0, len(text), 3):
            try:
                read_idl(text[:end], "x") if text is IDL else read_msg(text[:end], "demo/msg/X", "x")
            except Unreadable:
                refused += 1
    assert refused > len(IDL) // 4


def test_a_message_without_fields_has_the_one_of_ros2(tmp_path: Path) -> None:
    messages = Messages([str(write_types(tmp_path, {"std_msgs/msg/Empty.msg": "# nothing\n"}))])
    assert starting(messages, Named("std_msgs/msg/Empty")) == {EMPTY: 0}


def test_messages_of_an_installed_ros_are_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of ROS 2 all; of Debian's ROS 1 those that mean the same."""
    write_types(tmp_path / "jazzy/share", {"a/msg/A.msg": "b/B b\n"})
    ros1 = {"b/msg/B.msg": "float64 x\n", "b/msg/C.msg": "Header header\n", "b/msg/D.msg": "time stamp\n"}
    write_types(tmp_path / "debian", ros1)
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{tmp_path / 'none'}:{tmp_path / 'jazzy'}")
    monkeypatch.setattr(msgs, "ROS1", str(tmp_path / "debian"))
    messages = Messages([])
    assert messages.at("a/msg/A", ["b", "x"]) == Plain("float64")
    for name in ("b/msg/C", "b/msg/D"):
        with pytest.raises(Unreadable, match="of ROS 1") as caught:
            messages.find(name)
        assert caught.value.place == f"{tmp_path / 'debian' / name}.msg:1"


def test_messages_that_hold_each_other_are_refused(tmp_path: Path) -> None:
    messages = Messages([str(write_types(tmp_path, {"a/msg/A.msg": "B b\n", "a/msg/B.msg": "A[] a\n"}))])
    with pytest.raises(Unreadable, match="a/msg/A has itself as a part"):
        messages.find("a/msg/A")

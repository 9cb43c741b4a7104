"""The program behind ports of the kind `ros2`, with others like it as peers, in processes of their own on `lo`."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.extensions.ros.dds import BOOL, Child, child, connect, decimals, free_domain, topics, write_types
from tests.outside import needs
from tests.runtime.ports.bench import bench, declared

pytestmark = [needs("cyclonedds"), pytest.mark.slow]
DOOR, SCAN = "std_msgs/msg/Bool", "sensor_msgs/msg/LaserScan"
TWO = decimals(2)


@pytest.fixture
def domain() -> Iterator[int]:
    with free_domain() as number:
        yield number


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return write_types(tmp_path / "msgs")


def test_values_go_from_topic_to_topic_and_only_what_has_changed(domain: int, folder: Path) -> None:
    used = topics(door=DOOR, cmd_vel="geometry_msgs/msg/Twist", scan={"type": SCAN, "reliability": "best_effort"})
    fields = {"/cmd_vel.linear.x": TWO, "/door.data": BOOL, "/scan.ranges.1": decimals(0)}
    with child(domain, folder, used, fields) as reads, child(domain, folder, used, {}, list(fields)) as writes:
        first = {"/cmd_vel": {"linear": {"x": 0.126}}, "/door": {"data": True}, "/scan": {"ranges": {"1": 2.75}}}
        assert connect(reads, writes, first) == {
            "/cmd_vel": {"linear": {"x": "0.13"}}, "/door": {"data": True}, "/scan": {"ranges": {"1": "3"}},
        }  # fmt: skip
        speeds = [{"/cmd_vel": {"linear": {"x": f"{n}.00"}}} for n in (4, 5)]
        writes.tell(values={**first, "/cmd_vel": {"linear": {"x": 4}}})
        reads.upto(speeds[0])
        writes.tell(values={"/cmd_vel": {"linear": {"x": 4}}, "/door": {"data": False}})
        got = reads.upto({"/door": {"data": False}})
        writes.tell(safe={"/cmd_vel": {"linear": {"x": 5}}})
        got += reads.upto(speeds[1])
        assert [one for one in got if "/cmd_vel" in one] == [speeds[1]]
        assert writes.said == reads.said == []


def test_the_same_again_is_published_again(domain: int, folder: Path) -> None:
    """With `when` the run sends what is equal on purpose."""
    used, shut, opened = topics(door=DOOR), {"/door": {"data": False}}, {"/door": {"data": True}}
    with (
        child(domain, folder, used, {"/door.data": BOOL}) as reads,
        child(domain, folder, used, {}, ["/door.data"]) as writes,
    ):
        connect(reads, writes, opened)
        for values in (shut, shut, shut, opened):
            writes.tell(values=values)
        reads.upto(shut)
        assert reads.upto(opened) == [shut, shut, opened]


def test_a_publisher_that_leaves_is_lost_and_may_come_back(domain: int, folder: Path) -> None:
    used = topics(door=DOOR)
    with child(domain, folder, used, {"/door.data": BOOL}) as reads:
        for _ in range(2):
            with child(domain, folder, used, {}, ["/door.data"]) as writes:
                assert connect(reads, writes, {"/door": {"data": True}}) == {"/door": {"data": True}}
            assert reads.until("lost") == {"lost": ["/door.data"], "why": "nobody publishes /door any more"}


def test_a_topic_that_was_never_published_is_said_once(domain: int, folder: Path) -> None:
    used = topics(door=DOOR)
    with (
        child(domain, folder, used, {"/door.data": BOOL}, settling=0) as reads,
        child(domain, folder, used, {}, ["/door.data"], settling=0) as writes,
    ):
        assert reads.until("say")["say"] == "nobody publishes /door yet; without `timeout` that is not a failure"
        connect(reads, writes, {"/door": {"data": True}})
        assert len(reads.said) == 1 and not writes.said


def test_the_domain_is_that_of_the_environment(domain: int, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    used = topics(door=DOOR)
    with child(domain, folder, used, {"/door.data": BOOL}) as reads:
        monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
        with child(None, folder, used, {}, ["/door.data"]) as writes:
            assert connect(reads, writes, {"/door": {"data": True}}) == {"/door": {"data": True}}


@pytest.mark.parametrize("text", ["232", "-1", "7 ", "1e2"])
def test_a_domain_that_cannot_be_is_said(text: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", text)
    made = Child(None, folder, topics(door=DOOR), {"/door.data": BOOL})
    assert made.line()["say"] == f"ROS_DOMAIN_ID is `{text}`; write a number from 0 to 231"
    assert made.process.wait() == 1
    made.kill()


def test_another_type_under_the_same_topic_is_said(domain: int, folder: Path) -> None:
    write_types(folder, {"demo/msg/Door.msg": "string data\n"})  # of equal fields, Cyclone DDS connects them
    with (
        child(domain, folder, topics(door=DOOR), {"/door.data": BOOL}) as reads,
        child(domain, folder, topics(door="demo/msg/Door"), {}, ["/door.data"]) as writes,
    ):
        why = "its type is {}, and ours {}"
        reads.until("lost")
        assert reads.said == [f"a publisher of /door does not fit: {why.format('demo/msg/Door', 'std_msgs/msg/Bool')}"]
        assert writes.until("say") and writes.said == [
            f"a subscriber of /door does not fit: {why.format('std_msgs/msg/Bool', 'demo/msg/Door')}"
        ]


def test_another_message_under_the_same_type_is_said(domain: int, folder: Path, tmp_path: Path) -> None:
    other = write_types(tmp_path / "other", {"std_msgs/msg/Bool.msg": "float64 data\nstring why\n"})
    with (
        child(domain, folder, topics(door=DOOR), {"/door.data": BOOL}) as reads,
        child(domain, other, topics(door=DOOR), {}, ["/door.data"]),
    ):
        reads.until("lost")
        assert reads.said == ["a publisher of /door does not fit: its type has other fields"]


def test_bytes_that_are_not_a_message_do_not_take_others_with_them(folder: Path) -> None:
    from llfsm_verify.extensions.ros import dds_node

    write_types(folder, {"std_msgs/msg/String.msg": "string data\n"})
    kind = dds_node.Classes(dds_node.Messages([str(folder)])).of("std_msgs/msg/String")
    assert kind.deserialize(b"\0\1\0\0\2\0\0\0a\0").data == "a"
    broken = kind.deserialize(b"\0\1\0\0\2\0\0\0\xff\0")
    assert isinstance(broken, dds_node.Broken) and broken.problem.startswith("UnicodeDecodeError")


@pytest.mark.parametrize(
    ("offered", "requested", "why"),
    [
        ({"reliability": "best_effort"}, {}, "it is best_effort, and ours reliable"),
        ({}, {"durability": "transient_local"}, "it is volatile, and ours transient_local"),
    ],
)
def test_a_quality_that_does_not_fit_is_said(
    domain: int, folder: Path, offered: dict[str, str], requested: dict[str, str], why: str
) -> None:
    with (
        child(domain, folder, topics(door={"type": DOOR, **requested}), {"/door.data": BOOL}) as reads,
        child(domain, folder, topics(door={"type": DOOR, **offered}), {}, ["/door.data"]) as writes,
    ):
        reads.until("lost")
        assert reads.said == [f"a publisher of /door does not fit: {why}"]
        turned = why.replace("it is", "ours is").replace("and ours", "and it")
        assert writes.until("say")["say"] == f"a subscriber of /door does not fit: {turned}"


def test_what_no_field_can_have_is_said_and_others_go_on(domain: int, folder: Path) -> None:
    write_types(folder, {"demo/msg/Two.msg": "uint8 n\nfloat32 x\nstring<=3 s\n"})
    used, fields = topics(two="demo/msg/Two"), ["/two.n", "/two.x", "/two.s"]
    with (
        child(domain, folder, used, dict.fromkeys(fields, TWO)) as reads,
        child(domain, folder, used, {}, fields) as writes,
    ):
        first = connect(reads, writes, {"/two": {"n": 256, "x": "NaN", "s": "long"}})
        assert first == {"/two": {"n": 0, "s": ""}} and set(reads.lost) == {"/two.x is not a number"}
        assert writes.said == [] and [writes.until("say")["say"] for _ in range(2)] == [
            "/two keeps its value: `256` is not a value of uint8: 256 is not from 0 to 255",
            "/two keeps its value: `long` is longer than 3 characters",
        ]
        writes.tell(values={"/two": {"n": "RED", "x": 1e300, "s": "ok"}})
        while not writes.until("say")["say"].startswith("/two is not published: float too large"):
            continue
        assert "/two keeps its value: `RED` is not a value of uint8" in writes.said
        writes.tell(values={"/two": {"n": 3, "x": 0.5, "s": "ok"}})
        reads.upto({"/two": {"n": 3, "x": "0.50", "s": "ok"}})


def test_a_sequence_that_is_too_short_is_said(domain: int, folder: Path) -> None:
    used = topics(scan=SCAN)
    with (
        child(domain, folder, used, {"/scan.ranges.2": TWO, "/scan.angle_min": TWO}) as reads,
        child(domain, folder, used, {}, ["/scan.angle_min", "/scan.ranges.1"]) as writes,
    ):
        values = {"/scan": {"angle_min": 1, "ranges": {"1": 3}}}
        assert connect(reads, writes, values) == {"/scan": {"angle_min": "1.00"}}
        assert set(reads.lost) == {"/scan.ranges.2 has 2 elements, and no element 2"}


def test_a_flood_is_taken_as_fast_as_the_run_reads(domain: int, folder: Path) -> None:
    write_types(folder, {"demo/msg/Count.msg": "uint64 n\n"})
    used, many = topics(n={"type": "demo/msg/Count", "depth": 10_000}), 10_000
    with (
        child(domain, folder, used, {"/n.n": decimals(0)}) as reads,
        child(domain, folder, used, {}, ["/n.n"]) as writes,
    ):
        connect(reads, writes, {"/n": {"n": 0}})
        for n in range(many):
            writes.tell(values={"/n": {"n": n + 1}})
        seen = [got["/n"]["n"] for got in reads.upto({"/n": {"n": many}}) if got["/n"]["n"]]
        assert seen == sorted(set(seen)) and reads.said == writes.said == []


def test_a_run_that_says_more_than_it_reads_is_heard(domain: int, folder: Path) -> None:
    many = 5000  # more than the two sockets hold
    with child(domain, folder, topics(door=DOOR), {}, ["/door.data"]) as writes:
        for _ in range(many):
            writes.tell(values={"/door": {"data": "maybe"}})
        for _ in range(many):
            assert writes.until("say")["say"] == "/door keeps its value: `maybe` is not a value of bool"


@pytest.mark.parametrize(
    ("given", "uri", "why"),
    [
        ({"interface": "nowhere0"}, None, "nowhere0: does not match an available interface."),
        ({"peers": ["no.such.host.invalid"]}, None, "the peer no.such.host.invalid is not known: "),
        ({"peers": [], "interface": None}, "<CycloneDDS><Domain><Foo/></Domain></CycloneDDS>", "Foo: unknown element"),
        ({"peers": [], "interface": None}, "file:///nowhere.xml", "can't open configuration file file:///nowhere.xml"),
    ],
)
def test_a_program_that_cannot_begin_says_why(
    folder: Path, given: dict[str, Any], uri: str | None, why: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    if uri is not None:
        monkeypatch.setenv("CYCLONEDDS_URI", uri)
    with free_domain() as domain:
        made = Child(domain, folder, topics(door=DOOR), {"/door.data": BOOL}, **given)
        assert why in made.line()["say"]
        assert made.process.wait() == 1
        made.kill()


def test_settings_of_the_user_that_are_not_looked_at_are_said(
    domain: int, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", "file:///nowhere.xml")
    with child(domain, folder, topics(door=DOOR), {"/door.data": BOOL}) as reads:
        assert reads.until("say")["say"].startswith("CYCLONEDDS_URI is not looked at")


def test_elements_are_counted(domain: int, folder: Path) -> None:
    used = topics(scan=SCAN)
    with (
        child(domain, folder, used, {"/scan.ranges.count": decimals(0)}) as reads,
        child(domain, folder, used, {}, ["/scan.ranges.2"]) as writes,
    ):
        assert connect(reads, writes, {"/scan": {"ranges": {"2": 1}}}) == {"/scan": {"ranges": {"count": 3}}}


PORTS = """\
ports:
  world:
    kind: ros2
    domain: %d
    peers: [127.0.0.1]
    interface: lo
    messages: [msgs]
    topics: {/in: geometry_msgs/msg/Twist, /out: geometry_msgs/msg/Twist}
    inputs: {speed: /in.linear.x}
    outputs: {speed: /out.angular.z}
    on_failure: safe
    safe: {speed: 0.5}
"""


def test_a_run_reads_and_writes_topics(domain: int, folder: Path) -> None:
    used = topics(**{"in": "geometry_msgs/msg/Twist", "out": "geometry_msgs/msg/Twist"})
    specs = declared(PORTS % domain, folder.parent)
    with child(domain, folder, used, {"/out.angular.z": TWO}, ["/in.linear.x"]) as peer, bench(*specs) as run:

        def tell(speed: object) -> None:
            """Again and again, as each side comes to know the other."""
            peer.tell(values={"/in": {"linear": {"x": speed}}})
            time.sleep(0.02)

        run.until(lambda: tell("NaN") or any("/in.linear.x is not a number" in said for said in run.said))
        run.until(lambda: tell(-0.254) or str(run.value("speed")) == "-0.25")
        run.until(lambda: peer.has_said() and "-0.25" in str(peer.line()))
        counts = run.ports.counts["world"]
        assert counts.taken and counts.failures and not counts.refused and not counts.malformed
    assert not any("failed" in said for said in run.said), run.said

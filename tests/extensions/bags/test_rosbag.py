"""Rosbags as logs: their verdicts are those of a table with the same values, whoever wrote the bag."""

from __future__ import annotations

import csv
import json
import math
import random
import shutil
import sqlite3
import subprocess
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from tests.cli.running import llfsm
from tests.extensions.rosmonitoring.examples import DOOR
from tests.outside import needs

pytestmark = pytest.mark.slow
Events = list[tuple[int, str, float]]
"""Nanoseconds, topic, value: of /door a truth, of /cmd_vel a speed."""
MAPPING = 'topic: /cmd_vel\ncolumns: {open: "/door:data", speed: {column: linear.x, scale: 4}}\ntime: log_time\n'
COLUMNS = "columns: {open: open, speed: {column: speed, scale: 4}}\ntime: {column: time, unit: ns}\n"
LINES = ("safe: G (open -> speed <= 4)", "soon: G (open -> F[<=1s] speed == 0)", "F (open && speed == 7)")


def random_events(seed: int) -> Events:
    draw = random.Random(seed)
    time, events = 1_700_000_000_000_000_000, [(1_700_000_000_000_000_000, "/door", 0.0)]
    for _ in range(30):
        time += draw.choice([1, 100_000_000, 450_000_000])
        topic = draw.choice(["/door", "/cmd_vel"])
        events.append(
            (time, topic, float(draw.random() < 0.2) if topic == "/door" else draw.choice([0, 0, 1.25, 1.75]))
        )
    return events


def ros1(place: Path, events: Events) -> Path:
    store = get_typestore(Stores.ROS1_NOETIC)
    truth, twist, vector = (
        store.types[f"{name}"] for name in ("std_msgs/msg/Bool", "geometry_msgs/msg/Twist", "geometry_msgs/msg/Vector3")
    )
    path = place / "run.bag"
    with Writer1(path) as writer:
        door = writer.add_connection("/door", truth.__msgtype__, typestore=store)
        moves = writer.add_connection("/cmd_vel", twist.__msgtype__, typestore=store)
        for time, topic, value in events:
            message = truth(bool(value)) if topic == "/door" else twist(vector(value, 0, 0), vector(0, 0, 0))
            connection = door if topic == "/door" else moves
            writer.write(connection, time, store.serialize_ros1(message, message.__msgtype__))
    return path


def ros2(place: Path, events: Events, storage: StoragePlugin) -> Path:
    store = get_typestore(Stores.ROS2_HUMBLE)
    truth, twist, vector = (
        store.types[f"{name}"] for name in ("std_msgs/msg/Bool", "geometry_msgs/msg/Twist", "geometry_msgs/msg/Vector3")
    )
    path = place / "run"
    with Writer2(path, version=9, storage_plugin=storage) as writer:
        door = writer.add_connection("/door", truth.__msgtype__, typestore=store)
        moves = writer.add_connection("/cmd_vel", twist.__msgtype__, typestore=store)
        for time, topic, value in events:
            message = truth(bool(value)) if topic == "/door" else twist(vector(value, 0, 0), vector(0, 0, 0))
            connection = door if topic == "/door" else moves
            writer.write(connection, time, store.serialize_cdr(message, message.__msgtype__))
    return path


REAL = """
import json, sys
import genpy, rosbag
from geometry_msgs.msg import Twist
from std_msgs.msg import Bool
with rosbag.Bag("run.bag", "w", compression=sys.argv[1]) as bag:
    for time, topic, value in json.load(sys.stdin):
        message = Bool(bool(value)) if topic == "/door" else Twist()
        if topic == "/cmd_vel":
            message.linear.x = value
        bag.write(topic, message, genpy.Time(time // 10**9, time % 10**9))
"""


def real(place: Path, events: Events, compression: str) -> Path:
    command = ["/usr/bin/python3", "-c", REAL, compression]
    subprocess.run(command, cwd=place, input=json.dumps(events), text=True, check=True, capture_output=True)
    return place / "run.bag"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name, text in (("door.yaml", DOOR), ("m.yaml", MAPPING), ("columns.yaml", COLUMNS)):
        (tmp_path / name).write_text(text)
    return tmp_path


def said(log: str, mapping: str, *words: str) -> str:
    lines = [word for line in LINES for word in ("-p", line)]
    done = llfsm("check-recording", log, "--arrangement", "door.yaml", "--mapping", mapping, *lines, *words)
    assert done.returncode in (1, 4), done.stderr
    return done.stdout


def agree(folder: Path, write: Callable[[Path, Events], Path], *words: str) -> None:
    for seed in range(3):
        place = folder / str(seed)
        place.mkdir()
        events, opened, rows = random_events(seed), "", list[tuple[object, ...]]()
        for time, topic, value in events:
            if topic == "/door":
                opened = json.dumps(bool(value))
            else:
                rows.append((time, opened, value))
        with (folder / "log.csv").open("w", newline="") as file:
            csv.writer(file).writerows([("time", "open", "speed"), *rows])
        found = said(str(write(place, events)), "m.yaml", *words)
        assert found == said("log.csv", "columns.yaml") and "at row" in found


def test_bags_of_ros_1(folder: Path) -> None:
    agree(folder, ros1)


@pytest.mark.parametrize("storage", StoragePlugin)
def test_bags_of_ros_2_are_folders(folder: Path, storage: StoragePlugin) -> None:
    agree(folder, lambda place, events: ros2(place, events, storage), "--from", "rosbag")
    if storage is StoragePlugin.SQLITE3:
        (database,) = (folder / "0/run").glob("*.db3")
        assert said(str(database), "m.yaml") == said("0/run", "m.yaml", "--from", "rosbag")


@needs("rospy")
@pytest.mark.parametrize("compression", ["none", "bz2", "lz4"])
def test_bags_that_rosbag_wrote(folder: Path, compression: str) -> None:
    agree(folder, lambda place, events: real(place, events, compression))


@pytest.mark.parametrize(
    ("mapping", "code", "told"),
    [
        (MAPPING.replace("/cmd_vel", "/cmd"), "E496", "there is no topic `/cmd` in run.bag\n"),
        (MAPPING.replace("topic: /cmd_vel\n", ""), "E497", "it has 2 topics (/cmd_vel, /door): say `topic: …`"),
        (MAPPING.replace("linear.x", "linear"), "E496", "there is no column `linear` in run.bag\n"),
        (MAPPING.replace("scale: 4", "scale: 3"), "E497", "`1.25` is not a whole number"),
    ],
)
def test_what_does_not_fit_a_bag_is_said(folder: Path, mapping: str, code: str, told: str) -> None:
    events = [(1, "/door", 1.0), (2, "/cmd_vel", 1.25)]
    ros1(folder, events)
    (folder / "m.yaml").write_text(mapping)
    done = llfsm("check-recording", "run.bag", "--arrangement", "door.yaml", "--mapping", "m.yaml", "-p", LINES[0])
    assert done.returncode == 3 and f"error[{code}]" in done.stderr and told in done.stderr


def test_what_is_not_a_whole_bag_is_not_decided_on(folder: Path) -> None:
    whole = ros1(folder, random_events(1)).read_bytes()
    ros2(folder, random_events(1), StoragePlugin.SQLITE3)
    (folder / "run/metadata.yaml").write_text("rosbag2_bagfile_information: {}\n")
    for damaged in (whole[:5000], whole[:200], whole.replace(b"op=\x05", b"op=\x77"), b"#ROSBAG V1.2\n", b""):
        (folder / "run.bag").write_bytes(damaged)
        for log in ("run.bag", "run"):
            words = ("--from", "rosbag", "--arrangement", "door.yaml", "--mapping", "m.yaml", "-p", LINES[0])
            done = llfsm("check-recording", log, *words)
            assert done.returncode == 3 and "error[E497]: the log cannot be read: " in done.stderr, done.stderr
    (folder / "run.old").write_bytes(whole)
    done = llfsm("check-recording", "run.old", *words)
    assert done.returncode == 3 and "a bag of ROS 1 is called `….bag`" in done.stderr
    shutil.rmtree(folder / "run")
    done = llfsm("check-recording", "run", *words)
    assert done.returncode == 3 and "the log cannot be read: No such file" in done.stderr


def odd(place: Path, values: list[float], *, defined: bool = True) -> None:
    """A bag of ROS 2 with messages of a type that ROS 2 does not have."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg("bool open\nfloat64 speed\nint32[] many", "odd_msgs/msg/Odd"))
    kind = store.types["odd_msgs/msg/Odd"]
    with Writer2(place / "run", version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connection = writer.add_connection("/odd", kind.__msgtype__, typestore=store)
        for time, value in enumerate(values):
            message = kind(True, value, np.arange(3, dtype=np.int32))
            writer.write(connection, time, store.serialize_cdr(message, kind.__msgtype__))
    if not defined:
        with closing(sqlite3.connect(next((place / "run").glob("*.db3")))) as database:
            database.execute("delete from message_definitions")
            database.commit()


@pytest.mark.parametrize(
    ("values", "defined", "code", "told"),
    [
        ([math.nan], True, "E497", "message 1, column `speed` (`speed`): `nan` is not a "),
        ([1.0, -math.inf], True, "E497", "message 2, column `speed` (`speed`): `-inf` is not a "),
        ([1.0], False, "E497", "the bag does not say what a `odd_msgs/msg/Odd` is, of `/odd`"),
    ],
)
def test_what_a_message_of_a_bag_cannot_say_is_told(folder: Path, values, defined: bool, code: str, told: str) -> None:
    odd(folder, values, defined=defined)
    (folder / "m.yaml").write_text("columns: {open: open, speed: {column: speed, scale: 4}}\n")
    words = ("--from", "rosbag", "--arrangement", "door.yaml", "--mapping", "m.yaml", "-p", "G (speed <= 4)")
    done = llfsm("check-recording", "run", *words)
    assert done.returncode == 3 and f"error[{code}]" in done.stderr and told in done.stderr, done.stderr


@pytest.mark.parametrize("write", [ros1, lambda place, events: ros2(place, events, StoragePlugin.SQLITE3)])
def test_messages_of_a_bag_are_read_in_the_order_of_their_times(folder: Path, write) -> None:
    events, later = random_events(2), folder / "later"
    later.mkdir()
    found = said(str(write(folder, events)), "m.yaml", "--from", "rosbag")
    assert said(str(write(later, sorted(events, key=lambda event: -event[0]))), "m.yaml", "--from", "rosbag") == found

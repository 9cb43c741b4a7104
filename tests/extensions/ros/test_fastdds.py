"""Random messages of all types of fields, and counts of them, to and from Fast DDS, what ROS 2 speaks by default."""

from __future__ import annotations

import json
import math
import struct
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random
from typing import Any

import pytest

from llfsm_verify.extensions.ros.msgs import Many, Messages, Named, Plain, Text, Type, limit
from tests.extensions.ros.dds import child, decimals, free_domain, topics, write_types
from tests.extensions.ros.everything import MSG, peer
from tests.outside import needs

pytestmark = [needs("cyclonedds", "fastdds", "g++"), pytest.mark.slow]
EVERYTHING, MANY, ROUNDS = "demo/msg/Everything", 1000, 150


@pytest.fixture(scope="module")
def program() -> Path:
    return peer()


@pytest.fixture
def fastdds(program: Path) -> Iterator[tuple[int, Callable[..., str]]]:
    """The domain, and a function that gives the peer a line, if one is given, and takes one."""
    with free_domain() as domain, subprocess.Popen([program, str(domain)], stdin=-1, stdout=-1, text=True) as process:
        assert process.stdin is not None and process.stdout is not None

        def line(command: str = "") -> str:
            assert process.stdin is not None and process.stdout is not None
            process.stdin.write(command)
            process.stdin.flush()
            return process.stdout.readline().strip()

        assert line() == "ready"
        yield domain, line
        process.stdin.close()
        assert process.wait() == 0


def drawn(random: Random, of: Type, messages: Messages) -> Any:
    """A value; the bounds of each type are often among them."""
    if isinstance(of, Named):
        return {m.name: drawn(random, m.type, messages) for m in messages.find(of.name).members}
    if isinstance(of, Many):
        length = of.size if of.size is not None else random.randrange(min(limit(of), 6) + 1)
        return [drawn(random, of.of, messages) for _ in range(length)]
    if isinstance(of, Text):
        return "".join(random.choice('az" \\é\n') for _ in range(random.randrange(min(of.most or 12, 5))))
    assert isinstance(of, Plain)
    if of.name == "bool":
        return random.random() < 0.5
    if of.name.startswith("float"):
        value = random.choice([math.nan, math.inf, -math.inf, -0.0, random.uniform(-1e9, 1e9), 5e-324])
        return struct.unpack("f", struct.pack("f", value))[0] if of.name == "float32" else value
    bits = 8 if of.name in ("byte", "char") else int(of.name.removeprefix("u").removeprefix("int"))
    low = -(1 << bits - 1) if of.name.startswith("int") else 0
    return random.choice([low, low + (1 << bits) - 1, low + random.randrange(1 << bits)])


def same(left: Any, right: Any) -> bool:
    if isinstance(left, dict):
        return bool(left.keys() == right.keys() and all(same(left[name], right[name]) for name in left))
    if isinstance(left, list):
        return len(left) == len(right) and all(map(same, left, right))
    if isinstance(left, float) and math.isnan(left):
        return isinstance(right, float) and math.isnan(right)
    return bool(left == right)


def plain(value: Any) -> Any:
    """What Cyclone DDS has read, as values of Python."""
    if isinstance(value, list | bytes):
        return [plain(one) for one in value]
    fields = getattr(type(value), "__annotations__", None)
    return value if fields is None else {name: plain(getattr(value, name)) for name in fields}


def test_random_messages_come_back_as_they_went(fastdds: tuple[int, Callable[..., str]], tmp_path: Path) -> None:
    """Each is compared twice: what Fast DDS has read, as it prints it, and what we read of what it writes."""
    from llfsm_verify.extensions.ros import dds_node as node

    domain, line = fastdds
    messages = Messages([str(write_types(tmp_path, MSG))])
    classes, quality = node.Classes(messages), node.quality(topics(ping=EVERYTHING)["/ping"])
    settings = node.configuration(["127.0.0.1"], "lo")
    assert settings is not None
    whole = node.Domain(domain, settings)
    participant = node.DomainParticipant(domain)
    kind = classes.of(EVERYTHING)
    writer = node.DataWriter(participant, node.Topic(participant, "rt/ping", kind, qos=quality), quality)
    reader = node.DataReader(participant, node.Topic(participant, "rt/pong", kind, qos=quality), quality)
    while not writer.get_matched_subscriptions() or not reader.get_matched_publications():
        time.sleep(0)
    first = classes.sample(Named(EVERYTHING), node.starting(messages, Named(EVERYTHING)))
    sent = 0
    while not reader.take(1):  # each side knows the other
        writer.write(first)
        sent += 1
        time.sleep(0.05)
    random = Random(1)
    for _ in range(ROUNDS):
        value = drawn(random, Named(EVERYTHING), messages)
        writer.write(classes.sample(Named(EVERYTHING), value))
        assert any(same(json.loads(line()), value) for _ in range(sent + 1))
        assert any(same(plain(reader.take_one(timeout=10**11)), value) for _ in range(sent + 1))
        sent = 0
    del reader, writer, participant, whole


def test_as_many_messages_come_as_were_sent(fastdds: tuple[int, Callable[..., str]], tmp_path: Path) -> None:
    domain, line = fastdds
    write_types(tmp_path, MSG)
    of = {"type": "demo/msg/Count", "depth": MANY}
    inputs = {"/counts_out.n": decimals(0), "/counts_out.t": decimals(1)}
    used = topics(counts_in=of, counts_out=of)
    with child(domain, tmp_path, used, inputs, ["/counts_in.n", "/counts_in.t"]) as ours:
        while not ours.has_said(0.05):  # each side knows the other
            assert line("publish 1\n") == "published 1"
        while line("heard 0\n") == "no":
            ours.tell(values={"/counts_in": {"n": 0, "t": 0}})
            while ours.has_said(0.05):
                ours.line()
        assert line(f"publish {MANY}\n") == f"published {MANY}"
        got: list[dict[str, Any]] = [ours.values()["/counts_out"]]
        while got[-1]["n"] != MANY:
            got.append(ours.values()["/counts_out"])
        assert got[-MANY:] == [{"n": n, "t": f"{n / 2:.1f}"} for n in range(1, MANY + 1)]
        for n in range(1, MANY + 1):
            ours.tell(values={"/counts_in": {"n": n, "t": n / 2}})
        assert line(f"count {MANY}\n") == f"counted {MANY} wrong 0"
        assert ours.said == ours.lost == []

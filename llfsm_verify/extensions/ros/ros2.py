"""The kind of port `ros2`: topics of ROS 2 by DDS, without an installed ROS.

    ports:
      door:
        kind: ros2
        messages: [msgs]
        topics: {/door: std_msgs/msg/Bool, /cmd_vel: geometry_msgs/msg/Twist}
        inputs: {open: /door.data}
        outputs: {speed: /cmd_vel.linear.x}
        on_failure: stale

A field is a topic and a path in its message. Types and fields are looked up before the run, at their places:

    `/dor.data`: there is no topic `/dor` under `topics`                            did you mean `/door`?
    `/cmd_vel.linear.w`: geometry_msgs/msg/Vector3 has no field `w`                 its fields are x, y, z
    there is no message std_msgs/msg/Bol        name a folder with std_msgs/msg/Bol.msg under `messages`, or …
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator, Mapping
from importlib.util import find_spec
from pathlib import Path

from llfsm_verify.extensions.ros.msgs import MOST_DOMAIN, NAME, Messages, Unreadable
from llfsm_verify.extensions.ros.ros1 import SETTLING, folders_of
from llfsm_verify.plug import (
    CHILD_FIELDS,
    NUMBER,
    WRONG_PORT,
    ByName,
    Either,
    Field,
    Json,
    Link,
    MappingNode,
    Node,
    Port,
    PortKind,
    ProcessSettings,
    Report,
    Scalar,
    Several,
    Single,
    Started,
    Table,
    Words,
    did_you_mean,
    mark,
    patience_of,
    whole_number,
)

TOPIC = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*)+\Z")
RELIABILITY, DURABILITY = ("reliable", "best_effort"), ("volatile", "transient_local")
MOST_DEPTH = 10_000
QUALITY = Table(
    "a topic: its type, and its quality of service where it is not that of ROS 2",
    (
        Field("type", "such as `std_msgs/msg/Bool`", Single(("string",)), required=True),
        Field("reliability", "`reliable`, the default, or `best_effort`", Words(RELIABILITY)),
        Field("durability", "`volatile`, the default, or `transient_local`", Words(DURABILITY)),
        Field("depth", "how many messages wait for a slow reader, 10 by default", NUMBER),
    ),
)


class Ros2(PortKind):
    """Topics; the program behind it is `dds_node`."""

    table = Table(
        "topics of ROS 2 by DDS. It was tried against Cyclone DDS 11 and Fast DDS 2.9, not against rclcpp",
        (
            Field(
                "topics",
                "the type of each topic that is used: `{/door: std_msgs/msg/Bool}`, or "
                "`{/scan: {type: sensor_msgs/msg/LaserScan, reliability: best_effort}}`",
                ByName(Either((Single(("string",)), QUALITY)), TOPIC.pattern.replace("\\Z", "$")),
                required=True,
            ),
            Field(
                "messages",
                "folders with types: `std_msgs/msg/Bool.msg`, or `.idl`; those of an installed ROS 2 are found",
                Several(Single(("string",))),
            ),
            Field("domain", "the domain of DDS (default: ROS_DOMAIN_ID, or 0)", NUMBER),
            Field(
                "peers",
                "addresses of other computers, which are then found without multicast; `[127.0.0.1]` is this one",
                Several(Single(("string",))),
            ),
            Field("interface", "the network interface, such as `lo`; by default DDS chooses one", Single(("string",))),
            *CHILD_FIELDS,
        ),
    )
    keys, required, paths = table.keys, table.required, True
    no_requests = "services and actions of ROS 2 differ from one vendor of DDS to the other, so it has topics only"

    def settings(self, report: Report, found: Mapping[str, Node], what: str, folder: str) -> Started | None:
        """See `Kind`."""
        before = len(report.diagnostics)
        folders = folders_of(report, found.get("messages"), folder)
        messages = Messages(folders)
        topics = dict(_topics(report, found["topics"], what, messages))
        if len(report.diagnostics) == before:
            for key in ("inputs", "outputs"):
                _check(report, found.get(key), messages, topics, output=key == "outputs")
        interface = report.scalar(found["interface"], "`interface`") if "interface" in found else None
        peers = _words(report, found.get("peers"), "peers")
        for at in (*(at for _, at in peers), *(() if interface is None else (interface,))):
            if not re.fullmatch(r"[\w.:%-]+", at.text, re.ASCII):
                message = f"`{at.text[:60]}` is not an address or an interface"
                report.error(WRONG_PORT, message, mark(at), "write one such as `192.168.0.7`, or `lo`")
        domain = whole_number(report, found, "domain", 0, MOST_DOMAIN, 0) if "domain" in found else None
        timing = patience_of(report, found, what)
        if len(report.diagnostics) > before or timing is None:
            return None
        told: dict[str, Json] = {
            "domain": domain, "peers": [peer for peer, _ in peers], "topics": dict(topics), "settling": SETTLING,
            "interface": None if interface is None else interface.text,
            "messages": list(folders),
        }  # fmt: skip
        run = (sys.executable, "-P", "-m", "llfsm_verify.extensions.ros.dds_node")
        hint = "correct `domain` (or ROS_DOMAIN_ID), `peers` or `interface`, or the file that CYCLONEDDS_URI names"
        started = ProcessSettings(run, str(Path(folder).resolve()), told, *timing, hint=hint).started

        def start(link: Link) -> Port:
            if find_spec("cyclonedds") is None:
                raise ModuleNotFoundError("No module named 'cyclonedds'", name="cyclonedds")
            return started.start(link)

        return Started(start)

    def field_problem(self, name: str, *, output: bool) -> str | None:  # noqa: ARG002 - both have topics
        """See `Kind`."""
        topic, _, rest = name.partition(".")
        if TOPIC.match(topic) is None or not rest:
            return "a field of ROS 2 is a topic and a path in its message, such as `/door.data`"
        return None


def _words(report: Report, node: Node | None, key: str) -> list[tuple[str, Scalar]]:
    sequence = None if node is None else report.sequence(node, f"`{key}`")
    scalars = [] if sequence is None else [report.scalar(item, f"what `{key}` has") for item in sequence.items]
    return [(scalar.text, scalar) for scalar in scalars if scalar is not None]


def _topics(report: Report, node: Node, what: str, messages: Messages) -> Iterator[tuple[str, Json]]:
    mapping = report.mapping(node, f"`topics` of {what}")
    for key, value in () if mapping is None else mapping.items:
        if TOPIC.match(key.text) is None:
            hint = "write names between `/`, the first one before the first name: `/arm/speed`"
            report.error(WRONG_PORT, f"`{key.text[:60]}` cannot be a topic", key.span, hint)
            continue
        of: Mapping[str, Node] | None = {"type": value}
        if isinstance(value, MappingNode):
            of = report.fields(value, f"`{key.text}`", QUALITY.keys, QUALITY.required)
        kind = None if of is None else report.scalar(of["type"], f"the type of `{key.text}`")
        if of is None or kind is None:
            continue
        yield (
            key.text,
            {
                "type": kind.text,
                "reliability": report.choice(of.get("reliability"), "`reliability`", RELIABILITY, RELIABILITY[0]),
                "durability": report.choice(of.get("durability"), "`durability`", DURABILITY, DURABILITY[0]),
                "depth": whole_number(report, of, "depth", 1, MOST_DEPTH, 10),
            },
        )
        try:
            if NAME.match(kind.text) is None:
                hint = f"write `{'/msg/'.join(kind.text.split('/'))}`" if kind.text.count("/") == 1 else ""
                raise Unreadable(f"`{kind.text[:60]}` is not a type of ROS 2", hint or "write `PACKAGE/msg/NAME`")
            messages.find(kind.text)
        except Unreadable as problem:
            _say(report, problem, kind)


def _check(report: Report, node: Node | None, messages: Messages, topics: Mapping[str, Json], *, output: bool) -> None:
    """Whether the fields are values of their topics."""
    for _, value in node.items if isinstance(node, MappingNode) else ():
        if not isinstance(value, Scalar):
            continue  # it was said
        topic, _, path = value.text.partition(".")
        of = topics.get(topic)
        try:
            if not isinstance(of, dict):
                hint = did_you_mean(topic, topics) or f"write `{topic}: TYPE` there"
                raise Unreadable(f"there is no topic `{topic}` under `topics`", hint)
            messages.at(str(of["type"]), path.split("."), output=output)
        except Unreadable as problem:
            _say(report, problem, value)


def _say(report: Report, problem: Unreadable, at: Scalar) -> None:
    notes = (f"its file is {problem.place}",) if problem.place else ()
    report.error(WRONG_PORT, f"`{at.text[:80]}`: {problem}", mark(at), problem.hint, notes)


KIND = Ros2()

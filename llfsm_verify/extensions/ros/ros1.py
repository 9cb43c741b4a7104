"""The kind of port `ros1`: topics, services, actions and parameters of ROS 1.

    ports:
      robot:
        kind: ros1
        topics: {/sm_ready_msg: std_msgs/String, /arm/distance: std_msgs/Float64, /cmd_vel: geometry_msgs/Twist}
        messages: [msgs]
        inputs: {start: /sm_ready_msg.data, distance: /arm/distance.data, rate: "param:/picker/rate"}
        outputs: {speed: /cmd_vel.linear.x}
        events: {start: NONE}
        values: {"Start state machine": START}
        requests:
          locate: {service: /fruit_request, type: crops_msgs/Fruits_req, answers: {fruits: fruit_list.count}}
          arm: {action: /move_box_arm_action, type: crops_msgs/moveArm, sends: {x: target.x}}
        on_failure: stale

    $ llfsm run picker.yaml --ports robot.ports.yaml

A field is a topic and a path in its message. The program behind it, `ros1_node`, runs under the Python that has rospy.
It also says here which types and fields there are, so that mistakes are told at their places before the run:

    `/sm_redy_msg.data`: there is no topic `/sm_redy_msg` under `topics`        did you mean `/sm_ready_msg`?
    `/arm/distance.dat`: std_msgs/Float64 has no field `dat`                    did you mean `data`?
    `crops_msgs/Fruit_req`: package crops_msgs has no service `Fruit_req`       did you mean `crops_msgs/Fruits_req`?
"""

from __future__ import annotations

import json
import re
import subprocess
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from llfsm_verify.extensions.ros.codes import NO_ROS
from llfsm_verify.plug import (
    CHILD_FIELDS,
    NUMBER,
    TRUTHS,
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
    Sequence,
    Several,
    Single,
    Started,
    Table,
    Unopened,
    Words,
    did_you_mean,
    mark,
    patience_of,
    whole_number,
)

NAME = re.compile(r"[~/]?[A-Za-z][A-Za-z0-9_]*(/[A-Za-z0-9_]+)*\Z")
PARAMETER, ASKED, ANSWERED = "param:", "asked", "answered"
PARAMETER_WRONG = re.compile(r"(?:there is no|the) parameter (\S+?)(?:;| is .* does not have$)", re.DOTALL)
"""How `ros1_node` says so."""
PYTHON = "/usr/bin/python3"
NODE = str(Path(__file__).with_name("ros1_node"))
QUEUE, MOST_QUEUE = 100, 100_000
ANSWERING = 10
"""Seconds in which the arrangement must answer a service."""
SETTLING = 5.0
"""Seconds after which a topic that nobody has published is said."""
CHECKING = 30.0
"""Seconds in which types must be found."""
INSTALL = (
    "install ROS 1 (on Debian: apt-get install python3-rospy python3-actionlib), or name the Python that has it: "
    "`python: …`"
)
_TYPE = Field("type", "such as `std_msgs/String`", Single(("string",)), required=True)
TOPIC = Table(
    "a topic: its type, its queue, and whether later subscribers get the last message",
    (
        _TYPE,
        Field("queue", f"how many messages wait for a slow reader, {QUEUE} by default", NUMBER),
        Field("latch", "`true` or `false`; the default is `true`, and with `when` it is `false`", Words(TRUTHS)),
    ),
)
SERVICE = Table(
    "a service that the arrangement answers",
    (_TYPE, Field("patience", f"seconds in which it must answer, {ANSWERING} by default", NUMBER)),
)


@dataclass(slots=True)
class _Asked:
    """A type, and the fields of it that are named: what `ros1_node/check.py` is asked."""

    kind: Literal["topic", "service", "action", "serves"]
    type: Scalar
    fields: list[tuple[str, str, Scalar]] = field(default_factory=list)
    """Each with its part, its path, and where it is written."""


class Ros1(PortKind):
    """One node."""

    table = Table(
        "a node of ROS 1: topics, services, actions and parameters",
        (
            Field(
                "topics",
                "the type of each topic that is used: `{/start: std_msgs/String}`, or "
                "`{/arm/distance: {type: std_msgs/Float64, queue: 1, latch: true}}`",
                ByName(Either((Single(("string",)), TOPIC))),
            ),
            Field(
                "services",
                "services that the arrangement answers, with their types; their requests are inputs, their responses "
                "outputs",
                ByName(Either((Single(("string",)), SERVICE))),
            ),
            Field(
                "messages",
                "folders with packages of `.msg`, `.srv` and `.action` files (`PACKAGE/msg/NAME.msg`), beside those "
                "that are installed",
                Several(Single(("string",))),
            ),
            Field("node", "the name of the node; the default begins with `llfsm` and is unique", Single(("string",))),
            Field("python", f"the Python that has rospy; the default is `{PYTHON}`", Single(("string",))),
            *CHILD_FIELDS,
        ),
    )
    keys, required = table.keys, table.required
    requests = Table(
        "a service or an action of another node",
        (
            Field("service", "the name of the service", Single(("string",))),
            Field("action", "the name of the action", Single(("string",))),
            Field("type", "its type, such as `std_srvs/Trigger`", Single(("string",)), required=True),
        ),
        one=("service", "action"),
    )

    def settings(self, report: Report, found: Mapping[str, Node], what: str, folder: str) -> Started | None:
        """See `Kind`."""
        before = len(report.diagnostics)
        words = {key: report.scalar(found[key], f"`{key}`") for key in ("node", "python") if key in found}
        named = {key: scalar.text for key, scalar in words.items() if scalar is not None}
        node = words.get("node")
        if node is not None and NAME.match(node.text) is None:
            report.error(
                WRONG_PORT, f"`{node.text[:60]}` cannot be a node", mark(node), "write letters, digits and `_`"
            )
        folders = folders_of(report, found.get("messages"), folder)
        asked: dict[str, _Asked] = {}
        topics = dict(_topics(report, found, asked))
        services = dict(_services(report, found, asked))
        for key in ("inputs", "outputs"):
            _fields(report, found.get(key), asked, output=key == "outputs")
        requests = list(_requests(report, found.get("requests")))
        timing = patience_of(report, found, what)
        if len(report.diagnostics) > before or timing is None:
            return None
        python = named.get("python", PYTHON)
        python = str(Path(folder, python).absolute()) if "/" in python else python
        _check(
            report,
            python,
            folders,
            [*asked.values(), *requests],
            words.get("python") or found.get("kind") or next(iter(found.values())),
        )
        if len(report.diagnostics) > before:
            return None
        told: dict[str, Json] = {
            "node": named.get("node"), "messages": list(folders), "topics": topics, "services": services,
            "events": list(_events(found)), "when": "when" in found, "settling": SETTLING,
            "values": [key.text for key, _ in values.items] if isinstance(values := found.get("values"), MappingNode)
            else [],
        }  # fmt: skip
        hint = "start `roscore`, set ROS_MASTER_URI, or correct the file of ports"
        started = ProcessSettings((python, NODE), str(Path(folder).resolve()), told, *timing, hint=hint).started

        def start(link: Link) -> Port:
            try:
                return started.start(link)
            except Unopened as problem:  # the words of its command line are not the user's
                why = str(problem).partition("`: ")[2] or str(problem)
                wrong = PARAMETER_WRONG.match(why)
                hint = f"run `rosparam set {wrong[1]} VALUE`, or correct the file of ports" if wrong else problem.hint
                raise Unopened(why, hint) from None

        return Started(start)

    def field_problem(self, name: str, *, output: bool) -> str | None:
        """See `Kind`. Fields of requests are paths only, those of topics are looked at by `_fields`."""
        if not name.startswith(PARAMETER):
            return None
        if output:
            return "a parameter is read before the run, and cannot be written"
        wrong = NAME.match(name[len(PARAMETER) :].partition(".")[0]) is None
        return "a parameter is written as `param:/picker/rate`" if wrong else None


def folders_of(report: Report, node: Node | None, folder: str) -> tuple[str, ...]:
    sequence = None if node is None else report.sequence(node, "`messages`")
    scalars = [] if sequence is None else [report.scalar(item, "what `messages` has") for item in sequence.items]
    found = []
    for scalar in (one for one in scalars if one is not None):
        place = Path(folder, scalar.text).resolve() if "\0" not in scalar.text else None
        if place is None or not place.is_dir():
            message = f"there is no folder `{scalar.text[:60]}`"
            report.error(WRONG_PORT, message, mark(scalar), "write one with packages, such as `std_msgs/msg`")
        found.append(str(place))
    return tuple(found)


def _entries(
    report: Report, node: Node | None, key: str, table: Table
) -> Iterator[tuple[Scalar, Scalar, Mapping[str, Node]]]:
    """Names, with the type of each and what is said of it beside."""
    mapping = None if node is None else report.mapping(node, f"`{key}`")
    for name, value in () if mapping is None else mapping.items:
        of: Mapping[str, Node] | None = {"type": value}
        if isinstance(value, MappingNode):
            of = report.fields(value, f"`{name.text[:60]}`", table.keys, table.required)
        made = None if of is None else report.scalar(of["type"], f"the type of `{name.text[:60]}`")
        if NAME.match(name.text) is None:
            hint = "write letters, digits and `_` between `/`: `/arm/speed`"
            report.error(WRONG_PORT, f"`{name.text[:60]}` cannot be a name of ROS", name.span, hint)
        elif of is not None and made is not None:
            yield name, made, of


def _topics(report: Report, found: Mapping[str, Node], asked: dict[str, _Asked]) -> Iterator[tuple[str, Json]]:
    latch = "false" if "when" in found else "true"
    for name, made, of in _entries(report, found.get("topics"), "topics", TOPIC):
        asked[name.text] = _Asked("topic", made)
        yield name.text, {
            "type": made.text, "queue": whole_number(report, of, "queue", 1, MOST_QUEUE, QUEUE),
            "latch": report.choice(of.get("latch"), "`latch`", TRUTHS, latch) == "true",
        }  # fmt: skip


def _services(report: Report, found: Mapping[str, Node], asked: dict[str, _Asked]) -> Iterator[tuple[str, Json]]:
    used = {field.text.partition(".")[::2] for key in ("inputs", "outputs") for field in _written(found.get(key))}
    for name, made, of in _entries(report, found.get("services"), "services", SERVICE):
        if name.text in asked:
            report.error(WRONG_PORT, f"`{name.text}` is a topic as well", name.span, "remove one of the two")
        for word, key in ((ASKED, "inputs"), (ANSWERED, "outputs")):
            if (name.text, word) not in used:
                hint = f"write `{key}: {{NAME: {name.text}.{word}}}`, with a slot of the type bool"
                report.error(WRONG_PORT, f"the service `{name.text}` has no `{word}`", name.span, hint)
        asked[name.text] = _Asked("serves", made)
        yield name.text, {"type": made.text, "timeout": whole_number(report, of, "patience", 1, 3600, ANSWERING)}


def _written(node: Node | None) -> Iterator[Scalar]:
    """The fields of `inputs`, `outputs` and the like; what else there is was reported."""
    if isinstance(node, MappingNode):
        yield from (value for _, value in node.items if isinstance(value, Scalar))
    elif isinstance(node, Sequence):
        yield from (value for value in node.items if isinstance(value, Scalar))


def _fields(report: Report, node: Node | None, asked: Mapping[str, _Asked], *, output: bool) -> None:
    for scalar in _written(node):
        name, _, path = scalar.text.partition(".")
        of = asked.get(name)
        if scalar.text.startswith(PARAMETER):
            continue
        if NAME.match(name) is None or not path:
            message = f"`{scalar.text[:60]}` is not a topic and a field of its messages"
            report.error(WRONG_PORT, message, mark(scalar), "write the two with a dot between: `/cmd_vel.linear.x`")
        elif of is None:
            hint = did_you_mean(name, asked) or f"write `topics: {{{name}: PACKAGE/TYPE}}`"
            message = f"`{scalar.text[:60]}`: there is no topic `{name[:60]}` under `topics`"
            report.error(WRONG_PORT, message, mark(scalar), hint)
        elif of.kind == "topic":
            of.fields.append(("out" if output else "in", path, scalar))
        elif path != (ANSWERED if output else ASKED):
            of.fields.append(("response" if output else "request", path, scalar))


def _requests(report: Report, node: Node | None) -> Iterator[_Asked]:
    """What requests ask of types; that they have all they need is seen where requests are read."""
    for _, value in node.items if isinstance(node, MappingNode) else ():
        of = {key.text: one for key, one in value.items} if isinstance(value, MappingNode) else {}
        made = of.get("type")
        kind: Literal["service", "action"] = "service" if "service" in of else "action"
        said = of.get("kind")
        if ("service" in of) == ("action" in of) or (isinstance(said, Scalar) and said.text != kind):
            hint = "write `service: /NAME`, or `action: /NAME` for one with feedback that can be cancelled"
            report.error(WRONG_PORT, "a request of ROS 1 is a service or an action", mark(said or value), hint)
            continue
        if not isinstance(made, Scalar):
            continue
        parts = {"sends": "request", "answers": "response"} if kind == "service" else {}
        parts = parts or {"sends": "goal", "answers": "result", "feedback": "feedback"}
        yield _Asked(kind, made, [(part, f.text, f) for key, part in parts.items() for f in _written(of.get(key))])


def _events(found: Mapping[str, Node]) -> Iterator[str]:
    """The fields of the inputs that are events."""
    events, inputs = found.get("events"), found.get("inputs")
    if isinstance(events, MappingNode) and isinstance(inputs, MappingNode):
        names = {key.text for key, _ in events.items}
        yield from (value.text for key, value in inputs.items if key.text in names and isinstance(value, Scalar))


def _check(report: Report, python: str, folders: tuple[str, ...], asked: list[_Asked], at: Node) -> None:
    """Report the types and fields that there are not."""
    question = {
        "messages": folders,
        "asked": [
            {"kind": one.kind, "type": one.type.text, "fields": [[part, path] for part, path, _ in one.fields]}
            for one in asked
        ],
    }
    try:
        done = subprocess.run(  # noqa: S603 - the user's Python
            [python, NODE, "check"], input=json.dumps(question), capture_output=True, text=True, check=False,
            timeout=CHECKING,
        )  # fmt: skip
        answer = json.loads(done.stdout)
    except (OSError, ValueError, subprocess.TimeoutExpired) as error:
        why = error.strerror if isinstance(error, OSError) else f"it does not answer within {CHECKING:g} s"
        if isinstance(error, ValueError):
            why = (done.stderr.strip().splitlines() or ["it says nothing"])[-1][:200]
        report.error(NO_ROS, f"{python}: {why}", mark(at), INSTALL)
        return
    if "missing" in answer:
        report.error(NO_ROS, f"{python} has no ROS 1: {answer['missing']}", mark(at), INSTALL)
        return
    for one, (wrong, fields) in zip(asked, answer["found"], strict=True):
        if wrong is not None:
            report.error(WRONG_PORT, f"`{one.type.text[:60]}`: {wrong[0]}", mark(one.type), wrong[1])
        for (_, path, scalar), problem in zip(one.fields, fields, strict=True):
            if problem is not None:
                shown = scalar.text[:60] if scalar.text.endswith(path) else path[:60]
                report.error(WRONG_PORT, f"`{shown}`: {problem[0]}", mark(scalar), problem[1])


KIND = Ros1()

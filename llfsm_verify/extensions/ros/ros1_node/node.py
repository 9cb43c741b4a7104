"""A node of ROS 1 for one port: topics, parameters, requests of services and actions, and services of its own.

Nothing here waits by the clock of ROS, which may stand still where `use_sim_time` is set.
"""

from __future__ import annotations

import http.client
import logging
import math
import os
import re
import threading
import time
import xmlrpc.client
from typing import Any, Container, Dict, List, Mapping, Optional, Set

import rosgraph
import rospy
from rospy.impl.registration import Registration, get_registration_listeners, get_service_manager, get_topic_manager

from .asking import Action, Service
from .channel import Channel, flat, nested
from .fields import Field, NoField, Unfit, digits_of, fits, rounded
from .messages import NoType, Types, fields_of
from .serving import Server

PARAMETER = "param:"
LOOKS, CALLS = 0.1, 1.0
"""Seconds between two looks at connections, and between two calls of the master."""
PATIENCE = 2.0
"""Seconds in which the master must answer at first."""
READER = re.compile(r"types do not match: \[(.*?)\] vs. \[(.*?)\]\{.*'callerid': '(.*?)'.*'topic': '(.*?)'")
"""What rospy says of a subscriber of another type: the two types, its name and that of the topic."""
FLUSHING = 0.8
"""Seconds in which the last messages must have gone."""


class Unfound(Exception):
    """The port cannot be opened; the message says why."""


def run() -> None:
    """Serve a port until its run ends."""
    channel = Channel()
    lines = channel.lines()
    hello = next(lines, None)
    if hello is None:
        return
    try:
        node = Node(channel, hello)
        values = {"values": nested(node.parameters)} if node.parameters else {}
        channel.first({"hello": 1, **values})
    except Exception as problem:  # noqa: BLE001 - rospy raises its own, and a broken master any
        told = isinstance(problem, (Unfound, NoType, NoField))
        channel.first({"say": str(problem) if told else f"{type(problem).__name__}: {problem}"})
        os._exit(1)
    for said in lines:
        node.hear(said)
        if "end" in said:
            break
    node.close()
    os._exit(0)  # threads may wait for servers


class Input:
    """The fields of a topic that feed inputs."""

    def __init__(self, channel: Channel, topic: str, message: Any, fields: Mapping[str, int], events: Set[str]) -> None:
        self._channel = channel
        self.topic, self.fields = topic, sorted(fields)
        self._read = [(name, Field(message, name[len(topic) + 1 :]), digits) for name, digits in fields.items()]
        self._events = not events.isdisjoint(fields)
        self.alone = events.issuperset(fields)
        """Whether they are events, which no publisher needs to be there for."""
        self.subscriber: Any = None
        self.connected = False
        self.unheard = not self.alone
        """Whether no publisher was ever there, and it was not said yet."""

    def take(self, message: Any) -> None:
        """A message has come."""
        self.connected, self.unheard = True, False
        values, broken = {}, {}
        for name, field, digits in self._read:
            try:
                values[name] = field.get(message, digits)
            except Unfit as problem:
                broken[name] = str(problem)
        if values:
            self._channel.values(values, self._events)
        for name, why in broken.items():
            self._channel.lost([name], f"{name} {why}")


class Output:
    """The fields of a topic that show slots."""

    def __init__(self, topic: str, message: Any, fields: List[str]) -> None:
        self.topic = topic
        self._write = {name: Field(message, name[len(topic) + 1 :], output=True) for name in fields}
        self._message = message()
        self._last: Optional[Dict[str, Any]] = None
        self._stamped = fields_of(message).get("header") == "std_msgs/Header" and f"{topic}.header.stamp" not in fields
        self.publisher: Any = None

    def send(self, values: Mapping[str, Any], always: bool) -> None:
        """Publish, if something has changed. Unfit."""
        given = {name: values[name] for name in self._write if name in values}
        if not given or (given == self._last and not always):
            return
        self._last = given
        for name, value in given.items():
            try:
                self._write[name].put(self._message, value)
            except Unfit as problem:
                raise Unfit(f"{name} {problem}; nothing is published to {self.topic}") from None
        if self._stamped:
            self._message.header.stamp = rospy.get_rostime()
        self.publisher.publish(self._message)


class Node:
    """Connected as the first line says. Raises Unfound, NoType and NoField."""

    def __init__(self, channel: Channel, hello: Mapping[str, Any]) -> None:
        self._channel, told = channel, hello["told"]
        self._master = rosgraph.get_master_uri()
        try:
            self._knows()
        except Exception as error:  # noqa: BLE001 - whatever says it, it is no master
            why = error if isinstance(error, (OSError, http.client.InvalidURL)) else f"its answer is not one ({error})"
            where = self._master or "ROS_MASTER_URI, which is empty"
            raise Unfound(f"there is no ROS master at {where}: {why}") from None
        types = Types(told.get("messages", ()))
        name = told.get("node")
        rospy.init_node(name or "llfsm", argv=[], anonymous=not name, disable_signals=True)
        for logger in ("rospy.internal", "rosout"):
            logging.getLogger(logger).addHandler(_Listener(self))
        self._over = False
        rospy.core.add_preshutdown_hook(self._shut_down)
        self._always = bool(told.get("when"))
        self._settled = time.monotonic() + float(told.get("settling", math.inf))
        known, inputs = told.get("values", ()), hello["inputs"]
        self.parameters = {f: _parameter(f, of, known) for f, of in inputs.items() if f.startswith(PARAMETER)}
        self._values: Dict[str, Any] = {}
        self._connect(told, types, inputs, list(hello["outputs"]), known)
        self._asked: Dict[str, Any] = {}
        for name, of in hello.get("requests", {}).items():
            if of["kind"] not in of:
                raise Unfound(f"the request {name} is of the kind {of['kind']}; write `{of['kind']}: /NAME` for it")
            self._asked[name] = (Action if of["kind"] == "action" else Service)(channel, name, of, types)
        for act in (self._look, self._watch_master):
            threading.Thread(target=act, daemon=True).start()

    def _connect(
        self, told: Mapping[str, Any], types: Types, inputs: Mapping[str, Any], outputs: List[str],
        known: Container[str],
    ) -> None:  # fmt: skip
        for what in ("topics", "services"):
            resolved: Dict[str, str] = {}
            for name in told.get(what, {}):
                first = resolved.setdefault(rospy.resolve_name(name), name)
                if first != name:
                    raise Unfound(
                        f"`{first}` and `{name}` are the same here, {rospy.resolve_name(name)}: write one name"
                    )
        events = set(told.get("events", ()))
        self._inputs: List[Input] = []
        self._outputs: List[Output] = []
        self._servers = [
            Server(self._channel, name, of, types, inputs, outputs, known)
            for name, of in told.get("services", {}).items()
        ]
        for topic, of in told.get("topics", {}).items():
            read = {f: digits_of(of_it) for f, of_it in inputs.items() if f.startswith(f"{topic}.")}
            written = [f for f in outputs if f.startswith(f"{topic}.")]
            message = types.message(of["type"])
            if read:
                one = Input(self._channel, topic, message, read, events)
                one.subscriber = rospy.Subscriber(
                    topic, message, one.take, queue_size=of["queue"], buff_size=1 << 20, tcp_nodelay=True
                )
                self._inputs.append(one)
            if written:
                other = Output(topic, message, written)
                other.publisher = rospy.Publisher(topic, message, queue_size=of["queue"], latch=of["latch"])
                self._outputs.append(other)

    def hear(self, said: Mapping[str, Any]) -> None:
        """The run has said something."""
        if "values" in said and "request" not in said:
            self._send(flat(said["values"]), self._always)
        elif "safe" in said:
            self._send({**self._values, **flat(said["safe"])}, self._always)
        elif "request" in said:
            self._asked[said["name"]].ask(said["request"], flat(said["values"]))
        elif "cancel" in said:
            for one in self._asked.values():
                one.cancel(said["cancel"])

    def _send(self, values: Dict[str, Any], always: bool) -> None:
        self._values = values
        for output in self._outputs:
            try:
                output.send(values, always)
            except Unfit as problem:
                self._channel.say(str(problem))
            except Exception as error:  # noqa: BLE001 - it is closed, or a field cannot be written
                self._channel.say(f"nothing is published to {output.topic}: {error}")
        for server in self._servers:
            server.hear(values)

    def close(self) -> None:
        """Let the last messages go, and leave."""
        self._over = True
        limit = time.monotonic() + FLUSHING
        while time.monotonic() < limit and any(map(_has_more, self._outputs)):
            time.sleep(0.005)
        time.sleep(0.02)  # what was taken from a queue is written
        leaving = threading.Thread(target=rospy.signal_shutdown, args=("the run has ended",), daemon=True)
        leaving.start()
        leaving.join(FLUSHING)  # the master may not answer

    # ---------------------------------------------------------------- what goes wrong

    def _look(self) -> None:
        """Tell when the publishers of a topic are gone, and when servers of actions are."""
        while not self._over:
            for one in self._inputs:
                connected = _is_connected(one)
                if one.connected and not connected and not one.alone:
                    self._channel.lost(one.fields, f"{one.topic} has no publisher any more")
                one.connected = connected
                one.unheard = one.unheard and not connected
                if one.unheard and time.monotonic() >= self._settled:
                    one.unheard = False
                    self._channel.say(f"nobody publishes {one.topic} yet; without `timeout` that is not a failure")
            for asked in self._asked.values():
                asked.look()
            time.sleep(LOOKS)

    def other_type(self, text: str, thread: str) -> None:
        """A connection of rospy fails because of a type; a thread that connects has the name of the topic."""
        told = re.search(r"Client \[.*|topic types do not match[^{]*|request from \[[^{]*", text)
        why = (told.group() if told else text).split("  Will try")[0][:400]
        for one in self._inputs:
            if one.subscriber.resolved_name == thread:
                self._channel.lost(one.fields, f"{one.topic} has another type at its publisher: {why}")
                return
        if "rosrpc://" in text:
            return  # a service of another type: its call fails, and says so
        reader = READER.search(text)
        self._channel.say("{2} reads {3} as {0}, and here it is {1}".format(*reader.groups()) if reader else why)

    def _shut_down(self, reason: str) -> None:
        if not self._over:
            hint = "; write another name under `node`" if "same name" in reason else ""
            self._channel.tell({"lost": [], "why": f"the node was shut down: {reason}{hint}"})

    def _knows(self) -> bool:
        """Whether the master knows this node. Raises whatever a wrong one makes of it."""
        server: Any = xmlrpc.client.ServerProxy(self._master, transport=_Timely())
        code, _, _ = server.lookupNode("/llfsm", rospy.get_name())
        return bool(code == 1)

    def _watch_master(self) -> None:
        """Tell when the master is gone, and register again with one that does not know this node any more."""
        there, begun = True, False  # at the first look, rospy may be about to register
        while not self._over:
            time.sleep(CALLS)
            try:
                knows = self._knows()
            except Exception:  # noqa: BLE001 - whatever it says, it is no master
                if there and not self._over:
                    self._channel.say(f"the ROS master at {self._master} is gone; connections stay")
                there = False
                continue
            if self._over or rospy.is_shutdown():
                return  # it has unregistered itself meanwhile
            if begun and not (there and knows):
                if not knows:
                    self._register()
                self._channel.say(f"the ROS master at {self._master} is back, and knows this node again")
            there = begun = True

    def _register(self) -> None:
        added = get_registration_listeners().notify_added
        topics, services = get_topic_manager(), get_service_manager()
        for name, of in topics.get_publications():
            added(name, of, Registration.PUB)
        for name, of in topics.get_subscriptions():
            added(name, of, Registration.SUB)
        for name, uri in services.get_services():
            added(name, uri, Registration.SRV)


class _Listener(logging.Handler):
    """Hears what rospy logs about types that do not fit."""

    def __init__(self, node: Node) -> None:
        super().__init__(logging.WARNING)
        self._node = node

    def emit(self, record: logging.LogRecord) -> None:
        """See `logging.Handler`."""
        text = record.getMessage()
        if "md5sum" in text or "types do not match" in text:
            self._node.other_type(text, record.threadName or "")


class _Timely(xmlrpc.client.Transport):
    """Calls that end in time."""

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        """See `Transport`."""
        made = super().make_connection(host)
        made.timeout = PATIENCE
        return made


def _parameter(field: str, of: Mapping[str, Any], known: Container[str]) -> Any:
    """The value of a parameter, or of a part of it. Unfound."""
    name, *parts = field[len(PARAMETER) :].split(".")
    try:
        value = rospy.get_param(name)
    except KeyError:
        there = [one for one in sorted(rospy.get_param_names()) if not one.startswith("/run_id")]
        hint = ", ".join(there[:12]) if there else "none"
        raise Unfound(f"there is no parameter {rospy.resolve_name(name)}; there are {hint}") from None
    for part in parts:
        try:
            value = value[int(part) if part.isdecimal() else len(value)] if isinstance(value, list) else value[part]
        except (KeyError, IndexError, ValueError, TypeError):
            raise Unfound(f"the parameter {name} is {value!r}, which has no `{part}`") from None
    if isinstance(value, (list, dict)):
        raise Unfound(f"the parameter {name} is {value!r}; name one of its values: `{field}.…`")
    if isinstance(value, float) and digits_of(of) >= 0:
        value = rounded(value, digits_of(of))
    if not isinstance(value, (bool, int, float, str)) or not fits(value, of, known):
        shown = repr(value) if isinstance(value, (bool, int, float, str)) else f"a {type(value).__name__}"
        raise Unfound(f"the parameter {rospy.resolve_name(name)} is {shown}, which its input does not have")
    return value


def _has_more(output: Output) -> bool:
    """Whether a connection of a publisher has messages that are not sent."""
    return any(one._queue for one in output.publisher.impl.connections if hasattr(one, "_queue"))


def _is_connected(one: Input) -> bool:
    """Whether a publisher is there; rospy keeps connections that it tries to open again."""
    return any(c.socket is not None and c.type is not None for c in one.subscriber.impl.connections)

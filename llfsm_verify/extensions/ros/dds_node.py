"""The program behind a port of the kind `ros2`: a participant of DDS, which speaks the protocol of process ports.

A topic ``/door`` is the topic ``rt/door`` of DDS, and ``std_msgs/msg/Bool`` the type ``std_msgs::msg::dds_::Bool_``, in
CDR of the first version, with the quality of service that ROS 2 has by default (reliable, volatile, the last 10). The
names are those of ROS 2 (design.ros2.org, "Topic and service name mapping to DDS"), the rest is Cyclone DDS.

Threads of Cyclone DDS only wake the one that does all work. Where the run does not read as fast as messages come, this
program waits, and DDS keeps as many as the depth of the topic says.
"""

from __future__ import annotations

import copy
import json
import math
import os
import re
import select
import socket
import sys
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication, BuiltinTopicDcpsSubscription
from cyclonedds.core import DDSException, Listener, Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct, make_idl_struct, types
from cyclonedds.internal import InvalidSample
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from llfsm_verify.extensions.ros.msgs import (
    COUNT,
    MOST_DOMAIN,
    Many,
    Messages,
    Named,
    Plain,
    Text,
    Type,
    Unreadable,
    number,
    starting,
)

if TYPE_CHECKING:
    from cyclonedds.builtin_types import DcpsEndpoint

ALIVE = 16
"""The state of an instance that has a writer."""
AT_ONCE, MOST = 256, 100_000
"""Samples of a topic, and of who is there, that are taken in one call."""
ALL = 4096
"""Words of threads of DDS, which a pipe has room for."""
SETTLING = 0.1
"""Seconds after which a reader that has come mostly knows us as we know it; before that it would hear nothing."""
PATIENCE = 1.0
"""Seconds in which an endpoint that fits must be connected."""
LEAVING = 500_000_000
"""Nanoseconds for which the end waits until readers have all."""
BLOCKING = 100_000_000
"""Nanoseconds for which a reliable writer waits for a reader, as ROS 2 has it."""


class Broken:
    """What stands for a sample whose bytes are no message."""

    def __init__(self, problem: str) -> None:
        self.problem = problem


def _fill(self: Any, **values: object) -> None:
    vars(self).update(values)


def _deserialize(cls: Any, data: bytes) -> Any:
    """In the place of that of `IdlStruct`: one that cannot be read does not take those with it that can."""
    try:
        return cls.__idl__.deserialize(data)
    except Exception as error:  # noqa: BLE001 - of Cyclone DDS, which raises whatever happens
        return Broken(f"{type(error).__name__}: {error}")


class Classes:
    """The classes of messages for Cyclone DDS, by name."""

    def __init__(self, messages: Messages) -> None:
        self._messages = messages
        self._known: dict[str, type[IdlStruct]] = {}

    def of(self, name: str) -> type[IdlStruct]:
        """The class of this message. Unreadable."""
        if name not in self._known:
            members = self._messages.find(name).members
            package, kind, last = name.split("/")
            fields = {member.name: self._type(member.type) for member in members}
            whole = f"{package}::{kind}::dds_::{last}_"
            made: Any = make_idl_struct(last, whole, fields, dataclassify=False)
            made.__init__, made.deserialize = _fill, classmethod(_deserialize)
            self._known[name] = made
        return self._known[name]

    def _type(self, of: Type) -> Any:
        if isinstance(of, Named):
            return self.of(of.name)
        if isinstance(of, Text):
            return str if of.most is None else types.bounded_str[of.most]
        if isinstance(of, Many):
            inner = self._type(of.of)
            whole = types.sequence[inner]
            if of.size is not None:
                return types.array[inner, of.size]
            return whole if of.most is None else types._th.Annotated[whole.__origin__, types.sequence(inner, of.most)]
        plain = {"bool": bool, "char": types.uint8, "byte": types.byte}
        return plain.get(of.name) or getattr(types, of.name)

    def sample(self, of: Type, value: Any) -> Any:
        """The value of this type, with dictionaries for messages, as Cyclone DDS has it."""
        if isinstance(of, Named):
            members = self._messages.find(of.name).members
            return self.of(of.name)(**{one.name: self.sample(one.type, value[one.name]) for one in members})
        return [self.sample(of.of, one) for one in value] if isinstance(of, Many) else value


# ---------------------------------------------------------------- values of fields


def shown(value: Any, of: Mapping[str, Any]) -> bool | int | str:
    """The value of a field for a slot of this type: decimals are rounded to those of the slot. ValueError: no slot
    has it.
    """
    if not isinstance(value, float):
        return value  # type: ignore[no-any-return]
    if not math.isfinite(value):
        raise ValueError("is not a number" if math.isnan(value) else f"is {'' if value > 0 else '-'}infinite")
    return str(value) if of["labels"] or of["boolean"] else f"{value:.{of['digits']}f}"


def field_value(value: object, of: Plain | Text) -> object:
    """The value of a slot for a field of this type. ValueError says why there is none."""
    text = value if isinstance(value, str) else json.dumps(value)
    if isinstance(of, Text):
        if len(text) > (of.most or len(text)):
            raise ValueError(f"`{text[:60]}` is longer than {of.most} characters")
        return text
    try:
        return number(text, of)
    except ValueError as error:
        why = f": {error}" if "from" in str(error) else ""
        raise ValueError(f"`{text[:60]}` is not a value of {of.name}{why}") from None


def put(value: Any, path: tuple[str, ...], of: Type, messages: Messages, leaf: object) -> None:
    """Set what is at the path in a value; sequences become as long as they must."""
    for step, after in zip(path, (*path[1:], None), strict=True):
        if isinstance(of, Named):
            member = messages.find(of.name).member(step)
            assert member is not None
            key: Any = step
            of = member.type
        else:
            assert isinstance(of, Many)
            key, of = int(step), of.of
            value += [starting(messages, of) for _ in range(key + 1 - len(value))]
        if after is None:
            value[key] = leaf
        value = value[key]


def read(value: Any, path: Iterable[str]) -> Any:
    """What is at the path in a message. ValueError: a sequence is too short."""
    for step in path:
        if not isinstance(value, list | bytes):
            value = getattr(value, step)
        elif step in COUNT:
            value = len(value)
        elif int(step) < len(value):
            value = value[int(step)]
        else:
            raise ValueError(f"has {len(value)} elements, and no element {step}")
    return value


def nested(values: Iterable[tuple[tuple[str, ...], object]]) -> dict[str, Any]:
    """The values at their paths."""
    found: dict[str, Any] = {}
    for path, value in values:
        inner = found
        for step in path[:-1]:
            inner = inner.setdefault(step, {})
        inner[path[-1]] = value
    return found


def paths(fields: Iterable[str]) -> dict[str, dict[str, tuple[str, ...]]]:
    """By topic the path of each of its fields, by the field."""
    found: dict[str, dict[str, tuple[str, ...]]] = {}
    for one in fields:
        topic, _, rest = one.partition(".")
        found.setdefault(topic, {})[one] = tuple(rest.split("."))
    return found


# ---------------------------------------------------------------- the participant


def configuration(peers: Iterable[str], interface: str | None) -> str | None:
    """Of Cyclone DDS; None: as the user's CYCLONEDDS_URI has it."""
    named = "".join(f"<Peer address={quoteattr(peer)}/>" for peer in peers)
    if not named and interface is None:
        return None
    many = "" if not named else ' multicast="false"'
    place = "" if interface is None else f"<NetworkInterface name={quoteattr(interface)}{many}/>"
    return (
        '<CycloneDDS><Domain id="any"><General>'
        + (f"<Interfaces>{place}</Interfaces>" if place else "")
        + ("<AllowMulticast>false</AllowMulticast>" if named else "")
        + "</General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
        + (f"<Peers>{named}</Peers>" if named else "")
        + "</Discovery></Domain></CycloneDDS>"
    )


def domain_number(given: int | None) -> int:
    """That of the file of ports, or else that of ROS 2. Unreadable."""
    text = os.environ.get("ROS_DOMAIN_ID", "") if given is None else str(given)
    if not re.fullmatch("[0-9]{0,3}", text) or int(text or 0) > MOST_DOMAIN:
        raise Unreadable(f"ROS_DOMAIN_ID is `{text[:60]}`; write a number from 0 to {MOST_DOMAIN}", "")
    return int(text or 0)


def _resolve(peer: str) -> None:
    """Unreadable: nobody has this address, which would end Cyclone DDS with the whole program."""
    try:
        socket.getaddrinfo(peer if peer.count(":") > 1 else peer.partition(":")[0], None)
    except (OSError, UnicodeError) as error:
        raise Unreadable(f"the peer {peer} is not known: {error}", "correct it") from None


def quality(told: Mapping[str, Any]) -> Qos:
    """The quality of service of a topic."""
    is_reliable, is_kept = told["reliability"] == "reliable", told["durability"] == "transient_local"
    return Qos(
        Policy.Reliability.Reliable(BLOCKING) if is_reliable else Policy.Reliability.BestEffort,
        Policy.Durability.TransientLocal if is_kept else Policy.Durability.Volatile,
        Policy.History.KeepLast(told["depth"]),
        Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False),
    )


@dataclass(slots=True)
class End:
    """A topic that is read or written."""

    name: str
    type: Named
    told: Mapping[str, Any]
    fields: Mapping[str, tuple[str, ...]]
    entity: Any
    """The reader or writer."""
    value: Any = None
    """The newest message, of a writer."""
    begun: bool = False
    """Whether it was published."""
    waits: bool = False
    """Whether nobody was there to read it."""
    due: float | None = None
    """When it is published to somebody who has come since."""
    count: int = 0
    """Of those that are connected."""
    known: bool = False
    """Whether one was ever connected, or it was said that none is."""
    others: dict[Any, tuple[DcpsEndpoint, float]] = field(default_factory=dict)
    """Endpoints that are not known to be connected, and since when they are there."""


class Node:
    """The participant, between the descriptors of the run and DDS."""

    def __init__(self, hello: Mapping[str, Any], write: int) -> None:
        """Unreadable, DDSException."""
        told = hello["told"]
        self._write = write
        self._inputs = hello["inputs"]
        self._wake_read, self._wake_write = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        self._messages = Messages(told["messages"])
        self._classes = Classes(self._messages)
        for peer in told["peers"]:
            _resolve(peer)
        settings = configuration(told["peers"], told["interface"])
        self._ignored = settings is not None and "CYCLONEDDS_URI" in os.environ
        number = domain_number(told["domain"])
        self._domain = None if settings is None else Domain(number, settings)
        self._participant = DomainParticipant(number)
        self._settled = time.monotonic() + told.get("settling", math.inf)
        self._own = self._participant.guid
        self._topics: dict[str, Topic[Any]] = {}
        self._readers = self._ends(told["topics"], hello["inputs"], self._reader)
        self._writers = self._ends(told["topics"], hello["outputs"], self._writer)
        self._found = [
            (BuiltinDataReader(self._participant, topic, listener=self._listener("on_data_available")), ends)
            for topic, ends in (
                (BuiltinTopicDcpsPublication, self._readers), (BuiltinTopicDcpsSubscription, self._writers),
            )
        ]  # fmt: skip

    def _ends(
        self, topics: Mapping[str, Any], fields: Iterable[str], make: Callable[[Any, Qos], Any]
    ) -> dict[str, End]:
        found: dict[str, End] = {}
        for name, of in paths(fields).items():
            told = topics[name]
            if name not in self._topics:
                kind = self._classes.of(told["type"])
                self._topics[name] = Topic(self._participant, f"rt{name}", kind, qos=quality(told))
            end = End(name, Named(told["type"]), told, of, make(self._topics[name], quality(told)))
            found[f"rt{name}"] = end
            for path in of.values():
                self._messages.at(end.type.name, path)
            end.value = starting(self._messages, end.type)
        return found

    def _listener(self, *events: str, data: bool = False) -> Listener:
        """Wakes `run`, for `data`, and to look who is there at events."""
        descriptor = self._wake_write  # and not `self`, which has the listeners

        def waker(word: bytes) -> Callable[..., None]:
            def wake(*_: object) -> None:
                with suppress(BlockingIOError):  # there is enough in it
                    os.write(descriptor, word)

            return wake

        heard = {"on_data_available": waker(b"d")} if data else {}
        return Listener(**heard, **dict.fromkeys(events, waker(b"e")))

    def _reader(self, topic: Topic[Any], of: Qos) -> DataReader[Any]:
        return DataReader(self._participant, topic, of, self._listener("on_subscription_matched", data=True))

    def _writer(self, topic: Topic[Any], of: Qos) -> DataWriter[Any]:
        return DataWriter(self._participant, topic, of, self._listener("on_publication_matched"))

    # ---- what the run gets

    def say(self, **line: object) -> None:
        """A line to the run; it may wait until there is room."""
        data = json.dumps(line).encode() + b"\n"
        while data:
            data = data[os.write(self._write, data) :]

    def _take(self) -> bool:
        """Whether there may be more."""
        most = 0
        for end in self._readers.values():
            samples = end.entity.take(AT_ONCE)
            most = max(most, len(samples))
            for sample in samples:
                if not isinstance(sample, InvalidSample):
                    self._message(end, sample)
        return most == AT_ONCE

    def _message(self, end: End, sample: Any) -> None:
        if isinstance(sample, Broken):
            self.say(lost=list(end.fields), why=f"a message of {end.name} cannot be read: {sample.problem}")
            return
        values, lost = [], []
        for one, path in end.fields.items():
            try:
                values.append(((end.name, *path), shown(read(sample, path), self._inputs[one])))
            except ValueError as problem:
                lost.append((one, f"{one} {problem}"))
        if values:
            self.say(values=nested(values))
        for one, why in lost:
            self.say(lost=[one], why=why)

    # ---- who else is there

    def _look(self) -> None:
        """Who has come, gone, or does not fit."""
        now = time.monotonic()
        for reader, ends in self._found:
            for endpoint in reader.take(MOST):
                end = None if isinstance(endpoint, InvalidSample) else ends.get(endpoint.topic_name)
                if isinstance(endpoint, InvalidSample) or endpoint.sample_info.instance_state != ALIVE:
                    key = endpoint.key_sample.key if isinstance(endpoint, InvalidSample) else endpoint.key
                    for one in ends.values():
                        one.others.pop(key, None)
                elif end is not None and endpoint.participant_key != self._own:
                    end.others[endpoint.key] = (endpoint, now)
        for end in self._readers.values():
            self._matched(end, end.entity.get_subscription_matched_status().current_count, now)
            self._judge(end, now, reads=True)
            if not end.known and now >= self._settled:
                end.known = True
                self.say(say=f"nobody publishes {end.name} yet; without `timeout` that is not a failure")
        if now >= self._settled:
            self._settled = math.inf
        for end in self._writers.values():
            self._matched(end, end.entity.get_publication_matched_status().current_count, now)
            self._judge(end, now, reads=False)

    def _matched(self, end: End, count: int, now: float) -> None:
        before, end.count = end.count, count
        end.known = end.known or count > 0
        if end.waits and count and end.due is None:
            end.due = now + SETTLING
        if end.due is not None and now >= end.due:
            self._publish(end)
        if before and not count and isinstance(end.entity, DataReader):
            self.say(lost=list(end.fields), why=f"nobody publishes {end.name} any more")

    def _judge(self, end: End, now: float, *, reads: bool) -> None:
        """Say of what does not fit why; of what fits nothing, unless it is not connected in time."""
        if not end.others:
            return
        entity = end.entity
        handles = entity.get_matched_publications() if reads else entity.get_matched_subscriptions()
        data = entity.get_matched_publication_data if reads else entity.get_matched_subscription_data
        matched = {one.key for one in map(data, handles) if one is not None}
        for key, (endpoint, since) in list(end.others.items()):
            why = None if key in matched else misfit(end, endpoint, reads=reads)
            if why is None and key not in matched:
                if now < since + PATIENCE:
                    continue
                why = "its type has other fields"
            del end.others[key]
            if why is not None:
                self.say(say=f"{'a publisher' if reads else 'a subscriber'} of {end.name} does not fit: {why}")
                if reads and not matched:
                    self.say(lost=list(end.fields), why=f"no publisher of {end.name} fits")

    # ---- what the run says

    def _values(self, values: Mapping[str, Any]) -> None:
        """Publish what has changed; all, where nothing has: the run then says the same again on purpose."""
        changed = [end for end in self._writers.values() if self._change(end, values.get(end.name, {}))]
        for end in changed or self._writers.values():
            self._publish(end)

    def _change(self, end: End, given: Any) -> bool:
        before = copy.deepcopy(end.value)
        for path in end.fields.values():
            leaf = given
            for step in path:
                leaf = leaf.get(step) if isinstance(leaf, dict) else None
            if leaf is None:
                continue  # safe values may be of some fields only
            try:
                of = self._messages.at(end.type.name, path)
                put(end.value, path, end.type, self._messages, field_value(leaf, of))
            except ValueError as error:
                self.say(say=f"{end.name} keeps its value: {error}")
        return not end.begun or end.value != before

    def _publish(self, end: End) -> None:
        end.begun, end.waits, end.due = True, not end.count, None
        try:
            end.entity.write(self._classes.sample(end.type, end.value))
        except Exception as error:  # noqa: BLE001 - of Cyclone DDS, which raises plain ones
            self.say(say=f"{end.name} is not published: {error.__cause__ or error}")

    def run(self, read: int) -> None:
        """Until the run says that it ends, or is gone."""
        self.say(hello=1)
        if self._ignored:
            self.say(say="CYCLONEDDS_URI is not looked at, because the file of ports has `peers` or `interface`")
        rest, more = b"", True
        self._look()
        while True:
            waits = any(end.others or end.due is not None for _, ends in self._found for end in ends.values())
            waits = waits or (self._settled < math.inf and not all(end.known for end in self._readers.values()))
            patience = 0.0 if more else SETTLING if waits else None
            ready = select.select([read, self._wake_read], [], [], patience)[0]
            woken = os.read(self._wake_read, 1 << 16) if self._wake_read in ready else b""
            more = self._take() if woken or more else False
            if waits or b"e" in woken or len(woken) > ALL:  # of more words, some may be lost
                self._look()
            if read not in ready:
                continue
            data = os.read(read, 1 << 16)
            *lines, rest = (rest + data).split(b"\n")
            if not data or not all(self._line(json.loads(line, parse_float=str)) for line in lines):
                return

    def _line(self, line: Mapping[str, Any]) -> bool:
        """Whether the run goes on."""
        if "values" in line or "safe" in line:
            self._values(line.get("values") or line.get("safe") or {})
        return "end" not in line

    def close(self) -> None:
        """Wait until those who read have all, and leave, so that others need not wait until they miss us."""
        for end in self._writers.values():
            if end.count and end.told["reliability"] == "reliable":
                with suppress(AttributeError):  # so Cyclone DDS 11 says that time is over
                    end.entity.wait_for_acks(LEAVING)
        self._readers, self._writers, self._topics = {}, {}, {}
        self._found.clear()
        del self._participant, self._domain


def misfit(end: End, endpoint: DcpsEndpoint, *, reads: bool) -> str | None:
    """Why an endpoint of another participant cannot be connected with ours; None: no reason is known."""
    package, kind, last = end.type.name.split("/")
    if endpoint.type_name != f"{package}::{kind}::dds_::{last}_":
        other = endpoint.type_name.replace("::dds_::", "::").removesuffix("_").replace("::", "/")
        return f"its type is {other}, and ours {end.type.name}"
    ours, theirs = quality(end.told), endpoint.qos
    offered, requested = (theirs, ours) if reads else (ours, theirs)
    best, volatile = Policy.Reliability.BestEffort, Policy.Durability.Volatile
    if offered[Policy.Reliability] == best and requested[Policy.Reliability] != best:
        return f"{'it' if reads else 'ours'} is best_effort, and {'ours' if reads else 'it'} reliable"
    if offered[Policy.Durability] == volatile and requested[Policy.Durability] != volatile:
        return f"{'it' if reads else 'ours'} is volatile, and {'ours' if reads else 'it'} transient_local"
    return None


def main() -> int:
    """Speak with the run; the exit code."""
    source, target = sys.stdin.fileno(), sys.stdout.fileno()
    first = b""
    while not first.endswith(b"\n"):
        byte = os.read(source, 1)
        if not byte:
            return 1
        first += byte
    heard = os.memfd_create("standard error")  # where Cyclone DDS says why it cannot begin
    error, why = os.dup(2), ""
    os.dup2(heard, 2)
    try:
        node = Node(json.loads(first), target)
    except (Unreadable, DDSException) as problem:
        said = os.pread(heard, 1 << 14, 0).decode(errors="replace").splitlines()
        why = re.sub(r"^\d+\.\d+ \[\d+\] +\S+ ", "", said[0]) if said else str(problem)
    os.dup2(error, 2)
    if why:
        os.write(target, json.dumps({"say": why[:400]}).encode() + b"\n")
        return 1
    os.write(2, os.pread(heard, 1 << 14, 0))
    try:
        node.run(source)
        node.close()
    except (BrokenPipeError, ConnectionResetError):
        return 1  # the run is gone
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""The child of a port, with a real master and real nodes beside it."""

from __future__ import annotations

import math
import random
import struct
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from tests.extensions.ros.conftest import BOOL, LIMIT, NAMES, NUMBER, Graph, decimal, topic
from tests.outside import needs

FRUITS = "crops_msgs/Fruits_req"
MESSAGES = [str(Path(__file__).parent / "msgs")]

pytestmark = [needs("rospy"), pytest.mark.slow]


def test_topics_and_parameters_come_in_and_go_out(graph: Graph):
    peer = graph.peer()
    peer.do("parameter", name="/picker/rate", value=0.25)
    peer.do("parameter", name="/picker/names", value=["a", {"b": True}])
    told = {
        "topics": {"/start": topic("std_msgs/String"), "/arm": topic("std_msgs/Float64"),
                   "/cmd": topic("geometry_msgs/Twist", latch=True), "/seen": topic("crops_msgs/Fruits")},
        "messages": MESSAGES,
    }  # fmt: skip
    child = graph.child(
        told, greet=False,
        inputs={"/start.data": NAMES, "/arm.data": decimal(2), "param:/picker/rate": decimal(1),
                "param:/picker/names.1.b": BOOL, "/seen.fruits.count": NUMBER, "/seen.fruits.1.from": decimal(1),
                "/seen.raw.2": NUMBER, "/seen.seen": decimal(3), "/seen.gaps.1": decimal(9)},
        outputs={"/cmd.linear.x": decimal(2), "/cmd.angular.z": NUMBER},
    )  # fmt: skip
    assert child.until("hello")["values"] == {
        "param:/picker/rate": "0.2", "param:/picker/names": {"1": {"b": True}},
    }  # fmt: skip

    for name, of in (("/start", "std_msgs/String"), ("/arm", "std_msgs/Float64"), ("/seen", "crops_msgs/Fruits")):
        peer.do("publisher", topic=name, of=of)
    peer.begin("publish", topic="/start", values={"data": "Start state machine"})
    assert child.input("/start.data") == "Start state machine"
    peer.begin("publish", topic="/arm", values={"data": 0.1 + 0.2})
    assert child.input("/arm.data") == "0.30"
    fruits = [{"kind": "apple"}, {"kind": "pear", "from_": 2.25}]
    peer.begin("publish", topic="/seen", values={
        "fruits": fruits, "raw": [1, 2, 3, 4], "seen": {"secs": 5, "nsecs": 7_500_000},
        "gaps": [{"secs": 0, "nsecs": 0}, {"secs": -1, "nsecs": 1}],
    })  # fmt: skip
    assert child.until("values")["values"]["/seen"] == {
        "fruits": {"count": 2, "1": {"from": "2.2"}}, "raw": {"2": 3}, "seen": "5.008", "gaps": {"1": "-0.999999999"},
    }  # fmt: skip
    peer.begin("publish", topic="/seen", values={"raw": [1, 2, 3, 4]})
    lost = child.until("lost")
    assert lost["lost"] == ["/seen.fruits.1.from"] and "has 0 elements" in lost["why"]

    peer.do("subscriber", topic="/cmd", of="geometry_msgs/Twist")
    child.tell(values={"/cmd": {"linear": {"x": 1.5}, "angular": {"z": -3}}}, time=0.0, cycle=2)
    heard = peer.until(topic="/cmd")["values"]
    assert heard["linear"]["x"] == 1.5 and heard["angular"]["z"] == -3
    child.tell(safe={"/cmd": {"linear": {"x": 0.0}}})
    child.end()
    assert peer.until(topic="/cmd")["values"]["linear"]["x"] == 0.0


def test_a_service_that_fails_one_time_in_five(graph: Graph):
    peer = graph.peer()
    fruits = [{"kind": "apple"}] * 3
    answers = [{"fruit_list": fruits[: number % 4]} if number % 5 else None for number in range(1, 11)]
    peer.do("service", name="/fruits", of=FRUITS, answers=answers)
    of = request("service", "/fruits", FRUITS, sends={"row": NUMBER}, answers={"fruit_list.count": NUMBER})
    child = graph.child({"messages": MESSAGES}, requests={"locate": of})
    states = []
    for number in range(1, 11):
        child.tell(request=number, name="locate", values={"row": -number})
        answer = child.until("answer")
        assert answer["answer"] == number
        assert peer.until(service="/fruits")["request"] == {"row": -number}
        states.append(answer["state"])
        if answer["state"] == "DONE":
            assert answer["values"] == {"fruit_list": {"count": number % 4}}
    assert states == (["DONE"] * 4 + ["FAILED"]) * 2
    assert sum("no fruit is seen" in line.get("say", "") for line in child.lines.all) == 2
    child.tell(request=11, name="locate", values={"row": 2**31})
    assert child.until("say")["say"] == "locate: /fruits has failed: row cannot be 2147483648, because it is an int32"
    assert child.until("answer") == {"answer": 11, "state": "FAILED"}


def test_a_service_that_hangs_dies_or_is_not_there(graph: Graph):
    peer = graph.peer()
    of = request("service", "/hangs", FRUITS, sends={"row": NUMBER}, answers={"fruit_list.count": NUMBER})
    child = graph.child({"messages": MESSAGES}, requests={"locate": of})
    child.tell(request=1, name="locate", values={"row": 0})
    assert child.until("answer") == {"answer": 1, "state": "FAILED"}
    assert "service [/hangs] unavailable" in child.lines.all[-2]["say"]
    peer.do("service", name="/hangs", of=FRUITS, answers=[], hang=True)
    child.tell(request=2, name="locate", values={"row": 1})
    peer.until(service="/hangs")
    child.tell(cancel=2)  # its time is over
    child.tell(request=3, name="locate", values={"row": 2})
    peer.until(service="/hangs")
    peer.close()
    assert child.until("answer") == {"answer": 3, "state": "FAILED"}
    child.end()


def goal(distance: bool = True) -> dict[str, Any]:
    return request("action", "", "crops_msgs/moveArm", sends={"target.x": decimal(2)}, answers={"reached": BOOL},
                   feedback={"distance": decimal(2)} if distance else {})  # fmt: skip


def request(kind: str, name: str, of: str, **fields: Any) -> dict[str, Any]:
    return {
        "kind": kind,
        "timeout": None,
        "sends": {},
        "answers": {},
        "feedback": {},
        kind: name,
        "type": of,
        **fields,
    }


ENDS = {
    "SUCCEEDED": ["set_accepted", "set_succeeded"],
    "ABORTED": ["set_accepted", "set_aborted"],
    "PREEMPTED": ["set_accepted", "set_canceled"],
    "REJECTED": ["set_rejected"],
    "RECALLED": ["set_canceled"],
}


def test_an_action_ends_in_every_way(graph: Graph):
    peer = graph.peer()
    child = graph.child({"messages": MESSAGES}, requests={"arm": {**goal(), "action": "/move"}})
    child.tell(request=1, name="arm", values={"target": {"x": 0.25}})  # before its server is there
    peer.do("action", name="/move", of="crops_msgs/moveArm")
    for number, (end, acts) in enumerate(ENDS.items(), 1):
        if number > 1:
            child.tell(request=number, name="arm", values={"target": {"x": 0.25 * number}})
        assert peer.until("goal", action="/move")["goal"] == {"target": {"x": 0.25 * number, "y": 0.0, "z": 0.0}}
        if end in ("PREEMPTED", "RECALLED"):
            child.tell(cancel=number)
            assert peer.until(action="/move")["cancelled"]
        *first, last = acts
        for act in first:
            peer.do("act", name="/move", act=act)
            assert child.until(of=number)["state"] == "ACTIVE"
        if end == "SUCCEEDED":
            peer.do("act", name="/move", act="feedback", values={"distance": 0.126})
            assert child.until(of=number) == {"state": "ACTIVE", "of": number, "values": {"distance": "0.13"}}
            peer.do("act", name="/move", act="feedback", values={"distance": math.nan})
            assert child.until("say")["say"] == "arm: feedback of /move: distance is not a number"
        peer.do("act", name="/move", act=last, values={"reached": end == "SUCCEEDED"})
        answer = {"answer": number, "state": end, "values": {"reached": end == "SUCCEEDED"}}
        while (found := child.until("answer")) != answer:
            raise AssertionError(found)
    assert not [line for line in child.lines.all if "lost" in line]


def test_a_goal_is_recalled_before_it_is_sent_and_lost_with_its_server(graph: Graph):
    child = graph.child({"messages": MESSAGES}, requests={"arm": {**goal(), "action": "/lost"}})
    child.tell(request=1, name="arm", values={"target": {"x": 0}})
    child.tell(cancel=1)
    assert child.until("answer") == {"answer": 1, "state": "RECALLED", "values": {}}
    for number in (2, 3):
        child.tell(request=number, name="arm", values={"target": {"x": 1}})
        peer = graph.peer()
        peer.do("action", name="/lost", of="crops_msgs/moveArm")
        peer.until("goal")
        if number == 3:
            peer.do("act", name="/lost", act="set_accepted")
            assert child.until(of=3)["state"] == "ACTIVE"
        peer.close()
        assert child.until("answer") == {"answer": number, "state": "LOST", "values": {}}


def test_the_arrangement_answers_a_service(graph: Graph):
    peer = graph.peer()
    told = {"services": {"/pick": {"type": FRUITS, "timeout": 30.0}}, "messages": MESSAGES}
    child = graph.child(
        told, inputs={"/pick.asked": BOOL, "/pick.row": NUMBER},
        outputs={"/pick.answered": BOOL, "/pick.fruit_list.0.kind": NAMES},
    )  # fmt: skip

    def shows(answered: bool, kind: str) -> None:
        child.tell(values={"/pick": {"answered": answered, "fruit_list": {"0": {"kind": kind}}}}, time=0.0, cycle=2)

    for row in (1, 2):
        peer.begin("call", name="/pick", of=FRUITS, values={"row": row})
    shows(False, "NONE")
    rows = []
    for kind in ("START", "NONE"):
        values = child.until("values")["values"]["/pick"]
        assert values["asked"] is True
        rows.append(values["row"])
        shows(True, kind)
        assert child.until("values")["values"] == {"/pick": {"asked": False}}
        assert peer.until("called")["response"]["fruit_list"][0]["kind"] == kind
        shows(False, "NONE")
    assert sorted(rows) == [1, 2]


def test_nobody_answers_a_service(graph: Graph):
    peer = graph.peer()
    told = {"services": {"/silent": {"type": FRUITS, "timeout": 0.2}}, "messages": MESSAGES}
    child = graph.child(told, inputs={"/silent.asked": BOOL}, outputs={"/silent.answered": BOOL})
    peer.do("call", name="/silent", of=FRUITS, values={"row": 1})
    assert "the arrangement takes no request" in peer.until("called")["failed"]
    child.tell(values={"/silent": {"answered": False}}, time=0.0, cycle=2)
    peer.do("call", name="/silent", of=FRUITS, values={"row": 1})
    assert [child.until("values")["values"]["/silent"]["asked"] for _ in range(2)] == [True, False]
    assert "no answer within 0.2 s" in peer.until("called")["failed"]


def test_events_are_kept_and_values_are_replaced(graph: Graph):
    peer = graph.peer()
    told = {"topics": {"/event": topic("std_msgs/Int32"), "/value": topic("std_msgs/Int32")}, "events": ["/event.data"]}
    child = graph.child(told, inputs={"/event.data": NUMBER, "/value.data": NUMBER})
    for name in ("/event", "/value"):
        peer.do("publisher", topic=name, of="std_msgs/Int32")
        peer.begin("publish", topic=name, values=[{"data": number} for number in range(1000)])
        peer.until("done")
    found = [child.input("/event.data") for _ in range(1000)]
    assert found == list(range(1000))
    value = -1
    while value != 999:
        before, value = value, child.input("/value.data")
        assert value > before


def test_a_type_of_another_kind_is_told_and_mended(graph: Graph):
    wrong, right = graph.peer(), graph.peer()
    wrong.do("publisher", topic="/type", of="std_msgs/Int32")
    child = graph.child({"topics": {"/type": topic("std_msgs/Float64")}}, inputs={"/type.data": decimal(1)})
    lost = child.until("lost")
    assert lost["lost"] == ["/type.data"]
    assert lost["why"].startswith("/type has another type at its publisher: ")
    assert "std_msgs/Float64" in lost["why"] and "std_msgs/Int32" in lost["why"]
    wrong.close()
    right.do("publisher", topic="/type", of="std_msgs/Float64")
    right.begin("publish", topic="/type", values={"data": 1.5})
    assert child.input("/type.data") == "1.5"
    right.close()
    assert child.until("lost") == {"lost": ["/type.data"], "why": "/type has no publisher any more"}
    again = graph.peer()
    again.do("publisher", topic="/type", of="std_msgs/Float64")
    again.begin("publish", topic="/type", values=[{"data": math.nan}, {"data": -math.inf}, {"data": 2.0}])
    assert child.until("lost") == {"lost": ["/type.data"], "why": "/type.data is not a number"}
    assert child.until("lost") == {"lost": ["/type.data"], "why": "/type.data is -infinite"}
    assert child.input("/type.data") == "2.0"


def test_a_topic_that_was_never_published_is_said_once(graph: Graph):
    told = {"topics": {"/never": topic("std_msgs/Bool"), "/seldom": topic("std_msgs/Bool")}, "events": ["/seldom.data"]}
    child = graph.child({**told, "settling": 0}, inputs={"/never.data": BOOL, "/seldom.data": BOOL})
    peer = graph.peer()
    assert child.until("say")["say"] == "nobody publishes /never yet; without `timeout` that is not a failure"
    for name in ("/seldom", "/never"):
        peer.do("publisher", topic=name, of="std_msgs/Bool")
        peer.do("publish", topic=name, values={"data": True})
        assert child.input(f"{name}.data") is True
    peer.close()
    assert child.until("lost") == {"lost": ["/never.data"], "why": "/never has no publisher any more"}
    assert len([line for line in child.lines.all if "say" in line]) == 1


def test_a_master_goes_and_returns(alone: Graph):
    old = alone.peer()
    old.do("publisher", topic="/old", of="std_msgs/Bool")
    told = {"topics": {"/old": topic("std_msgs/Bool"), "/new": topic("std_msgs/Bool"), "/out": topic("std_msgs/Bool")}}
    child = alone.child(told, inputs={"/old.data": BOOL, "/new.data": BOOL}, outputs={"/out.data": BOOL})
    old.begin("publish", topic="/old", values={"data": True})
    assert child.input("/old.data") is True
    alone.master.stop()
    assert child.until("say")["say"].endswith("is gone; connections stay")
    old.begin("publish", topic="/old", values={"data": False})
    assert child.input("/old.data") is False
    alone.master.start()
    assert "is back" in child.until("say")["say"]
    new = alone.peer()
    new.do("publisher", topic="/new", of="std_msgs/Bool")
    new.begin("publish", topic="/new", values={"data": True})
    assert child.input("/new.data") is True
    new.do("subscriber", topic="/out", of="std_msgs/Bool")
    told_true = {"/out": {"data": True}}
    child.tell(values={"/out": {"data": False}}, time=0.0, cycle=2)
    child.tell(values=told_true, time=0.0, cycle=3)
    child.end()


def test_a_clock_that_stands_still_stops_nothing(alone: Graph):
    peer = alone.peer()
    peer.do("parameter", name="/use_sim_time", value=True)
    told = {"topics": {"/x": topic("std_msgs/Bool")}, "messages": MESSAGES}
    child = alone.child(told, inputs={"/x.data": BOOL}, requests={"arm": {**goal(), "action": "/move"}})
    peer.do("publisher", topic="/x", of="std_msgs/Bool")
    peer.begin("publish", topic="/x", values={"data": True})
    assert child.input("/x.data") is True
    child.tell(request=1, name="arm", values={"target": {"x": 0}})
    peer.do("action", name="/move", of="crops_msgs/moveArm")
    peer.until("goal")
    peer.do("act", name="/move", act="set_accepted")
    assert child.until(of=1)["state"] == "ACTIVE"
    child.end()


def test_what_is_missing_is_the_only_line(alone: Graph):
    child = alone.child(greet=False, inputs={"param:/picker/rat": NUMBER})
    assert child.until("say")["say"].startswith("there is no parameter /picker/rat; there are ")
    assert child.process.wait(LIMIT) == 1
    alone.master.stop()
    child = alone.child(greet=False)
    assert child.until("say")["say"].startswith(f"there is no ROS master at http://127.0.0.1:{alone.master.port}: ")
    alone.master.start()


def test_another_node_takes_the_name(alone: Graph):
    child = alone.child({"node": "picker"}, inputs={})
    other = alone.child({"node": "picker"}, inputs={})
    lost = child.until("lost")
    assert lost["lost"] == [] and "new node registered with same name" in lost["why"]
    assert lost["why"].endswith("; write another name under `node`")
    child.end()
    other.end()


def test_nothing_of_ros_is_on_standard_output(graph: Graph):
    child = graph.child({"topics": {"/x": topic("std_msgs/Int8")}}, outputs={"/x.data": NUMBER})
    assert child.lines.all == [{"hello": 1}]  # without parameters no values, which would be a message of no field
    child.tell(values={"/x": {"data": 300}}, time=0.0, cycle=2)
    said = child.until("say")["say"]
    assert said == "/x.data cannot be 300, because it is an int8; nothing is published to /x"
    child.end()  # whatever it has said was JSON
    child.until("gone")


SIZES = {"i8": 8, "i16": 16, "i32": 32, "i64": 64, "old_i8": 8}
UNSIGNED = {"u8": 8, "u16": 16, "u32": 32, "u64": 64, "old_u8": 8, "three.2": 8}


def whole(draw: random.Random, low: int, high: int) -> int:
    return draw.choice([low, high, 0, 1, draw.randint(low, high)])


def real(draw: random.Random, most: float) -> float:
    extremes = [0.0, -0.0, 5e-324, most, -most, 0.5, 2.5, 1e-3, 0.0005, 0.0015]
    return draw.choice([*extremes, draw.uniform(-1e6, 1e6), most * draw.uniform(-1, 1)])


def drawn(draw: random.Random) -> dict[str, Any]:
    """By field, as the other side has it: numbers of times in nanoseconds."""
    found: dict[str, Any] = {"b": draw.random() < 0.5}
    found |= {name: whole(draw, -(2 ** (bits - 1)), 2 ** (bits - 1) - 1) for name, bits in SIZES.items()}
    found |= {name: whole(draw, 0, 2**bits - 1) for name, bits in UNSIGNED.items()}
    found["f32"] = struct.unpack("f", struct.pack("f", real(draw, 3.4e38)))[0]
    found["f64"], found["two.1.from"] = real(draw, 1.7e308), float(draw.randint(-9, 9))
    found["text"] = draw.choice(["", "Start state machine", "ünïcode \U0001f34e", '"\\\n', "x" * 3000, "true", "1e3"])
    found["t"] = whole(draw, 0, 2**32 * 10**9 - 1)
    found["d"] = whole(draw, -(2**31) * 10**9, 2**31 * 10**9 - 1)
    found["many.1"] = whole(draw, -(2**63), 2**63 - 1)
    return found


def rounded(number: float | Fraction, digits: int) -> Fraction:
    return Fraction(round(Fraction(number) * 10**digits), 10**digits)  # half to even, as IEEE 754 does


def test_random_values_arrive_as_they_were_sent(graph: Graph):
    peer, draw = graph.peer(), random.Random(7)
    names = sorted(drawn(draw))
    inputs = {f"/in.{n}": decimal(9 if n in "td" else 3) if n in ("f32", "f64", "t", "d") else NUMBER for n in names}
    inputs |= {"/in.b": BOOL, "/in.text": NAMES, "/in.many.count": NUMBER}
    told = {
        "topics": {"/in": topic("crops_msgs/All"), "/out": topic("crops_msgs/All", latch=True)},
        "messages": MESSAGES,
    }
    child = graph.child(
        {**told, "events": list(inputs)}, inputs=inputs, outputs={f"/out.{name}": NUMBER for name in names}
    )
    peer.do("publisher", topic="/in", of="crops_msgs/All")
    peer.do("subscriber", topic="/out", of="crops_msgs/All")
    sent = [drawn(draw) for _ in range(300)]
    for values in sent:
        message = {n: v for n, v in values.items() if "." not in n}
        message |= {n: dict(zip(("secs", "nsecs"), divmod(values[n], 10**9), strict=True)) for n in "td"}
        message |= {"many": [0, values["many.1"]], "three": [1, 2, values["three.2"]]}
        message["two"] = [{}, {"from_": values["two.1.from"]}]
        peer.begin("publish", topic="/in", values=message)
    for values in sent:
        given = child.until("values")["values"]["/in"]
        found = {n: given[n] for n in values if "." not in n}
        found |= {"three.2": given["three"]["2"], "many.1": given["many"]["1"], "two.1.from": given["two"]["1"]["from"]}
        assert given["many"]["count"] == 2
        for name in ("t", "d", "f32", "f64", "two.1.from"):
            found[name] = Fraction(found[name])
        as_sent = {**values, **{n: Fraction(values[n], 10**9) for n in "td"}}
        as_sent["two.1.from"] = Fraction(values["two.1.from"])
        for name in ("f32", "f64"):
            as_sent[name] = rounded(Fraction(repr(values[name])), 3)
        assert found == as_sent

    for number, values in enumerate(sent):
        told_back = dict(values)
        for name in "td":
            sign = "-" if values[name] < 0 else ""
            told_back[name] = f"{sign}{abs(values[name]) // 10**9}.{abs(values[name]) % 10**9:09}"
        outputs: dict[str, Any] = {n: v for n, v in told_back.items() if "." not in n}
        outputs |= {"many": {"1": values["many.1"]}, "three": {"2": values["three.2"]}}
        outputs["two"] = {"1": {"from": values["two.1.from"]}}
        child.tell(values={"/out": outputs}, time=0.0, cycle=number + 2)
        if number and all(values[n] == sent[number - 1][n] for n in names):
            continue  # nothing is published
        message = peer.until(topic="/out")["values"]
        assert {n: message[n] for n in message if n in values and n not in "td"} == {
            n: v for n, v in values.items() if "." not in n and n not in "td"
        }
        for name in "td":
            assert message[name][0] * 10**9 + message[name][1] == values[name]
        assert message["many"] == [0, values["many.1"]] and message["three"] == [0, 0, values["three.2"]]
        assert [one["from_"] for one in message["two"]] == [0.0, values["two.1.from"]]

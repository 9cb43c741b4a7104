"""Masters, parameters, messages and clients that are not as they should be, with a real master beside them."""

from __future__ import annotations

import json
import math
import subprocess
import threading
import xmlrpc.client
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any

import pytest

from tests.extensions.ros.conftest import BOOL, LIMIT, NAMES, NODE, NUMBER, PYTHON, Graph, around, decimal, topic
from tests.extensions.ros.test_child import FRUITS, MESSAGES, request
from tests.outside import needs

pytestmark = [needs("rospy"), pytest.mark.slow]


@contextmanager
def answering(status: int, body: bytes) -> Iterator[int]:
    """The port of a server that gives this answer to whatever it is asked."""

    class Answer(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            self.rfile.read(int(self.headers.get("content-length", 0)))
            self.send_response(status)
            self.send_header("content-length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_: object) -> None:
            pass

    with HTTPServer(("127.0.0.1", 0), Answer) as server:
        serving = threading.Thread(target=server.serve_forever)
        serving.start()
        try:
            yield server.server_address[1]
        finally:
            server.shutdown()
            serving.join()


def refused(surroundings: dict[str, str]) -> str:
    """What a node says that cannot begin, and nothing else."""
    hello = json.dumps({"hello": 1, "inputs": {}, "outputs": {}, "told": {}})
    done = subprocess.run(
        [PYTHON, str(NODE)], input=hello + "\n", env=surroundings, capture_output=True, text=True, check=False,
        timeout=LIMIT,
    )  # fmt: skip
    assert done.returncode == 1 and "Traceback" not in done.stderr
    said: str = json.loads(done.stdout)["say"]
    return said


@pytest.mark.parametrize("uri", ["", "nonsense", "http://127.0.0.1:abc", "ftp://127.0.0.1:1", "http://127.0.0.1:1"])
def test_an_address_without_a_master_is_told(uri: str, tmp_path: Path):
    told = refused({**around(1, tmp_path), "ROS_MASTER_URI": uri})
    assert told.startswith(f"there is no ROS master at {uri or 'ROS_MASTER_URI, which is empty'}")


@pytest.mark.parametrize(
    ("status", "body"),
    [(200, b"<html>hello</html>"), (404, b""), (200, xmlrpc.client.dumps(("no",), methodresponse=True).encode())],
)
def test_a_server_that_is_not_a_master_is_told(status: int, body: bytes, tmp_path: Path):
    with answering(status, body) as port:
        assert refused(around(port, tmp_path)).startswith(f"there is no ROS master at http://127.0.0.1:{port}: its ")


def test_a_master_that_has_forgotten_the_node_hears_of_it_again(alone: Graph):
    child = alone.child({"topics": {"/in": topic("std_msgs/Bool")}, "node": "picker"}, inputs={"/in.data": BOOL})
    with xmlrpc.client.ServerProxy(f"http://127.0.0.1:{alone.master.port}") as server:
        master: Any = server
        while not any("is back" in line.get("say", "") for line in child.lines.now()):
            uri = master.lookupNode("/test", "/picker")[2]
            for names, forget in zip(
                master.getSystemState("/test")[2], ("Publisher", "Subscriber", "Service"), strict=True
            ):
                for name in [name for name, nodes in names if "/picker" in nodes]:
                    where = master.lookupService("/test", name)[2] if forget == "Service" else uri
                    getattr(master, f"unregister{forget}")("/picker", name, where)
            threading.Event().wait(0.2)
    peer = alone.peer()
    peer.do("publisher", topic="/in", of="std_msgs/Bool")
    peer.begin("publish", topic="/in", values={"data": True})
    assert child.input("/in.data") is True


BINARY = 'import rospy, xmlrpc.client; rospy.set_param("/given", xmlrpc.client.Binary(b"x"))'


@pytest.mark.parametrize(
    ("value", "field", "of", "told"),
    [
        (1000, "/given", {**NUMBER, "high": 9}, "the parameter /given is 1000, which its input does not have"),
        (math.nan, "/given", decimal(2), "the parameter /given is 'NaN', which its input does not have"),
        ("yes", "/given", BOOL, "the parameter /given is 'yes', which its input does not have"),
        ("PAUSE", "/given", NAMES, "the parameter /given is 'PAUSE', which its input does not have"),
        ([1, 2], "/given.-1", NUMBER, "the parameter /given is [1, 2], which has no `-1`"),
        (None, "/given", NUMBER, "the parameter /given is a Binary, which its input does not have"),
    ],
)
def test_a_parameter_that_no_input_can_have_is_told(alone: Graph, value: Any, field: str, of: Any, told: str):
    if value is None:
        subprocess.run([PYTHON, "-c", BINARY], env=alone.master.surroundings, check=True)
    else:
        alone.peer().do("parameter", name="/given", value=value)
    child = alone.child(greet=False, inputs={f"param:{field}": of})
    assert child.until("say")["say"] == told


def test_a_parameter_may_be_a_text_that_the_file_of_ports_translates(alone: Graph):
    alone.peer().do("parameter", name="/given", value="Start state machine")
    child = alone.child({"values": ["Start state machine"]}, greet=False, inputs={"param:/given": NAMES})
    assert child.until("hello")["values"] == {"param:/given": "Start state machine"}


def test_two_names_of_a_topic_are_told(graph: Graph):
    both = {"/same": topic("std_msgs/Bool"), "same": topic("std_msgs/Int32")}
    child = graph.child({"topics": both}, greet=False, inputs={"/same.data": BOOL, "same.data": NUMBER})
    assert child.until("say")["say"] == "`/same` and `same` are the same here, /same: write one name"


def test_a_header_that_is_not_ros_and_a_number_without_end(graph: Graph, tmp_path: Path):
    (tmp_path / "own/msg").mkdir(parents=True)
    (tmp_path / "own/msg/Odd.msg").write_text("string header\ntime t\nint8 x\n")
    child = graph.child({"topics": {"/odd": topic("own/Odd")}, "messages": [str(tmp_path)]},
                        outputs={"/odd.t": NUMBER, "/odd.x": NUMBER})  # fmt: skip
    peer = graph.peer()
    peer.do("subscriber", topic="/odd", of="std_msgs/Int8")
    assert child.until("say")["say"].endswith(" reads /odd as std_msgs/Int8, and here it is own/Odd")
    for time in ("1e9999999999", "1e99", "-1", 2**32):
        child.tell(values={"/odd": {"t": time, "x": 1}}, time=0.0, cycle=2)
        assert child.until("say")["say"].endswith("because it is a time; nothing is published to /odd")
    child.tell(values={"/odd": {"t": 2**32 - 1, "x": 128}}, time=0.0, cycle=3)
    assert child.until("say")["say"].startswith("/odd.x cannot be 128, because it is an int8")
    child.end()


def test_a_request_that_an_input_cannot_have_is_refused(graph: Graph):
    """With a value that is refused, the arrangement would answer what nobody has asked."""
    peer = graph.peer()
    told = {"services": {"/few": {"type": FRUITS, "timeout": 30.0}}, "messages": MESSAGES, "values": ["12"]}
    child = graph.child(
        told, inputs={"/few.asked": BOOL, "/few.row": {**NUMBER, "low": 0, "high": 9}}, outputs={"/few.answered": BOOL}
    )
    child.tell(values={"/few": {"answered": False}}, time=0.0, cycle=2)
    peer.do("call", name="/few", of=FRUITS, values={"row": 10})
    assert "row cannot be 10, which its input does not have" in peer.until("called")["failed"]
    for row in (9, 12):
        peer.do("call", name="/few", of=FRUITS, values={"row": row})
        assert child.until("values")["values"]["/few"] == {"row": row, "asked": True}
        child.tell(values={"/few": {"answered": True}}, time=0.0, cycle=3)
        assert "response" in peer.until("called")
        child.tell(values={"/few": {"answered": False}}, time=0.0, cycle=4)
        child.until("values")


def test_a_service_of_another_type_fails_and_says_so_once(graph: Graph):
    peer = graph.peer()
    peer.do("service", name="/loggers", of="roscpp/GetLoggers", answers=[])
    of = request("service", "/loggers", FRUITS, sends={"row": NUMBER})
    told = {"services": {"/ours": {"type": FRUITS, "timeout": 30.0}}, "messages": MESSAGES}
    child = graph.child(told, requests={"locate": of}, inputs={"/ours.asked": BOOL}, outputs={"/ours.answered": BOOL})
    child.tell(request=1, name="locate", values={"row": 1})
    assert child.until("say")["say"].startswith("locate: /loggers has failed: unable to connect to service: ")
    assert child.until("answer") == {"answer": 1, "state": "FAILED"}
    peer.do("call", name="/ours", of="roscpp/GetLoggers", values={})
    said = child.until("say")["say"]
    assert said.startswith("request from [/peer") and said.endswith("]") and "md5sums do not match" in said


FLOOD = """
import sys, threading
sys.path.insert(0, sys.argv[1])
from ros1_node.channel import Channel
channel = Channel()
channel.first({"hello": 1})
threading.Thread(target=channel.say, args=("x" * 10_000_000,)).start()
while not channel._writes:
    pass
for number in range(50_000):
    channel.feed(7, "ACTIVE", {"distance": number})
    channel.values({"/x.data": number}, event=True)
    channel.lost(["/y.data"], "/y.data is not a number")
channel.tell({"answer": 7, "state": "SUCCEEDED", "values": {}})
print("done", file=sys.stderr, flush=True)
"""


def test_what_a_run_does_not_read_has_bounds_and_answers_are_kept():
    pipe = subprocess.PIPE
    command = [PYTHON, "-c", FLOOD, str(NODE.parent)]
    with subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=pipe, stderr=pipe) as process:
        assert process.stdout is not None and process.stderr is not None
        assert process.stderr.readline() == b"done\n"
        hello, long, *lines = [json.loads(line) for line in process.stdout]
    assert hello == {"hello": 1} and len(long["say"]) == 10_000_000 and process.returncode == 0
    fed = [line for line in lines if "of" in line]
    assert fed == [{"state": "ACTIVE", "of": 7, "values": {"distance": 49_999}}]
    assert lines[-2] == {"answer": 7, "state": "SUCCEEDED", "values": {}}
    assert [line["values"] for line in lines if "values" in line and not line.keys() & {"of", "answer"}][-1] == {
        "/x": {"data": 49_999}
    }
    assert 10_000 <= len(lines) < 10_010
    assert "some are left out" in lines[-1]["say"]

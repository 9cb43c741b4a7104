"""The kind of port: what a file of ports says of it, and a run whose inputs and outputs are topics."""

from __future__ import annotations

from pathlib import Path

import jsonschema
import pytest
import yaml

from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.runtime.ports.file import schema
from llfsm_verify.testing.conformance import port_cases
from tests.extensions.ros.conftest import HERE, Graph
from tests.outside import needs
from tests.runtime.ports.bench import bench, declared

TOPICS = "{/arm/distance: std_msgs/Float64, /cmd: {type: geometry_msgs/Twist, queue: 1, latch: true}}"
PORT = f"""\
ports:
  robot:
    kind: ros1
    topics: {TOPICS}
    inputs: {{speed: /arm/distance.data, level: 'param:/picker/level'}}
    outputs: {{drive: /cmd.linear.x}}
    on_failure: safe
    safe: {{drive: -0.5, speed: 0, level: 1}}
"""
SERVED = "inputs: {go: /pick.asked, level: /pick.row}, outputs: {go: /pick.answered}, on_failure: stale"
PICK = f"messages: [{HERE / 'msgs'}], services: {{/pick: crops_msgs/Fruits_req}}"
WRONG = [
    ("inputs: {speed: §/arm/distanc.data}, on_failure: stale", "E493", "did you mean `/arm/distance`?"),
    ("outputs: {drive: §/wheels.x}", "E493", "known here: `/arm/distance`, `/cmd`"),
    ("outputs: {drive: §/cmd}", "E493", "with a dot between"),
    ("outputs: {drive: §.x}", "E493", "with a dot between"),
    ("outputs: {drive: §'param:/x'}", "E493", "another name"),
    ("inputs: {speed: §'param:x y'}, on_failure: stale", "E493", "another name"),
    ("outputs: {drive: /cmd.linear.x}, node: §a-b", "E493", "letters, digits"),
    ("outputs: {drive: /cmd.linear.x}, messages: [§nowhere]", "E493", "such as `std_msgs/msg`"),
    ("outputs: {drive: /pick.answered}, services: {§/pick: std_msgs/Empty}", "E493", "/pick.asked"),
    ("outputs: {drive: /cmd.linear.x}, services: {§/a b: std_msgs/Empty}", "E493", "between `/`"),
    ("outputs: {drive: /cmd.linear.x}, python: §/nowhere/python3", "E536", "`python: …`"),
    ("outputs: {drive: /cmd.linear.x}, python: §/bin/false", "E536", "`python: …`"),
]
TYPES = [
    ("outputs: {drive: §/cmd.linear}", "E493", "name one of its fields: x, y, z"),
    ("outputs: {drive: §/cmd.linear.w}", "E493", "it has x, y, z"),
    ("inputs: {speed: §/arm/distance.dat}, on_failure: stale", "E493", "did you mean `data`?"),
    (f"{SERVED}, services: {{/pick: §crops_msgs/Fruits_req}}", "E493", "source its workspace"),
    (f"{SERVED.replace('/pick.row', '§/pick.raw')}, {PICK}", "E493", "did you mean `row`?"),
]  # fmt: skip


def problem(settings: str, folder: Path) -> tuple[str, tuple[int, int] | None, tuple[int, int], str]:
    text = f"ports: {{robot: {{kind: ros1, topics: {TOPICS}, {settings}}}}}\n"
    with pytest.raises(DiagnosticError) as caught:
        declared(text.replace("§", ""), folder)
    (found,) = caught.value.diagnostics
    at = (found.span.line, found.span.column) if found.span else None
    return found.code, at, Source("x", text.replace("§", "")).position(text.index("§")), found.hint or ""


@pytest.mark.parametrize(("settings", "code", "hint"), WRONG)
def test_what_is_wrong_is_told_at_its_place(settings: str, code: str, hint: str, tmp_path: Path):
    found, at, place, said = problem(settings, tmp_path)
    assert (found, at) == (code, place) and hint in said


@needs("rospy")
@pytest.mark.slow
@pytest.mark.parametrize(("settings", "code", "hint"), TYPES)
def test_types_and_fields_are_looked_up_before_the_run(settings: str, code: str, hint: str, tmp_path: Path):
    found, at, place, said = problem(settings, tmp_path)
    assert (found, at) == (code, place) and hint in said


@needs("rospy")
@pytest.mark.slow
def test_the_schema_takes_what_the_reader_takes(tmp_path: Path):
    (spec,) = declared(PORT, tmp_path)
    assert spec.inputs == {"speed": "/arm/distance.data", "level": "param:/picker/level"}
    jsonschema.Draft202012Validator(schema("ports")).validate(yaml.safe_load(PORT))


@pytest.mark.slow
def test_topics_feed_a_run_and_show_its_outputs(graph: Graph, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    for name, value in graph.master.surroundings.items():
        monkeypatch.setenv(name, value)
    peer = graph.peer()
    peer.do("parameter", name="/picker/level", value=3)
    peer.do("publisher", topic="/arm/distance", of="std_msgs/Float64")
    specs = declared(PORT, tmp_path)
    with bench(*specs) as run:
        run.until(run.has("level", 3))
        run.board.posts.post({"go": True})
        peer.begin("publish", topic="/arm/distance", values={"data": 0.123})
        peer.do("subscriber", topic="/cmd", of="geometry_msgs/Twist")

        def drives(value: str) -> bool:
            return str(run.value("drive")) == value

        run.until(lambda: drives("0.12"))
        run.until(lambda: any(one.get("values", {}).get("linear", {}).get("x") == 0.12 for one in peer.lines.now()))
        peer.close()
        run.until(lambda: drives("0.00"))
        said = "port robot: /arm/distance has no publisher any more: `speed` gets its safe value"
        assert [one for one in run.said if "nobody publishes" not in one] == [said]
        run.end("stopped")


@pytest.mark.slow
def test_a_port_without_a_master_or_parameter_is_not_opened(
    alone: Graph, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    for name, value in alone.master.surroundings.items():
        monkeypatch.setenv(name, value)
    specs = declared(PORT, tmp_path)
    with (
        pytest.raises(DiagnosticError, match="there is no parameter /picker/level; there are ") as caught,
        bench(*specs),
    ):
        pass
    assert (caught.value.diagnostics[0].hint or "").startswith("run `rosparam set /picker/level VALUE`, or ")
    alone.master.stop()
    told = "port `robot` cannot be opened: there is no ROS master at http://127"
    with pytest.raises(DiagnosticError, match=told) as caught, bench(*specs):
        pass
    assert "set ROS_MASTER_URI" in (caught.value.diagnostics[0].hint or "")
    alone.master.start()


@needs("rospy")
@pytest.mark.slow
def test_it_conforms(graph: Graph, monkeypatch: pytest.MonkeyPatch):
    for name, value in graph.master.surroundings.items():
        monkeypatch.setenv(name, value)
    cases = port_cases("ros1", "{topics: {/x: std_msgs/Bool}}")
    assert cases and not [outcome.wrong for outcome in (case() for case in cases) if outcome.wrong]

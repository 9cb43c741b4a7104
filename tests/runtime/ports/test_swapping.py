"""Machines that are replaced in a run with ports, which read the slots of the machines that are there."""

from __future__ import annotations

import copy
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import llfsm_verify as lv
from tests.runtime.ports.picker import PICKER, port

COUNTS = "n = (n + 1) % 7;"
PROGRAM = """
for message in messages:
    if "request" in message: say(answer=message["request"], values={"list": [{"count": 4}]})
    if "values" in message and "request" not in message:
        with open("n.new", "w") as new: json.dump(message["values"], new)
        os.rename("n.new", "n")
"""
KEYS = """requests:
  locate: {kind: service, ask: locate, state: locate_state, answers: {fruits: list.0.count}}"""


def machine(variables: dict[str, str], does: str = COUNTS) -> dict[str, object]:
    declared = {name: {"type": of, "init": 0} for name, of in variables.items()}
    return {"machine": "K", "variables": declared, "states": [{"name": "S", "internal": does, "stays": True}]}


def soon(condition: Callable[[], bool]) -> None:
    while not condition():
        time.sleep(0.001)


@pytest.mark.slow
def test_ports_go_on_with_the_slots_of_the_new_machine(tmp_path: Path) -> None:
    document: dict[str, Any] = {**copy.deepcopy(PICKER), "cycle_ms": 1, "operators": {"replace": ["k"]}}
    document["machines"] = {"k": {"file": "k.yaml"}, **document["machines"]}
    document["schedule"] = ["k", "m"]
    files = {
        "k": machine({"n": "0..9"}), "wide": machine({"a": "0..60000", "b": "0..60000", "n": "0..9"}, "n = 8; a = 9;"),
        "other": machine({"n": "0..99"}), "less": machine({}, ""), "a": document,
    }  # fmt: skip
    for name, text in files.items():
        (tmp_path / f"{name}.yaml").write_text(json.dumps(text))
    hello = json.dumps({"hello": 1, "values": {"wants": 0}})
    text = port(tmp_path, PROGRAM, KEYS, hello=hello).replace("{level: level}", "{wants: wants, gain: gain}")
    (tmp_path / "a.ports.yaml").write_text(text.replace("{doubled: doubled}", "{k.n: n}"))
    port(tmp_path, PROGRAM, KEYS, hello=hello.replace('"wants"', '"gain": 1, "wants"'))
    with lv.load(tmp_path / "a.yaml").run(ports=tmp_path / "a.ports.yaml") as run:
        for name in ("other", "less"):
            with pytest.raises(ValueError, match=r"a port needs `k\.n`"):
                run.replace("k", tmp_path / f"{name}.yaml", unchecked=True)
        run.replace("k", tmp_path / "wide.yaml", unchecked=True)
        soon(lambda: (tmp_path / "n").exists() and json.loads((tmp_path / "n").read_text()) == {"n": 8})
        run._shared.posts.post({"wants": 1})  # what the child could say
        soon(lambda: run.values()["locate_state"] == "DONE")
        assert run.values()["fruits"] == 4
    assert run.wait().ending == "stopped"

"""Tasks of sweeps over the traffic lights, and calls that behave in ways that checks do not."""

from __future__ import annotations

import json
import os
import time
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from llfsm_verify.extensions.sweep import worker
from llfsm_verify.extensions.sweep.task import Outcome, Task

ROOT = Path(__file__).parents[3]
FOLDER = ROOT / "models" / "traffic_lights"
COUNTER = """\
name: counter
whiteboard: {n: {type: 0..9, init: 0}}
machines:
  m:
    parameters: {most: 3}
    inline:
      machine: M
      parameters: {most: {constant: 0..9}}
      states: [{name: A, internal: "if (n < most) n++;", transitions: [{when: "false", to: A}]}]
schedule: [m]
"""
BELOW = "below: G n < 5\n"


@cache
def lights() -> tuple[tuple[str, str], ...]:
    """The texts of all arrangements and properties."""
    texts = {path.name: path.read_text() for path in sorted(FOLDER.glob("*.yaml"))}
    return (*texts.items(), ("asked/p.ltl", (ROOT / "properties" / "traffic_lights.ltl").read_text()))


def lights_task(key: str, arrangement: str = "arrangement.yaml", **changed: Any) -> Task:
    task = Task(key, lights(), arrangement, ("asked/p.ltl",), (), (), None, None)
    return replace(task, **changed)


def counter_task(most: int, **changed: Any) -> Task:
    values = (("constant", "most", most),)
    files = (("counter.yaml", COUNTER), ("p.ltl", BELOW))
    return replace(Task(str(most), files, "counter.yaml", ("p.ltl",), values, (), None, None), **changed)


def twelve() -> list[Task]:
    """Tasks of all kinds of ends."""
    return [
        *map(counter_task, range(8)),
        counter_task(17),
        counter_task(3, key="wrong", properties=("no.ltl",)),
        lights_task("lights"),
        lights_task("faulty", "faulty.yaml"),
    ]


def lasting(outcome: Outcome) -> object:
    """What of an outcome is the same each time: passes are looked at for vacuity as long as time is left for that."""
    taken = {"seconds", "vacuity"}
    text = json.dumps(outcome.result)
    found = json.loads(text, object_hook=lambda each: {k: v for k, v in each.items() if k not in taken})
    return outcome.state, found, outcome.message, outcome.traces


# ---------------------------------------------------------------- what workers do


def process_of(seconds: float) -> int:
    time.sleep(seconds)
    return os.getpid()


def stuck(task: Task) -> Outcome:
    """As `worker.guarded`, of a check that does not end, where patience is short."""
    worker.GRACE = (1.0, 0.3)
    worker.perform = lambda _: time.sleep(1000)  # type: ignore[assignment,return-value]
    return worker.guarded(task)


def deserted(text: str) -> str:
    """A task that ends its process when it is told to, and leaves a file in the temporary folder."""
    import tempfile

    with tempfile.NamedTemporaryFile(delete=False):
        pass
    if text.startswith("end"):
        os.kill(os.getpid(), 9)
    return text

"""An arrangement that has all that ports can serve, and children that are written in a few lines."""

from __future__ import annotations

import json
import sys
from functools import cache
from pathlib import Path

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.runtime.live.loop import LiveCode
from tests.runtime.live.runs import code_of

SERVICE = ["IDLE", "WAITING", "DONE", "FAILED", "TIMED_OUT"]
ACTION = ["IDLE", "PENDING", "ACTIVE", "PREEMPTED", "RECALLED", "REJECTED", "LOST", "SUCCEEDED"]
PICKER = {
    "name": "picker",
    "cycle_ms": 10,
    "types": {"Event": ["NONE", "START", "PAUSE"], "Service": SERVICE, "Action": ACTION},
    "whiteboard": {
        "level": {"type": "-3..4", "role": "input", "init": 0},
        "speed": {"type": {"decimal": 0.01, "range": "-1.0..1.0"}, "role": "input", "init": 0},
        "start": {"type": "Event", "role": "input", "init": "NONE"},
        "locate_state": {"type": "Service", "role": "input", "init": "IDLE"},
        "fruits": {"type": "0..9", "role": "input", "init": 0},
        "arm_state": {"type": "Action", "role": "input", "init": "IDLE"},
        "distance": {"type": "0..9", "role": "input", "init": 9},
        "wants": {"type": "0..2", "role": "input", "init": 0},
        "gain": {"type": "0..9", "role": "input", "changes": "never"},
        "locate": {"type": "bool", "init": False},
        "reach": {"type": "bool", "init": False},
        "starts": {"type": "uint16", "init": 0},
        "pauses": {"type": "uint16", "init": 0},
        "doubled": {"type": "-6..8", "init": 0},
        "now": {"type": "Event", "init": "NONE"},
    },
    "machines": {
        "m": {
            "inline": {
                "machine": "M",
                "states": [
                    {
                        "name": "S",
                        "internal": "now = start; if (start == START) { starts += 1; } "
                        "if (start == PAUSE) { pauses += 1; } doubled = level + level; locate = wants == 1; "
                        "reach = wants == 2;",
                        "transitions": [{"when": "gain < 0", "to": "S"}],
                    }
                ],
            }
        }
    },
    "schedule": ["m"],
}
"""``wants`` says what is asked for: 1 the service, 2 the action."""


@cache
def picker() -> LiveCode:
    return code_of(build_arrangement(PICKER))


CHILD = """\
import json, os, sys
def say(**message): print(json.dumps(message), flush=True)
def heard():
    for line in sys.stdin:
        yield json.loads(line)
hello = next(messages := heard())
"""


def port(folder: Path, program: str, keys: str, *, hello: str = '{"hello": 1}') -> str:
    """A file of a port `p` whose child does this; `hello` is what it says first ("": nothing)."""
    greets = f"print({json.dumps(hello)}, flush=True)\n" if hello else ""
    (folder / "child.py").write_text(CHILD + greets + program)
    return (
        f"ports:\n  p:\n    kind: process\n    run: [{json.dumps(sys.executable)}, -ISu, child.py]\n"
        "    on_failure: stale\n    inputs: {level: level}\n    outputs: {doubled: doubled}\n"
        + "".join(f"    {line}\n" for line in keys.splitlines())
    )  # fmt: skip

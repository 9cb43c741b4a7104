"""Whether types are there and have the fields that a file of ports names: JSON in, JSON out.

In: {"messages": [FOLDER, …], "asked": [{"kind": KIND, "type": TYPE, "fields": [[PART, PATH], …]}, …]}; KIND is
``topic``, ``service``, ``action`` or ``serves``; PART is ``in`` or ``out`` of a topic, ``request``, ``response``,
``goal``, ``result`` or ``feedback``. Out: {"missing": TEXT} where a package of ROS is missing, else {"found":
[[PROBLEM of the type, or null, [PROBLEM of each field, or null]], …]}; a PROBLEM is [WHAT, HINT].
"""

from __future__ import annotations

import json
import os
import sys
from typing import Any, Dict, List, Optional, Tuple

Problem = Optional[Tuple[str, str]]
WRITTEN = ("out", "request", "goal")


def run() -> None:
    """Read what is asked, and answer."""
    out = os.dup(1)
    os.dup2(2, 1)
    os.write(out, json.dumps(answer(json.load(sys.stdin))).encode())


def answer(given: Dict[str, Any]) -> Dict[str, Any]:
    """See above."""
    try:
        import actionlib  # noqa: F401
        import genmsg  # noqa: F401
        import genpy  # noqa: F401
        import rospy  # noqa: F401
    except Exception as error:  # noqa: BLE001 - a broken installation raises anything
        return {"missing": f"{type(error).__name__}: {error}"}
    from .messages import NoType, Types

    types = Types(given["messages"])
    found: List[Tuple[Problem, List[Problem]]] = []
    for asked in given["asked"]:
        try:
            parts = _parts(types, asked["kind"], asked["type"])
        except NoType as problem:
            found.append(((str(problem), problem.hint), [None] * len(asked["fields"])))
            continue
        served = asked["kind"] == "serves"
        found.append((None, [_problem(parts[part], path, _writes(part, served)) for part, path in asked["fields"]]))
    return {"found": found}


def _writes(part: str, served: bool) -> bool:
    """Whether the run gives the field its value."""
    return part == "response" if served else part in WRITTEN


def _parts(types: Any, kind: str, name: str) -> Dict[str, Any]:
    if kind == "topic":
        made = types.message(name)
        return {"in": made, "out": made}
    if kind == "action":
        action = types.action(name)()
        return {
            "goal": type(action.action_goal.goal), "result": type(action.action_result.result),
            "feedback": type(action.action_feedback.feedback),
        }  # fmt: skip
    made = types.service(name)
    return {"request": made._request_class, "response": made._response_class}


def _problem(message: Any, path: str, output: bool) -> Problem:
    from .fields import Field, NoField

    try:
        Field(message, path, output=output)
    except NoField as problem:
        return str(problem), problem.hint
    return None

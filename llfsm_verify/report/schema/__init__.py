"""The JSON Schemas (draft 2020-12) of what this package writes: results and tables of monitors."""

from __future__ import annotations

from typing import cast

from llfsm_verify.jsonschemas import loader

NAMES = ("result", "monitor", "lint", "query", "simulation")
OF_RESULT = ("lint", "query", "simulation")
"""Their files leave out what they share with `result`: the definitions SHARED."""
SHARED = ("failure", "diagnostic", "span", "sampled", "change", "cause", "step", "trace", "attempt", "proof", "inputs")


_plain = loader(__name__, *NAMES)


def load(name: str) -> dict[str, object]:
    """The schema called `name` (one of NAMES) as plain dictionaries; KeyError when there is none."""
    schema = _plain(name)
    if name in OF_RESULT:
        shared = cast(dict[str, object], load("result")["$defs"])
        own = cast(dict[str, object], schema["$defs"])
        schema["$defs"] = own | {key: shared[key] for key in SHARED}
    return schema

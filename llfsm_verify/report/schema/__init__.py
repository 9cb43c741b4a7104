"""The published JSON Schemas (draft 2020-12): all by their names, and those of what this package writes."""

from __future__ import annotations

from collections.abc import Callable
from typing import cast

from llfsm_verify.registry import Entry, Registry

NAMES = ("result", "monitor", "lint", "coverage", "query", "simulation", "knowledge")
OF_RESULT = ("lint", "coverage", "query", "simulation", "knowledge")
"""Their files leave out what they share with `result`: the definitions SHARED."""
SHARED = ("failure", "diagnostic", "span", "sampled", "change", "cause", "step", "trace", "attempt", "proof", "inputs")


def load(name: str) -> dict[str, object]:
    """The schema called `name` (one of NAMES) as plain dictionaries; KeyError: it has another name."""
    import json  # which `--help` does without, like the next
    from importlib.resources import files

    if name not in NAMES:
        raise KeyError(name)
    text = files(__name__).joinpath(f"{name}.schema.json").read_text(encoding="utf-8")
    schema = cast(dict[str, object], json.loads(text))
    if name in OF_RESULT:
        shared = cast(dict[str, object], load("result")["$defs"])
        own = cast(dict[str, object], schema["$defs"])
        schema["$defs"] = own | {key: shared[key] for key in SHARED}
    return schema


_WRITTEN_BY_PEOPLE, _WRITTEN_BY_US = "llfsm_verify.arrangement.keys:schema", "llfsm_verify.report.schema:load"
SCHEMAS: Registry[Callable[[str], dict[str, object]]] = Registry(
    "schema",
    [
        Entry("arrangement", _WRITTEN_BY_PEOPLE, "arrangement files"),
        Entry("machine", _WRITTEN_BY_PEOPLE, "machine files"),
        Entry("policy", _WRITTEN_BY_PEOPLE, "policy files, `access: {file: …}`"),
        Entry("ports", "llfsm_verify.runtime.ports.file:schema", "files of ports, `llfsm run --ports`"),
        Entry("trace", "llfsm_verify.verification.tracefile_fields:schema", "trace files"),
        Entry("result", _WRITTEN_BY_US, "`llfsm verify --format json`"),
        Entry("monitor", _WRITTEN_BY_US, "`llfsm monitor --as table`"),
        Entry("lint", _WRITTEN_BY_US, "`llfsm lint --format json`"),
        Entry("coverage", _WRITTEN_BY_US, "`llfsm coverage --format json`"),
        Entry("query", _WRITTEN_BY_US, "`llfsm query --format json`"),
        Entry("simulation", _WRITTEN_BY_US, "`llfsm simulate --format json`"),
        Entry("knowledge", _WRITTEN_BY_US, "`llfsm knowledge … --format json`"),
    ],
    "llfsm_verify.schemas",
)
"""Each is loaded by its name."""

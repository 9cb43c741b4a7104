"""The published JSON Schemas (draft 2020-12) by their names: of what people write, and of what this package writes."""

from __future__ import annotations

from collections.abc import Callable

from llfsm_verify.registry import Entry, Registry

_WRITTEN_BY_PEOPLE, _WRITTEN_BY_US = "llfsm_verify.arrangement.schema:load", "llfsm_verify.report.schema:load"
SCHEMAS: Registry[Callable[[str], dict[str, object]]] = Registry(
    "schema",
    [
        Entry("arrangement", _WRITTEN_BY_PEOPLE, "arrangement files"),
        Entry("machine", _WRITTEN_BY_PEOPLE, "machine files"),
        Entry("policy", _WRITTEN_BY_PEOPLE, "policy files, `access: {file: …}`"),
        Entry("ports", "llfsm_verify.runtime.ports.file:schema", "files of ports, `llfsm run --ports`"),
        Entry(
            "mapping",
            "llfsm_verify.runtime.deciding.logs.mapping:schema",
            "mappings of logs, `check-recording --mapping`",
        ),
        Entry("trace", "llfsm_verify.verification.trace_fields:schema", "trace files"),
        Entry("result", _WRITTEN_BY_US, "`llfsm verify --format json`"),
        Entry("monitor", _WRITTEN_BY_US, "`llfsm monitor --as table`"),
        Entry("lint", _WRITTEN_BY_US, "`llfsm lint --format json`"),
        Entry("query", _WRITTEN_BY_US, "`llfsm query --format json`"),
        Entry("simulation", _WRITTEN_BY_US, "`llfsm simulate --format json`"),
    ],
)
"""Each is loaded by its name."""

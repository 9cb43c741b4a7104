"""The JSON Schema (draft 2020-12) of mappings of logs."""

from __future__ import annotations

from llfsm_verify.jsonschemas import loader

load = loader(__name__, "mapping")

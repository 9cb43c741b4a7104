"""The JSON Schemas (draft 2020-12) of the files that people write: arrangements, machines and policies."""

from __future__ import annotations

from llfsm_verify.jsonschemas import loader

load = loader(__name__, "arrangement", "machine", "policy")

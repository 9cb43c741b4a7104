"""The JSON Schema (draft 2020-12) of files of ports."""

from __future__ import annotations

from llfsm_verify.jsonschemas import loader

load = loader(__name__, "ports")

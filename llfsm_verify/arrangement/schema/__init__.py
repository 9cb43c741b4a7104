"""The JSON Schemas (draft 2020-12) of the files that people write: arrangements, and machines and policies as parts."""

from __future__ import annotations

from typing import cast

from llfsm_verify.jsonschemas import loader
from llfsm_verify.yaml.fields import VERSION

Schema = dict[str, object]
_PARTS = {
    "machine": (
        "Machine of llfsm-verify",
        "A logic-labelled finite-state machine.",
        ("name", "type", "value", "variable", "transition", "state", "parameter", "suppressions"),
    ),
    "policy": ("Policy of llfsm-verify", "Who may do what in an arrangement (`access: {file: …}`).", ("name",)),
}
"""Of each part that may have a file of its own: title, description, and the definitions that it uses."""
_whole = loader(__name__, "arrangement")


def load(name: str) -> Schema:
    """The schema of `arrangement`, `machine` or `policy`; KeyError: it has another name."""
    if name not in _PARTS:
        return _whole(name)
    title, about, used = _PARTS[name]
    whole = _whole("arrangement")
    definitions = cast(dict[str, Schema], whole["$defs"])
    part = definitions[name]
    head = {"$schema": whole["$schema"], "$id": f"urn:llfsm-verify:{name}", "title": title, "description": about}
    version = {VERSION: cast(Schema, whole["properties"])[VERSION]}
    return {
        **head,
        **{key: value for key, value in part.items() if key != "description"},
        "properties": {**version, **cast(Schema, part["properties"])},
        "$defs": {key: definitions[key] for key in used},
    }

"""The JSON Schema (draft 2020-12) of mappings of logs."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import cast


def load(name: str) -> dict[str, object]:
    """The schema called `name` (mapping) as plain dictionaries; KeyError when there is none."""
    if name != "mapping":
        raise KeyError(name)
    text = files(__name__).joinpath(f"{name}.schema.json").read_text(encoding="utf-8")
    return cast(dict[str, object], json.loads(text))

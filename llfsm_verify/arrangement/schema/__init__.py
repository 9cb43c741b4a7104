"""The JSON Schemas (draft 2020-12) of the files that people write: arrangements and machines."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import cast


def load(name: str) -> dict[str, object]:
    """The schema called `name` (arrangement, machine) as plain dictionaries; KeyError when there is none."""
    if name not in ("arrangement", "machine"):
        raise KeyError(name)
    text = files(__name__).joinpath(f"{name}.schema.json").read_text(encoding="utf-8")
    return cast(dict[str, object], json.loads(text))

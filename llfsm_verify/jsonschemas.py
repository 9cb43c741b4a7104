"""JSON Schemas (draft 2020-12), each a file of this package."""

from __future__ import annotations

import json
from collections.abc import Callable
from importlib.resources import files
from typing import cast


def loader(package: str, *names: str) -> Callable[[str], dict[str, object]]:
    """A function that loads the schemas of these names in a package as dictionaries; KeyError: it has another name."""

    def load(name: str) -> dict[str, object]:
        if name not in names:
            raise KeyError(name)
        text = files(package).joinpath(f"{name}.schema.json").read_text(encoding="utf-8")
        return cast(dict[str, object], json.loads(text))

    return load

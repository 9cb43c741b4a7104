"""What tests need from outside the project, in one place: a test that lacks it is skipped, and says what it lacks.

With LLFSM_REQUIRE_ORACLES=1 it fails instead, so that no cross-check is left out unseen; with a list of names, such as
`spin,nusmv`, only for those. The folders of `FOLDERS` do not belong to the project: only a list can require them.
`python -m tools.oracles` prints the names, after it has got what can be got.
"""

from __future__ import annotations

import importlib
import os
from pathlib import Path
from types import ModuleType

import pytest

from tools import oracles

SHARED = Path(os.environ.get("LLFSM_SHARED", Path(__file__).resolve().parents[2] / "shared"))
FACTS = SHARED / "corpora" / "ltl" / "facts.tsv"
GOLDEN = Path(os.environ.get("LLFSM_GOLDEN", SHARED / "golden" / "clfsm"))
FOLDERS = {
    "shared": (FACTS, "LLFSM_SHARED names the folder of the corpora"),
    "golden": (GOLDEN, "LLFSM_GOLDEN names the folder of the golden traces"),
}
"""Data by name: a file or folder of it, and how one says where it is."""
VARIABLE = "LLFSM_REQUIRE_ORACLES"


def needs(*names: str) -> pytest.MarkDecorator:
    """Mark a test that compares with these. `tests/conftest.py` asks for them before it runs."""
    for name in names:
        _known(name)
    return pytest.mark.needs(*names)


def demand(*names: str) -> None:
    """Skip the test that runs, or fail it where they are required, if one of these is missing."""
    for name in names:
        reason = missing(name)
        if reason is None:
            continue
        if name in required(os.environ.get(VARIABLE, "")):
            pytest.fail(f"{reason}, and {VARIABLE} requires it", pytrace=False)
        pytest.skip(reason)


def load(name: str, module: str = "") -> ModuleType:
    """The module of an oracle that is a package, or a part of it, after demanding it."""
    demand(name)
    return importlib.import_module(module or oracles.MODULES[name])


def program(name: str) -> str:
    """The path of an oracle that is a program, after demanding it."""
    demand(name)
    found = oracles.find(name)
    assert found is not None
    return found


def missing(name: str) -> str | None:
    """Why it cannot be used; None: it can."""
    _known(name)
    if name in FOLDERS:
        path, where = FOLDERS[name]
        return None if path.exists() else f"{name}: no {path} ({where})"
    return None if oracles.find(name) is not None else f"{name} is not installed (`make oracles` does what it can)"


def required(said: str) -> frozenset[str]:
    """The names that must not be missing, from the value of LLFSM_REQUIRE_ORACLES. Raises ValueError for others."""
    if said in ("", "0"):
        return frozenset()
    if said == "1":
        return frozenset(oracles.NAMES)
    names = frozenset(name.strip() for name in said.split(",") if name.strip())
    for name in sorted(names):
        _known(name)
    return names


def _known(name: str) -> None:
    if name not in FOLDERS and name not in oracles.NAMES:
        raise ValueError(f"there is no oracle {name!r}; there are {', '.join((*oracles.NAMES, *FOLDERS))}")

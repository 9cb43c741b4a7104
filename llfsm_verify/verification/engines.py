"""The engines by the names that ``--engine`` knows them by; each is imported when it is asked for."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from importlib import import_module

from llfsm_verify.checking.verdict import Engine

_ENTRIES = {
    "auto": "llfsm_verify.verification.portfolio:auto",
    "explicit": "llfsm_verify.engines.explicit.engine:ExplicitEngine",
    "bmc": "llfsm_verify.engines.bounded.engine:BoundedEngine",
    "induction": "llfsm_verify.engines.inductive.engine:induction",
    "pdr": "llfsm_verify.engines.inductive.engine:pdr",
    "all": "llfsm_verify.verification.differential:AllEngines",
}


def _made(entry: str) -> Engine:
    """What the callable at `entry` (``module:name``) makes."""
    module, _, name = entry.partition(":")
    engine: Engine = getattr(import_module(module), name)()
    return engine


ENGINES: Mapping[str, Callable[[], Engine]] = {name: partial(_made, entry) for name, entry in _ENTRIES.items()}
"""What makes an engine, by name."""

"""The engines, by the names that ``--engine`` knows them by."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from llfsm_verify.registry import Entry, Registry

if TYPE_CHECKING:
    from llfsm_verify.checking.verdict import Engine

ENGINES: Registry[Callable[[], Engine]] = Registry(
    "engine",
    [
        Entry("auto", "llfsm_verify.verification.portfolio:auto", "each of the next four in turn"),
        Entry("explicit", "llfsm_verify.engines.explicit.engine:ExplicitEngine", "all configurations, one by one"),
        Entry("bmc", "llfsm_verify.engines.bounded.engine:BoundedEngine", "runs of growing length, by Z3"),
        Entry("induction", "llfsm_verify.engines.inductive.engine:induction", "k-induction, by Z3"),
        Entry("pdr", "llfsm_verify.engines.inductive.engine:pdr", "property-directed reachability, by Z3's Spacer"),
        Entry("all", "llfsm_verify.verification.differential:AllEngines", "the same four, which have to agree"),
    ],
)
"""What makes an engine."""

DEFAULT_ENGINE = "auto"
"""The engine that is asked unless somebody names one: on the command line, in Python and in tests."""

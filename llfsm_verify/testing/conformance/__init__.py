"""Conformance suites for engines and executors of others, and for ours (docs/engines.md).

- `check_engine(entry)`: an `Outcome` a case; `engine_cases(entry)`: the cases, to be run one by one
- `check_executor(make)`, `executor_cases(make)`: the same for executors of step programs
- `Delegate`: a session that leaves everything to another one
"""

from __future__ import annotations

from llfsm_verify.testing.conformance.engines import Delegate, check_engine, engine_cases
from llfsm_verify.testing.conformance.executors import (
    Executor,
    Native,
    Reference,
    Step,
    check_executor,
    executor_cases,
)
from llfsm_verify.testing.conformance.outcome import Case, Outcome

__all__ = [
    "Case",
    "Delegate",
    "Executor",
    "Native",
    "Outcome",
    "Reference",
    "Step",
    "check_engine",
    "check_executor",
    "engine_cases",
    "executor_cases",
]

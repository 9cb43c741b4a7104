"""Conformance suites for what others add, and for what is ours (docs/plugs.md, examples/engine/).

- `check_engine(entry)`: an `Outcome` a case; `engine_cases(entry)`: the cases, to be run one by one
- `check_executor(make)`, `executor_cases(make)`: the same for executors of step programs
- `port_cases`, `reader_cases`, `writer_cases`, `log_cases`, `timeline_cases`, `drawing_cases`, `report_cases`,
  `target_cases`, `scheduler_cases`: those of the other plugs
- `Delegate`: a session that leaves everything to another one
"""

from __future__ import annotations

from llfsm_verify.testing.conformance.engines import Delegate, check_engine, engine_cases
from llfsm_verify.testing.conformance.executors import Executor, Native, Reference, Step, check_executor, executor_cases
from llfsm_verify.testing.conformance.outcome import Case, Outcome
from llfsm_verify.testing.conformance.plugs import (
    drawing_cases,
    log_cases,
    reader_cases,
    report_cases,
    timeline_cases,
    writer_cases,
)
from llfsm_verify.testing.conformance.ports import port_cases
from llfsm_verify.testing.conformance.schedulers import scheduler_cases
from llfsm_verify.testing.conformance.targets import target_cases

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
    "drawing_cases",
    "engine_cases",
    "executor_cases",
    "log_cases",
    "port_cases",
    "reader_cases",
    "report_cases",
    "scheduler_cases",
    "target_cases",
    "timeline_cases",
    "writer_cases",
]

"""Saving the run that fails a check, as a trace file that goes on failing until the model is mended."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.verdict import FaultResult, Result
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.report.saving import trace_documents
from llfsm_verify.testing.pytest_plugin.session import session_of
from llfsm_verify.testing.pytest_plugin.texts import SAVE
from llfsm_verify.testing.saving import keep_trace

if TYPE_CHECKING:
    import pytest


def save_failure(
    result: Result,
    arrangement: Arrangement,
    properties: PropertySet,
    violated: frozenset[str],
    request: pytest.FixtureRequest,
    *,
    faults: bool,
) -> list[str]:
    """Save the traces that were not expected where `--llfsm-save` or the ini key says; a line about each.

    A failure that a file of that name already shows is not saved a second time; another one gets a name with a number.
    Raises DiagnosticError (E405).
    """
    named = str(request.config.getoption(SAVE) or request.config.getini(SAVE))
    items = tuple(item for item in result.properties if item.trace is not None and item.name not in violated)
    unexpected = replace(result, properties=items, faults=result.faults if faults else _none(result.faults))
    if not named or not (items or unexpected.faults.findings):
        return []
    if not Path(arrangement.path).is_file():
        return ["no trace saved: the arrangement does not come from a file"]
    if _is_expected(request):
        return ["no trace saved: the test is marked xfail, and a saved run would fail by itself"]
    directory = Path(request.path).parent / named
    load = session_of(request.config).arrangement
    lines = []
    for name, what, text in trace_documents(unexpected, arrangement, properties, directory, "holds"):
        path, new = keep_trace(directory, name, what, text, arrangement, load)
        lines.append(f"trace saved{'' if new else ' before'}: {path}")
    return lines


def _is_expected(request: pytest.FixtureRequest) -> bool:
    """Whether a mark says that the test fails: not where its condition is a value that is false."""
    conditions = [mark.args or (mark.kwargs.get("condition", True),) for mark in request.node.iter_markers("xfail")]
    return not request.config.getoption("runxfail", default=False) and any(any(each) for each in conditions)


def _none(faults: FaultResult) -> FaultResult:
    return replace(faults, findings=())

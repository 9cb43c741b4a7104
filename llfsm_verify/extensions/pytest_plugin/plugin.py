"""The pytest plugin: trace files as tests, and fixtures that check and step an arrangement.

Every pytest run of those who have installed us imports this module, so it imports pytest and nothing heavy: the rest
of the package comes in with the first fixture or trace that is used. It has no assertions for pytest to rewrite
(PYTEST_DONT_REWRITE): else pytest would warn where we have been imported before it.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from llfsm_verify.extensions.pytest_plugin.items import ANSWER, TraceTests
from llfsm_verify.extensions.pytest_plugin.texts import MARKER, SAVE, SUFFIX, UPDATE

if TYPE_CHECKING:
    from llfsm_verify import Simulation
    from llfsm_verify.extensions.pytest_plugin.checks import Check
    from llfsm_verify.plug import Arrangement
    from llfsm_verify.testing.stretches import Wrapper

__all__ = ["TraceTests"]


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("llfsm", "arrangements of logic-labelled finite-state machines")
    group.addoption(
        "--llfsm-save", dest=SAVE, metavar="DIR", help="save the run that fails a `check` as DIR/NAME.trace.yaml; "
        "a relative DIR is taken from the folder of the test file"
    )  # fmt: skip
    group.addoption(
        "--llfsm-update", dest=UPDATE, action="store_true", default=False,
        help="rewrite `expect:` and the digest of trace files to what is found",
    )  # fmt: skip
    parser.addini(MARKER, "the arrangement of the fixtures, relative to the folder of this file", default="")
    parser.addini(SAVE, "where --llfsm-save saves when it is not given", default="")


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line(
        "markers", f"{MARKER}(path): the arrangement of the fixtures, relative to the folder of the test file"
    )


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> TraceTests | None:
    if not file_path.name.endswith(SUFFIX):
        return None
    collector: TraceTests = TraceTests.from_parent(parent, path=file_path)
    return collector


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    told = [
        str(text)
        for reports in terminalreporter.stats.values()
        for report in reports
        if isinstance(report, pytest.TestReport) and report.when == "call"
        for key, text in report.user_properties
        if key == ANSWER
    ]
    if told:
        terminalreporter.section("llfsm")
        for text in told:
            terminalreporter.write_line(text)


@pytest.fixture
def arrangement(request: pytest.FixtureRequest) -> Arrangement:
    """The arrangement that the marker `llfsm_arrangement`, or the ini key of that name, names; else the only
    `arrangement.yaml` near the test file."""
    from llfsm_verify.extensions.pytest_plugin.session import arrangement_of, session_of, without_traceback

    with without_traceback(request.config):
        return session_of(request.config).arrangement(arrangement_of(request.node, request.config))


@pytest.fixture
def load_arrangement(request: pytest.FixtureRequest) -> Callable[[str | Path], Arrangement]:
    """`load_arrangement(path)`: another arrangement; a relative path is taken from the folder of the test file."""
    from llfsm_verify.extensions.pytest_plugin.session import session_of, without_traceback

    def load(path: str | Path) -> Arrangement:
        __tracebackhide__ = True
        with without_traceback(request.config):
            return session_of(request.config).arrangement(request.path.parent / path)

    return load


@pytest.fixture
def simulation(request: pytest.FixtureRequest, arrangement: Arrangement | Wrapper) -> Simulation:
    """`arrangement`, ready for its first step; inputs that a step is not given have their lowest values."""
    from llfsm_verify.extensions.pytest_plugin.session import session_of, without_traceback
    from llfsm_verify.testing.stretches import unwrap

    with without_traceback(request.config):
        return session_of(request.config).simulation(unwrap(arrangement))


@pytest.fixture
def check(request: pytest.FixtureRequest) -> Check:
    """`check.holds(…)`, `check.violated(…)`, `check.file(…)`, of the fixture `arrangement` or that of `check.on(…)`."""
    from llfsm_verify.extensions.pytest_plugin.checks import Check

    return Check(request)

"""A pytest plugin that runs the tests of a plan, in its order and within its limits, and keeps a journal of them.

The plan is the JSON file that MUTANTS_PLAN names:

    journal  the file to write: a line of JSON when a test starts and when it ends
    tests    the tests to run, in this order; null: all that are collected
    kinds    which kinds of tests to run: quick, slow, long
    without  tests that are left out
    spent    so much processor time, in seconds, is spent on tests; then no further one starts
    slack    a test that takes this many seconds of processor time ...
    factor   ... and this many times what it took on the unmutated source (`usual`) is ended, and pytest with it
    memory   bytes that a process may map (only with limits)

Under `coverage run` every line is recorded with the test that ran it, by processes that a test starts as well.
"""

from __future__ import annotations

import json
import os
import resource
import signal
import sys
from collections.abc import Generator
from pathlib import Path
from typing import Any

import pytest

PLAN = "MUTANTS_PLAN"
TEST = "MUTANTS_TEST"
"""Names the test for the coverage of the processes that it starts."""


def pytest_configure(config: pytest.Config) -> None:
    plan = json.loads(Path(os.environ.pop(PLAN)).read_text())
    if "memory" in plan:
        resource.setrlimit(resource.RLIMIT_AS, (plan["memory"], resource.getrlimit(resource.RLIMIT_AS)[1]))
        _fail_fast()
    config.pluginmanager.register(Steering(plan), "steering of a mutant's tests")


class Steering:
    def __init__(self, plan: dict[str, Any]) -> None:
        self.plan = plan
        self.journal = Path(plan["journal"]).open("a", encoding="utf-8")  # noqa: SIM115 -- as long as pytest runs
        self.failure: str | None = None
        self.skipped = False
        self.coverage = None
        if "coverage" in sys.modules:
            import coverage

            self.coverage = coverage.Coverage.current()
        if self.coverage is not None:
            os.environ["COVERAGE_PROCESS_START"] = plan["coverage"]
            os.register_at_fork(after_in_child=_go_on_recording)

    def write(self, **entry: Any) -> None:
        self.journal.write(json.dumps(entry) + "\n")
        self.journal.flush()

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, config: pytest.Config, items: list[pytest.Item]) -> None:
        order = None if self.plan["tests"] is None else {name: i for i, name in enumerate(self.plan["tests"])}
        left_out = [
            item
            for item in items
            if (order is not None and item.nodeid not in order)
            or kind(item) not in self.plan["kinds"]
            or item.nodeid in self.plan.get("without", ())
        ]
        gone = set(left_out)
        items[:] = [item for item in items if item not in gone]
        if order is not None:
            items.sort(key=lambda item: order[item.nodeid])
        config.hook.pytest_deselected(items=left_out)

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        self.write(package=_package_file(), collected=len(session.items))

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, Any, Any]:
        self.failure, self.skipped, start = None, False, processor_time()
        self.write(start=item.nodeid)
        os.environ[TEST] = item.nodeid
        if self.coverage is not None:
            self.coverage.switch_context(item.nodeid)
        else:
            limit = self.plan["slack"] + self.plan["factor"] * self.plan["usual"].get(item.nodeid, 1)
            signal.setitimer(signal.ITIMER_PROF, limit)
        try:
            return (yield)
        finally:
            if self.coverage is not None:
                self.coverage.switch_context("")
            else:
                signal.setitimer(signal.ITIMER_PROF, 0)
            seconds = round(processor_time() - start, 3)
            self.write(end=item.nodeid, failure=self.failure, skipped=self.skipped, kind=kind(item), seconds=seconds)
            if processor_time() > self.plan["spent"]:
                self.write(stopped=True)
                item.session.shouldstop = "the time for this mutant is spent"

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self.skipped = self.skipped or (report.when != "teardown" and report.skipped)
        if report.failed and self.failure is None:
            crash = getattr(report.longrepr, "reprcrash", None)
            text = str(report.longrepr) if crash is None else crash.message
            self.failure = next((line.strip() for line in text.splitlines() if line.strip()), "failed")


def kind(item: pytest.Item) -> str:
    """A test of `make check` is quick, another one of `make test` slow, one of `make test-slow` long."""
    return next((name for name in ("long", "slow") if item.get_closest_marker(name) is not None), "quick")


def _go_on_recording() -> None:
    """In a forked process coverage.py has begun anew and knows of no test."""
    import coverage

    current, test = coverage.Coverage.current(), os.environ.get(TEST)
    if current is not None and test:
        current.switch_context(test)


def _fail_fast() -> None:
    """Hypothesis does not explain failures, which takes long, in test modules imported from now on."""
    from hypothesis import Phase, settings

    phases = [phase for phase in Phase if phase is not Phase.explain]
    settings.register_profile("mutants", settings.get_profile(settings.get_current_profile_name()), phases=phases)
    settings.load_profile("mutants")


def processor_time() -> float:
    """Seconds of processor time of this process and of those that it started and that ended."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def _package_file() -> str | None:
    """Where the package under test was imported from."""
    package = sys.modules.get(os.environ.get("MUTANTS_PACKAGE", ""))
    return None if package is None else str(package.__file__)

"""Random tests draw the same examples in every run, so that a red run speaks of the change under test.

`make fuzz`, or LLFSM_FRESH=1, draws fresh ones.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator

import pytest
from hypothesis import Phase, settings

from tests import outside
from tests.quick import FRESH, QUICK

# Explaining a failure takes longer than finding it: `make check` only says that there is one.
PHASES = [phase for phase in Phase if phase is not Phase.explain or not QUICK]
settings.register_profile("repeatable", derandomize=True, deadline=None, phases=PHASES)
settings.register_profile("fresh", deadline=None, phases=PHASES)
settings.load_profile("fresh" if FRESH else "repeatable")

outside.required(os.environ.get(outside.VARIABLE, ""))  # a name that is not known ends the run


def pytest_runtest_setup(item):
    for mark in item.iter_markers("needs"):
        outside.demand(*mark.args)


# Workers of pytest-xdist have it, and our tables would fit themselves to it.
os.environ.pop("COLUMNS", None)


@pytest.fixture(scope="session", autouse=True)
def as_at_a_terminal():
    """pytest, run by our tests, prints a failure a second time in its summary where these are set."""
    with pytest.MonkeyPatch.context() as patched:
        for name in ("CI", "BUILD_NUMBER"):
            patched.delenv(name, raising=False)
        yield


@pytest.fixture(autouse=True)
def interrupts_are_served() -> Iterator[None]:
    """Ctrl-C is served as at a terminal, also where pytest was started with it ignored (`nohup … &`).

    Programs that a test starts inherit what is ignored, but no handler. A test leaves the handler as it found it.
    """
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    assert signal.signal(signal.SIGINT, before) is signal.default_int_handler

"""Random tests draw the same examples in every run, so that a red run speaks of the change under test.

`make fuzz`, or LLFSM_FRESH=1, draws fresh ones.
"""

from __future__ import annotations

import os

import pytest
from hypothesis import settings

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.register_profile("fresh", deadline=None)
settings.load_profile("fresh" if os.environ.get("LLFSM_FRESH") == "1" else "repeatable")

# Workers of pytest-xdist have it, and our tables would fit themselves to it.
os.environ.pop("COLUMNS", None)


@pytest.fixture(scope="session", autouse=True)
def as_at_a_terminal():
    """pytest, run by our tests, prints a failure a second time in its summary where these are set."""
    with pytest.MonkeyPatch.context() as patched:
        for name in ("CI", "BUILD_NUMBER"):
            patched.delenv(name, raising=False)
        yield

"""Random tests draw the same examples in every run, so that a red run speaks of the change under test.

`make soak`, or LLFSM_FRESH=1, draws fresh ones.
"""

from __future__ import annotations

import os
import signal
import sys
import tempfile
from collections.abc import Callable, Iterator
from types import FrameType

import pytest
from hypothesis import Phase, settings
from hypothesis.internal.conjecture import providers

from tests import outside
from tests.last_words import LastWords
from tests.quick import FRESH, QUICK

# Explaining a failure takes longer than finding it: `make check` only says that there is one.
PHASES = [phase for phase in Phase if phase is not Phase.explain or not QUICK]
settings.register_profile("repeatable", derandomize=True, deadline=None, phases=PHASES)
settings.register_profile("fresh", deadline=None, phases=PHASES)
settings.load_profile("fresh" if FRESH else "repeatable")
if not FRESH:
    # Hypothesis draws constants of our own modules, too, as far as they are imported: examples would change with each
    # change of the source, and with the order in which workers run tests.
    providers._get_local_constants = providers.Constants

outside.required(os.environ.get(outside.VARIABLE, ""))  # a name that is not known ends the run


def pytest_configure(config):
    config.pluginmanager.register(LastWords(config))


def pytest_runtest_setup(item):
    for mark in item.iter_markers("needs"):
        outside.demand(*mark.args)


# Workers of pytest-xdist have it, and our tables would fit themselves to it.
os.environ.pop("COLUMNS", None)


@pytest.fixture(scope="session", autouse=True)
def as_at_a_terminal():
    """pytest, run by our tests, prints a failure a second time in its summary where these are set.

    Python, run by our tests, writes no bytecode: where a test limits the size of files, others would read parts of it.
    pytest, run by our tests, leaves out plugins that what we compare with brings: they stumble over items of others.
    Whiteboards are found in a folder of these tests alone: runs that were killed leave their names behind.
    """
    with tempfile.TemporaryDirectory(prefix="llfsm-") as boards, pytest.MonkeyPatch.context() as patched:
        patched.setenv("LLFSM_WHITEBOARDS", boards)
        patched.setenv("PYTHONDONTWRITEBYTECODE", "1")
        for name in ("CI", "BUILD_NUMBER"):
            patched.delenv(name, raising=False)
        patched.setenv("PYTEST_ADDOPTS", "-p no:asyncio -p no:pytest-lsp")
        yield


@pytest.fixture(autouse=True)
def signals_are_served() -> Iterator[None]:
    """Signals are served as at a terminal, also where pytest was started with some ignored (`nohup … &`).

    Programs that a test starts inherit what is ignored, but no handler. A test leaves the handlers as it found them.
    """
    handlers: dict[signal.Signals, Callable[[int, FrameType | None], object]]
    handlers = {signal.SIGINT: signal.default_int_handler}
    for name in ("SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is signal.SIG_IGN:
            handlers[number] = _ignore
    before = {number: signal.signal(number, handler) for number, handler in handlers.items()}
    handlers[signal.SIGPIPE] = signal.getsignal(signal.SIGPIPE)
    before[signal.SIGPIPE] = handlers[signal.SIGPIPE]
    yield
    left = {number: signal.signal(number, handler) for number, handler in before.items()}
    assert left == handlers


@pytest.fixture(autouse=True)
def nothing_was_asked_before(monkeypatch: pytest.MonkeyPatch) -> None:
    """Z3's main context is new in each test: what is found there depends on what was asked before."""
    if "z3.z3" in sys.modules:
        monkeypatch.setattr(sys.modules["z3.z3"], "_main_ctx", None)
        contexts = sys.modules.get("llfsm_verify.backends.smt")
        if contexts is not None:
            contexts.tolerant_main()


def _ignore(_number: int, _frame: FrameType | None) -> None:
    pass

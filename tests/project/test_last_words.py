"""A worker that dies says how, and where it was."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.last_words import ended

ROOT = Path(__file__).parents[2]
CONFTEST = """
from tests.last_words import LastWords

def pytest_configure(config):
    config.pluginmanager.register(LastWords(config))
"""
DYING = """
import ctypes, os

import pytest

pytest_plugins = "pytester"

def test_within(pytester, worker_id):  # from here on the stacks that pytest has written are lost
    pytester.makepyfile(**{f"test_{worker_id}": "def test_it(): pass"})
    pytester.runpytest_inprocess("-p", "no:xdist").assert_outcomes(passed=1)

def test_wrong_address():
    ctypes.string_at(8)

def test_leaves():
    os._exit(130)

def test_lives():
    pass
"""


@pytest.mark.slow
def test_how_workers_died_is_printed(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    pytester.makeconftest(CONFTEST)
    pytester.makepyfile(test_dying=DYING)
    done = pytester.runpytest_subprocess("-p", "xdist", "-n", "1", "-p", "no:cacheprovider", "test_dying.py")
    done.assert_outcomes(passed=2, failed=2)
    parts = re.split(r"=+ last words of worker (gw\d) =+\n", done.stdout.str())
    assert parts[1::2] == ["gw0", "gw1"]
    wrong, leaves = parts[2::2]
    assert "was ended by SIGSEGV" in wrong and "in test_wrong_address" in wrong
    assert "has ended with exit code 130" in leaves and "it left no stacks" in leaves


def test_how_a_process_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as process:
        monkeypatch.setattr("tests.last_words.PATIENCE", 0.0)
        assert ended(process) == f"{process.pid} still runs"
        monkeypatch.setattr("tests.last_words.PATIENCE", None)
        process.communicate(b"\n")
        assert ended(process) == f"{process.pid} has ended with exit code 0"

"""Searches run here: their kernels are compiled beforehand."""

from __future__ import annotations

import pytest

from tests.extensions.pytest_plugin.preloaded import PRELOADED
from tests.warm import compiled_kernels

__all__ = ["PRELOADED", "compiled_kernels"]

DOOR = """name: door
whiteboard:
  button: {type: bool, init: false, role: input}
  locked: {type: bool, init: false, role: input}
machines:
  m: {file: door.machine.yaml}
schedule: [m]
"""
MACHINE = """machine: Door
states:
  - name: SHUT
    transitions:
      - {when: button, to: OPEN}
  - name: OPEN
    transitions:
      - {when: not button, to: SHUT}
"""


@pytest.fixture
def project(pytester, monkeypatch):
    """A folder with the arrangement of a door, where pytest runs with our plugin and no other."""
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    monkeypatch.setenv("PYTEST_PLUGINS", "llfsm_verify.extensions.pytest_plugin.plugin")
    pytester.path.joinpath("arrangement.yaml").write_text(DOOR)
    pytester.path.joinpath("door.machine.yaml").write_text(MACHINE)
    return pytester

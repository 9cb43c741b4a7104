"""Kernels that every check needs are compiled beforehand: what else a command says on standard error is looked at."""

from __future__ import annotations

import pytest

from tests.cli.running import FAULTY, LIGHTS, PROPERTIES, llfsm


@pytest.fixture(scope="session", autouse=True)
def compiled_kernels() -> None:
    for model in (LIGHTS, FAULTY):
        llfsm("verify", model, PROPERTIES, "-q")

"""Kernels are compiled beforehand: pages show what a command says, and not that it compiles."""

from __future__ import annotations

import pytest

from llfsm_verify.kripke.compiled import kernels


@pytest.fixture(scope="session", autouse=True)
def compiled_kernels() -> None:
    kernels().load_all()

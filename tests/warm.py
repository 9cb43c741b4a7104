"""Kernels compiled beforehand, for tests that look at what a command says: a first run says that it compiles."""

from __future__ import annotations

import pytest

from llfsm_verify.kripke.compiled import kernels

__all__ = ["compiled_kernels"]


@pytest.fixture(scope="session", autouse=True)
def compiled_kernels() -> None:
    kernels().load_all()

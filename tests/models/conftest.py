"""Kernels are compiled beforehand: a first run says that it compiles."""

from __future__ import annotations

import pytest

from llfsm_verify.kripke.compiled import kernels


@pytest.fixture(scope="session", autouse=True)
def compiled_kernels() -> None:
    kernels().load_all()

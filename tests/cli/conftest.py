"""Kernels are compiled beforehand: what else a command says on standard error is looked at."""

from __future__ import annotations

import pytest

from llfsm_verify.kripke.compiled import kernels


@pytest.fixture(scope="session", autouse=True)
def compiled_kernels() -> None:
    kernels().load_all()

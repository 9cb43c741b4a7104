"""The ring's counts, on which SPIN, NuSMV, TLC and a Python search agree but for the first configurations."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

from llfsm_verify.checking.verdict import Options, Verdict

spec = importlib.util.spec_from_file_location("ring", Path(__file__).parents[3] / "benchmarks" / "ring.py")
assert spec is not None
assert spec.loader is not None
benchmark = importlib.util.module_from_spec(spec)
spec.loader.exec_module(benchmark)

SERVED = """
a: G (m0@OFF -> F m0@ON)
b: G (m0@OFF -> F (m0@ON || !m2@OFF))
apart: G !(m0@ON && m1@ON && m2@ON)
"""


@pytest.mark.parametrize(
    ("size", "modulus", "count"),
    [
        (3, 2, 507),
        (4, 3, 17_826),
        pytest.param(5, 3, 174_971, marks=pytest.mark.slow),
        pytest.param(6, 3, 1_649_017, marks=pytest.mark.slow),
    ],
)
def test_counts_with_all_bits_kept(check, size: int, modulus: int, count: int) -> None:
    result = check(benchmark.ring(size, modulus), "", Options(keep_all_bits=True))
    assert (result.exploration.states, result.complete, result.faults.verdict) == (count, True, Verdict.HOLDS)


@pytest.mark.parametrize("keep_all_bits", [False, True])
def test_dead_bits_change_counts_but_no_verdict(check, keep_all_bits: bool) -> None:
    result = check(benchmark.ring(3, 2), SERVED, Options(keep_all_bits=keep_all_bits))
    assert result.exploration.states == (507 if keep_all_bits else 216)
    assert [p.verdict.value for p in result.properties] == ["violated", "violated", "holds"]

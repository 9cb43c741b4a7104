"""How many random examples a test draws.

Tests that are not `long`: all in `make test`, a quarter in `make check`, which sets LLFSM_QUICK. The long ones: all in
`make soak`, which sets LLFSM_FRESH, a tenth in `make test-slow`.
"""

from __future__ import annotations

import os

QUICK = os.environ.get("LLFSM_QUICK") == "1"
FRESH = os.environ.get("LLFSM_FRESH") == "1"


def examples(full: int) -> int:
    """`full`, or what of it `make check` has time for."""
    return min(full, max(4, full // 4)) if QUICK else full


def many(full: int) -> int:
    """`full`, or what of it `make test-slow` has time for."""
    return full if FRESH else full // 10

"""How many random examples a test draws: all in `make test`, a quarter in `make check`, which sets LLFSM_QUICK."""

from __future__ import annotations

import os

QUICK = os.environ.get("LLFSM_QUICK") == "1"


def examples(full: int) -> int:
    """`full`, or what of it `make check` has time for."""
    return min(full, max(8, full // 4)) if QUICK else full

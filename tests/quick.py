"""How many random examples a test draws.

Fast tests: all in `make test`, a quarter in `make check`, which sets LLFSM_QUICK. The longest slow tests: all in
`make fuzz`, which sets LLFSM_FRESH, a tenth elsewhere.
"""

from __future__ import annotations

import os

QUICK = os.environ.get("LLFSM_QUICK") == "1"
FRESH = os.environ.get("LLFSM_FRESH") == "1"


def examples(full: int) -> int:
    """`full`, or what of it `make check` has time for."""
    return min(full, max(4, full // 4)) if QUICK else full


def many(full: int) -> int:
    """`full`, or what of it `make test` has time for."""
    return full if FRESH else full // 10

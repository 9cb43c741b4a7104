"""How many random examples a test draws.

Tests that are not `long`: all in `make test`, a quarter in `make check`, which sets LLFSM_QUICK. The long ones: all in
`make soak`, which sets LLFSM_FRESH, a tenth in `make test-slow`.
"""

from __future__ import annotations

import os
from collections.abc import Callable

from hypothesis import given, seed, settings
from hypothesis import strategies as st

BATCH = 25
"""Examples that are drawn from one seed."""

QUICK = os.environ.get("LLFSM_QUICK") == "1"
FRESH = os.environ.get("LLFSM_FRESH") == "1"


def examples(full: int) -> int:
    """`full`, or what of it `make check` has time for."""
    return min(full, max(4, full // 4)) if QUICK else full


def many(full: int) -> int:
    """`full`, or what of it `make test-slow` has time for."""
    return full if FRESH else full // 10


def spread(
    test: Callable[..., None], amount: settings, *strategies: st.SearchStrategy[object], size: int = BATCH
) -> None:
    """Run `test` on `amount.max_examples` examples, in batches from seeds of their own, but fresh ones.

    From one seed Hypothesis stays near where it began, so that whole kinds of examples may not come.
    """
    for number, done in enumerate(range(0, amount.max_examples, size)):
        batch = settings(amount, max_examples=min(size, amount.max_examples - done))

        @batch
        @given(st.tuples(*strategies))
        def drawn(values: tuple[object, ...]) -> None:
            test(*values)

        (drawn if FRESH else seed(number)(drawn))()

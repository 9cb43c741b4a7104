"""How many random examples a test draws.

All in `make soak`, which sets LLFSM_FRESH. Elsewhere a quarter of them, and in `long` tests a twentieth.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping

from hypothesis import given, seed, settings
from hypothesis import strategies as st

BATCH = 25
"""Examples that are drawn from one seed."""
MORE_BATCHES = 30

QUICK = os.environ.get("LLFSM_QUICK") == "1"
FRESH = os.environ.get("LLFSM_FRESH") == "1"


def examples(full: int) -> int:
    """`full`, or what of it `make test` has time for."""
    return full if FRESH else min(full, max(4, full // 4))


def many(full: int) -> int:
    """`full`, or what of it `make test-slow` has time for."""
    return full if FRESH else full // 20


def share(number: int, of: int) -> bool:
    """Whether what has this number is tried: all in `make soak`, else one of `of`."""
    return FRESH or number % of == 0


class AtLeast:
    """Whether a tally has so many of each kind."""

    def __init__(self, tally: Mapping[str, float], least: Mapping[str, float]) -> None:
        self.tally = tally
        self.least = least

    def __call__(self) -> bool:
        return all(self.tally.get(kind, 0) >= number for kind, number in self.least.items())

    def __repr__(self) -> str:
        return f"at least {dict(self.least)} of {dict(self.tally)}"


def each(tally: Mapping[str, float], kinds: Iterable[str]) -> AtLeast:
    """Whether a tally has one of each kind."""
    return AtLeast(tally, dict.fromkeys(kinds, 1))


def spread(
    test: Callable[..., None],
    amount: settings,
    *strategies: st.SearchStrategy[object],
    size: int = BATCH,
    until: Callable[[], bool] | None = None,
) -> None:
    """Run `test` on `amount.max_examples` examples, in batches from seeds of their own, but fresh ones; then on more
    batches `until` what has to be met is met. After 30 more it fails.

    From one seed Hypothesis stays near where it began, so that whole kinds of examples may not come.
    """
    planned = range(0, amount.max_examples, size)
    for number in range(len(planned) + MORE_BATCHES):
        if number >= len(planned) and (until is None or until()):
            break
        left = amount.max_examples - number * size
        batch = settings(amount, max_examples=min(size, left) if left > 0 else size)

        @batch
        @given(st.tuples(*strategies))
        def drawn(values: tuple[object, ...]) -> None:
            test(*values)

        (drawn if FRESH else seed(number)(drawn))()
    assert until is None or until(), until

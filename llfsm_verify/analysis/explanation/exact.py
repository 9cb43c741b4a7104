"""Few marks are tried out: those of them that are causes by the definition stay."""

from __future__ import annotations

from llfsm_verify.analysis.explanation.causes import Pair, causes
from llfsm_verify.analysis.explanation.readings import Reading

EFFORT = 400_000
"""Truth values of subformulas at letters that are computed for it (some tenths of a second)."""


def exact_causes(reading: Reading) -> tuple[frozenset[Pair], bool]:
    """`causes` of the whole formula, and whether those that are none have been taken out.

    All contingencies are sets of causes, so sets of marks are enough: a mark is a cause when some set of others leaves
    the formula false, and no longer with it.
    """
    marks = sorted(causes(reading))
    if reading.size << len(marks) > EFFORT:
        return frozenset(marks), False
    false = [
        reading.fails_with([m for i, m in enumerate(marks) if chosen >> i & 1]) for chosen in range(1 << len(marks))
    ]
    kept = (
        mark
        for i, mark in enumerate(marks)
        if any(false[s] and not false[s | 1 << i] for s in range(len(false)) if not s >> i & 1)
    )
    return frozenset(kept), True

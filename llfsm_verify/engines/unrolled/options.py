"""What engines that look at runs of growing length can be told beside what all engines are."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class UnrolledOptions:
    """One of `Options.own`."""

    depth: int | None = None
    """Steps up to which runs are looked at, and of provers what they call depth; None: as many as the engine says."""

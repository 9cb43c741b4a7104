"""What engines that look at runs of growing length can be told beside what all engines are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, TypedDict

from llfsm_verify.checking.engine_option import COUNT, EngineOption, EngineOptions


class UnrolledKeywords(TypedDict, total=False):
    """The options as keywords of Python."""

    depth: int | None
    """Steps up to which engines look at runs that do not explore all configurations."""


@dataclass(frozen=True, slots=True)
class UnrolledOptions(EngineOptions):
    """One of `Options.own`."""

    OPTIONS: ClassVar[tuple[EngineOption, ...]] = (
        EngineOption(
            "depth", "--depth", kind=COUNT,
            help="how far bmc (60 steps), induction (k 30) and pdr (1000 frames) go",
        ),
    )  # fmt: skip

    depth: int | None = None
    """Steps up to which runs are looked at, and of provers what they call depth; None: as many as the engine says."""

"""What a tool answered and what it took, and the medians of several such measurements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import median


class Wrong(Exception):
    """A tool's answer is not the one that is known to be right, or it gave none; the message says what came instead."""


@dataclass(frozen=True, slots=True)
class Measurement:
    """One tool on one task. Times in seconds; processor time is user and system."""

    tool: str
    states: int
    """0: it did not count all of them, because it proved what was asked."""
    transitions: int
    verdicts: Mapping[str, str]
    whole_wall: float
    whole_cpu: float
    """From the shell to the answer to all questions, what is built before included."""
    search_wall: float
    search_cpu: float
    """Without starting Python, and without building SPIN's verifier."""
    build_cpu: float
    """Of that: making the program that searches."""
    memory: int
    """Largest resident memory in bytes, above that of the same program with next to nothing to do."""
    runs: int = 1

    @property
    def rate(self) -> float:
        """States a second of processor time."""
        return self.states / self.search_cpu if self.search_cpu else float("inf")

    @property
    def bytes_each(self) -> float:
        """Bytes a state; 0 where they were not counted."""
        return self.memory / self.states if self.states else 0.0


def medians(runs: Sequence[Measurement]) -> Measurement:
    """The medians of each quantity. Raises Wrong when runs of one tool counted differently."""
    first = runs[0]
    for other in runs[1:]:
        if (other.states, other.transitions, other.verdicts) != (first.states, first.transitions, first.verdicts):
            raise Wrong(f"{first.tool} counted {first.states} states in one run and {other.states} in another")
    return Measurement(
        first.tool, first.states, first.transitions, first.verdicts,
        median(r.whole_wall for r in runs), median(r.whole_cpu for r in runs),
        median(r.search_wall for r in runs), median(r.search_cpu for r in runs),
        median(r.build_cpu for r in runs), round(median(r.memory for r in runs)), len(runs),
    )  # fmt: skip

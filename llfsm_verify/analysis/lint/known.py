"""What is known of outcomes, by single turns and by the reachable configurations together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from llfsm_verify.analysis.lint.finding import Proof
from llfsm_verify.analysis.lint.local import Locally, Situation
from llfsm_verify.checking.replay.confirm import Schedule
from llfsm_verify.semantics.probes import Outcome, Probe
from llfsm_verify.transforms.probing import Probed


class Runs(Protocol):
    """Something that has runs of a probed program, by the outcomes of their last steps."""

    @property
    def probed(self) -> Probed: ...

    @property
    def complete(self) -> bool:
        """What it does not have there is none of."""
        ...

    def has(self, outcome: Outcome) -> bool: ...

    def run_to(self, outcome: Outcome) -> Schedule: ...


class Known:
    """Answers about the outcomes of a probed program (a wide one)."""

    def __init__(self, probed: Probed, locally: Locally, reaches: Sequence[Runs]) -> None:
        """`reaches`: runs of this program, or of the same one with fewer probes."""
        self.probed = probed
        self._locally = locally
        self._reaches = reaches

    @property
    def complete(self) -> bool:
        """All reachable configurations are known."""
        return any(r.complete for r in self._reaches)

    def never(self, probe: Probe, value: int = 1) -> Proof | None:
        """How it is known that this never comes out; None: it can, or that is not known."""
        outcome = Outcome(probe, value)
        if outcome not in self.probed.outputs or outcome in self._locally.impossible:
            return "local"
        searched = (r for r in self._reaches if r.complete and outcome in r.probed.outputs)
        return "reachable" if any(not r.has(outcome) for r in searched) else None

    def shown(self, probe: Probe, value: int = 1) -> Runs | None:
        """What has a run in which this comes out."""
        return next((r for r in self._reaches if r.has(Outcome(probe, value))), None)

    def somewhere(self, probe: Probe, value: int = 1) -> Situation | None:
        """A configuration inside the ranges, which need not be reachable, in whose turn this comes out."""
        return self._locally.possible.get(Outcome(probe, value))

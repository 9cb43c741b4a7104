"""Scripts performed by the executor and confirmed by an evaluation of their own, whatever engine found them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

from llfsm_verify.backends.native.code import OVERFLOW
from llfsm_verify.checking.claims import Claim
from llfsm_verify.checking.goals.goal import Goal, Unconfirmed
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.replay.confirm import (
    Disagreement,
    Letter,
    Misfit,
    ReplayedRun,
    Schedule,
    confirm_lasso,
    perform,
)
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.logic.bounds import HIDDEN
from llfsm_verify.logic.expressions import ExpressionTooLarge
from llfsm_verify.program.program import FaultSite


class Replayer:
    """The executor of one arrangement, compiled when it is first asked for.

    What the executor or the evaluation does not confirm raises Disagreement.
    """

    def __init__(self, problem: Problem) -> None:
        self._problem = problem

    @cached_property
    def execution(self) -> Execution:
        """With all bits kept: what is shown is what happens."""
        return Execution(self._problem.program(keep_all_bits=True))

    def shown(self, goal: Goal, assumed: Sequence[Claim], beside: Sequence[str] = ()) -> list[str]:
        """The atoms that a trace of `goal` shows: those of users, not those we made."""
        read = {*goal.atoms, *beside, *(name for f in assumed for name in f.atoms)}
        return sorted(name for name in read if not name.startswith(HIDDEN))

    def perform(self, schedule: Schedule, first: Letter, what: str, shown: Sequence[str]) -> ReplayedRun:
        """What the executor does; `first` is the first letter, `what` names the finding."""
        try:
            return perform(self.execution, schedule, first, shown)
        except Misfit as misfit:
            raise Disagreement(f"{what}: the executor cannot follow the search: {misfit}") from misfit

    def confirm(
        self,
        goal: Goal,
        assumed: Sequence[Claim],
        replayed: ReplayedRun,
        what: str,
        *,
        prefix: bool,
        recurs_soon: bool = True,
    ) -> None:
        """The run violates the goal: as a bad prefix (`prefix`) or, under the assumptions and fairly, for ever.

        Unconfirmed: the executor's 64 bits or the evaluation meet a limit, or the loop does not recur soon where that
        may be (`recurs_soon` False).
        """
        _fits(replayed)
        try:
            if prefix:
                goal.confirm_prefix(replayed, what)
                return
            if not replayed.recurs and not recurs_soon:
                what_varies = "variables that the property does not depend on do not recur for long"
                raise Unconfirmed(f"{what_varies}; --cone off searches with them")
            confirm_lasso(replayed, assumed, self.execution.program.fairness, what)
            start = replayed.loop_letter
            if not goal.violated_by(replayed.letters[:start], replayed.letters[start:]):
                raise Disagreement(f"{what}: the trace satisfies the property")
        except ExpressionTooLarge as limit:
            raise Unconfirmed(str(limit)) from None

    def confirm_fault(self, site: FaultSite, replayed: ReplayedRun) -> None:
        """The run ends in this fault. Unconfirmed: the executor's 64 bits meet their limit."""
        _fits(replayed)
        if replayed.trace.fault != site:
            raise Disagreement(f"fault {site.code} ({site.message}): the executor does not fault on its trace")


def _fits(replayed: ReplayedRun) -> None:
    """Numbers have no end for engines that calculate with mathematical integers."""
    if replayed.status == OVERFLOW:
        raise Unconfirmed("there a value of type int leaves the 64 bits in which the executor holds it")

"""The labels of a program, where it has wide inputs: only then is the solver loaded."""

from __future__ import annotations

from typing import TYPE_CHECKING

from llfsm_verify.kripke.labels.sizes import is_wide
from llfsm_verify.limits import Budget
from llfsm_verify.program.program import Program

if TYPE_CHECKING:
    from llfsm_verify.kripke.labels.labels import Labels


def labels_of(program: Program, budget: Budget) -> Labels | None:
    """The labels of a program; None: no input is wide.

    Raises LimitReached when time, memory or units of work end it, and KeyboardInterrupt.
    """
    if not any(map(is_wide, program.choices)):
        return None
    from llfsm_verify.kripke.labels.labels import Labels
    from llfsm_verify.kripke.labels.planning import Planner
    from llfsm_verify.kripke.labels.reaching import decide_reachable

    planner = Planner(program, budget.check)
    with planner.spending(budget.max_work):
        decided = planner.decide()
        decide_reachable(planner, decided, budget)
    return Labels(planner, decided)

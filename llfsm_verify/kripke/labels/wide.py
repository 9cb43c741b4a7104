"""Which inputs are wide enough to be split into classes, and the labels of them: only then is the solver loaded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from llfsm_verify.limits import Budget
from llfsm_verify.program.program import Choice, Program

if TYPE_CHECKING:
    from llfsm_verify.kripke.labels.labels import Labels


WIDE = 16
"""Choices with at most so many values are enumerated as they are."""


def size(choice: Choice) -> int:
    """The number of values."""
    return choice.type.high - choice.type.low + 1


def is_wide(choice: Choice) -> bool:
    """A choice of an input with too many values to be enumerated as a matter of course."""
    return choice.kind != "age" and size(choice) > WIDE


@dataclass(frozen=True, slots=True)
class InputNote:
    """Inputs that are split together (most often one), with the number of their valuations.

    `classes`: the most that one reading tells apart; None: all values are tried, and `reason` says why.
    """

    inputs: tuple[str, ...]
    values: int
    classes: int | None
    reason: str | None = None


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

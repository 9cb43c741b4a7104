"""What an engine of proofs asks of a system, and the answers it can get."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from llfsm_verify.backends.smt.solver import SolverBudget
from llfsm_verify.engines.inductive.invariant import Invariant
from llfsm_verify.engines.inductive.system import System
from llfsm_verify.limits import Budget
from llfsm_verify.program.program import Expr


@dataclass(frozen=True, slots=True)
class Proved:
    """By this invariant, which is to be certified before it counts."""

    invariant: Invariant


@dataclass(frozen=True, slots=True)
class Reached:
    """The prover says that the target can be reached."""


@dataclass(frozen=True, slots=True)
class Undecided:
    """`reason`: why it is not known, in a clause."""

    reason: str


Answer = Proved | Reached | Undecided


class Prover(Protocol):
    """A way of proving that the target of a system is not reached."""

    name: str
    depth: int
    """Unless --depth says otherwise."""
    effort: int
    """Z3's units of work for one question, unless a limit says otherwise."""
    integers: bool
    """It wants mathematical integers also where every value has bounds."""

    def ask(
        self, system: System, budget: Budget, depth: int, effort: int, total: SolverBudget, known: Sequence[Expr] = ()
    ) -> Answer:
        """`depth` bounds what the prover goes through, `effort` Z3's units of work for each question, and
        `total` those for all questions of an engine.

        `known` are formulas over the configuration that are inductive together; a proof has them in its invariant.
        LimitReached, KeyboardInterrupt: the budget's, or the user's.
        """
        ...

"""What proves that a property holds, as reports show it and as it can be checked again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True)
class Proof:
    """A certified inductive invariant. A property may take two: one for bad prefixes, one for other violations.

    `invariant` are the conjuncts in the user's names (none: what the types say is enough), `legend` says what the other
    names in them mean.
    """

    shows: Literal["faults", "prefixes", "rounds", "loops"]
    """What is never reached: a fault; a bad prefix; more rounds of a violation than `bound`; a loop that violates."""
    sentence: str
    """The same in a clause."""
    bound: int | None
    unit: Literal["cycle", "step"]
    """After which the invariant holds."""
    invariant: tuple[str, ...]
    legend: tuple[tuple[str, str], ...]
    k: int
    """0: the invariant is inductive and implies the property. Else: with it, k-induction over so many units does."""
    checked_by: tuple[str, ...]
    """The solvers, with their versions, that have checked initiation, consecution and implication."""
    smt: str
    """The invariant as a term of SMT-LIB 2 over integers and Booleans."""

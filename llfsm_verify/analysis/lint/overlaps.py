"""Guards of one state that overlap, told in one note: chains of thresholds have a pair for every two of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from llfsm_verify.analysis.lint.finding import Finding, Proof, Witness
from llfsm_verify.arrangement.model import Transition

MOST_PAIRS = 3
"""Pairs that are named beside the first one."""


@dataclass(frozen=True, slots=True)
class Overlap:
    """Two transitions of a state whose guards can be true together, and how that is known, in which machines."""

    earlier: Transition
    later: Transition
    target: str
    """Where the earlier one leads."""
    machines: tuple[str, ...]
    proof: Proof
    witness: Witness


def fold_overlaps(overlaps: Sequence[Overlap], hint: str) -> Finding:
    """One note for the overlaps of a state (at least one), at the first of them that a run shows, if one does."""
    overlaps = sorted(overlaps, key=lambda o: (o.later.span.start, o.earlier.span.start))
    first = next((o for o in overlaps if o.proof == "run"), overlaps[0])
    message = f"`{first.earlier.text}` and `{first.later.text}` can be true together: the first one decides"
    notes = (f"it is at line {first.earlier.span.line}, and leads to {first.target}", *_others(overlaps, first))
    return Finding("L003", "note", message, first.later.span, first.machines, first.proof, notes, hint, first.witness)


def _others(overlaps: Sequence[Overlap], first: Overlap) -> Iterator[str]:
    others = [o for o in overlaps if o is not first]
    for o in others[:MOST_PAIRS]:
        known = " (not known to be reachable)" if o.proof == "ranges" and first.proof != "ranges" else ""
        where = "" if o.machines == first.machines else f", in {', '.join(f'`{m}`' for m in o.machines)}"
        yield f"so can `{o.earlier.text}` and `{o.later.text}` at line {o.later.span.line}{where}{known}"
    if len(others) > MOST_PAIRS:
        yield f"and so can {len(others) - MOST_PAIRS} more pairs of guards of this state"

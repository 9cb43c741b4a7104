"""Proofs as text: the invariant in the user's names, what else its names mean, and who has checked it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from rich.text import Text

if TYPE_CHECKING:
    from llfsm_verify.checking.proof import Proof


def proofs_text(name: str, proofs: Sequence[Proof]) -> Iterator[Text]:
    """What proves that the property `name` holds; nothing where another engine found that."""
    for proof in proofs:
        yield Text()
        yield Text(f"{name}: proved, since {proof.sentence}.", "bold")
        for line in proof_lines(proof):
            yield Text(line)


def proof_lines(proof: Proof) -> Iterator[str]:
    """A proof without its heading, line by line."""
    times = f"in the beginning and after every {proof.unit}"
    if proof.invariant:
        yield f"Invariant, true {times}:"
        yield from (f"  {line}" for line in proof.invariant)
    elif proof.k == 0:
        yield "Every value is in the range of its type; no other invariant is needed."
    if proof.legend:
        yield "where"
        width = max(len(name) for name, _ in proof.legend)
        yield from (f"  {name.ljust(width)}  {meaning}" for name, meaning in proof.legend)
    if proof.k:
        first, run = (f"first {proof.unit}", f"a {proof.unit}")
        if proof.k != 1:
            first, run = (f"first {proof.k} {proof.unit}s", f"{proof.k} {proof.unit}s in a row")
        given = ", all of which satisfy the invariant" if proof.invariant else ""
        base = f"this does not happen in the {first} of any run"
        yield (
            f"k-induction, k = {proof.k}: {base}; and where it has not happened in {run}, through different "
            f"configurations{given}, it does not happen in the {proof.unit} after."
        )
    solvers = " and ".join(name.split()[0] for name in proof.checked_by)
    yield f"Checked again by {solvers}: initiation, consecution and implication."


__all__ = ["proof_lines", "proofs_text"]

"""Test vectors: inputs for an image, and the records that the executor makes of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Unit = Literal["ringlet", "cycle"]


@dataclass(frozen=True, slots=True)
class Sequence:
    """A run from the beginning. `inputs`: the values of `Vectors.inputs` in each step; `records`: those of
    `Vectors.fields` after it; `fault`: the number of the program's fault that ends the step after the last record
    (from 1, 0: none; -2: an `int` left 64 bits), for which `inputs` has one row more."""

    inputs: tuple[tuple[int, ...], ...]
    records: tuple[tuple[int, ...], ...]
    fault: int = 0
    start: tuple[int, ...] = ()
    """The values of `Vectors.fields` from which it goes on; empty: it begins as the program does."""


@dataclass(frozen=True, slots=True)
class Vectors:
    """`unit`: what a step is; in a `cycle` its inputs are held. `inputs`: the program's choices, in their order;
    `fields`: the elements of its variables (`values.element_names`), in theirs. Values are those of the program: an
    enumeration's by its number, a decimal's by its digits."""

    program: str
    """A hash of the program, without which records mean nothing."""
    unit: Unit
    inputs: tuple[str, ...]
    fields: tuple[str, ...]
    sequences: tuple[Sequence, ...]

"""Moves: what a run is told to do, step by step."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Move:
    """One ringlet (`process` None: the stutter) with the values of the choices it read."""

    process: int | None
    choices: dict[str, int]

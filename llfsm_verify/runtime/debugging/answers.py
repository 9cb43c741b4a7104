"""What a debugger answers, without any terminal: lines of text, steps, and tables."""

from __future__ import annotations

from dataclasses import dataclass

from llfsm_verify.checking.trace import TraceStep


@dataclass(frozen=True, slots=True)
class Steps:
    """Steps as traces show them, `first` being the number of the first one; so many were `left_out` before it."""

    first: int
    steps: tuple[TraceStep, ...]
    left_out: int = 0


@dataclass(frozen=True, slots=True)
class Table:
    """Cells below the titles of their columns."""

    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


Part = str | Steps | Table


@dataclass(frozen=True, slots=True)
class Answer:
    """What a command came to. `expected`: whether what `expect` asked for is so (None: nothing was asked)."""

    parts: tuple[Part, ...] = ()
    expected: bool | None = None
    quits: bool = False

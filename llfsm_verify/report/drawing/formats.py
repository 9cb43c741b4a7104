"""The formats of drawings, by the names that ``--format`` knows; the first is written unless another is meant."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from llfsm_verify.registry import Registry

if TYPE_CHECKING:
    from llfsm_verify.report.drawing.graph import Graph

DRAWINGS: Registry[Callable[[Graph], str | bytes]] = Registry(
    "format of drawings",
    (),
    "llfsm_verify.drawings",
)
GRAPHS: Registry[Callable[..., Graph]] = Registry("graph of runs", (), "llfsm_verify.graphs")
"""What is drawn on machines: `run` (of an arrangement, a machine or None, a trace, what it shows, and `reaches`:
whether it does not violate that), `replayed` (of an arrangement, a machine or None, and a `Replayed`; None: it does not
fit), and `coverage` (of an arrangement and a `Coverage`)."""

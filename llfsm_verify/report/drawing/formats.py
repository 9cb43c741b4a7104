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

"""Oracles: what answers monitors of other systems, message by message, with the verdicts of properties."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

from llfsm_verify.registry import Registry

if TYPE_CHECKING:
    from llfsm_verify.runtime.deciding.logs.check import LogReading


class Oracle(Protocol):
    """Answers until SIGINT or SIGTERM, each connection by a copy of `reading`.

    `filtering`: a message that violates a property is refused, and counts as not sent. `tell` is told the address, and
    notes. DiagnosticError: it cannot listen there.
    """

    def __call__(
        self, reading: LogReading, host: str, port: int, *, filtering: bool, tell: Callable[[str], None]
    ) -> None: ...


ORACLES: Registry[Oracle] = Registry("oracle", (), "llfsm_verify.oracles")

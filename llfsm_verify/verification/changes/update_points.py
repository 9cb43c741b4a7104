"""Where a run stands at the end of a cycle, and whether something may be loaded there."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from struct import pack

from llfsm_verify.verification.changes.state_transfer import HasLayout

UNKNOWN = "it is unknown whether it may be loaded"


@dataclass(frozen=True, slots=True)
class Accepted:
    """Nothing wrong is reachable where it is loaded at the end of a cycle in one of `points`."""

    points: frozenset[bytes]
    """What `update_point` gives."""
    notes: tuple[str, ...]
    """What else is to be said, in sentences without their full stops."""


def update_point(code: HasLayout, record: bytes, states: Iterable[int]) -> bytes:
    """A configuration of a run and the states of its monitors."""
    return record[: code.layout.configuration_bytes] + b"".join(pack("<q", state) for state in states)

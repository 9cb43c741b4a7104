"""The entry of a format of reports. It is apart from the registries, which ask extensions for their entries."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

from llfsm_verify.registry import Entry, at

if TYPE_CHECKING:
    from llfsm_verify.diagnostics import Diagnostic

Failed = Callable[[Sequence["Diagnostic"], int], str]
"""What stands in place of a report when the files are wrong, from diagnostics and the exit code."""


@dataclass(frozen=True, slots=True)
class ReportEntry(Entry):
    """A format of a report."""

    failure: str | None = None
    """The place of what says in this format that the files are wrong (`Failed`); None: people read it on standard
    error."""

    def failed(self) -> Failed | None:
        """What is at that place."""
        return None if self.failure is None else cast(Failed, at(self.failure))

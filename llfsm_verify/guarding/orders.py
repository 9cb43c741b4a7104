"""What an outside guard tells a run to do."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Order:
    """An operator's command, or (`kind` None) a post of an input."""

    kind: str | None
    target: str
    value: str | None = None

    @property
    def text(self) -> str:
        """As users write it."""
        if self.kind is None:
            return f"{self.target} = {self.value}"
        return " ".join(part for part in (self.kind, self.target, self.value) if part is not None)

    @property
    def statement(self) -> str:
        """A command as a machine gives it."""
        assert self.kind is not None, "machines post no inputs"
        return f"{self.target} = {self.value};" if self.value is not None else f"{self.kind}({self.target});"

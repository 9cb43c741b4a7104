"""What a run is given from the folders above: where its frames are recorded, and where others see them."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol


class Newest(Protocol):
    """Where frames are published."""

    def newest(self) -> list[int] | None:
        """The newest frame; None: no frame was published."""


class FrameLog(Protocol):
    """A recording to which the loop appends (`runtime.recording.file.Recorder`)."""

    path: Path

    def fileno(self) -> int:
        """Its file, which a process needs that appends."""

    def reach(self) -> None:
        """Let the loop append in this process. OSError: there is no room, for example."""

    def grow(self) -> None:
        """Give the loop more room. OSError: as for `reach`."""

    def give_up(self, error: OSError) -> str:
        """Nothing more is recorded; why, as users read it."""

    def close(self) -> None:
        """Nothing more is recorded."""


class Published(Protocol):
    """What others see of a run (`runtime.whiteboard.shared.Shared`)."""

    @property
    def segment(self) -> Newest: ...

    @property
    def descriptors(self) -> tuple[int, ...]:
        """What a process needs that runs the loop."""

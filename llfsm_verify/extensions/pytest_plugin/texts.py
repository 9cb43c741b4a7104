"""The names that users meet: options, ini keys, the marker, and what trace files end in."""

from __future__ import annotations

from typing import Final

MARKER: Final = "llfsm_arrangement"
"""The marker, and the ini key, that name an arrangement."""
SAVE: Final = "llfsm_save"
UPDATE: Final = "llfsm_update"
SUFFIX: Final = ".trace.yaml"

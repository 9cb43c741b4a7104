"""Small arrangements and their verdicts."""

from tests.small_checks import check, verdicts

__all__ = ["check", "verdicts"]

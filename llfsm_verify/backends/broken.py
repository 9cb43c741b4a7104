"""The error for a step program that breaks its contract: a mistake of ours, never of the user's model."""

from __future__ import annotations


class BrokenProgramError(Exception):
    """An index outside its array, a value outside its variable's type, a division by zero, a turn or state without a
    slot or block: what the lowering has to check with a `Fault` or rule out before an engine sees it."""

"""How much a debugger keeps to go back to."""

MOST_STEPS = 1_000_000
"""Steps; each takes a few hundred bytes."""

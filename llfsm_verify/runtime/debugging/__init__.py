"""Runs that one walks forwards and backwards: by ringlets, by cycles, to break points; and why guards were true."""

MOST_STEPS = 1_000_000
"""Steps that are kept to go back to, by default; each takes a few hundred bytes."""

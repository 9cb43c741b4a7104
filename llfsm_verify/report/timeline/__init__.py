"""Runs over time, for people and for other tools: one value, and a writer for each format."""

CODES = {"E487": "A timeline cannot be written there."}
UNWRITABLE = "E487"

"""Runs over time, for people and for other tools: one value, and a writer for each format."""

"""Kripke structures and whole arrangements in the formats of other tools."""

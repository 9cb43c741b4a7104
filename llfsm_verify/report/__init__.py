"""Verdicts, traces and models as people and other programs read them."""

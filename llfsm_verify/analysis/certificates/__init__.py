"""Certificates: what proves the verdicts of a result to a small program that knows nothing of the checker."""
